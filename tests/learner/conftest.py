from itertools import cycle, islice

import numpy as np
import pytest

from mplearn.demonstrator import Demonstration, demonstrate
from mplearn.evaluation.observing import observe
from mplearn.recording import Recording

SCRIPT = ("BAR", "BAL", "BAD", "BAU")  # the four primitives of [Kulic2012, 4.1]


@pytest.fixture(scope="session")
def four() -> Demonstration:
    """Four primitives, twelve times each, in an order that is not always the same."""
    rng = np.random.default_rng(5)
    script = list(islice(cycle(SCRIPT), 32))
    for _ in range(4):
        script += list(rng.permutation([("BAR", "BAL"), ("BAD", "BAU")], axis=0).ravel())
    return demonstrate([str(name) for name in script], seed=4)


@pytest.fixture(scope="session")
def features(four: Demonstration) -> Recording:
    """The same as the robot's features."""
    return observe(four.recording)
