"""A demonstrator who changes: others take over, and each may change habits."""

from __future__ import annotations

from bisect import bisect_right
from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np

from mplearn.recording import FloatArray
from mplearn_envs.skills.action_choices import drawn_slot
from mplearn_envs.skills.repertoire import Repertoire

from .changes import Changes, When


class People(NamedTuple):
    """How several people go on, in the slots of a repertoire of C.

    Attributes:
        ways: How often each goes on with what after what, by person, (C, C) each; 0 where the robot
            cannot perform it.
        starts: With what one begins, where there is no way on, shape (C,).
    """

    ways: Mapping[int, FloatArray]
    starts: FloatArray

    @classmethod
    def of(cls, repertoires: Mapping[int, Repertoire], starts: FloatArray) -> People:
        """Return them from what each can be followed in.

        Args:
            repertoires: By person, all with the same slots.
            starts: See above.
        """
        ways = {}
        for person, repertoire in repertoires.items():
            matrix = np.zeros((repertoire.capacity, repertoire.capacity))
            for id in repertoire.feasible_ids:
                choices = repertoire.after(id)
                if not choices.dead_end:
                    matrix[repertoire.slots[id]] = choices.prior
            ways[person] = matrix
        return cls(ways, starts)

    def __deepcopy__(self, memo: dict[int, Any]) -> People:
        """Share it: nothing of it changes."""
        return self


class ChangingPerson:
    """Who is the demonstrator of an episode when, and with which habits.

    All depends on the seed and on time alone, in whatever order it is asked.

    Args:
        people: How they go on.
        first: Who begins.
        changes: What changes, and when.
        seed: Of all that is drawn.
    """

    def __init__(self, people: People, first: int, changes: Changes, seed: int) -> None:
        self.people, self.changes, self.seed = people, changes, seed
        habits, others, who = np.random.SeedSequence(seed).spawn(3)
        self._habits = _Moments(changes.habits_s, habits)
        self._others = _Moments(changes.people_s, others)
        self._who = np.random.default_rng(who)
        self._persons = [first]
        self._rows: dict[tuple[int, int, int], FloatArray] = {}

    def person_at(self, time_s: float) -> int:
        """Return who is there."""
        n_changes = self._others.before(time_s)
        while len(self._persons) <= n_changes:
            rest = [each for each in self.people.ways if each != self._persons[-1]]
            drawn = rest[int(self._who.integers(len(rest)))] if rest else self._persons[-1]
            self._persons.append(drawn)
        return self._persons[n_changes]

    def prior(self, before: int, time_s: float) -> FloatArray:
        """Return how likely each slot comes after another, shape (C,); what begins, at a dead end.

        Args:
            before: Slot of what was performed before.
            time_s: Time in the episode [s].
        """
        person, habit = self.person_at(time_s), self._habits.before(time_s)
        row: FloatArray = self.people.ways[person][before]
        if not row.any():
            return self.people.starts
        if habit == 0:
            return row
        key = person, habit, before
        if key not in self._rows:
            rng = np.random.default_rng([self.seed % 2**32, *key])
            possible = np.flatnonzero(row)
            drawn = rng.gamma(np.maximum(self.changes.evenness * row[possible], 1e-3))
            changed = np.zeros_like(row)
            changed[possible] = drawn if drawn.sum() > 0 else row[possible]
            self._rows[key] = changed / changed.sum()
        return self._rows[key]

    def is_way(self, before: int, after: int) -> bool:
        """Return whether anyone goes on so; else one has begun anew."""
        return any(ways[before, after] > 0 for ways in self.people.ways.values())

    def walked(self, start: int, n: int) -> Sequence[int]:
        """Return slots of ``n`` motions before the episode, by who begins it.

        Args:
            start: The first.
            n: How many.
        """
        rng = np.random.default_rng([self.seed % 2**32])
        walk = [start]
        while len(walk) < n:
            walk.append(drawn_slot(self.prior(walk[-1], 0.0), rng))
        return walk


class _Moments:
    """Moments at which something changes, as far as they were asked for."""

    def __init__(self, when: When, seed: np.random.SeedSequence) -> None:
        self._mean_s = when if isinstance(when, float) else None
        self._rng = np.random.default_rng(seed)
        self._moments = list(when) if isinstance(when, tuple) else []

    def before(self, time_s: float) -> int:
        """Return how many changes there were until a time."""
        while self._mean_s is not None and (not self._moments or self._moments[-1] <= time_s):
            last = self._moments[-1] if self._moments else 0.0
            self._moments.append(last + float(self._rng.exponential(self._mean_s)))
        return bisect_right(self._moments, time_s)
