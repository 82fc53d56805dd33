"""From motions to files."""

from __future__ import annotations

import re
import shutil
from collections.abc import Sequence
from contextlib import nullcontext
from pathlib import Path

from mplearn.errors import InvalidValueError
from mplearn.writing import written_whole

from .format import Format
from .motion import RobotMotion
from .registry import formats
from .robot_model import RobotModel
from .sidecar import sidecar_path, write_sidecar

_UNFIT = re.compile(r"[^\w.-]+")
_LONGEST = 80


def export(
    motions: Sequence[RobotMotion],
    model: RobotModel,
    format: Format,
    out: Path,
    *,
    rate_hz: float | None = None,
) -> tuple[Path, ...]:
    """Write motions, and beside each file what is meant by it (see `sidecar`).

    Args:
        motions: The motions.
        model: The robot.
        format: The format.
        out: File to write. Where there are several motions and the format does not hold many, the
            folder to write files into, named after the motions.
        rate_hz: Frames per second; None is what is usual in the format [1/s].

    Returns:
        The files, or folders where the format is one.

    Raises:
        InvalidValueError: There is no motion, or the place is taken by something else.
        MissingDependencyError: The format needs a package that is not installed.

    Example:
        >>> from mplearn_envs.export import RobotModel, check, export, format_of, perform
        >>> from mplearn_envs.robot import humanoid
        >>> model = RobotModel.of(humanoid())
        >>> bow = perform(None, humanoid(), ("bow down", "bow up")).motions
        >>> (path,) = export(bow, model, format_of("unitree"), Path("bow.csv"))
        >>> check(path, model)[0].in_order
        True
    """
    if not motions:
        raise InvalidValueError("there is no motion to export")
    check_place(format, out, len(motions))
    ready = [motion.resampled(rate_hz or format.rate_hz) for motion in motions]
    if format.many or len(ready) == 1:
        out.parent.mkdir(parents=True, exist_ok=True)
        jobs = [(out, ready)]
    else:
        out.mkdir(parents=True, exist_ok=True)
        jobs = [
            (out / f"{name}{format.suffix}", [motion])
            for name, motion in zip(_file_names(ready), ready, strict=True)
        ]
    for path, part in jobs:
        if path.is_dir() and not format.suffix:
            if any(path.iterdir()) and not sidecar_path(path).is_file():
                raise InvalidValueError(f"{path} is a folder with something else in it")
            shutil.rmtree(path)
        elif path.is_dir():
            raise InvalidValueError(f"{path} is a folder; {format.name} is one file")
        with written_whole(path) if format.suffix else nullcontext(path) as place:
            format.write(place, part, model)
        write_sidecar(path, format.name, part, model)
    return tuple(path for path, _ in jobs)


def check_place(format: Format, out: Path, n: int) -> None:
    """Refuse a place that is not what so many motions are written to: a file, or a folder of files.

    Raises:
        InvalidValueError: It is not.
    """
    if format.many or n == 1:
        if not out.name.lower().endswith(format.suffix):
            raise InvalidValueError(
                f"{format.name} is written to a file that ends with {format.suffix}, not to "
                f"{out.name!r}"
            )
    elif out.is_file():
        raise InvalidValueError(f"{out} is a file: {n} motions need a folder")
    elif out.suffix and not out.is_dir() and out.suffix.lower() in _suffixes():
        raise InvalidValueError(
            f"{out.name!r} is the name of one file: {n} motions are {n} files of {format.name}; "
            f"give a folder to write them into, such as {out.stem!r}"
        )


def _suffixes() -> set[str]:
    return {each.suffix for each in formats().values()}


def file_name(text: str) -> str:
    """Return a name as one that any system takes for a file.

    Example:
        >>> file_name("bow down / up?")
        'bow_down_up'
    """
    return _UNFIT.sub("_", text).strip("_.")[:_LONGEST] or "motion"


def _file_names(motions: Sequence[RobotMotion]) -> list[str]:
    """Return a name for each, all different whatever the case."""
    taken: set[str] = set()
    out = []
    for motion in motions:
        name, k = file_name(motion.name), 1
        while name.lower() in taken:
            k += 1
            name = f"{file_name(motion.name)}_{k}"
        taken.add(name.lower())
        out.append(name)
    return out
