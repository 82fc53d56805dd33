"""Options of the commands that read recordings, and what reading says on the console."""

from __future__ import annotations

import argparse
from collections.abc import Callable, Collection, Iterable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING

from mplearn.errors import InvalidValueError
from mplearn_agents.terminal.arguments import count, positive
from mplearn_agents.terminal.inert import printable

if TYPE_CHECKING:
    from rich.console import Console

    from mplearn.anatomy import Bodies
    from mplearn.mocap import Hints, Takes
    from mplearn.recording import Recording

_SHOWN = 8  # names in a line


@contextmanager
def shown_reading(console: Console) -> Iterator[Callable[[Collection[str]], Iterable[str]]]:
    """Yield what shows in a terminal how many of how many takes are read: `open_takes`' through."""
    from mplearn_agents.terminal.progress import open_progress

    shown = console if console.is_terminal else None
    with open_progress(shown, "{task.completed:.0f} of {task.total:.0f}") as bar:
        yield lambda names: names if len(names) < 2 else bar.track(names, description="reading")


def add_reading_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare what a file may not say about itself, and what to do with one that is refused."""
    group = parser.add_argument_group("what the files do not say, or say wrongly")
    group.add_argument("--unit", help="length of their unit: m, cm, mm, in, ... or a number [m]")
    group.add_argument("--up", metavar="AXIS", help="their axis that points up: x, y, z, -x, ...")
    group.add_argument("--rate", type=positive, help="frames per second in the files [1/s]")
    group.add_argument(
        "--skeleton", type=Path, metavar="ASF", help="the skeleton that belongs to AMC files"
    )
    group.add_argument(
        "--angles",
        choices=["degrees", "radians"],
        help="what angles of BVH and AMC files are in (default: found from the motion)",
    )
    group.add_argument(
        "--mirrored",
        action="store_true",
        help="their axes are left-handed, as those of Unity and Unreal: people would be mirrored",
    )
    group.add_argument(
        "--level",
        action="store_true",
        help="the camera was tilted: turn people so that who stands straight is upright",
    )
    group.add_argument(
        "--map",
        type=Path,
        metavar="FILE",
        help="which point is which place of the body, a line each: LeftUpLeg = hip_l",
    )
    parser.add_argument(
        "--strict", action="store_true", help="refuse all if one take is refused; else leave it out"
    )


def add_corpus_arguments(parser: argparse.ArgumentParser, verb: str) -> None:
    """Declare who does the work."""
    group = parser.add_argument_group("many recordings at once")
    group.add_argument(
        "--jobs",
        type=count,
        metavar="N",
        help=f"{verb} the takes of a folder, and of the folders in it, by N processes; what comes "
        "out does not depend on N",
    )
    group.add_argument(
        "--ray",
        nargs="?",
        const="",
        metavar="ADDRESS",
        help="by the workers of a Ray cluster (mplearn[cluster]) that all see the files: the one "
        "of this machine, or that at ADDRESS",
    )


def hints_of(args: argparse.Namespace, *, joint_axes: bool = False) -> Hints:
    """Return what the options say about the files.

    Raises:
        InvalidValueError: A unit or an axis does not exist.
    """
    from mplearn.mocap import DIRECTIONS, UNITS_M, Hints, named_unit

    unit_m: float | None = None
    if args.unit is not None:
        unit_m = named_unit(args.unit)
        if unit_m is None:
            try:
                unit_m = float(args.unit)
            except ValueError:
                raise InvalidValueError(
                    f"--unit must be one of {', '.join(UNITS_M)} or a length in metres, "
                    f"not {args.unit!r}"
                ) from None
    if args.up is not None and args.up not in DIRECTIONS:
        raise InvalidValueError(f"--up must be one of {', '.join(DIRECTIONS)}, not {args.up!r}")
    return Hints(
        rate_hz=args.rate,
        unit_m=unit_m,
        up_axis=args.up,
        skeleton=args.skeleton,
        angle_unit=args.angles,
        mirrored=args.mirrored,
        level=args.level,
        joint_axes=joint_axes,
    )


def say_takes(console: Console, takes: Takes) -> None:
    """Say how the takes of a folder were read, and which could not be, or were not looked for."""
    for name, error in takes.unreadable.items():
        say_left_out(console, name, error)
    say_not_read(console, takes)
    said: dict[str, list[str]] = {}
    for recording in takes.recordings:
        for line in remarks(recording):
            said.setdefault(line, []).append(recording.name)
    for line, names in said.items():  # what is said of many takes is said once
        console.print(printable(f"{_listed(names)}: {line}"), markup=False, highlight=False)


def say_not_read(console: Console, takes: Takes) -> None:
    """Say which folders in a folder are not looked into, and which files are no recordings."""
    lines = []
    if takes.folders:
        lines.append(
            f"not looked into, folders in it: {_listed(takes.folders)} (learn --jobs N does)"
        )
    if takes.passed_over:
        lines.append(f"passed over, no key points in it: {_listed(takes.passed_over)}")
    for line in lines:
        console.print(printable(line), markup=False, highlight=False, style="yellow")


def say_bodies(console: Console, bodies: Bodies) -> None:
    """Say what was recognised in the takes: what is left out, what is in doubt."""
    said: dict[str, list[str]] = {}
    for name, body in bodies.maps.items():
        for line in (f"warning: {text}" for text in body.warnings):
            said.setdefault(line, []).append(name)
        left = f"; left out: {_listed(body.left_out)}" if body.left_out else ""
        unseen = f"; unseen: {_listed(body.unseen)}" if body.unseen else ""
        line = f"a body by {len(body.places)} places of {bodies.marker_sets[name]!r}{left}{unseen}"
        said.setdefault(line, []).append(name)
    for line, names in said.items():
        console.print(printable(f"{_listed(names)}: {line}"), markup=False, highlight=False)


def remarks(recording: Recording) -> list[str]:
    """Return what the report of a recording notes and warns of, a line each."""
    report = recording.report
    if report is None:
        return []
    lines = [f"warning: {text}" for text in report.warnings] + list(report.notes)
    if report.left_out:
        lines.append(f"left out: {_listed(report.left_out)}")
    return lines


def say_left_out(console: Console, name: str, error: Exception) -> None:
    """Say that a take is left out, and why."""
    text = printable(f"left out: {name}: {error}")
    console.print(text, markup=False, highlight=False, style="yellow")


def _listed(names: Iterable[str]) -> str:
    names = list(names)
    more = f" and {len(names) - _SHOWN} more" if len(names) > _SHOWN else ""
    return ", ".join(names[:_SHOWN]) + more
