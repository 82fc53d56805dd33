"""What happened: commands with who and when, and what became of primitives; the latest are kept."""

from __future__ import annotations

import json
from collections.abc import Iterable
from dataclasses import dataclass, field, replace
from itertools import pairwise
from typing import Literal, TypeAlias

from ..errors import StateError
from ..learner import (
    Event,
    PrimitiveBorn,
    PrimitiveConfirmed,
    PrimitiveForgotten,
    PrimitiveMerged,
    PrimitiveSplit,
)
from ..state import Count, SharedState, State, require
from .commands import Command, from_record, to_record
from .effects import Effect

UNDOABLE = 100  # commands, the latest, that can be undone
ENTRIES = 1_000  # commands that are kept
HAPPENINGS = 10_000  # of all primitives
_BLOCK = 64  # that are kept together
_FULL = HAPPENINGS // _BLOCK  # of such blocks

What: TypeAlias = Literal["born", "confirmed", "forgotten", "merged", "split", "command"]


@dataclass(frozen=True)
class Happening:
    """Something that happened to a primitive.

    Attributes:
        frame: Frame after the motion that showed it; frames seen by then, where a person did it.
        when: Clock time [s since 1970].
        what: What it was; "command" where a person did it.
        primitive: Its id.
        others: Other primitives that took part: those absorbed, or split into.
        entry: Number of the command, if it was one.
        exemplars: Demonstrations that it had then; 0 where that does not matter.

    Example:
        >>> import numpy as np
        >>> from mplearn import LearnerConfig, MotionLearner
        >>> from mplearn.store import LifelongLearner
        >>> t = np.arange(800) / 100.0
        >>> swing = np.where(t % 2 < 1, np.sin(np.pi * t) ** 2, 0.0)[:, None]  # up, down, a rest
        >>> config = LearnerConfig(("elbow",), segmenter="zero-velocity")
        >>> life = LifelongLearner(MotionLearner(config))
        >>> events = life.learn_many(swing)
        >>> [happening.what for happening in life.history(1)][0]
        'born'
    """

    frame: Count
    when: float
    what: What
    primitive: Count
    others: tuple[Count, ...] = ()
    entry: Count | None = None
    exemplars: Count = 0


@dataclass(frozen=True)
class Entry:
    """A command in the log.

    Attributes:
        number: Its number, from 1.
        command: What was asked.
        by: Who asked.
        when: Clock time [s since 1970].
        frame: Frames seen by then.
        undone: Whether it is undone now.

    Example:
        >>> import numpy as np
        >>> from mplearn import LearnerConfig, MotionLearner
        >>> from mplearn.store import LifelongLearner, Note
        >>> life = LifelongLearner(MotionLearner(LearnerConfig(("elbow",))))
        >>> events = life.learn_many(np.zeros((150, 1)))
        >>> entry = life.execute(Note("a long rest"), by="Anna", when=0.0)
        >>> entry.number, entry.by, entry.frame, entry.undone
        (1, 'Anna', 150, False)
    """

    number: int
    command: Command
    by: str
    when: float
    frame: int
    undone: bool = False


@dataclass(frozen=True, eq=False)
class EntryState(SharedState):
    """An entry, and what it changed; the command as JSON.

    Attributes:
        toggled: Number of the entry that did, undid or redid it last.
        effect: What it changed; None where that is no longer known.
    """

    number: Count
    command: str
    by: str
    when: float
    frame: Count
    undone: bool
    toggled: Count
    effect: Effect | None


@dataclass(frozen=True, eq=False)
class HappeningsState(SharedState):
    """Some happenings in a row."""

    happenings: tuple[Happening, ...]


@dataclass(frozen=True, eq=False)
class JournalState(State):
    """All that is kept of what happened."""

    entries: tuple[EntryState, ...] = ()
    happenings: tuple[HappeningsState, ...] = ()
    n_happenings: Count = 0
    next_number: Count = 1

    def check(self) -> None:
        """Check that what is kept are the latest ones, each once and none left out."""
        numbers = [*(each.number for each in self.entries), self.next_number]
        in_turn = all(b == a + 1 for a, b in pairwise(numbers))
        require(in_turn, "entries", f"must be numbered in turn, up to {self.next_number - 1}")
        wanted = min(self.next_number - 1, ENTRIES)
        n_entries = len(self.entries)
        require(n_entries == wanted, "entries", f"must be {wanted}, not {n_entries}")
        sizes = [len(each.happenings) for each in self.happenings]
        fits = all(size == _BLOCK for size in sizes[:-1]) and max(sizes, default=0) <= _BLOCK
        full, rest = divmod(self.n_happenings, _BLOCK)
        wanted = min(full, _FULL) * _BLOCK + rest
        fits &= sum(sizes) == wanted
        require(fits, "happenings", f"must be {wanted} in blocks of {_BLOCK}, not in {sizes}")


