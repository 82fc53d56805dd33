"""Sums in compiled loops are numpy's, to the bit."""

import numpy as np
import pytest

from mplearn.maths.sums import pairwise_sum


@pytest.mark.parametrize("seed", range(3))
def test_sums_are_numpys_whatever_their_length(seed: int) -> None:
    rng = np.random.default_rng(seed)
    for n in [*range(40), 127, 128, 129, 135, 136, 137, 255, 256, 257, 1000, 1033]:
        values = rng.normal(size=n) * 10.0 ** rng.integers(-3, 4, n)
        assert pairwise_sum(values) == values.sum()
