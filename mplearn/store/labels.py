"""What people say of primitives, and the learner does not know: names and notes."""

from __future__ import annotations

import re
from collections.abc import Collection, Iterable
from dataclasses import dataclass, replace

from ..errors import InvalidValueError
from ..library import Primitive
from ..state import Count, SharedState

_DEFAULT = re.compile(r"P\d+")
_SPARE = 1000  # names of primitives that are gone, for when they come back


@dataclass(frozen=True)
class NoteText:
    """A note.

    Attributes:
        text: What it says.
        primitive: Id of the primitive that it is about; None where it is about all.
    """

    text: str
    primitive: Count | None = None


@dataclass(frozen=True, eq=False)
class LabelsState(SharedState):
    """Names by id, and notes by the number of the command."""

    names: tuple[tuple[Count, str], ...] = ()
    notes: tuple[tuple[Count, NoteText], ...] = ()


class Labels:
    """Names and notes of primitives; a name stays with its id, whether that is there or not.

    Attributes:
        names: Name of each primitive that has one.
        notes: Notes by the number of the command that wrote them.
    """

    def __init__(self, state: LabelsState | None = None) -> None:
        state = state or LabelsState()
        self.names: dict[int, str] = dict(state.names)
        self.notes: dict[int, NoteText] = dict(state.notes)
        self._state = state

    def rename(self, id: int, name: str, known: Collection[int]) -> None:
        """Give a primitive a name.

        Raises:
            InvalidValueError: The name is empty or not printable, or is, or may become, another's.
        """
        if not (isinstance(name, str) and name.strip() and name.isprintable()):
            raise InvalidValueError(f"a name must be printable and not empty, not {name!r:.80}")
        if len(name) > 200:
            raise InvalidValueError(f"a name must have at most 200 characters, not {len(name)}")
        if _DEFAULT.fullmatch(name) and name != f"P{id}":
            raise InvalidValueError(
                f"{name!r} is the name of primitive {name[1:]} until it has one"
            )
        for other, taken in self.shown(known).items():
            if taken == name and other != id:
                raise InvalidValueError(f"{name!r} is the name of primitive {other} already")
        if name == f"P{id}":
            self.names.pop(id, None)
        else:
            self.names[id] = name

    def merged(self, kept: int, absorbed: int) -> None:
        """Let a primitive that has no name take that of one that it absorbs."""
        if absorbed in self.names:
            self.names.setdefault(kept, self.names[absorbed])

    def shown(self, known: Iterable[int]) -> dict[int, str]:
        """Return the names of primitives: no two are the same."""
        shown: dict[int, str] = {}
        for id in sorted(known):
            name = self.names.get(id, f"P{id}")
            shown[id] = name if name not in shown.values() else f"{name} ({id})"
        return shown

    def tidy(self, known: Collection[int]) -> None:
        """Forget names of primitives that are gone for long."""
        gone = [id for id in self.names if id not in known]
        for id in gone[:-_SPARE]:
            del self.names[id]

    def state(self) -> LabelsState:
        """Return everything: the same object as long as nothing has changed."""
        names, notes = tuple(self.names.items()), tuple(self.notes.items())
        if (names, notes) != (self._state.names, self._state.notes):
            self._state = LabelsState(names, notes)
        return self._state


def named(primitive: Primitive, name: str) -> Primitive:
    """Return a primitive with a name; the same one, if it has that."""
    return primitive if primitive.name == name else replace(primitive, name=name)
