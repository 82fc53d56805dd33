"""What a robot performs, as plain numbers: the one form that all formats are written from."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from mplearn.errors import InvalidValueError
from mplearn.recording import FloatArray


class Span(NamedTuple):
    """A primitive within a motion.

    Attributes:
        id: Its id in the library; -1 where the robot held its posture.
        name: Its name.
        start_s: Where it begins [s].
        end_s: Where it ends [s].

    Example:
        >>> Span(id=7, name="bow down", start_s=0.0, end_s=1.2).name
        'bow down'
    """

    id: int
    name: str
    start_s: float
    end_s: float


@dataclass(frozen=True, eq=False)
class RobotMotion:
    """A motion of a robot, in the conventions of its own MJCF: z up, x ahead.

    Attributes:
        name: What the motion is called.
        joint_names: Names of the n hinges, in the order of the model.
        rate_hz: Frames per second [1/s].
        root_pos: Where the floating base is, shape (T, 3) [m].
        root_quat: How it is turned, unit quaternions (w, x, y, z), shape (T, 4).
        joint_pos: Angles of the hinges, in the zero of the robot's own MJCF, shape (T, n) [rad].
        spans: The primitives, one after another.

    Example:
        >>> still = np.tile([1.0, 0.0, 0.0, 0.0], (101, 1))
        >>> swing = np.sin(np.linspace(0.0, 6.0, 101))[:, None]
        >>> motion = RobotMotion("swing", ("elbow",), 50.0, np.zeros((101, 3)), still, swing)
        >>> motion.duration_s, len(motion.resampled(30.0))
        (2.0, 61)
    """

    name: str
    joint_names: tuple[str, ...]
    rate_hz: float
    root_pos: FloatArray
    root_quat: FloatArray
    joint_pos: FloatArray
    spans: tuple[Span, ...] = ()

    def __post_init__(self) -> None:
        n_frames, n = len(self.root_pos), len(self.joint_names)
        shapes = {"root_pos": (n_frames, 3), "root_quat": (n_frames, 4), "joint_pos": (n_frames, n)}
        for field, shape in shapes.items():
            value = getattr(self, field)
            if value.shape != shape or not np.isfinite(value).all():
                raise InvalidValueError(
                    f"{field} must be finite and of shape {shape}, not of {value.shape}"
                )
        if n_frames < 2:
            raise InvalidValueError(f"a motion has at least 2 frames, not {n_frames}")
        if not 0.0 < self.rate_hz < np.inf:
            raise InvalidValueError(f"rate_hz must be positive and finite, not {self.rate_hz}")

    def __len__(self) -> int:
        """Return the number of frames."""
        return len(self.root_pos)

    @property
    def duration_s(self) -> float:
        """Time from the first frame to the last [s]."""
        return (len(self) - 1) / self.rate_hz

    @property
    def times_s(self) -> FloatArray:
        """Time of each frame, shape (T,) [s]."""
        return np.arange(len(self)) / self.rate_hz

    def resampled(self, rate_hz: float) -> RobotMotion:
        """Return the motion at another rate, through the same postures (cubic splines).

        Raises:
            InvalidValueError: The rate is not positive and finite.

        Example:
            >>> from mplearn_envs.export import perform
            >>> from mplearn_envs.robot import humanoid
            >>> motion = perform(None, humanoid(), walk=1).motions[0]
            >>> motion.rate_hz, motion.resampled(30.0).rate_hz
            (50.0, 30.0)
        """
        from scipy.interpolate import CubicSpline

        if not 0.0 < rate_hz < np.inf:
            raise InvalidValueError(f"rate_hz must be positive and finite, not {rate_hz}")
        if rate_hz == self.rate_hz:
            return self
        n_frames = int(np.floor(self.duration_s * rate_hz + 1e-9)) + 1
        if n_frames < 2:
            raise InvalidValueError(
                f"a motion of {self.duration_s:.3g} s has no two frames at {rate_hz:g} Hz"
            )
        quat = continuous_quaternions(self.root_quat)
        known = np.hstack((self.root_pos, quat, self.joint_pos))
        there = CubicSpline(self.times_s, known)(np.arange(n_frames) / rate_hz)
        turned = there[:, 3:7] / np.linalg.norm(there[:, 3:7], axis=1, keepdims=True)
        return replace(
            self,
            rate_hz=rate_hz,
            root_pos=there[:, :3],
            root_quat=turned,
            joint_pos=there[:, 7:],
        )


def continuous_quaternions(quaternions: FloatArray) -> FloatArray:
    """Return quaternions, shape (T, ..., 4), of which each is on the side of the one before."""
    steps = np.where((quaternions[1:] * quaternions[:-1]).sum(axis=-1) < 0.0, -1.0, 1.0)
    sign = np.concatenate((np.ones_like(steps[:1]), np.cumprod(steps, axis=0)))
    return np.asarray(quaternions * sign[..., None])
