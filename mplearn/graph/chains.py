"""Primitives that only ever follow each other, seen as one [Kulic2012, 4.3]."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from itertools import pairwise

import numpy as np

from ..recording import IntArray
from .edges import EdgeTable


def find_chains(
    ids: Iterable[int], sources: IntArray, targets: IntArray
) -> tuple[tuple[int, ...], ...]:
    """Group ids into chains: j joins i if j is i's only successor and i is j's only predecessor.

    Every id is in exactly one chain, most in one of their own. A ring of such pairs is opened in
    front of the id that comes first in ``ids``.
    """
    successors: dict[int, list[int]] = {}
    predecessors: dict[int, list[int]] = {}
    for source, target in zip(sources.tolist(), targets.tolist(), strict=True):
        successors.setdefault(source, []).append(target)
        predecessors.setdefault(target, []).append(source)
    following = {
        source: only[0]
        for source, only in successors.items()
        if len(only) == 1 and only[0] != source and len(predecessors[only[0]]) == 1
    }
    led_to = set(following.values())
    chains: dict[int, tuple[int, ...]] = {}
    taken: set[int] = set()
    order = list(ids)
    for head in [i for i in order if i not in led_to] + order:  # what is left then are rings
        if head in taken:
            continue
        chain = [head]
        while (follower := following.get(chain[-1])) is not None and follower != head:
            chain.append(follower)
        taken.update(chain)
        chains[head] = tuple(chain)
    return tuple(chains[i] for i in order if i in chains)


def merged_edges(edges: EdgeTable, chains: Mapping[int, tuple[int, ...]]) -> IntArray:
    """Return the rows of the edges between chains, shape (E, 5); those inside are gone.

    A chain takes the mean time of its inner edges more than its last primitive alone.
    """
    head_of = {chain[-1]: head for head, chain in chains.items()}
    rows = []
    for source, target, count, total_ms, squares in edges.rows.tolist():
        if source in head_of and target in chains:
            chain = chains[head_of[source]]
            more = sum(round(1e3 * edges.time_s(i, j)[0]) for i, j in pairwise(chain))
            squares += 2 * more * total_ms + more**2 * count
            rows.append([head_of[source], target, count, total_ms + more * count, squares])
    return np.array(rows, dtype=np.int64).reshape(len(rows), 5)
