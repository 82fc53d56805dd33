"""Checks of a stored graph before it is trusted."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from ..errors import InvalidValueError
from ..recording import IntArray


def checked_arrays(state: Mapping[str, Any], order: int) -> tuple[IntArray, IntArray, IntArray]:
    """Return the ids (n,), edges (E, 5) and histories (H, order + 3) of a graph's state.

    Raises:
        InvalidValueError: They do not describe a graph.
    """
    ids, edges, histories = (np.asarray(state[key]) for key in ("ids", "edges", "histories"))
    shapes_fit = ids.ndim == 1 and edges.ndim == histories.ndim == 2
    if not (shapes_fit and edges.shape[1] == 5 and histories.shape[1] == order + 3):
        raise InvalidValueError(
            "a graph's state needs ids (n,), edges (E, 5) and histories (H, order + 3), not "
            f"{ids.shape}, {edges.shape} and {histories.shape}"
        )
    if any(array.dtype.kind not in "iu" for array in (ids, edges, histories)):
        raise InvalidValueError("a graph's state holds whole numbers only")
    lengths = histories[:, 0]
    if not ((lengths >= 2) & (lengths <= order)).all():
        raise InvalidValueError(f"histories must have lengths in [2, {order}]")
    used = np.arange(order) < lengths[:, None]
    named = (edges[:, :2].ravel(), histories[:, 1:-2][used], histories[:, -2])
    if len(set(ids.tolist())) != len(ids) or not np.isin(np.concatenate(named), ids).all():
        raise InvalidValueError("a graph's ids must differ, and its transitions name only them")
    if (edges[:, 2] < 1).any() or (edges[:, 3:] < 0).any() or (histories[:, -1] < 1).any():
        raise InvalidValueError("a graph's counts must be at least 1, its durations at least 0")
    return ids, edges, histories
