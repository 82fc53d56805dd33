"""How surprising each counted transition is to all the others: what surprises are held against."""

from __future__ import annotations

import math
from itertools import pairwise
from typing import TYPE_CHECKING

import numpy as np

from ..recording import FloatArray

if TYPE_CHECKING:
    from .counts import TransitionCounts


def left_out_surprises(counts: TransitionCounts) -> FloatArray:
    """Return the surprise of each counted transition, itself left out, sorted, shape (n,) [nat].

    A transition is held against the longest context that it was counted in.
    """
    tables = _tables(counts)
    longest = [dict(table) for table in tables]
    for shorter, longer in pairwise(longest):  # counted once, at the longest
        for (context, next_id), count in longer.items():
            key = context[1:], next_id
            if key in shorter:
                shorter[key] -= count
    totals, kinds = _sums(tables)
    scores: list[float] = []
    weights: list[int] = []
    for table in longest[1:]:
        for (context, next_id), count in table.items():
            if count > 0:
                scores.append(_surprise(counts, tables, totals, kinds, context, next_id))
                weights.append(count)
    return np.sort(np.repeat(np.array(scores), weights)) if scores else np.zeros(0)


_Table = dict[tuple[tuple[int, ...], int], int]


def _tables(counts: TransitionCounts) -> list[_Table]:
    """Return how often each primitive followed each context, by the context's length."""
    tables: list[_Table] = [{} for _ in range(counts.order + 1)]
    for source, target, count, *_ in counts.edge_rows().tolist():
        tables[1][(source,), target] = count
        tables[0][(), target] = tables[0].get(((), target), 0) + count
    for context, next_id, count in counts.histories():
        tables[len(context)][context, next_id] = count
    return tables


def _sums(
    tables: list[_Table],
) -> tuple[dict[tuple[int, ...], int], dict[tuple[int, ...], int]]:
    """Return how often each context was followed, and by how many different primitives."""
    totals: dict[tuple[int, ...], int] = {}
    kinds: dict[tuple[int, ...], int] = {}
    for table in tables:
        for (context, _), count in table.items():
            totals[context] = totals.get(context, 0) + count
            kinds[context] = kinds.get(context, 0) + 1
    return totals, kinds


def _surprise(
    counts: TransitionCounts,
    tables: list[_Table],
    totals: dict[tuple[int, ...], int],
    kinds: dict[tuple[int, ...], int],
    context: tuple[int, ...],
    next_id: int,
) -> float:
    """Return -log p(next | context) as `backed_off` gives it where it came once less."""
    p = 1.0 / len(counts)
    for length in range(len(context) + 1):
        part = context[len(context) - length :]
        seen = tables[length].get((part, next_id), 0) - 1
        total = totals.get(part, 0) - 1
        if seen < 0 or total <= 0:
            continue
        weight = counts.concentration * (kinds[part] - (seen == 0))
        p = (seen + weight * p) / (total + weight)
    return -math.log(p)
