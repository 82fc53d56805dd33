"""What a command changed: by this it is undone, and done again, whatever command it was."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import NamedTuple, TypeVar

from ..learner import Known, LearnerEdit, MotionLearner
from ..state import Count, SharedState
from .labels import Labels, LabelsState, NoteText

V = TypeVar("V")


class NameChange(NamedTuple):
    """A primitive's name before and after; None for none."""

    primitive: Count
    before: str | None
    after: str | None


class NoteChange(NamedTuple):
    """A note before and after; None for none."""

    number: Count
    before: NoteText | None
    after: NoteText | None


@dataclass(frozen=True, eq=False)
class Effect(SharedState):
    """What a command changed.

    Attributes:
        learner: In what was learned; None for nothing.
        names: Of the names.
        notes: Of the notes.
        paused: Whether learning was paused, before and after.
    """

    learner: LearnerEdit | None
    names: tuple[NameChange, ...]
    notes: tuple[NoteChange, ...]
    paused: tuple[bool, bool]

    @property
    def is_empty(self) -> bool:
        """Whether nothing changed."""
        changed = self.paused[0] != self.paused[1]
        return not (self.learner or self.names or self.notes or changed)

    @property
    def touched(self) -> set[tuple[str, int]]:
        """What it is about: commands that are about the same are undone in order."""
        found = {("name", each.primitive) for each in self.names}
        found |= {("note", each.number) for each in self.notes}
        if self.learner is not None:
            found |= {("primitive", id) for id in self.learner.primitives}
        if self.paused[0] != self.paused[1]:
            found.add(("paused", 0))
        return found

    def reversed(self) -> Effect:
        """Return the effect of undoing this one."""
        return Effect(
            None if self.learner is None else self.learner.reversed(),
            tuple(NameChange(each.primitive, each.after, each.before) for each in self.names),
            tuple(NoteChange(each.number, each.after, each.before) for each in self.notes),
            (self.paused[1], self.paused[0]),
        )

    def take_back(self, learner: MotionLearner, labels: Labels) -> None:
        """Undo it; what came since stays, and so does what the rules made of it since."""
        if self.learner is not None:
            learner.undo(self.learner)
        for name in self.names:
            _put(labels.names, name.primitive, name.after, name.before)
        for note in self.notes:
            _put(labels.notes, note.number, note.after, note.before)
        if self.paused[0] != self.paused[1]:
            if self.paused[0]:
                learner.pause()
            else:
                learner.resume()


class Moment(NamedTuple):
    """All that a command can change, at one moment."""

    known: Known
    labels: LabelsState
    paused: bool

    @classmethod
    def of(cls, learner: MotionLearner, labels: Labels) -> Moment:
        """Return what is now."""
        return cls(learner.known(), labels.state(), learner.paused)

    def until(self, later: Moment) -> Effect:
        """Return what has changed since."""
        edit = LearnerEdit.between(self.known, later.known)
        names = _changes(dict(self.labels.names), dict(later.labels.names))
        notes = _changes(dict(self.labels.notes), dict(later.labels.notes))
        return Effect(
            None if edit.is_empty else edit,
            tuple(NameChange(*each) for each in names),
            tuple(NoteChange(*each) for each in notes),
            (self.paused, later.paused),
        )


def _changes(
    before: Mapping[int, V], after: Mapping[int, V]
) -> list[tuple[int, V | None, V | None]]:
    ids = sorted(before.keys() | after.keys())
    rows = [(id, before.get(id), after.get(id)) for id in ids]
    return [row for row in rows if row[1] != row[2]]


def _put(table: dict[int, V], key: int, now: V | None, wanted: V | None) -> None:
    """Put a value into a table; one that is another by now than it was then stays."""
    if table.get(key) != now:
        return
    if wanted is None:
        table.pop(key, None)
    else:
        table[key] = wanted
