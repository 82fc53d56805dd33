"""What every reader is: it turns one file of its format into a recording."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import ClassVar

import numpy as np

from ..errors import InvalidValueError, RecordingError
from ..recording import Recording
from .files import cmu_subject, stem

DIRECTIONS = ("x", "-x", "y", "-y", "z", "-z")
"""Axes of a file that may point up."""


ANGLE_UNITS = ("degrees", "radians")


@dataclass(frozen=True)
class Hints:
    """What a file does not say about itself, or says wrongly: a value given here wins.

    Attributes:
        rate_hz: Frames per second at which the file was recorded [1/s].
        unit_m: Length of the file's unit of length [m].
        up_axis: The file's axis that points up: ``"x"``, ``"y"``, ``"z"``, or ``"-x"``, ...
        skeleton: The ASF file that belongs to an AMC file.
        angle_unit: What the angles of a BVH, AMC or G1 file are in: ``"degrees"`` or ``"radians"``.
        mirrored: Whether the file's axes are left-handed, as those of Unity and Unreal are: then
            people would be mirrored, and one axis is turned round.
        level: Whether the camera was tilted: then people are turned so that who stands straight is
            upright.
        joint_axes: With joint positions, also how each joint is turned: three points more
            (``Head>x``), 0.1 m along axes that turn with it.

    Example:
        >>> Hints(rate_hz=120.0, unit_m=0.001).unit_m  # millimetres
        0.001
    """

    rate_hz: float | None = None
    unit_m: float | None = None
    up_axis: str | None = None
    skeleton: Path | str | None = None
    angle_unit: str | None = None
    mirrored: bool = False
    level: bool = False
    joint_axes: bool = False

    def __post_init__(self) -> None:
        for name in ("rate_hz", "unit_m"):
            value = getattr(self, name)
            if value is not None and not (np.isfinite(value) and value > 0):
                raise InvalidValueError(f"{name} must be positive and finite, not {value}")
        if self.up_axis is not None and self.up_axis not in DIRECTIONS:
            raise InvalidValueError(
                f"up_axis must be one of {', '.join(DIRECTIONS)}, not {self.up_axis!r}"
            )
        if self.angle_unit not in (None, *ANGLE_UNITS):
            raise InvalidValueError(
                f"angle_unit must be one of {', '.join(ANGLE_UNITS)}, not {self.angle_unit!r}"
            )


class Reader(ABC):
    """Reads one format, or one dialect of files that share a suffix.

    Attributes:
        format: Name of the format or dialect, for reports and messages.
        suffixes: The file suffixes of the format, lower case, without ``.gz``.
        begins: How the text of all its files begins, upper case, where that tells the format
            whatever a file is called.

    Example:
        >>> class Shouts(Reader):
        ...     format, suffixes = "shouts", (".shout",)
        ...     def read(self, path, hints, *, positions):
        ...         rows = [[float(line)] for line in path.read_text().split()]
        ...         return Recording(np.array(rows), hints.rate_hz or 25.0, ("loudness",))
        >>> file = Path("a.shout")
        >>> file.write_text("0.1 0.5 0.2")
        11
        >>> len(Shouts().read(file, Hints(), positions=True))
        3
    """

    format: ClassVar[str]
    suffixes: ClassVar[tuple[str, ...]]
    begins: ClassVar[tuple[str, ...]] = ()

    @abstractmethod
    def read(self, path: Path, hints: Hints, *, positions: bool) -> Recording:
        """Read one file, plain or gzipped.

        Args:
            path: The file.
            hints: What the file does not say about itself.
            positions: Joint-centre positions instead of joint angles, for skeletal formats.

        Returns:
            Markers or positions [m], z up, or joint angles [rad], at the file's own rate.

        Raises:
            RecordingError: The file does not hold what its format promises.
        """

    def read_each(self, path: Path, hints: Hints, *, positions: bool) -> tuple[Recording, ...]:
        """Read a recording of each who moves in one file, as far as `read` returns one of several.

        By default that is what `read` returns, in which `each_person` may tell people apart.
        """
        return (self.read(path, hints, positions=positions),)

    def accepts(self, path: Path) -> bool:
        """Whether a file with the right suffix is one of the format, by its name or its start."""
        return True

    def person(self, take: str) -> str:
        """Return who moves in a take, as far as its name tells: CMU's ``86_01`` is of ``86``."""
        return cmu_subject(take)

    def takes(self, paths: Sequence[Path]) -> dict[str, tuple[Path, ...]]:
        """Group the accepted files of a folder into takes, by name: one file is one take."""
        named: dict[str, tuple[Path, ...]] = {}
        for path in paths:
            if stem(path) in named:
                raise RecordingError(
                    f"{path}: the same take lies beside it as {named[stem(path)][0].name!r}; "
                    "expected each take once"
                )
            named[stem(path)] = (path,)
        return named


def joined(name: str, parts: Sequence[Recording]) -> Recording:
    """Return the parts of one continuous take, one after another, with their labels."""
    offsets = np.cumsum([0, *(len(part) for part in parts)])
    labels = tuple(
        replace(label, start=label.start + int(offset), end=label.end + int(offset))
        for part, offset in zip(parts, offsets, strict=False)
        for label in part.labels
    )
    frames = np.concatenate([part.frames for part in parts])
    return replace(parts[0], frames=frames, name=name, labels=labels)
