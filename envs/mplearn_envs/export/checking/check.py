"""Whether a file is what it should be, and if not why."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from mplearn.errors import RecordingError

from ..format import Dialect, Format, Reading
from ..registry import formats, recognised
from ..robot_model import RobotModel
from ..sidecar import Meant, Sidecar, read_sidecar
from .faults import Evidence, Fault, faults
from .misfit import CONSISTENT, Misfit, by_itself, measure

_BEAM, _DEPTH = 3, 3  # so many readings are followed, so many faults deep
_WORTH = 0.5  # a fault that explains less is none
_TIME = 0.1  # share of a frame by which times may be off
_SPEED = 1.5  # share of its limit at which no joint moves
_FLOOR_M, _LIMIT_RAD = 0.05, 0.1


@dataclass(frozen=True, eq=False)
class Verdict:
    r"""What was found out about one motion of a file.

    Attributes:
        name: What the motion is called.
        format: Name of the format.
        n_frames: Number of frames.
        rate_hz: Rate at which readers play it [1/s].
        misfit: How far it is off.
        faults: What is wrong, most important first.
        left: How far it would be off without these faults.
        problems: What is wrong and not explained.
        notes: What could not be checked.

    Example:
        >>> from pathlib import Path
        >>> from mplearn_envs.export import RobotModel, export, format_of, perform
        >>> from mplearn_envs.robot import humanoid
        >>> model = RobotModel.of(humanoid())
        >>> bow = perform(None, humanoid(), ("bow down",)).motions
        >>> (path,) = export(bow, model, format_of("unitree"), Path("bow.csv"))
        >>> rows = [line.split(",") for line in path.read_text().splitlines()]
        >>> for row in rows:
        ...     row[3:7] = row[6], *row[3:6]  # quaternions in the other order
        >>> _ = path.write_text("\n".join(",".join(row) for row in rows))
        >>> verdict = check(path, model)[0]
        >>> verdict.in_order, len(verdict.faults) + len(verdict.problems) > 0
        (False, True)
    """

    name: str
    format: str
    n_frames: int
    rate_hz: float
    misfit: Misfit
    faults: tuple[Fault, ...]
    left: Misfit
    problems: tuple[str, ...]
    notes: tuple[str, ...]

    @property
    def in_order(self) -> bool:
        """Whether nothing is wrong."""
        return not self.faults and not self.problems

    def plain(self) -> dict[str, Any]:
        """Return the verdict as plain values."""
        return {
            "name": self.name,
            "format": self.format,
            "frames": self.n_frames,
            "rate_hz": self.rate_hz,
            "in_order": self.in_order,
            "position_m": self.misfit.position_m,
            "body": self.misfit.body,
            "frame": self.misfit.frame,
            "angle_deg": float(np.degrees(self.misfit.angle_rad)),
            "compared_with": list(self.misfit.compared),
            "faults": [{"kind": f.kind, "problem": f.problem} for f in self.faults],
            "left_m": self.left.position_m,
            "left_deg": float(np.degrees(self.left.angle_rad)),
            "problems": list(self.problems),
            "notes": list(self.notes),
        }


def check(
    path: Path,
    model: RobotModel,
    format: Format | None = None,
    *,
    tolerance_m: float = 1e-3,
    tolerance_rad: float = 2e-3,
) -> tuple[Verdict, ...]:
    """Read a file as its readers do, do forward kinematics again, and say what does not fit.

    What stands beside the file (`sidecar`) is used where it is there; else the file is held against
    itself and against what the robot can do.

    Args:
        path: The file, or the folder where the format is one.
        model: The robot.
        format: The format; None finds it.
        tolerance_m: How far bodies may be off [m].
        tolerance_rad: How far they may be turned otherwise [rad].

    Returns:
        A verdict for each motion of the file.

    Raises:
        RecordingError: The file cannot be read, or is of another robot.

    Example:
        >>> from pathlib import Path
        >>> from mplearn_envs.export import RobotModel, export, format_of, perform
        >>> from mplearn_envs.robot import humanoid
        >>> model = RobotModel.of(humanoid())
        >>> bow = perform(None, humanoid(), ("bow down",)).motions
        >>> (path,) = export(bow, model, format_of("unitree"), Path("bow.csv"))
        >>> [verdict.in_order for verdict in check(path, model)]
        [True]
    """
    sidecar = read_sidecar(path)
    if format is None:
        said = None if sidecar is None else formats().get(sidecar.format)
        format = said or recognised(path)
    readings = format.read(path, model)
    meant = _meant(path, sidecar, model, len(readings))
    found: list[tuple[Dialect, ...]] = []  # what else it may say, if it is asked for

    def dialects(k: int) -> list[Fault]:
        if not found:
            found.append(format.dialects(path, model))
        return [Fault(each.kind, each.problem, each.readings[k]) for each in found[0]]

    return tuple(
        _verdict(
            format.name,
            f"{path.name}" if len(readings) == 1 else f"{path.name} {k}",
            reading,
            Evidence(model, aim),
            partial(dialects, k),
            tolerance_m,
            tolerance_rad,
        )
        for k, (reading, aim) in enumerate(zip(readings, meant, strict=True))
    )


def _meant(
    path: Path, sidecar: Sidecar | None, model: RobotModel, n: int
) -> tuple[Meant | None, ...]:
    if sidecar is None:
        return (None,) * n
    if sidecar.body_names != model.body_names:
        raise RecordingError(
            f"{path} was written for robot {sidecar.robot!r} of {len(sidecar.body_names)} bodies; "
            f"{model.name!r} has {len(model.body_names)}, and others: give --robot"
        )
    if len(sidecar.motions) != n:
        raise RecordingError(f"{path} holds {n} motions; {len(sidecar.motions)} were written")
    return sidecar.motions


@dataclass(frozen=True, eq=False)
class _Trail:
    """A reading, and the faults that were taken back on the way to it."""

    reading: Reading
    evidence: Evidence
    misfit: Misfit
    faults: tuple[Fault, ...] = ()

    def without(self, fault: Fault) -> _Trail:
        """Return the trail with one more fault taken back."""
        evidence = self.evidence._replace(meant=fault.meant or self.evidence.meant)
        misfit = measure(fault.reading, *evidence)
        return _Trail(fault.reading, evidence, misfit, (*self.faults, fault))


def _verdict(
    format: str,
    name: str,
    reading: Reading,
    evidence: Evidence,
    dialects: Callable[[], Sequence[Fault]],
    tolerance_m: float,
    tolerance_rad: float,
) -> Verdict:
    first = _Trail(reading, evidence, measure(reading, *evidence))

    def problems(misfit: Misfit) -> tuple[str, ...]:
        return tuple(_problems(misfit, tolerance_m, tolerance_rad))

    plain = by_itself(reading, first.misfit, evidence.model)
    best = first if plain is reading else _Trail(plain, evidence, measure(plain, *evidence))
    beam = [best]
    for _ in range(_DEPTH):
        if not problems(best.misfit):
            break
        found = [
            further
            for trail in beam
            for fault in _tried(trail, dialects)
            if (further := trail.without(fault)).misfit.cost < trail.misfit.cost - _WORTH
        ]
        beam = sorted(found, key=lambda trail: trail.misfit.cost)[:_BEAM]
        if beam and beam[0].misfit.cost < best.misfit.cost - _WORTH:
            best = beam[0]
    return Verdict(
        evidence.meant.name if evidence.meant else name,
        format,
        len(reading),
        reading.rate_hz,
        first.misfit,
        best.faults,
        best.misfit if best.faults else first.misfit,
        problems(best.misfit),
        tuple(_notes(reading, evidence)),
    )


def _tried(trail: _Trail, dialects: Callable[[], Sequence[Fault]]) -> Iterator[Fault]:
    if not trail.faults:
        yield from dialects()
    taken = {fault.problem for fault in trail.faults}
    for fault in faults(trail.reading, trail.evidence):
        if fault.problem not in taken:
            yield fault


def _problems(misfit: Misfit, tolerance_m: float, tolerance_rad: float) -> Iterator[str]:
    if misfit.position_m > tolerance_m:
        yield (
            f"bodies are off by {misfit.position_m:.4g} m at most ({misfit.body}, frame "
            f"{misfit.frame})"
        )
    if misfit.angle_rad > tolerance_rad:
        yield f"bodies are turned by {np.degrees(misfit.angle_rad):.3g} degrees at most"
    if misfit.missing:
        more = "more" if misfit.missing < 0 else "fewer"
        yield f"there are {abs(misfit.missing)} frames {more} than were meant"
    for name, share in misfit.velocities.items():
        if share > CONSISTENT:
            yield f"{name} differ from the differences of positions by {100 * share:.3g} %"
    if misfit.time > _TIME:
        yield f"the file's times are off its rate by {misfit.time:.3g} frames"
    if misfit.beyond_rad > _LIMIT_RAD:
        yield f"{misfit.joint} goes {misfit.beyond_rad:.3g} rad beyond its limits"
    if misfit.speed > _SPEED:
        yield f"joints move {misfit.speed:.3g} times as fast as the robot can"
    if abs(misfit.floor_m) > _FLOOR_M:
        side = "over" if misfit.floor_m > 0 else "under"
        yield f"the feet are {abs(misfit.floor_m):.3g} m {side} the floor in the median frame"
    if misfit.parts["tilt"] > 0:
        yield "the base does not stand upright in the median frame"
    if misfit.length > 0.01:
        yield f"the base's quaternions differ from length 1 by {misfit.length:.3g}"


def _notes(reading: Reading, evidence: Evidence) -> Iterator[str]:
    if evidence.meant is not None:
        return
    if reading.body_pos is None:
        yield (
            "nothing beside the file says what was meant, and it holds no bodies: it was held "
            "against the floor and the robot's limits only"
        )
    if reading.joint_vel is None and reading.times_s is None:
        yield f"nothing says whether it is meant for {reading.rate_hz:g} Hz"
    yield "a motion that is mirrored as a whole cannot be told without what was meant"
