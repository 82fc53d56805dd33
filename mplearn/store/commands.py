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
    """Base of all commands.

    Example:
        >>> from mplearn.store import Merge, Note
        >>> Merge(3, 7).kind, Merge(3, 7).about, Note("shoes off").about
        ('merge', (3, 7), ())
    """

    kind: ClassVar[str] = ""

    @property
    def about(self) -> tuple[int, ...]:
        """Ids of the primitives that it names."""
        return ()


@dataclass(frozen=True)
class Operation(Command, ABC):
    """Base of the commands that change what was learned.

    Example:
        >>> from mplearn import LearnerConfig, MotionLearner
        >>> from mplearn.store import LifelongLearner
        >>> @register_command("shout")
        ... @dataclass(frozen=True)
        ... class Shout(Operation):
        ...     word: str
        ...
        ...     def do(self, hands):
        ...         hands.labels.notes[hands.number] = NoteText(self.word.upper(), None)
        >>> life = LifelongLearner(MotionLearner(LearnerConfig(("elbow",))))
        >>> life.execute(Shout("hey")).command
        Shout(word='hey')
    """

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

    Example:
        >>> @register_command("star")
        ... @dataclass(frozen=True)
        ... class Star(Command):
        ...     primitive: Count
        >>> Star(7).kind
        'star'
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
    """Give a primitive a name: it is a motion, and the rules neither forget nor drop it.

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
        hands.learner.keep(self.primitive)

    @property
    def about(self) -> tuple[int, ...]:
        """The primitive."""
        return (self.primitive,)


@register_command("merge")
@dataclass(frozen=True)
class Merge(Operation):
    """Say that two primitives are one; the older one stays, and keeps its name.

    Example:
        >>> import numpy as np
        >>> from mplearn import LearnerConfig, MotionLearner
        >>> from mplearn.store import LifelongLearner
        >>> t = np.arange(800) / 100.0
        >>> swing = np.where(t % 2 < 1, np.sin(np.pi * t) ** 2, 0.0)[:, None]  # up, down, a rest
        >>> config = LearnerConfig(("elbow",), segmenter="zero-velocity")
        >>> life = LifelongLearner(MotionLearner(config))
        >>> events = life.learn_many(swing)
        >>> _ = life.execute(Merge(1, 2), by="Anna")
        >>> [each.id for each in life.snapshot()]
        [1]
    """

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

    Example:
        >>> import numpy as np
        >>> from mplearn import LearnerConfig, MotionLearner
        >>> from mplearn.store import LifelongLearner
        >>> t = np.arange(800) / 100.0
        >>> swing = np.where(t % 2 < 1, np.sin(np.pi * t) ** 2, 0.0)[:, None]  # up, down, a rest
        >>> config = LearnerConfig(("elbow",), segmenter="zero-velocity")
        >>> life = LifelongLearner(MotionLearner(config))
        >>> events = life.learn_many(swing)
        >>> _ = life.execute(Split(1, groups=((0, 1), (2, 3))), by="Anna")
        >>> len(life.snapshot())
        3
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
    """Forget a primitive and its demonstrations; shown again, it is learned anew.

    Example:
        >>> import numpy as np
        >>> from mplearn import LearnerConfig, MotionLearner
        >>> from mplearn.store import LifelongLearner
        >>> t = np.arange(800) / 100.0
        >>> swing = np.where(t % 2 < 1, np.sin(np.pi * t) ** 2, 0.0)[:, None]  # up, down, a rest
        >>> config = LearnerConfig(("elbow",), segmenter="zero-velocity")
        >>> life = LifelongLearner(MotionLearner(config))
        >>> events = life.learn_many(swing)
        >>> _ = life.execute(Delete(2), by="Anna")
        >>> [each.id for each in life.snapshot()]
        [1]
        >>> _ = life.undo(by="Anna")
        >>> [each.id for each in life.snapshot()]
        [1, 2]
    """

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
    """Let a primitive stay as it is, whatever comes.

    Example:
        >>> import numpy as np
        >>> from mplearn import LearnerConfig, MotionLearner
        >>> from mplearn.store import LifelongLearner
        >>> t = np.arange(800) / 100.0
        >>> swing = np.where(t % 2 < 1, np.sin(np.pi * t) ** 2, 0.0)[:, None]  # up, down, a rest
        >>> config = LearnerConfig(("elbow",), segmenter="zero-velocity")
        >>> life = LifelongLearner(MotionLearner(config))
        >>> events = life.learn_many(swing)
        >>> _ = life.execute(Freeze(1), by="Anna")  # whatever comes, it stays as it is
        >>> life.state().learner.frozen[0].primitive.id
        1
    """

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
    """Let a frozen primitive change again.

    Example:
        >>> import numpy as np
        >>> from mplearn import LearnerConfig, MotionLearner
        >>> from mplearn.store import LifelongLearner
        >>> t = np.arange(800) / 100.0
        >>> swing = np.where(t % 2 < 1, np.sin(np.pi * t) ** 2, 0.0)[:, None]  # up, down, a rest
        >>> config = LearnerConfig(("elbow",), segmenter="zero-velocity")
        >>> life = LifelongLearner(MotionLearner(config))
        >>> events = life.learn_many(swing)
        >>> _ = life.execute(Freeze(1)), life.execute(Unfreeze(1))
        >>> life.state().learner.frozen
        ()
    """

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
    """Write something down, about a primitive or about all.

    Example:
        >>> from mplearn import LearnerConfig, MotionLearner
        >>> from mplearn.store import LifelongLearner
        >>> life = LifelongLearner(MotionLearner(LearnerConfig(("elbow",))))
        >>> _ = life.execute(Note("shoes off from here on"), by="Anna")
        >>> [(entry.by, entry.command.text) for entry in life.entries()]
        [('Anna', 'shoes off from here on')]
    """

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
    """Stop learning; motions are recognised only.

    Example:
        >>> from mplearn import LearnerConfig, MotionLearner
        >>> from mplearn.store import LifelongLearner, Resume
        >>> learner = MotionLearner(LearnerConfig(("elbow",)))
        >>> life = LifelongLearner(learner)
        >>> _ = life.execute(Pause(), by="Anna")  # for a rehearsal that is not to be learned
        >>> learner.paused
        True
        >>> _ = life.execute(Resume(), by="Anna")
        >>> learner.paused
        False
    """

    def do(self, hands: Hands) -> None:
        """Stop."""
        hands.learner.pause()


@register_command("resume")
@dataclass(frozen=True)
class Resume(Operation):
    """Go on learning.

    Example:
        >>> from mplearn import LearnerConfig, MotionLearner
        >>> from mplearn.store import LifelongLearner, Pause
        >>> life = LifelongLearner(MotionLearner(LearnerConfig(("elbow",))))
        >>> [life.execute(command).number for command in (Pause(), Resume())]
        [1, 2]
    """

    def do(self, hands: Hands) -> None:
        """Go on."""
        hands.learner.resume()


@register_command("undo")
@dataclass(frozen=True)
class Undo(Reversal):
    """Take a command back; `LifelongLearner.undo`.

    Example:
        >>> from mplearn import LearnerConfig, MotionLearner
        >>> from mplearn.store import LifelongLearner, Note
        >>> life = LifelongLearner(MotionLearner(LearnerConfig(("elbow",))))
        >>> _ = life.execute(Note("shoes off"), by="Anna")
        >>> life.undo(by="Ben").command == Undo(entry=1), life.entries()[0].undone
        (True, True)
    """


@register_command("redo")
@dataclass(frozen=True)
class Redo(Reversal):
    """Do a command again that was taken back; `LifelongLearner.redo`.

    Example:
        >>> from mplearn import LearnerConfig, MotionLearner
        >>> from mplearn.store import LifelongLearner, Note
        >>> life = LifelongLearner(MotionLearner(LearnerConfig(("elbow",))))
        >>> _ = life.execute(Note("shoes off"), by="Anna"), life.undo(by="Anna")
        >>> life.redo(by="Anna").command == Redo(entry=1), life.entries()[0].undone
        (True, False)
    """


def _require(hands: Hands, id: int) -> None:
    leaves = hands.learner.tree.leaves
    if id not in leaves:
        raise UnknownPrimitiveError(f"no primitive {id}; known are {list(leaves)}")
