"""``mplearn show``: what a library holds."""

from __future__ import annotations

import argparse
import json
from pathlib import Path
from typing import TYPE_CHECKING

from mplearn_agents.terminal.inert import printable

if TYPE_CHECKING:
    from rich.console import Console

    from mplearn.library import PrimitiveLibrary

HELP = "Show the primitives, the tree and the transitions of a library."
EXAMPLE = "mplearn show my.mplearn --report my.html"


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare what the command takes."""
    parser.add_argument("library", type=Path, help="library file")
    parser.add_argument("--json", action="store_true", help="print it as JSON instead")
    parser.add_argument(
        "--report", type=Path, metavar="FILE.html", help="write a page with figures"
    )


def run(args: argparse.Namespace) -> None:
    """Print the tables, and write the page where one is asked for."""
    from mplearn.library import PrimitiveLibrary
    from mplearn_agents.terminal.console import open_console
    from mplearn_agents.terminal.tables import library_summary

    library = PrimitiveLibrary.load(args.library)
    console = open_console(stderr=args.json)
    if args.json:
        print(json.dumps(library_summary(library), indent=1))
    else:
        _show(library, console)
    if args.report:
        from mplearn_agents.report import library_page, render_page

        page = render_page(library_page(library, printable(args.library.name)))
        args.report.parent.mkdir(parents=True, exist_ok=True)
        args.report.write_text(page, encoding="utf-8")
        console.print(f"page written to {args.report}")


def _show(library: PrimitiveLibrary, console: Console) -> None:
    from mplearn_agents.terminal.tables import (
        chain_table,
        primitive_table,
        primitive_tree,
        transition_table,
    )

    tables = [primitive_table(library), transition_table(library), primitive_tree(library)]
    if any(len(chain) > 1 for chain in library.graph.chains()):
        tables.insert(2, chain_table(library))
    for table in tables:
        console.print(table)
    console.print(
        f"{len(library)} primitives, {len(library.channels)} channels at {library.rate_hz:g} Hz, "
        f"body {library.body or 'none'}, version {library.version}"
    )
