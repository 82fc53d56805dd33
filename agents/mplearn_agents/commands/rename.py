"""``mplearn rename``: gives a primitive a name."""

from __future__ import annotations

import argparse
from pathlib import Path

from mplearn_agents.terminal.arguments import primitive_key

HELP = "Give a primitive of a library a name; its id stays."
EXAMPLE = "mplearn rename my.mplearn 7 'bow down'"


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare what the command takes."""
    parser.add_argument("library", type=Path, help="library file or store, which is changed")
    parser.add_argument("primitive", metavar="ID", help="id or present name of the primitive")
    parser.add_argument("name", help="its new name")


def run(args: argparse.Namespace) -> None:
    """Rename the primitive and save the library."""
    from mplearn.library import PrimitiveLibrary
    from mplearn.state import is_database
    from mplearn_agents.commands import store

    if is_database(args.library):
        print(store.rename(args.library, args.primitive, args.name))
        return
    library = PrimitiveLibrary.load(args.library)
    key = args.primitive if args.primitive in library else primitive_key(args.primitive)
    before = library[key]
    library.rename(key, args.name).save(args.library)
    print(f"primitive {before.id}: {before.name} -> {args.name}")
