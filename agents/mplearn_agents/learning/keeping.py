"""What was learned is kept, also where it cannot be written where it was to be."""

from __future__ import annotations

import sys
import tempfile
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

from mplearn.errors import MPLearnError, StoreWriteError
from mplearn_agents.terminal.inert import printable

if TYPE_CHECKING:
    from mplearn.library import PrimitiveLibrary
    from mplearn.store import LifelongLearner


class Kept(NamedTuple):
    """Where all that was learned is.

    Attributes:
        paths: Files that ``mplearn learn`` was given and that hold it.
        problem: What to say where these are not all of them; empty where they are.
    """

    paths: list[Path]
    problem: str

    def __str__(self) -> str:
        """Return the paths as words."""
        return " and ".join(map(str, self.paths))


def keep(
    life: LifelongLearner, library: PrimitiveLibrary, *, out: Path | None, store: Path | None
) -> Kept:
    """Write a library, close the store, and say where what was learned is.

    Where one cannot be written (the disk stayed full), the other is still; where none can be, the
    library is written to a folder for what is passing.

    Args:
        life: Who learned.
        library: What was learned.
        out: Where the library is to be written; None for nowhere.
        store: Where the learner's store is; None where it has none.
    """
    paths: list[Path] = []
    problems: list[str] = []
    if out is not None:
        try:
            out.parent.mkdir(parents=True, exist_ok=True)
            paths.append(library.save(out))
        except MPLearnError as error:
            problems.append(str(error))
        except OSError as error:
            problems.append(f"cannot write {out}: {error.strerror}")
    try:
        life.close()
        if store is not None:
            paths.append(store)
    except StoreWriteError as error:
        problems.append(str(error))
    if problems:
        wanted = store or out
        path = paths[0] if paths or wanted is None else _rescued(library, wanted.stem)
        saved = f"the library is in {path}" if path else "the library cannot be written elsewhere"
        problems.append(saved)
    return Kept(paths, "; ".join(problems))


def say_unkept(why: str) -> None:
    """Say on standard error what `Kept.problem` says."""
    print(f"mplearn: {printable(why)}", file=sys.stderr)


def _rescued(library: PrimitiveLibrary, name: str) -> Path | None:
    """Write a library somewhere, and return where; None where nothing can be written."""
    try:
        folder = Path(tempfile.mkdtemp(prefix="mplearn-"))
    except OSError:
        return None
    try:
        return library.save(folder / f"{name}.mplearn")
    except MPLearnError:
        folder.rmdir()
        return None
