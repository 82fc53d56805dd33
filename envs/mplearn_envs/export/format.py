"""What every format is: how motions are written, and what a file says to its readers."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Sequence
from dataclasses import dataclass, fields
from pathlib import Path
from typing import ClassVar, NamedTuple

import numpy as np

from mplearn.errors import RecordingError
from mplearn.recording import FloatArray

from .motion import RobotMotion
from .robot_model import RobotModel

LARGEST = 1e9  # of a number that a file may say: what lies beyond is damage
_SHORTEST = 1e-6  # length of a quaternion


@dataclass(frozen=True, eq=False)
class Reading:
    """What a file says of one motion to those who read its format by the book.

    Attributes:
        rate_hz: Frames per second at which a reader plays it [1/s].
        root_pos: Where the base is, shape (T, 3), what the reader takes for [m].
        root_quat: How it is turned (w, x, y, z), shape (T, 4).
        joint_pos: Angles of the hinges, in the reader's order, shape (T, n), taken for [rad]; None
            where the format holds bodies alone.
        body_pos: Where the bodies are, in the reader's order, shape (T, B, 3); None for nothing.
        body_quat: How they are turned (w, x, y, z), shape (T, B, 4).
        joint_vel: Velocities of the hinges, shape (T, n).
        body_lin_vel: Of the bodies' origins, in the world's frame, shape (T, B, 3).
        body_ang_vel: Of the bodies, in the world's frame, shape (T, B, 3).
        times_s: The time that the file gives each frame, shape (T,) [s].
        local: Whether ``body_pos`` is seen from a base at the origin, not turned.

    Example:
        >>> import numpy as np
        >>> upright = np.tile([1.0, 0.0, 0.0, 0.0], (50, 1))
        >>> reading = Reading(50.0, np.zeros((50, 3)), upright, joint_pos=np.zeros((50, 30)))
        >>> reading.joint_pos.shape
        (50, 30)
    """

    rate_hz: float
    root_pos: FloatArray
    root_quat: FloatArray
    joint_pos: FloatArray | None = None
    body_pos: FloatArray | None = None
    body_quat: FloatArray | None = None
    joint_vel: FloatArray | None = None
    body_lin_vel: FloatArray | None = None
    body_ang_vel: FloatArray | None = None
    times_s: FloatArray | None = None
    local: bool = False

    def __len__(self) -> int:
        """Return the number of frames."""
        return len(self.root_pos)

    def require(self, path: Path, model: RobotModel) -> Reading:
        """Return the reading, if it is one of the robot.

        Raises:
            RecordingError: A part has another shape than the robot, or holds what is no number.
        """
        n_frames, n, n_bodies = len(self), len(model.joint_names), len(model.body_names)
        shapes = {
            "root_pos": (n_frames, 3),
            "root_quat": (n_frames, 4),
            "joint_pos": (n_frames, n),
            "body_pos": (n_frames, n_bodies, 3),
            "body_quat": (n_frames, n_bodies, 4),
            "joint_vel": (n_frames, n),
            "body_lin_vel": (n_frames, n_bodies, 3),
            "body_ang_vel": (n_frames, n_bodies, 3),
            "times_s": (n_frames,),
        }
        if n_frames < 2:
            raise RecordingError(f"{path}: a motion has 2 frames or more, this file {n_frames}")
        if not 0.0 < self.rate_hz < np.inf:
            raise RecordingError(f"{path}: the rate must be positive, not {self.rate_hz}")
        for field in fields(self):
            value = getattr(self, field.name)
            if field.name not in shapes or value is None:
                continue
            if value.shape != shapes[field.name]:
                raise RecordingError(
                    f"{path}: {field.name} is of shape {value.shape}, but robot {model.name!r} "
                    f"with {n} joints and {n_bodies} bodies needs {shapes[field.name]}"
                )
            far = ~(np.abs(value) <= LARGEST)  # NaN, too
            if far.any():
                frame = int(np.argwhere(far)[0][0])
                what = "not a number" if np.isnan(value[far]).any() else "too large"
                raise RecordingError(f"{path}: {field.name} is {what} in frame {frame}")
        for name in ("root_quat", "body_quat"):
            value = getattr(self, name)
            if value is not None and not (np.linalg.norm(value, axis=-1) > _SHORTEST).all():
                raise RecordingError(f"{path}: {name} holds a quaternion of length zero")
        return self


class Dialect(NamedTuple):
    """Another way to read a file of a format, for `check`.

    Attributes:
        kind: What kind of fault it is, see `Fault`.
        problem: What is wrong with the file if this is how it is meant.
        readings: What it says then.

    Example:
        >>> dialect = Dialect("quaternion order", "quaternions stand as x, y, z, w", readings=())
        >>> dialect.problem
        'quaternions stand as x, y, z, w'
    """

    kind: str
    problem: str
    readings: tuple[Reading, ...]


class Format(ABC):
    """Writes and reads one format.

    Attributes:
        name: What it is called on the command line, as in ``--to mjlab``.
        about: What it is, and for whom, in a line.
        suffix: What the names of its files end with; "" for a folder.
        rate_hz: Frames per second unless others are asked for [1/s].
        many: Whether one file (or folder) holds any number of motions.

    Example:
        >>> from mplearn_envs.export import format_of
        >>> format = format_of("unitree")
        >>> format.suffix, format.rate_hz, format.many
        ('.csv', 30.0, False)
    """

    name: ClassVar[str]
    about: ClassVar[str]
    suffix: ClassVar[str]
    rate_hz: ClassVar[float] = 50.0
    many: ClassVar[bool] = False

    @abstractmethod
    def write(self, path: Path, motions: Sequence[RobotMotion], model: RobotModel) -> None:
        """Write motions, all at one rate; just one where the format does not hold many.

        Raises:
            MissingDependencyError: The format needs a package that is not installed.
        """

    @abstractmethod
    def read(self, path: Path, model: RobotModel) -> tuple[Reading, ...]:
        """Return what a file says to its readers, motion by motion; nothing is put right.

        Raises:
            RecordingError: It is not of the format, or of another robot.
        """

    def dialects(self, path: Path, model: RobotModel) -> tuple[Dialect, ...]:
        """Return how else a file may be read, which only the format can tell."""
        return ()

    def accepts(self, path: Path) -> bool:
        """Whether a file, by its name or a look at it, is one of the format."""
        return path.name.lower().endswith(self.suffix)


def in_order(path: Path, what: str, found: Sequence[str], wanted: Sequence[str]) -> list[int]:
    """Return where each of the wanted names stands among those that were found.

    Raises:
        RecordingError: One is missing.
    """
    places = {name: k for k, name in enumerate(found)}
    missing = [name for name in wanted if name not in places]
    if missing:
        raise RecordingError(
            f"{path}: there is no {what} {missing[0]!r}; it has {list(found)[:40]}"
        )
    return [places[name] for name in wanted]
