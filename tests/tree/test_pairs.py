"""Which two that wait are one motion already: near each other, or alike in shape."""

from dataclasses import replace
from types import SimpleNamespace
from typing import cast

import numpy as np
import pytest

from mplearn.tree import TreeConfig
from mplearn.tree.nodes.structure import Structure
from mplearn.tree.rules import _clusters


def clusters(distance: float, extents: tuple[float, float], config: TreeConfig) -> int:
    """How many pairs are found of two that wait, the largest distance in a cluster being 1."""
    bank = SimpleNamespace(extents=lambda members: np.array([extents[n] for n in members]))
    waiting = SimpleNamespace(config=config, least=2, memory=SimpleNamespace(bank=bank))
    matrix = np.array([[0.0, distance], [distance, 0.0]])
    return len(_clusters(cast(Structure, waiting), [0, 1], matrix, 1.0))


@pytest.mark.parametrize("seed", range(40))
def test_a_pair_is_near_or_alike_and_never_beyond_the_scale(seed: int) -> None:
    rng = np.random.default_rng(seed)
    distance, *sizes = rng.uniform(0.05, 1.3), *rng.uniform(0.1, 4.0, 2)
    config = TreeConfig()
    share = distance / np.sqrt(sizes[0] * sizes[1])
    near = distance < config.pair_share and share < config.pair_extent
    alike = distance < 1.0 and share < config.pair_alike
    assert clusters(distance, (sizes[0], sizes[1]), config) == (near or alike)


def test_two_large_executions_are_one_motion_where_two_small_ones_are_not() -> None:
    config = TreeConfig()
    assert clusters(0.9, (3.0, 3.0), config) == 1
    assert clusters(0.9, (1.2, 1.2), config) == 0
    assert clusters(0.9, (3.0, 3.0), replace(config, pair_alike=0.0)) == 0
    assert clusters(1.1, (3.0, 3.0), config) == 0