@dataclass
class Kept:
    """An entry, and what undoing it needs."""

    entry: Entry
    toggled: int
    effect: Effect | None = None
    _state: tuple[tuple[object, ...], EntryState] | None = field(default=None, repr=False)

    def state(self) -> EntryState:
        """Return everything: the same object as long as nothing has changed."""
        entry = self.entry
        now = (entry.undone, self.toggled, self.effect is None)
        if self._state is None or self._state[0] != now:
            text = json.dumps(to_record(entry.command), sort_keys=True)
            state = EntryState(
                *(entry.number, text, entry.by, entry.when, entry.frame),
                *(entry.undone, self.toggled, self.effect),
            )
            self._state = now, state
        return self._state[1]

    @classmethod
    def from_state(cls, state: EntryState) -> Kept:
        """Return the entry that `state` described.

        Raises:
            StateError: Its command is not known.
        """
        try:
            record = json.loads(state.command)
        except ValueError as error:
            raise StateError("must be JSON", "command") from error
        require(isinstance(record, dict), "command", "must be a JSON object")
        command = from_record(record)
        entry = Entry(state.number, command, state.by, state.when, state.frame, state.undone)
        return cls(entry, state.toggled, state.effect)


class Journal:
    """The latest commands and happenings."""

    def __init__(self) -> None:
        self._entries: dict[int, Kept] = {}
        self._full: list[HappeningsState] = []
        self._open: list[Happening] = []
        self._n_happenings = 0
        self.next_number = 1

    # ---- commands

    def add(self, entry: Entry, effect: Effect | None) -> None:
        """Keep a command that was done; the oldest go, and can no longer be undone before that."""
        self._entries[entry.number] = Kept(entry, entry.number, effect)
        self.next_number = entry.number + 1
        for number in list(self._entries)[:-ENTRIES]:
            del self._entries[number]
        for number in self._undoable()[:-UNDOABLE]:
            self._entries[number].effect = None

    def toggle(self, number: int, undone: bool, by_entry: int) -> None:
        """Note that a command was undone, or done again, by a later one."""
        kept = self._entries[number]
        kept.entry, kept.toggled = replace(kept.entry, undone=undone), by_entry

    def entries(self, since: int = 0) -> tuple[Entry, ...]:
        """Return the commands with numbers above ``since`` that are kept."""
        return tuple(each.entry for number, each in self._entries.items() if number > since)

    def kept(self, number: int) -> Kept | None:
        """Return a command with what it changed."""
        return self._entries.get(number)

    def reversible(self, *, undone: bool) -> list[int]:
        """Return the commands that can be undone, or redone; the one that is next comes last."""
        found = [self._entries[n] for n in self._undoable()]
        found = [each for each in found if each.entry.undone == undone]
        return [each.entry.number for each in sorted(found, key=lambda each: each.toggled)]

    def blocking(self, number: int) -> list[Entry]:
        """Return the commands that must be undone, or done again, before a command can be.

        They are about the same: those that build on it, and for one that is undone also those that
        it had built on and that were undone after it. The latest come first.
        """
        mine = self._entries[number]
        touched = set() if mine.effect is None else mine.effect.touched
        found = []
        for other, each in self._entries.items():
            builds_on_it = other > number and not each.entry.undone
            was_below = other < number and each.entry.undone and each.toggled > mine.toggled
            same = each.effect is not None and not touched.isdisjoint(each.effect.touched)
            if same and (builds_on_it or (was_below and mine.entry.undone)):
                found.append(each.entry)
        return found[::-1]

    def _undoable(self) -> list[int]:
        return [number for number, each in self._entries.items() if each.effect is not None]

    # ---- happenings

    def happened(self, happenings: Iterable[Happening]) -> None:
        """Keep what happened; the oldest are forgotten."""
        for each in happenings:
            self._open.append(each)
            self._n_happenings += 1
            if len(self._open) == _BLOCK:
                self._full.append(HappeningsState(tuple(self._open)))
                self._open = []
        del self._full[:-_FULL]

    def history(self, primitive: int) -> tuple[Happening, ...]:
        """Return what happened to a primitive, the oldest first."""
        every = (*(h for block in self._full for h in block.happenings), *self._open)
        return tuple(h for h in every if primitive in (h.primitive, *h.others))

    # ---- keeping

    def state(self) -> JournalState:
        """Return everything."""
        happenings = (*self._full, *((HappeningsState(tuple(self._open)),) if self._open else ()))
        return JournalState(
            tuple(each.state() for each in self._entries.values()),
            happenings,
            self._n_happenings,
            self.next_number,
        )

    def load_state(self, state: JournalState) -> None:
        """Resume from what `state` returned.

        Raises:
            StateError: A command is not known.
        """
        self._entries = {each.number: Kept.from_state(each) for each in state.entries}
        self._full = [each for each in state.happenings if len(each.happenings) == _BLOCK]
        rest = [each for each in state.happenings if len(each.happenings) != _BLOCK]
        self._open = [h for block in rest for h in block.happenings]
        self._n_happenings, self.next_number = state.n_happenings, state.next_number


def happenings_of(event: Event) -> list[Happening]:
    """Return what an event says that happened to primitives; not when by the clock."""
    match event:
        case PrimitiveBorn(segment, primitive, exemplars, _):
            return [Happening(segment.end, 0.0, "born", primitive, exemplars=exemplars)]
        case PrimitiveConfirmed(segment, primitive, exemplars):
            return [Happening(segment.end, 0.0, "confirmed", primitive, exemplars=exemplars)]
        case PrimitiveForgotten(segment, primitive):
            return [Happening(segment.end, 0.0, "forgotten", primitive)]
        case PrimitiveMerged(segment, primitive, absorbed):
            return [Happening(segment.end, 0.0, "merged", primitive, (absorbed,))]
        case PrimitiveSplit(segment, primitive, into):
            return [Happening(segment.end, 0.0, "split", primitive, into)]
        case _:
            return []
