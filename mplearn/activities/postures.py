"""Frames as postures that can be compared: wherever the person stands, whichever way they face."""

from __future__ import annotations

from ..body import view_of
from ..recording import FloatArray

_PLACE = ("tx", "ty", "rx", "ry", "rz")  # of a skeleton's root; its angles depend on the heading
_LEVER_M = 0.2  # an angle counts as the way of a point this far from its joint
_SMALL = ("wrist", "hand", "finger", "thumb", "toe")  # these joints move little but themselves


def postures_of(frames: FloatArray, channels: tuple[str, ...]) -> FloatArray:
    """Return what of the frames is posture, in metres.

    Args:
        frames: Shape (T, D): the features of a `MotionObserver`; or the joint angles [rad] of a
            skeletal file, of which the height of the root is kept, its place and rotation are left
            out, and so are hands and toes; other channels are kept as they are.
        channels: Their names.

    Returns:
        Shape (T, V).

    Example:
        >>> import numpy as np
        >>> from mplearn.body import feature_channels, features_of, robot_body
        >>> frames = features_of(robot_body().rest[None])
        >>> postures_of(frames, feature_channels()).shape
        (1, 78)
    """
    root = channels[0].partition(".")[0]
    if not {f"{root}.{axis}" for axis in (*_PLACE, "tz")} <= set(channels):
        return view_of(channels).see(frames)
    place = {f"{root}.{axis}" for axis in _PLACE}
    kept = [i for i, name in enumerate(channels) if name not in place and not _is_small(name)]
    turning = [channels[i].rpartition(".")[2].startswith("r") for i in kept]
    return frames[:, kept] * [_LEVER_M if turns else 1.0 for turns in turning]


def _is_small(channel: str) -> bool:
    return any(part in channel.lower() for part in _SMALL)
