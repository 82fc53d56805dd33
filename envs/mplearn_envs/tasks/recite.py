"""Perform a requested sequence, though there is no direct way from one primitive to the next."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np
from gymnasium import spaces

from mplearn.errors import InvalidValueError, NoPathError
from mplearn.recording import FloatArray
from mplearn_envs.execution.tracking_report import TrackingReport
from mplearn_envs.skills.repertoire import Repertoire
from mplearn_envs.skills.soonest import performed, soonest

from .base import Choice, Scene, Task, padded
from .best import Clock, Scale, time_held


@dataclass
class ReciteTask(Task):
    """Recite a sequence of primitives.

    The request names ``length`` primitives. No two of them follow each other directly, wherever the
    library allows that: the shortcut is illegal, and one must find a way round. What is performed
    in between does not count. The episode ends when all is said, and after ``deadline_s``.

    ======== ========================================= ==================== =====================
    term     formula                                   paid                 extremes
    ======== ========================================= ==================== =====================
    hurry    - ``hurry``                               per second           - ``hurry`` .. 0
    said     ``said``                                  at the end of the    0 .. ``said``
                                                       primitive requested
    complete ``complete``                              after the last one   0 .. ``complete``
    fall     - ``fallen``                              at a fall            - ``fallen`` .. 0
    ======== ========================================= ==================== =====================

    So a return lies between - ``hurry`` / (-ln gamma) - ``fallen`` and
    ``length`` * ``said`` + ``complete``.

    The task's observation: ``length`` times a 1 at the slot of what remains to be said, the next
    first (all 0 where nothing does), shape (length * capacity,), and the share of ``deadline_s``
    that is left; all in [0, 1].

    Attributes:
        length: Number of primitives requested.
        request: The same request in each episode, as ids or names; None draws requests.
            ``reset(options={"request": ...})`` gives one for an episode.
        deadline_s: When the episode ends [s].
        hurry: Price of a second.
        said: Reward of a requested primitive in its turn.
        complete: Reward of the whole request.
        fallen: Price of a fall.

    Example:
        >>> import gymnasium as gym
        >>> import mplearn_envs
        >>> task = ReciteTask(request=["squat down", "bow down"])
        >>> env = gym.make("mplearn/PrimitiveHumanoid-v0", task=task, dynamics="kinematic")
        >>> observation, info = env.reset(seed=1)
        >>> info["is_success"]
        False
    """

    length: int = 3
    request: Sequence[int | str] | None = None
    deadline_s: float = 60.0
    hurry: float = 0.05
    said: float = 1.0
    complete: float = 1.0
    fallen: float = 10.0
    terms: ClassVar[tuple[str, ...]] = ("hurry", "said", "complete")
    reset_options: ClassVar[tuple[str, ...] | None] = ("request",)

    def __post_init__(self) -> None:
        if self.request is not None:
            self.length = len(self.request)
        if isinstance(self.length, bool) or self.length < 1:
            raise InvalidValueError(f"length must be an integer from 1, not {self.length!r}")
        if not (np.isfinite(self.deadline_s) and self.deadline_s > 0):
            raise InvalidValueError(f"deadline_s must be positive, not {self.deadline_s}")

    def space(self, repertoire: Repertoire) -> spaces.Box:
        """Return the bounds of the remaining request."""
        return spaces.Box(0.0, 1.0, (self.length * repertoire.capacity + 1,), np.float64)

    def reset(self, scene: Scene) -> None:
        """Draw a request.

        Raises:
            NoPathError: A given request cannot be performed.
            InvalidValueError: A given request has another length.
        """
        repertoire = scene.repertoire
        given = scene.options.get("request", self.request)
        if given is None:
            self._ids = _drawn_request(scene, self.length)
        else:
            if len(given) != self.length:
                raise InvalidValueError(f"a request names {self.length} primitives, not {given!r}")
            self._ids = tuple(repertoire.library[key].id for key in given)
            _require_possible(self._ids, scene)
        self._slots = tuple(repertoire.slots[id] for id in self._ids)
        self._capacity = repertoire.capacity
        self._n_said = 0
        self._chosen: int | None = None
        self._time_s = scene.time_s
        self._scale = self._computed_scale(scene)

    def observe(self) -> FloatArray:
        """Return what remains to be said, and the time left."""
        out = np.zeros(self.length * self._capacity + 1)
        for k, slot in enumerate(self._slots[self._n_said :]):
            out[k * self._capacity + slot] = 1.0
        out[-1] = max(0.0, 1.0 - self._time_s / self.deadline_s)
        return out

    def bonuses(self, choice: Choice) -> dict[str, float]:
        """Return nothing: what is said is paid when it was said."""
        self._chosen = choice.primitive
        return {}

    def rates(self, report: TrackingReport) -> dict[str, FloatArray]:
        """Return the term ``hurry``."""
        return {"hurry": np.full(len(report.time_s), -self.hurry)}

    def arrive(self, scene: Scene) -> dict[str, float]:
        """Return the terms ``said`` and ``complete``."""
        self._time_s = scene.time_s
        said = self._chosen is not None and not self._complete
        said = said and self._chosen == self._ids[self._n_said]
        self._n_said += int(said)
        return {
            "said": self.said if said else 0.0,
            "complete": self.complete if said and self._complete else 0.0,
        }

    @property
    def _complete(self) -> bool:
        return self._n_said == self.length

    @property
    def done(self) -> bool:
        """Whether all is said, or the time is over."""
        return self._complete or self._time_s >= self.deadline_s

    def report(self) -> dict[str, Any]:
        """Return success, and the slots that remain to be said."""
        return {
            "success": self._complete,
            "slots": padded(self._slots[self._n_said :], self.length),
            **self._scale.report(),
        }

    def _computed_scale(self, scene: Scene) -> Scale:
        """Return the returns of the quickest way, primitive by primitive, and of holding.

        Who says each as soon as can be says all as soon as can be, for after each the robot stands
        where it stands whatever the way.
        """
        clock, time_s, best = Clock.of(scene.repertoire, scene.discount), 0.0, 0.0
        before, choices = None, scene.choices
        for id in self._ids:
            ways = soonest(scene.repertoire, before, choices)
            if id not in ways:  # only by holding at a dead end
                return Scale(math.nan, math.nan)
            if time_s + ways[id].time_s > self.deadline_s:
                break
            time_s += ways[id].time_s
            best += self.said * clock.worth(time_s)
            before, choices = id, scene.repertoire.after(id)
        else:
            best += self.complete * clock.worth(time_s) - self.hurry * clock.held(time_s)
            return Scale(best, self._idle(clock, scene))
        return Scale(math.nan, self._idle(clock, scene))  # not all can be said in time

    def _idle(self, clock: Clock, scene: Scene) -> float:
        return -self.hurry * clock.held(time_held(self.deadline_s, scene.hold_s))


def _drawn_request(scene: Scene, length: int) -> tuple[int, ...]:
    """Return primitives that can be reached one after the other, none directly where possible.

    Raises:
        NoPathError: Nothing can be reached.
    """
    repertoire = scene.repertoire
    ids: list[int] = []
    direct = set(performed(repertoire, scene.choices))
    for _ in range(length):
        reached = _reachable(repertoire, direct)
        if not reached:
            where = f"after {repertoire.library[ids[-1]].name!r}" if ids else "at the start"
            raise NoPathError(f"no request of {length} primitives: nothing can follow {where}")
        # at a dead end nothing follows: it may only come last
        open_ended = [
            id for id in sorted(reached) if set(performed(repertoire, repertoire.after(id)))
        ] or sorted(reached)
        last = len(ids) == length - 1
        options = sorted(reached) if last else open_ended
        indirect = [id for id in options if id not in direct] or options
        ids.append(indirect[int(scene.rng.integers(len(indirect)))])
        direct = set(performed(repertoire, repertoire.after(ids[-1])))
    return tuple(ids)


def _require_possible(ids: tuple[int, ...], scene: Scene) -> None:
    repertoire = scene.repertoire
    library = repertoire.library
    direct = set(performed(repertoire, scene.choices))
    for id in ids:
        if id not in _reachable(repertoire, direct):
            problems = repertoire.skills.feasibility(id).problems
            why = "; ".join(map(str, problems)) or "no way leads there from what comes before"
            raise NoPathError(f"the request's {library[id].name!r} cannot be performed: {why}")
        direct = set(performed(repertoire, repertoire.after(id)))


def _reachable(repertoire: Repertoire, direct: set[int]) -> set[int]:
    """Return all primitives that can be reached from some, these included."""
    reached: set[int] = set()
    queue = list(direct)
    while queue:
        id = queue.pop()
        if id not in reached:
            reached.add(id)
            queue.extend(performed(repertoire, repertoire.after(id)))
    return reached
