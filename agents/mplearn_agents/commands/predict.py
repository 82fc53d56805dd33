"""``mplearn predict``: what comes next after some primitives."""

from __future__ import annotations

import argparse
import json
import math
from pathlib import Path

from mplearn_agents.terminal.arguments import count, primitive_key

HELP = "Predict which primitive comes next, how likely and when, after those given."
EXAMPLE = "mplearn predict my.mplearn 'bow down' 'bow up' --most 3"


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare what the command takes."""
    parser.add_argument("library", type=Path, help="library file")
    parser.add_argument(
        "history", nargs="+", metavar="PRIMITIVE", help="ids or names, the latest last"
    )
    parser.add_argument("--most", type=count, default=5, help="how many at most (default: 5)")
    parser.add_argument("--json", action="store_true", help="print a list as JSON")


def run(args: argparse.Namespace) -> None:
    """Predict, and print a table or JSON."""
    from rich.text import Text

    from mplearn.library import PrimitiveLibrary
    from mplearn_agents.terminal.console import new_table, open_console
    from mplearn_agents.terminal.inert import printable

    library = PrimitiveLibrary.load(args.library)
    history = [key if key in library else primitive_key(key) for key in args.history]
    found = library.predict_next(history, args.most)
    if args.json:
        rows = [
            {
                "primitive": each.id,
                "name": library[each.id].name,
                "probability": each.probability,
                "duration_s": _number(each.duration_s),
                "duration_std_s": _number(each.duration_std_s),
            }
            for each in found
        ]
        print(json.dumps(rows, indent=1))
        return
    right = ("id", "probability", "in [s]", "+- [s]")
    table = new_table("next", "id", "primitive", *right[1:], right=right)
    for each in found:
        table.add_row(
            str(each.id),
            Text(printable(library[each.id].name)),
            f"{each.probability:.3f}",
            f"{each.duration_s:.2f}",
            f"{each.duration_std_s:.2f}",
        )
    open_console().print(table)


def _number(value: float) -> float | None:
    return value if math.isfinite(value) else None
