"""What the learner sees of a posture: base height, roll and pitch, and the driven joint angles.

Position on the floor and heading are left out: a motion is the same motion wherever it is
performed.
"""

from __future__ import annotations

import numpy as np

from mplearn.errors import BodyError
from mplearn.maths.yaw_roll_pitch import roll_pitch_of, yaw_roll_pitch_quaternion
from mplearn.recording import FloatArray

from ...maths.compiling import njit
from ..models.body import Body
from ..models.robot import robot_body

BASE_CHANNELS = ("base_height", "base_roll", "base_pitch")


def feature_channels(body: Body | None = None) -> tuple[str, ...]:
    """Return the channel names: the three of the base, then the driven joints (the robot's: 33).

    Example:
        >>> feature_channels()[:4]
        ('base_height', 'base_roll', 'base_pitch', 'waist_yaw')
    """
    return BASE_CHANNELS + (body or robot_body()).driven_names


def features_of(q: FloatArray, body: Body | None = None) -> FloatArray:
    """Return the features of postures.

    The base's orientation is yaw, then roll, then pitch (z-x'-y''), of which the yaw is dropped. So
    deep bows and forward rolls go through no singular posture; only lying on one side is one.

    Args:
        q: Postures, shape (..., 7 + n).
        body: The body; the robot where not given.

    Returns:
        Height [m], roll and pitch [rad], driven joint angles [rad], shape (..., 3 + driven).

    Example:
        >>> from mplearn.body import robot_body
        >>> features = features_of(robot_body().rest[None])
        >>> features.shape, feature_channels()[:3]
        ((1, 33), ('base_height', 'base_roll', 'base_pitch'))
    """
    body = body or robot_body()
    if q.shape[-1] != body.nq:
        raise BodyError(f"a posture of {body.name!r} has {body.nq} values, not {q.shape[-1]}")
    features = np.empty((*q.shape[:-1], 3 + len(body.driven)))
    features[..., 0] = q[..., 2]
    features[..., 1], features[..., 2] = roll_pitch_of(np.moveaxis(q[..., 3:7], -1, 0))
    features[..., 3:] = q[..., 7 + body.driven]
    return features


def posture_of(
    features: FloatArray,
    x: float | FloatArray = 0.0,
    y: float | FloatArray = 0.0,
    yaw: float | FloatArray = 0.0,
    body: Body | None = None,
) -> FloatArray:
    """Return the postures that features describe; the inverse of `features_of`.

    Args:
        features: Shape (..., 3 + driven).
        x: Position of the base [m], a number or shape (...).
        y: The same to the left [m].
        yaw: Heading [rad].
        body: The body; the robot where not given.

    Returns:
        Postures, shape (..., 7 + n); held joints are zero.

    Example:
        >>> from mplearn.body import features_of, robot_body
        >>> features = features_of(robot_body().rest)
        >>> posture = posture_of(features, x=1.5)
        >>> float(posture[0]), bool(np.allclose(features_of(posture), features))
        (1.5, True)
    """
    body = body or robot_body()
    width = 3 + len(body.driven)
    if features.shape[-1] != width:
        raise BodyError(f"features of {body.name!r} have {width} values, not {features.shape[-1]}")
    q = np.zeros((*features.shape[:-1], body.nq))
    q[..., 0], q[..., 1], q[..., 2] = x, y, features[..., 0]
    turn = yaw_roll_pitch_quaternion(yaw, features[..., 1], features[..., 2])
    q[..., 3:7] = np.stack(turn, axis=-1)
    q[..., 7 + body.driven] = features[..., 3:]
    return q


@njit(cache=True)
def join_angles(angles: FloatArray, last: float) -> float:
    """Move angles by full turns, in place, so that each is near the one before; return the last.

    Args:
        angles: Shape (T,) [rad].
        last: The one before the first [rad].
    """
    for t in range(len(angles)):
        angles[t] += 2 * np.pi * np.round((last - angles[t]) / (2 * np.pi))
        last = angles[t]
    return last
