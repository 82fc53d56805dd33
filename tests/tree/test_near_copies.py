"""Motions played again, nearly or exactly alike, say nothing of how much a person varies."""

import numpy as np
import pytest

from mplearn.recording import FloatArray
from mplearn.tree import PrimitiveTree, TreeConfig

D, RATE_HZ = 3, 50.0
KINDS = np.random.default_rng(0).uniform(0, 2 * np.pi, (6, D))


def execution(kind: int, rng: np.random.Generator) -> FloatArray:
    t = np.linspace(0, np.pi, 40)[:, None]
    return np.asarray(rng.normal(1, 0.05, D) * np.sin(t + KINDS[kind] + rng.normal(0, 0.05, D)))


@pytest.mark.parametrize("noise", [0.0, 1e-7, 1e-5, 1e-3])
def test_playback_leaves_what_is_recognised_as_it_was(noise: float) -> None:
    rng = np.random.default_rng(1)
    tree = PrimitiveTree(TreeConfig(), D, RATE_HZ)
    shown = [(k % 6, execution(k % 6, rng)) for k in range(48)]
    for _, frames in shown:
        tree.insert(frames)
    later = [(k % 6, execution(k % 6, rng)) for k in range(60)]
    before = [tree.recogniser().recognise(frames).primitive for _, frames in later]
    for _ in range(4):
        for _, frames in shown:
            tree.insert(frames + rng.normal(0, noise, frames.shape) if noise else frames)
    after = [tree.recogniser().recognise(frames).primitive for _, frames in later]
    known = sum(each is not None for each in before)
    assert known >= 54
    assert sum(a is not None for a in after) >= 0.9 * known
    owner: dict[int, set[int]] = {}
    for (kind, _), primitive in zip(later, after, strict=True):
        if primitive is not None:
            owner.setdefault(primitive, set()).add(kind)
    assert all(len(kinds) == 1 for kinds in owner.values())
