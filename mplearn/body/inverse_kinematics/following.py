"""Frames of markers, one after another, followed by a posture: the compiled loop."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from mplearn.recording import BoolArray, FloatArray

from ...maths.compiling import njit
from ..kinematics.linkage import Linkage
from .gauss_newton import Markers, Moves, Search, solve_frame

FEWEST_MARKERS = 3  # fewer do not say where a body is: the posture is held
LARGEST_M = 3.5  # no person's markers span more along an axis
WIDENING = 3.0  # see `Search`


class FollowRules(NamedTuple):
    """What is assumed of frames, for kernels; see `IKConfig`.

    Attributes:
        reach: How far each degree of freedom moves in a frame at most, shape (6 + n,).
        drift: How much its variance grows in a frame, shape (6 + n,).
        most_uncertain: Bound on the variances.
        search: How a frame is solved.
    """

    reach: FloatArray
    drift: FloatArray
    most_uncertain: float
    search: Search


class Joints(NamedTuple):
    """What the degrees of freedom of the body may do.

    Attributes:
        limits: Of each, shape (6 + n, 2).
        free: Which of them may move, shape (6 + n,).
        rest_weight: Weight of each joint's distance from zero, shape (n,).
    """

    limits: FloatArray
    free: BoolArray
    rest_weight: FloatArray


class Followed(NamedTuple):
    """Who is followed; changed in place.

    Attributes:
        posture: Before the next frame, shape (7 + n,).
        variance: Of each degree of freedom, shape (6 + n,).
        fresh: Whether no frame was solved yet, so that the first may move it anywhere, shape (1,).
    """

    posture: FloatArray
    variance: FloatArray
    fresh: BoolArray


@njit(cache=True)
def follow_frames(
    frames: FloatArray,
    followed: Followed,
    markers: Markers,
    linkage: Linkage,
    joints: Joints,
    rules: FollowRules,
    residuals: FloatArray,
) -> tuple[FloatArray, int]:
    """Follow frames with a posture; one with too few markers is held, and its variance grows.

    Args:
        frames: Measured positions, shape (T, M, 3) [m]; NaN where missing.
        followed: Who is followed.
        markers: Where they sit on the body.
        linkage: The body's kinematics.
        joints: What its degrees of freedom may do.
        rules: What is assumed of frames.
        residuals: Distance of each marker from its place in the last frame, shape (M,) [m], filled;
            NaN where missing.

    Returns:
        The postures, shape (T, 7 + n), and the iterations of the last frame.
    """
    posture, variance, fresh = followed
    limits = joints.limits
    dofs = len(variance)
    out = np.empty((len(frames), len(posture)))
    low, high = np.empty(dofs), np.empty(dofs)
    frame = np.empty(frames.shape[1:])
    iterations = 0
    for t in range(len(frames)):
        for i in range(dofs):
            variance[i] = min(variance[i] + rules.drift[i], rules.most_uncertain)
        iterations = 0
        residuals[:] = np.nan
        if of_one_person(frames[t], frame) >= FEWEST_MARKERS:
            for i in range(dofs):
                reach = np.inf if fresh[0] else rules.reach[i]
                at = posture[i + 1] if i >= 6 else 0.0
                low[i] = max(-reach, limits[i, 0] - at)
                high[i] = min(reach, limits[i, 1] - at)
            fresh[0] = False
            moves = Moves(low, high, joints.free, joints.rest_weight)
            iterations = solve_frame(
                posture, variance, frame, markers, linkage, moves, rules.search, residuals
            )
        out[t] = posture
    return out, iterations


@njit(cache=True)
def of_one_person(frame: FloatArray, out: FloatArray) -> int:
    """Copy the markers (M, 3), NaN where unseen or too far from most others for a person.

    Returns:
        How many are left.
    """
    low, high = np.full(3, np.inf), np.full(3, -np.inf)
    n = 0
    for m in range(len(frame)):
        if frame[m, 0] == frame[m, 0] and frame[m, 1] == frame[m, 1] and frame[m, 2] == frame[m, 2]:
            n += 1
            out[m] = frame[m]
            for i in range(3):
                low[i], high[i] = min(low[i], frame[m, i]), max(high[i], frame[m, i])
        else:
            out[m] = np.nan
    if n == 0 or max(high[0] - low[0], high[1] - low[1], high[2] - low[2]) <= LARGEST_M:
        return n
    middle = np.empty(3)
    for i in range(3):
        middle[i] = np.nanmedian(out[:, i])
    for m in range(len(frame)):
        if out[m, 0] == out[m, 0]:
            away = max(
                abs(out[m, 0] - middle[0]), abs(out[m, 1] - middle[1]), abs(out[m, 2] - middle[2])
            )
            if away > LARGEST_M / 2:
                out[m] = np.nan
                n -= 1
    return n
