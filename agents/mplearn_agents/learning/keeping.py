"""What was learned is kept, also where its store cannot be written in the end."""

from __future__ import annotations

import argparse
import sys
import tempfile
from pathlib import Path
from typing import TYPE_CHECKING

from mplearn.errors import MPLearnError, StoreWriteError
from mplearn_agents.terminal.inert import printable

if TYPE_CHECKING:
    from mplearn.library import PrimitiveLibrary
    from mplearn.store import LifelongLearner


def close_store(life: LifelongLearner, library: PrimitiveLibrary, out: Path | None) -> str:
    """Close what keeps a life of learning, if anything does; return why not all of it is kept.

    Where the store cannot be written (the disk stayed full), the library is in ``out``, or is
    written to a folder for what is passing.

    Args:
        life: Who learned.
        library: What was learned.
        out: Where that is written; None for nowhere.

    Returns:
        What to say of it; empty where all is in the store, or none was wanted.
    """
    from mplearn.store import Store

    name = life.store.path.stem if isinstance(life.store, Store) else ""
    try:
        life.close()
    except StoreWriteError as error:
        path = out or _rescued(library, name)
        saved = f"the library is in {path}" if path else "the library cannot be written either"
        return f"{error}; {saved}"
    return ""


def written_to(args: argparse.Namespace, unkept: str) -> str:
    """Return which of the files that ``mplearn learn`` was given hold all that was learned."""
    paths = (args.out, None if unkept else args.store)
    return " and ".join(str(path) for path in paths if path is not None)


def say_unkept(why: str) -> None:
    """Say on standard error what `close_store` returned."""
    print(f"mplearn: {printable(why)}", file=sys.stderr)


def _rescued(library: PrimitiveLibrary, name: str) -> Path | None:
    """Write a library somewhere, and return where; None where nothing can be written."""
    try:
        return library.save(Path(tempfile.mkdtemp(prefix="mplearn-")) / f"{name}.mplearn")
    except (MPLearnError, OSError):
        return None
