"""``mplearn doctor``: what works here, what does not, and what to do about it."""

from __future__ import annotations

import argparse
import json

from mplearn_agents.terminal.exit_codes import NOT_IN_ORDER

HELP = (
    "Check this installation: versions, extras, rendering, data; say what to do. 1: not in order."
)
EXAMPLE = "mplearn doctor --json"


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare what the command takes."""
    parser.add_argument("--json", action="store_true", help="print a list as JSON")


def run(args: argparse.Namespace) -> int:
    """Check, print, and return 1 where something that is needed does not work."""
    from rich.text import Text

    from mplearn_agents.diagnosis import diagnose
    from mplearn_agents.terminal.console import new_table, open_console

    found = list(diagnose())
    if args.json:
        print(json.dumps([each._asdict() for each in found], indent=1))
    else:
        colours = {"ok": "green", "missing": "yellow", "wrong": "red"}
        table = new_table("doctor", "what", "state", "found", "what to do")
        for each in found:
            table.add_row(each.what, Text(each.state, colours[each.state]), each.found, each.advice)
        open_console().print(table)
    return NOT_IN_ORDER if any(each.state == "wrong" for each in found) else 0
