"""The demonstrator performs what the robot performs, in the robot's time."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from mplearn.maths.easing import smooth_step
from mplearn.maths.plane import turn_in_plane
from mplearn.maths.quaternions import quaternion_product, vector_quaternion
from mplearn.maths.resampling import stretch
from mplearn.recording import FloatArray, LabelledSegment

if TYPE_CHECKING:
    from mplearn.body import Body

_BLEND = 0.25  # share of a step over which its first posture is bent to the one before it


def accompany(
    body: Body,
    postures: FloatArray,
    truth: Sequence[LabelledSegment],
    steps: Sequence[tuple[str, int]],
) -> FloatArray:
    """Return postures of a person who performs the steps, taken from the demonstrations.

    Of all demonstrations of a step's class, the one that starts nearest to where the last step
    ended is shown, stretched to the step's length. Where a class was never demonstrated, the
    person waits.

    Args:
        body: The person.
        postures: What the person did, shape (T, 7 + n), in MuJoCo's qpos layout.
        truth: Which class was performed when, in frames of ``postures``.
        steps: The class and the number of pictures of each step.

    Returns:
        A posture for each picture, shape (sum of pictures, 7 + n), feet about the origin.

    Example:
        >>> from mplearn.body import human_body
        >>> from mplearn.demonstrator import demonstrate
        >>> shown = demonstrate(["BAR", "BAL"], seed=1)
        >>> frames = shown.posture.frames
        >>> accompany(human_body(), frames, shown.truth, [("BAL", 20), ("BAR", 30)]).shape
        (50, 47)
    """
    last = _centred(body, postures[truth[0].start : truth[0].start + 1])[0]
    pieces: list[FloatArray] = []
    for label, n_pictures in steps:
        candidates = [segment for segment in truth if segment.label == label]
        if n_pictures < 1:
            continue
        if not candidates:
            pieces.append(np.repeat(last[None], n_pictures, axis=0))
            continue
        starts = np.array([postures[segment.start, 7:] for segment in candidates])
        nearest = candidates[int(np.argmin(((starts - last[7:]) ** 2).sum(axis=1)))]
        piece = _stretched(postures[nearest.start : nearest.end], n_pictures)
        piece = _joined(last, _centred(body, piece))
        pieces.append(piece)
        last = piece[-1]
    return np.concatenate(pieces)


def _stretched(frames: FloatArray, n: int) -> FloatArray:
    return _unit(stretch(frames, n))


def _centred(body: Body, frames: FloatArray) -> FloatArray:
    """Move a motion so that its first posture stands about the origin, the toes along x."""
    feet = [body.tree.body(f"foot_{side}") for side in "lr"]
    places, turns = body.tree.forward(frames[0])
    ahead = turns[feet, :2, 0].sum(axis=0)
    yaw = np.arctan2(ahead[1], ahead[0])
    moved = frames.copy()
    x, y = (frames[:, :2] - places[feet, :2].mean(axis=0)).T
    moved[:, :2] = np.stack(turn_in_plane(x, y, -yaw), axis=1)
    turn = vector_quaternion(0.0, 0.0, -yaw)
    moved[:, 3:7] = np.stack(quaternion_product(turn, frames[:, 3:7].T), axis=1)
    return moved


def _joined(last: FloatArray, frames: FloatArray) -> FloatArray:
    """Bend the first postures so that they leave from ``last``."""
    x = np.clip(np.arange(len(frames)) / max(1.0, _BLEND * len(frames)), 0.0, 1.0)
    fade = 1.0 - smooth_step(x)
    return _unit(frames + fade[:, None] * (last - frames[0]))


def _unit(frames: FloatArray) -> FloatArray:
    frames[:, 3:7] /= np.linalg.norm(frames[:, 3:7], axis=1, keepdims=True)
    return frames
