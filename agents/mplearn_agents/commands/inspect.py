"""``mplearn inspect``: what is in recordings, and who was recognised."""

from __future__ import annotations

import argparse
import json
from importlib.util import find_spec
from math import isfinite
from pathlib import Path
from typing import TYPE_CHECKING

from mplearn_agents.recordings.reading import (
    add_reading_arguments,
    hints_of,
    say_left_out,
    say_not_read,
    shown_reading,
)

if TYPE_CHECKING:
    from rich.console import Console

    from mplearn_agents.recordings.inspection import Inspection

HELP = "Show what recordings hold: how they were read, and the person recognised in them."
EXAMPLE = "mplearn inspect session.c3d --up y --unit mm"
_MANY = 12  # names in a line
_MOST_ROWS = 20  # of a picture


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare what the command takes."""
    parser.add_argument("data", type=Path, help="a recording, or a folder of them")
    parser.add_argument("--json", action="store_true", help="print it as JSON, a list of takes")
    parser.add_argument(
        "--picture", type=Path, metavar="FILE.png", help="stick figures (default: NAME.png here)"
    )
    parser.add_argument("--no-picture", action="store_true", help="write no picture")
    add_reading_arguments(parser)


def run(args: argparse.Namespace) -> None:
    """Read, recognise, print and draw."""
    from mplearn.anatomy import read_map
    from mplearn.mocap import command_line, open_takes
    from mplearn_agents.recordings.inspection import inspect
    from mplearn_agents.terminal.console import open_console

    console = open_console()
    with command_line():
        with shown_reading(open_console(stderr=True)) as through:
            takes = open_takes(
                args.data,
                positions=True,
                hints=hints_of(args, joint_axes=True),
                strict=args.strict,
                through=through,
            )
        names = None if args.map is None else read_map(args.map)
        found = [inspect(recording, names) for recording in takes.recordings]
    if args.json:
        unreadable = [{"take": n, "problem": str(e)} for n, e in takes.unreadable.items()]
        print(json.dumps([each.as_dict() for each in found] + unreadable, indent=1))
    else:
        for name, error in takes.unreadable.items():
            say_left_out(console, name, error)
        say_not_read(console, takes)
        for each in found:
            _say(console, each)
    _draw(args, found, console)


def _draw(args: argparse.Namespace, found: list[Inspection], console: Console) -> None:
    from mplearn.extras import require

    if args.no_picture:
        return
    shown = [each for each in found if each.recording.is_markers]
    if not shown and args.picture is None:
        return  # channels alone: there is nothing to draw
    if args.picture is None and find_spec("matplotlib") is None:
        console.print("no picture: it needs pip install 'mplearn[report]'")
        return
    require("matplotlib", "report")
    from mplearn_agents.recordings.stick_figures import draw

    path = args.picture or Path(f"{args.data.absolute().name.split('.')[0] or 'takes'}.png")
    path.parent.mkdir(parents=True, exist_ok=True)
    shown = shown or found
    step = -(-len(shown) // _MOST_ROWS)
    draw(shown[::step], path)
    if not args.json:
        more = f" of every {step}th take" if step > 1 else ""
        console.print(f"stick figures{more} written to {path}")


def _say(console: Console, each: Inspection) -> None:
    def say(text: str) -> None:
        console.print(text, soft_wrap=True)

    facts = each.as_dict()
    unit = f", unit {facts['unit_m']:g} m" if facts["unit_m"] else ""
    up = f", {facts['up']} up" if facts["up"] else ""
    say(
        f"{facts['take']}: {facts['format']}, {facts['frames']} frames at {facts['rate_hz']:g} Hz "
        f"({facts['duration_s']:.1f} s){unit}{up}, {facts['points'] or facts['channels']} "
        f"{'points' if facts['points'] else 'channels'}"
    )
    for name, share in list(facts["gaps"].items())[:_MANY]:
        say(f"  missing: {name} in {100 * share:.1f} % of the frames")
    if each.body is not None:
        if isfinite(each.stature_m):  # else nobody fits, as is said below
            say(
                f"  a person of {each.stature_m:.2f} m, {1000 * each.fit_m:.0f} mm from the "
                f"points, confidence {each.body.confidence:.2f}"
            )
        say("  recognised: " + ", ".join(f"{p} = {' '.join(n)}" for p, n in each.body.parts))
    if facts["unseen"]:
        say(f"  unseen, held at rest: {', '.join(facts['unseen'])}")
    if facts["left_out"]:
        more = len(facts["left_out"]) - _MANY
        say(
            f"  left out: {', '.join(facts['left_out'][:_MANY])}"
            + (f" and {more} more" if more > 0 else "")
        )
    for note in facts["notes"]:
        say(f"  {note}")
    for warning in facts["warnings"]:
        say(f"  warning: {warning}")
    if each.problem:
        say(f"  nobody: {each.problem}")
