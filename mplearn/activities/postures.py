"""Frames as postures that can be compared: wherever the person stands, whichever way they face."""

from __future__ import annotations

from ..body import view_of
from ..body.view import LEVER_M
from ..recording import FloatArray

_PLACE = ("tx", "ty", "rx", "ry", "rz")  # of a skeleton's root; its angles depend on the heading


def postures_of(frames: FloatArray, channels: tuple[str, ...]) -> FloatArray:
    """Return what of the frames is posture, in metres.

    Args:
        frames: Shape (T, D): the features of a `MotionObserver`; or the joint angles [rad] of a
            skeletal file, of which the height of the root is kept and its place and rotation are
            left out; other channels are kept as they are.
        channels: Their names.

    Returns:
        Shape (T, V).
    """
    root = channels[0].partition(".")[0]
    if not {f"{root}.{axis}" for axis in (*_PLACE, "tz")} <= set(channels):
        return view_of(channels).see(frames)
    place = {f"{root}.{axis}" for axis in _PLACE}
    kept = [i for i, channel in enumerate(channels) if channel not in place]
    turning = [channels[i].rpartition(".")[2].startswith("r") for i in kept]
    return frames[:, kept] * [LEVER_M if turns else 1.0 for turns in turning]
