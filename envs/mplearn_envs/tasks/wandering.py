"""The best that can be done in free motion: by dynamic programming on what was performed lately.

What a choice of `FreeTask` earns depends on the last few primitives, so these are the state: a walk
of ``memory`` primitives on the graph, of which there are few where a primitive leads on to one or
two others. Where there are too many, fewer are remembered, and a repetition that is forgotten is
paid for as if it were new: the best is then bounded from above, not reached.
"""

from __future__ import annotations

import math
from collections.abc import Hashable
from typing import NamedTuple

import numpy as np

from mplearn.recording import FloatArray
from mplearn_envs.execution.tracking_report import TrackingReport
from mplearn_envs.planning.plan import Plan
from mplearn_envs.skills.repertoire import Repertoire
from mplearn_envs.skills.soonest import performed

from .base import Choice, Scene, Task
from .best import UNKNOWN, Clock, Scale, weights
from .long_run import Actions, best_rate, best_values

MOST_STATES = 400_000
_TOLERANCE = 1e-6  # of values, relative
_Recent = tuple[int, ...]  # the primitives that are remembered, the latest last


class Wandering(NamedTuple):
    """The best of free motion.

    Attributes:
        scale: The greatest return of all time from the start on, and that of holding for ever.
        rate: The greatest reward per second in the long run [1/s]; NaN where it is not known.
    """

    scale: Scale
    rate: float


class _Graph(NamedTuple):
    """What each state is worth, which is where, and the greatest reward per second."""

    place: dict[_Recent, int]
    values: FloatArray
    rate: float


def wandering(task: Task, memory: int, scene: Scene) -> Wandering:
    """Return the best of a task whose bonuses look back, plans taken at their word.

    Its bonuses may depend on the choice and on the last ``memory`` primitives, its rates on the
    moment. Unknown where the discount is 1, where a transition is allowed that was never observed
    (its price is the environment's), or where the robot comes to a dead end.

    Args:
        task: The task.
        memory: How far it looks back, in primitives.
        scene: Where an episode begins.
    """
    repertoire, clock = scene.repertoire, Clock.of(scene.repertoire, scene.discount)
    firsts = performed(repertoire, scene.choices)
    ids = _reached(repertoire, firsts)
    choices = [scene.choices, *(repertoire.after(id) for id in ids)]
    if clock.discount >= 1.0 or any(c.dead_end or c.novel.any() for c in choices):
        return Wandering(UNKNOWN, math.nan)
    key: Hashable = (
        *("wandering", repr(task), memory),
        *(repertoire.library.version, tuple(ids), clock, scene.hold_s),
    )
    graph: _Graph | None = repertoire.memory.get(key)
    if graph is None:
        graph = _solved(task, memory, repertoire, ids, clock, scene.hold_s)
        repertoire.memory.put(key, graph)
    best = -math.inf
    for id in firsts:
        plan = repertoire.skills.plan(scene.reference, id)
        choice = Choice(id, True, float(scene.choices.prior[repertoire.slots[id]]), ())
        paid = sum(task.bonuses(choice).values()) + earned_as_planned(task, plan, clock)
        rest = float(graph.values[graph.place[(id,)]])
        best = max(best, paid + clock.worth(plan.duration_s) * rest)
    hold = repertoire.skills.hold(scene.reference, scene.hold_s)
    idle = earned_as_planned(task, hold, clock) / (1.0 - clock.worth(hold.duration_s))
    return Wandering(Scale(best, idle), graph.rate)


def _solved(
    task: Task, memory: int, repertoire: Repertoire, ids: list[int], clock: Clock, hold_s: float
) -> _Graph:
    """Return all that can be remembered and done, and what it is worth."""
    following = {id: performed(repertoire, repertoire.after(id)) for id in ids}
    depth = _affordable(following, memory)
    steady = clock._replace(discount=1.0)
    meanwhile: dict[tuple[int, int | None], tuple[float, float, float]] = {}
    for before, after in following.items():
        here = repertoire.skills.end(before)
        for id in (None, *after):
            skills = repertoire.skills
            plan = skills.hold(here, hold_s) if id is None else skills.plan(here, id)
            earned = earned_as_planned(task, plan, clock), earned_as_planned(task, plan, steady)
            meanwhile[before, id] = *earned, plan.duration_s
    likely = {
        (before, id): float(repertoire.after(before).prior[repertoire.slots[id]])
        for before, after in following.items()
        for id in after
    }
    place: dict[_Recent, int] = {(id,): k for k, id in enumerate(ids)}
    queue: list[_Recent] = list(place)
    state: list[int] = []
    to: list[int] = []
    paid: list[tuple[float, float, float]] = []  # discounted, not discounted; and its time
    for k, recent in enumerate(queue):  # it grows meanwhile
        # what is forgotten is taken for something else, -1: so no more is paid than is due
        known = recent if len(recent) < depth else (*(-1,) * (memory - depth), *recent)
        here_id = recent[-1]
        for id in (None, *following[here_id]):
            bonus = 0.0
            then = recent
            if id is not None:
                choice = Choice(id, True, likely[here_id, id], known)
                bonus = sum(task.bonuses(choice).values())
                then = (*recent, id)[-depth:]
                if then not in place:
                    place[then] = len(queue)
                    queue.append(then)
            discounted, whole, lasts_s = meanwhile[here_id, id]
            state.append(k)
            to.append(place[then])
            paid.append((bonus + discounted, bonus + whole, lasts_s))
    discounted_, whole_, time_s = np.array(paid).T
    where = np.array(state), np.array(to)
    values = best_values(Actions.of(*where, discounted_, time_s), clock.discount, _TOLERANCE)
    return _Graph(place, values, best_rate(Actions.of(*where, whole_, time_s)))


def _affordable(following: dict[int, list[int]], memory: int) -> int:
    """Return how many primitives can be remembered, at least 1, at most ``memory``."""
    ids = list(following)
    step = np.zeros((len(ids), len(ids)))
    for before, after in following.items():
        step[ids.index(before), [ids.index(id) for id in after]] = 1.0
    n_walks = np.ones(len(ids))
    n_states, depth = n_walks.sum(), 1
    while depth < memory:
        n_walks = step @ n_walks
        n_states += n_walks.sum()
        if n_states > MOST_STATES:
            break
        depth += 1
    return depth


def earned_as_planned(task: Task, plan: Plan, clock: Clock) -> float:
    """Return what a plan's moments earn, discounted to its start, where it is taken at its word.

    Args:
        task: One whose rates depend on the moment alone.
        plan: The plan.
        clock: How time is counted.
    """
    report = TrackingReport.as_planned(plan)
    weight = weights(report.time_s, clock.discount)
    return sum(float(rate @ weight) for rate in task.rates(report).values())


def _reached(repertoire: Repertoire, firsts: list[int]) -> list[int]:
    """Return the ids of all primitives that can be performed sooner or later, in order."""
    found: set[int] = set()
    queue = list(firsts)
    while queue:
        id = queue.pop()
        if id not in found:
            found.add(id)
            queue += performed(repertoire, repertoire.after(id))
    return sorted(found)
