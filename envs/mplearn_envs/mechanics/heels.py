"""A foot whose heel is raised: its sole turns about its front edge, which stays where it is."""

from __future__ import annotations

import numpy as np

from mplearn.maths.compiling import njit
from mplearn.maths.easing import smooth_step
from mplearn.maths.plane import turn_in_plane
from mplearn.maths.rotation_kernels import turn_about_vertical, turn_by_vector
from mplearn.recording import FloatArray

_TILTED_RAD = 0.05  # with its heel raised by so much a sole stands on its front edge alone


def on_toes(heel: FloatArray) -> FloatArray:
    """Return how far a foot stands on the front edge of its sole alone, 0 to 1.

    Args:
        heel: By how much its heel is raised [rad].

    Example:
        >>> on_toes(np.array([0.0, 0.025, 0.5]))
        array([0. , 0.5, 1. ])
    """
    return smooth_step(np.clip(heel / _TILTED_RAD, 0.0, 1.0))


def bearing_corners(corners: FloatArray, heel: FloatArray) -> FloatArray:
    """Return corners of soles with those of raised heels moved to the toes, shape (..., 4, D) [m].

    Args:
        corners: Corners, front ones first, shape (..., 4, D) [m].
        heel: By how much each heel is raised, shape (...) [rad].
    """
    if not heel.any():
        return corners
    share = on_toes(heel)[..., None, None]
    front, back = corners[..., :2, :], corners[..., 2:, :]
    moved = back * (1.0 - share) + front[..., ::-1, :] * share
    return np.concatenate((np.broadcast_to(front, moved.shape), moved), axis=-2)


@njit(cache=True, nogil=True)
def raised_foot(
    corners: FloatArray, flat: FloatArray, height: float, place: FloatArray, heel: float
) -> tuple[FloatArray, FloatArray]:
    """Return where a foot is, shape (3,) [m], and how it is turned, shape (3, 3).

    Args:
        corners: Corners of its sole in its own frame, front ones first, shape (4, 3) [m].
        flat: How it is turned when it stands, yaw 0, shape (3, 3).
        height: How high it is then [m].
        place: Where it would stand flat: x, y [m] and yaw [rad], shape (3,).
        heel: By how much its heel is raised [rad].
    """
    rotation = turn_about_vertical(place[2], flat)
    position = np.array([place[0], place[1], height])
    if heel > 0.0:
        edge = 0.5 * (corners[0] + corners[1])
        axis = np.array([-np.sin(place[2]), np.cos(place[2]), 0.0]) * heel
        tilted = turn_by_vector(axis, rotation)
        for i in range(3):
            for k in range(3):
                position[i] += (rotation[i, k] - tilted[i, k]) * edge[k]
        rotation = tilted
    return position, rotation


def foot_places(corners: FloatArray, ground: FloatArray, heel: FloatArray) -> FloatArray:
    """Return where feet are, shape (..., 2, 3): x, y [m] and yaw [rad].

    Args:
        corners: Corners of both soles in their feet's frames, front ones first, (2, 4, 3) [m].
        ground: Where each would stand flat, shape (..., 2, 3).
        heel: By how much each heel is raised, shape (..., 2) [rad].
    """
    if not heel.any():
        return ground
    edge = corners[:, :2].mean(axis=1)
    ahead = edge[:, 0] * (1.0 - np.cos(heel)) - edge[:, 2] * np.sin(heel)
    out = ground.copy()
    x, y = turn_in_plane(ahead, 0.0 * ahead, ground[..., 2])
    out[..., 0] += x
    out[..., 1] += y
    return np.asarray(out)
