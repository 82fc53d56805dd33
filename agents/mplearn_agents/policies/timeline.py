"""What a robot can do where and when, while it watches: a graph that grows, known beforehand."""

from __future__ import annotations

import math
from bisect import bisect_right
from collections.abc import Collection, Iterator
from typing import TYPE_CHECKING, Any, NamedTuple, TypeAlias

import numpy as np

from mplearn.recording import FloatArray, IntArray
from mplearn_envs.skills.repertoire import Repertoire

if TYPE_CHECKING:
    from mplearn_envs.tasks.best import Clock

TICK_S = 0.1  # of the grid on which values are computed

#: Id of the primitive performed last, None at the start; and whether one may begin anew there.
Place: TypeAlias = tuple[int | None, bool]
START: Place = (None, True)


class Way(NamedTuple):
    """What can be done in a place.

    Attributes:
        id: The primitive; None holds.
        to: Where it leads.
        probability: How likely the demonstrator makes it, by what is known.
        time_s: How long it takes [s].
        paid: What its moments earn, discounted to its start.
    """

    id: int | None
    to: Place
    probability: float
    time_s: float
    paid: float


class _Known(NamedTuple):
    """What can be done from a time on.

    Attributes:
        time_s: That time in the episode [s].
        ways: By place, holding first.
        begin: Where the rows of each place of ``ways`` begin, shape (n,).
        places: Numbers of these places, shape (n,).
        ids: Id of each row's primitive, shape (E,); -1 holds.
        to: Number of the place to which it leads, (E,).
        ticks: How many moments it takes, (E,).
        paid: See `Way`, (E,).
        worth: What 1 after it is worth at its start, (E,).
    """

    time_s: float
    ways: dict[Place, list[Way]]
    begin: IntArray
    places: IntArray
    ids: IntArray
    to: IntArray
    ticks: IntArray
    paid: FloatArray
    worth: FloatArray


class Timeline:
    """What can be done, from the start of an episode to as late as is asked.

    Plans are taken at their word. What the moments of a plan earn depends on the moment alone.

    Args:
        env: An online environment whose episode has just begun; its task has such rates.
    """

    def __init__(self, env: Any) -> None:
        from mplearn_envs.tasks.best import Clock  # MuJoCo is not imported before it is needed

        self.clock: Clock = Clock.of(env.repertoire, env.discount)
        self._task, self._hold_s = env.task, env.actions.hold_s
        self._coming: Iterator[tuple[float, Repertoire]] = env.ahead(TICK_S)
        self._figures: dict[Any, tuple[float, float]] = {}
        self._ends: set[int] = set()  # primitives after which nothing was known to follow
        self._numbers: dict[Place, int] = {START: 0}
        self._known: list[_Known] = []
        self._times_s: list[float] = []
        self._take()

    def ways(self, place: Place, time_s: float) -> list[Way]:
        """Return what can be done in a place at a time in the episode [s], holding first.

        Where the primitive is gone, one begins anew.
        """
        known = self._at(time_s).ways
        return known.get(place, known[START])

    def number(self, place: Place) -> int:
        """Return the column of a place in `values`."""
        return self._numbers.get(place, 0)

    def values(
        self, end_s: float, wanted: Collection[int], pay: float, then: FloatArray | None = None
    ) -> FloatArray:
        """Return the most that can be earned from each moment and place on, until an end, (N, P).

        Args:
            end_s: Nothing that begins later counts [s].
            wanted: Ids of the primitives that are paid for at their end.
            pay: So much.
            then: What is earned from there on, (N, P); None: nothing.
        """
        self._at(end_s)
        n = math.ceil(end_s / TICK_S - 1e-9)
        out = np.zeros((n + 1, len(self._numbers)))
        for k in range(n - 1, -1, -1):
            known = self._at(k * TICK_S)
            end, reached = np.minimum(k + known.ticks, n), np.isin(known.ids, list(wanted))
            after = 0.0 if then is None else then[end, known.to]
            later = np.where(reached, pay + after, out[end, known.to])
            best = np.maximum.reduceat(known.paid + known.worth * later, known.begin)
            out[k] = best[0]  # of the start: what is not known is begun anew
            out[k, known.places] = best
        return out

    def _at(self, time_s: float) -> _Known:
        while self._times_s[-1] <= time_s:
            self._take()
        return self._known[bisect_right(self._times_s, time_s + 1e-9) - 1]

    def _take(self) -> None:
        """Take what is known from the next change on."""
        time_s, repertoire = next(self._coming)
        ways = {START: self._out_of(repertoire, START)}
        for id in repertoire.feasible_ids:
            ways[id, False] = self._out_of(repertoire, (id, False))
            if repertoire.after(id).dead_end:
                self._ends.add(id)
            if id in self._ends:
                ways[id, True] = self._out_of(repertoire, (id, True))
        for place in ways:
            self._numbers.setdefault(place, len(self._numbers))
        rows = [way for each in ways.values() for way in each]
        time = np.array([way.time_s for way in rows])
        known = _Known(
            time_s,
            ways,
            np.cumsum([0, *(len(each) for each in ways.values())])[:-1],
            np.array([self._numbers[place] for place in ways]),
            np.array([-1 if way.id is None else way.id for way in rows]),
            np.array([self._numbers[way.to] for way in rows]),
            np.maximum(1, np.rint(time / TICK_S)).astype(np.int64),
            np.array([way.paid for way in rows]),
            self.clock.discount**time,
        )
        self._known.append(known)
        self._times_s.append(time_s)

    def _out_of(self, repertoire: Repertoire, place: Place) -> list[Way]:
        before, anew = place
        if before is None or anew:
            choices = repertoire.entries(repertoire.skills.end(before))
        else:
            choices = repertoire.after(before)
        held = (before, anew or choices.dead_end)
        out = [Way(None, held, 0.0, *self._figures_of(repertoire, before, None))]
        for slot in np.flatnonzero(choices.mask).tolist():
            id = repertoire.primitive(slot)
            if id is not None:
                figures = self._figures_of(repertoire, before, id)
                out.append(Way(id, (id, False), float(choices.prior[slot]), *figures))
        return out

    def _figures_of(
        self, repertoire: Repertoire, before: int | None, id: int | None
    ) -> tuple[float, float]:
        """Return how long a primitive takes after another [s], and what its moments earn."""
        from mplearn_envs.tasks.wandering import earned_as_planned

        skills = repertoire.skills
        key = tuple(None if each is None else skills.key(each) for each in (before, id))
        if key not in self._figures:
            here = skills.end(before)
            plan = skills.hold(here, self._hold_s) if id is None else skills.plan(here, id)
            earned = earned_as_planned(self._task, plan, self.clock)
            self._figures[key] = plan.duration_s, earned
        return self._figures[key]
