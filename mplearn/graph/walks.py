"""Random walks of exactly the length asked for, on a graph that has dead ends."""

from __future__ import annotations

import math

import numpy as np

from ..recording import BoolArray, FloatArray, IntArray


def stationary(
    sources: IntArray, targets: IntArray, counts: IntArray, n_nodes: int, restart: float
) -> FloatArray:
    """Return the PageRank of each node with damping 1 - restart, shape (n,), by power iteration.

    Each step shrinks the error by 1 - restart at least, so its end is known beforehand.
    """
    if n_nodes == 0:
        return np.zeros(0)
    leaving = np.bincount(sources, weights=counts, minlength=n_nodes)
    shares = (1 - restart) * counts / leaving[sources]
    lost = np.where(leaving > 0, restart, 1.0) / n_nodes  # goes to all, from each
    visits = np.full(n_nodes, 1.0 / n_nodes)
    for _ in range(math.ceil(math.log(1e-14) / math.log1p(-min(restart, 0.999)))):
        before = visits
        visits = np.bincount(targets, weights=shares * before[sources], minlength=n_nodes)
        visits += lost @ before
        if np.abs(visits - before).sum() < 1e-14:
            break
    visits /= visits.sum()
    return visits


class WalkSampler:
    """Draws walks by transition probabilities, never into an end that comes too soon.

    A primitive is *alive for r* if a walk of r further steps starts there. At each step the row of
    probabilities is restricted to the successors that are alive for what remains, and normalised.
    """

    def __init__(
        self, sources: IntArray, targets: IntArray, counts: IntArray, n_nodes: int
    ) -> None:
        """Take the edges as indices and counts, each of shape (E,)."""
        order = np.lexsort((targets, sources))
        self._sources, self._targets = sources[order], targets[order]
        self._counts = counts[order]
        self._first = np.searchsorted(self._sources, np.arange(n_nodes + 1))
        self._alive = [np.ones(n_nodes, dtype=np.bool_)]
        self._settled = False  # the sets shrink until they repeat: from there all are the same

    def alive(self, remaining: int) -> BoolArray:
        """Return from which nodes a walk of ``remaining`` further steps exists, shape (n,)."""
        while not self._settled and len(self._alive) <= remaining:
            last = self._alive[-1]
            able = np.zeros_like(last)
            able[self._sources[last[self._targets]]] = True
            self._settled = bool((able == last).all())
            if not self._settled:
                self._alive.append(able)
        return self._alive[min(remaining, len(self._alive) - 1)]

    def longest(self, node: int) -> int:
        """Return the length of the longest walk from a node that must run into an end."""
        return int(sum(alive[node] for alive in self._alive))

    def draw_start(self, length: int, rng: np.random.Generator) -> int | None:
        """Draw a node that starts a walk of ``length``, by how often it was left; else None."""
        left = np.bincount(self._sources, weights=self._counts, minlength=len(self._alive[0]))
        weights = np.where(self.alive(length - 1), left if length > 1 else left + 1, 0.0)
        if not weights.any():
            return None
        return int(rng.choice(len(weights), p=weights / weights.sum()))

    def sample(self, start: int, length: int, rng: np.random.Generator) -> list[int]:
        """Draw a walk of ``length`` nodes from one that is alive for ``length - 1``."""
        walk = [start]
        tables: dict[tuple[int, int], tuple[IntArray, FloatArray]] = {}
        for remaining in range(length - 2, -1, -1):
            level = min(remaining, len(self._alive) - 1)
            key = (walk[-1], level)
            if key not in tables:
                tables[key] = self._choices(*key)
            targets, cumulative = tables[key]
            walk.append(int(targets[np.searchsorted(cumulative, rng.random(), side="right")]))
        return walk

    def _choices(self, node: int, level: int) -> tuple[IntArray, FloatArray]:
        edges = slice(self._first[node], self._first[node + 1])
        targets, counts = self._targets[edges], self._counts[edges]
        able = self._alive[level][targets]
        cumulative = np.cumsum(counts[able])
        return targets[able], cumulative / cumulative[-1]
