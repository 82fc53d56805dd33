"""Where an environment's library comes from: a file, an object, or a learner that goes on."""

from __future__ import annotations

from collections.abc import Callable
from functools import cache
from importlib.resources import files
from pathlib import Path
from typing import Protocol, TypeAlias, runtime_checkable

from mplearn.errors import LibraryError
from mplearn.library import PrimitiveLibrary
from mplearn.state import is_database


@runtime_checkable
class Learner(Protocol):
    """What goes on learning: a `mplearn.MotionLearner`, or what acts like one."""

    def snapshot(self) -> PrimitiveLibrary:
        """Return the library of now."""


Source: TypeAlias = PrimitiveLibrary | str | Path | Learner | Callable[[], PrimitiveLibrary] | None


class LibrarySource:
    """Gives the library of now.

    Args:
        source: A library, its file, or None for the built-in one: these never change. Or a
            `MotionLearner` that someone else feeds, the file of a store that another process
            writes to (`mplearn.store`), or a function that returns a library: these are *live*, and
            asked again at each reset. The learner must not be fed by another thread at that
            moment.

    Raises:
        StoreError: The store cannot be read.
        LibraryError: The file is missing or damaged, or this is none of these.
    """

    def __init__(self, source: Source) -> None:
        if isinstance(source, (str, Path)) and is_database(Path(source)):
            source = _of_store(Path(source))
        self.source = source
        self.live = isinstance(source, Learner) or (
            callable(source) and not isinstance(source, PrimitiveLibrary)
        )
        self._fixed = None if self.live else _opened(source)

    def now(self) -> PrimitiveLibrary:
        """Return the library of now.

        Raises:
            LibraryError: The function returned something else.
        """
        if self._fixed is not None:
            return self._fixed
        if isinstance(self.source, Learner):
            return self.source.snapshot()
        library = self.source()  # type: ignore[operator,misc]
        if not isinstance(library, PrimitiveLibrary):
            raise LibraryError(
                f"the function that gives the library returned a {type(library).__name__}, "
                "not a PrimitiveLibrary"
            )
        return library


def _of_store(path: Path) -> Callable[[], PrimitiveLibrary]:
    """Return what gives the library of a store as it is when it is asked."""
    from mplearn.store import StoreReader  # with all that learns: what needs no store starts sooner

    reader = StoreReader(path)

    def now() -> PrimitiveLibrary:
        reader.refresh()
        return reader.life.snapshot()

    return now


def _opened(source: object) -> PrimitiveLibrary:
    if source is None:
        return _default()
    if isinstance(source, (str, Path)):
        return PrimitiveLibrary.load(source)
    if not isinstance(source, PrimitiveLibrary):
        raise LibraryError(
            "library must be a PrimitiveLibrary, a file, a MotionLearner, a function or None, "
            f"not {type(source).__name__}"
        )
    return source


@cache
def _default() -> PrimitiveLibrary:
    """Return the built-in library; it is frozen, so that all may share it."""
    return PrimitiveLibrary.load(Path(str(files(__package__) / "default.mplearn")))
