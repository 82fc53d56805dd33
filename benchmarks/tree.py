"""One insertion into a tree of 1,000 leaves against one into a tree of 50, and the worst of all."""

import time
from itertools import cycle

import numpy as np

from mplearn.tree import PrimitiveTree, TreeConfig

from .interleaved import interleaved

RATE_HZ = 100.0
CHANNELS = 46
BLOCK = 20  # motions that are learned together
CALLS = 100


class Repertoire:
    """Smooth motions through random postures, each execution a little different."""

    def __init__(self, n_motions: int) -> None:
        self.rng = np.random.default_rng(0)
        self.keys = self.rng.normal(0, 0.2, (n_motions, 4, CHANNELS))

    def perform(self, motion: int) -> np.ndarray:
        at = np.linspace(0, 3, int(self.rng.integers(80, 140)))
        low = np.minimum(at.astype(int), 2)
        share = (1 - np.cos(np.pi * (at - low)))[:, None] / 2
        keys = self.keys[motion] * self.rng.normal(1, 0.05)
        curve = (1 - share) * keys[low] + share * keys[low + 1]
        return curve + self.rng.normal(0, 0.01, (1, CHANNELS))


def learned(n_motions: int) -> tuple[PrimitiveTree, Repertoire, list[float]]:
    """Return a tree of so many leaves, and how long each insertion took [s]."""
    repertoire = Repertoire(n_motions)
    tree = PrimitiveTree(TreeConfig(), CHANNELS, RATE_HZ)
    took = []
    for first in range(0, n_motions, BLOCK):
        for _ in range(5):
            for motion in range(first, min(first + BLOCK, n_motions)):
                frames = repertoire.perform(motion)
                for _ in frames:
                    tree.pass_time()
                begin = time.process_time()
                tree.insert(frames)
                took.append(time.process_time() - begin)
    return tree, repertoire, took


def renewed(tree: PrimitiveTree, repertoire: Repertoire) -> float:
    """Return how long the longest frame takes while all is modelled again [s].

    Motions five times as large come, until the variance of all motion has changed enough.
    """
    took, began = [0.0], False
    for motion in range(4 * len(repertoire.keys)):
        frames = 5.0 * repertoire.perform(motion % len(repertoire.keys))
        tree.insert(frames)
        for _ in frames:
            begin = time.process_time()
            tree.pass_time()
            took.append(time.process_time() - begin)
        going_on = tree.state().renewal is not None
        if began and not going_on:
            break
        began |= going_on
    return max(took)


def rows() -> list[tuple[str, str, str, str]]:
    learned(BLOCK)  # compiles
    small, few, _ = learned(50)
    large, many, took = learned(1000)
    streams = {
        tree: cycle([source.perform(m % len(source.keys)) for m in range(0, 7 * CALLS, 7)])
        for tree, source in ((small, few), (large, many))
    }

    def insert(tree: PrimitiveTree) -> None:
        for _ in range(CALLS):
            tree.insert(next(streams[tree]))

    times = interleaved({"50": lambda: insert(small), "1000": lambda: insert(large)})
    slowest = renewed(large, many)
    one, other = times["1000"] / CALLS, times["50"] / CALLS
    return [
        (
            f"insertion into a tree of {len(large.leaves)} leaves",
            f"{1e3 * one:.2f} ms",
            f"{1e3 * other:.2f} ms, a tree of {len(small.leaves)}",
            f"{one / other:.2f} x",
        ),
        (
            "worst of 5,000 insertions, birth of 1,000 leaves",
            f"{1e3 * max(took[BLOCK:]):.1f} ms",
            f"{1e3 * float(np.median(took)):.2f} ms, the median",
            f"{max(took[BLOCK:]) / float(np.median(took)):.0f} x",
        ),
        (
            "slowest frame while the models of 1,000 leaves are made again",
            f"{1e3 * slowest:.1f} ms",
            "sampling interval",
            "10 ms",
        ),
    ]
