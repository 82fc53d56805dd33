"""Skeletons as they are streamed: joints, and points that show how each is turned."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ...mocap.skeletons.kinematics import AXIS_M, AXIS_MARK
from ...recording import FloatArray, Skeleton, marker_channels


def with_axes(
    names: Sequence[str], parents: Sequence[int], offsets: FloatArray, unit_m: float
) -> tuple[tuple[str, ...], Skeleton]:
    """Return the channels and the skeleton of joints, with three points more for each.

    Args:
        names: Name of each joint, length J.
        parents: Index of each joint's parent; -1 for the root.
        offsets: Where each is in its parent, shape (J, 3) [unit].
        unit_m: Length of the unit [m].
    """
    n = len(names)
    points = [f"{name}{AXIS_MARK}{axis}" for name in names for axis in "xyz"]
    all_names = (*names, *points)
    along = np.tile(AXIS_M / unit_m * np.eye(3), (n, 1))
    skeleton = Skeleton(
        all_names,
        (*parents, *(joint for joint in range(n) for _ in range(3))),
        np.concatenate([offsets, along]),
        (*[False] * n, *[True] * (3 * n)),
    )
    return marker_channels(all_names), skeleton


def points_of(places: FloatArray, turns: FloatArray, unit_m: float) -> FloatArray:
    """Return a frame of joints and of the points on their axes, shape (12 J,).

    Args:
        places: Where the joints are, shape (J, 3) [unit].
        turns: How each is turned in the world, shape (J, 3, 3).
        unit_m: Length of the unit [m].
    """
    axes = places[:, None] + AXIS_M / unit_m * turns.transpose(0, 2, 1)  # (J, axis, 3)
    return np.concatenate([places.ravel(), axes.ravel()])
