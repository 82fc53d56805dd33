"""What a person can ask of what was learned: each command is a value, and can be undone.

A command of one's own is a frozen dataclass, an `Operation` with a ``do``, made known by
`register_command`; undo and redo come with it, for they go by what has changed.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, ClassVar, Protocol, TypeVar

from ..errors import InvalidValueError, StateError, UnknownPrimitiveError
from ..learner import MotionLearner
from ..state import Count, fields_of, from_plain
from .labels import Labels, NoteText

_LONGEST_NOTE = 10_000


class Hands(Protocol):
    """What a command may change.

    Attributes:
        learner: What was learned.
        labels: Names and notes.
    """

    learner: MotionLearner
    labels: Labels

    @property
    def number(self) -> int:
        """The number of the command in the log."""


@dataclass(frozen=True)
class Command:
    """Base of all commands."""

    kind: ClassVar[str] = ""

    @property
    def about(self) -> tuple[int, ...]:
        """Ids of the primitives that it names."""
        return ()


@dataclass(frozen=True)
class Operation(Command, ABC):
    """Base of the commands that change what was learned."""

    @abstractmethod
    def do(self, hands: Hands) -> None:
        """Do what is asked, or raise an `MPLearnError` before anything has changed."""


@dataclass(frozen=True)
class Reversal(Command):
    """Base of the commands that are about another one.

    Attributes:
        entry: Its number in the log.
    """

    entry: Count


C = TypeVar("C", bound=type[Command])
_KINDS: dict[str, type[Command]] = {}


def register_command(kind: str) -> Callable[[C], C]:
    """Make a command known by a name, by which the log is read.

    Args:
        kind: The name.

    Raises:
        InvalidValueError: The name is another command's.
    """

    def register(command: C) -> C:
        if _KINDS.setdefault(kind, command) is not command:
            raise InvalidValueError(f"{kind!r} is a command already; known are {sorted(_KINDS)}")
        command.kind = kind
        return command

    return register


def to_record(command: Command) -> dict[str, Any]:
    """Return a command as plain values."""
    return {"kind": command.kind, **fields_of(command)}


def from_record(record: dict[str, Any]) -> Command:
    """Return the command that `to_record` described.

    Raises:
        StateError: There is no such command, or it was of other fields.
    """
    values = dict(record)
    kind = values.pop("kind", None)
    if kind not in _KINDS:
        raise StateError(f"must be a command, one of {sorted(_KINDS)}, not {kind!r:.60}")
    return from_plain(_KINDS[kind], values)


@register_command("rename")
@dataclass(frozen=True)
class Rename(Operation):
    """Give a primitive a name.

    Example:
        >>> Rename(7, "bow down").name
        'bow down'
    """

    primitive: Count
    name: str

    def do(self, hands: Hands) -> None:
        """Give the name."""
        _require(hands, self.primitive)
        hands.labels.rename(self.primitive, self.name, hands.learner.tree.leaves)

    @property
    def about(self) -> tuple[int, ...]:
        """The primitive."""
        return (self.primitive,)


@register_command("merge")
@dataclass(frozen=True)
class Merge(Operation):
    """Say that two primitives are one; the older one stays, and keeps its name."""

    first: Count
    second: Count

    def do(self, hands: Hands) -> None:
        """Merge them."""
        for each in hands.learner.merge(self.first, self.second).merges:
            hands.labels.merged(each.kept, each.absorbed)

    @property
    def about(self) -> tuple[int, ...]:
        """Both."""
        return (self.first, self.second)


@register_command("split")
@dataclass(frozen=True)
class Split(Operation):
    """Say that a primitive is two or more.

    Attributes:
        primitive: Its id.
        groups: Positions of its exemplars that belong together; its two main branches if None.
    """

    primitive: Count
    groups: tuple[tuple[Count, ...], ...] | None = None

    def do(self, hands: Hands) -> None:
        """Split it."""
        hands.learner.split(self.primitive, self.groups)

    @property
    def about(self) -> tuple[int, ...]:
        """The primitive."""
        return (self.primitive,)


@register_command("delete")
@dataclass(frozen=True)
class Delete(Operation):
    """Forget a primitive and its demonstrations; shown again, it is learned anew."""

    primitive: Count

    def do(self, hands: Hands) -> None:
        """Forget it."""
        hands.learner.remove(self.primitive, forget=True)

    @property
    def about(self) -> tuple[int, ...]:
        """The primitive."""
        return (self.primitive,)


@register_command("freeze")
@dataclass(frozen=True)
class Freeze(Operation):
    """Let a primitive stay as it is, whatever comes."""

    primitive: Count

    def do(self, hands: Hands) -> None:
        """Freeze it."""
        hands.learner.freeze(self.primitive)

    @property
    def about(self) -> tuple[int, ...]:
        """The primitive."""
        return (self.primitive,)


@register_command("unfreeze")
@dataclass(frozen=True)
class Unfreeze(Operation):
    """Let a frozen primitive change again."""

    primitive: Count

    def do(self, hands: Hands) -> None:
        """Let it change."""
        hands.learner.unfreeze(self.primitive)

    @property
    def about(self) -> tuple[int, ...]:
        """The primitive."""
        return (self.primitive,)


@register_command("note")
@dataclass(frozen=True)
class Note(Operation):
    """Write something down, about a primitive or about all."""

    text: str
    primitive: Count | None = None

    def do(self, hands: Hands) -> None:
        """Write it down."""
        if not self.text.strip() or len(self.text) > _LONGEST_NOTE:
            raise InvalidValueError(
                f"a note must have 1 to {_LONGEST_NOTE} characters, not {len(self.text)}"
            )
        if self.primitive is not None:
            _require(hands, self.primitive)
        hands.labels.notes[hands.number] = NoteText(self.text, self.primitive)

    @property
    def about(self) -> tuple[int, ...]:
        """The primitive, if there is one."""
        return () if self.primitive is None else (self.primitive,)


@register_command("pause")
@dataclass(frozen=True)
class Pause(Operation):
    """Stop learning; motions are recognised only."""

    def do(self, hands: Hands) -> None:
        """Stop."""
        hands.learner.pause()


@register_command("resume")
@dataclass(frozen=True)
class Resume(Operation):
    """Go on learning."""

    def do(self, hands: Hands) -> None:
        """Go on."""
        hands.learner.resume()


@register_command("undo")
@dataclass(frozen=True)
class Undo(Reversal):
    """Take a command back; `LifelongLearner.undo`."""


@register_command("redo")
@dataclass(frozen=True)
class Redo(Reversal):
    """Do a command again that was taken back; `LifelongLearner.redo`."""


def _require(hands: Hands, id: int) -> None:
    leaves = hands.learner.tree.leaves
    if id not in leaves:
        raise UnknownPrimitiveError(f"no primitive {id}; known are {list(leaves)}")
