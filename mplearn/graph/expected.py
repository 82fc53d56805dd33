"""How surprising each counted transition is to all the others: what surprises are held against."""

from __future__ import annotations

import math

import numpy as np

from ..recording import FloatArray
from .prediction import Counts


def left_out_surprises(counts: Counts, length: int) -> FloatArray:
    """Return the surprise of each counted transition, itself left out, sorted, shape (n,) [nat].

    Args:
        counts: The counts.
        length: How many primitives before it are looked at; transitions that were counted after
            fewer are not held against anything.
    """
    tables = _tables(counts)[: length + 1]
    totals, kinds = _sums(tables)
    scores = [
        _surprise(counts, tables, totals, kinds, context, next_id)
        for context, next_id in tables[length]
    ]
    return np.sort(np.repeat(np.array(scores), list(tables[length].values())))


_Table = dict[tuple[tuple[int, ...], int], int]


def _tables(counts: Counts) -> list[_Table]:
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
    counts: Counts,
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
