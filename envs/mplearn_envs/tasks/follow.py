"""Do what the demonstrator is doing now."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np
from gymnasium import spaces

from mplearn.errors import InvalidValueError, NoPathError
from mplearn.library import PrimitiveLibrary
from mplearn.recording import FloatArray
from mplearn_envs.execution.tracking_report import TrackingReport
from mplearn_envs.skills.action_choices import HOLD, Choices, drawn_slot
from mplearn_envs.skills.repertoire import Repertoire

from .base import Choice, Scene, Task
from .best import Clock, Scale

_LONGEST_TIME = 3.0  # of the time since a motion began, as a share of its usual duration


@dataclass
class FollowTask(Task):
    """Mirror a demonstrator who moves on while the robot acts.

    The demonstrator performs primitives that the robot can perform too, in an order drawn from the
    library's transitions, at ``pace`` times the robot's speed, each a little faster or slower than
    usual. A motion is recognised under way, after the share ``recognised_after`` of its duration.
    Who waits until then is late by that much, and never by more: a slower demonstrator can be
    caught up with. Who guesses right is in time; who guesses wrong is led elsewhere, and must find
    a place where the demonstrator comes by.

    ======== ============================================== =========== ====================
    term     formula                                        paid        extremes
    ======== ============================================== =========== ====================
    agree    ``agree`` while the robot performs the          per second  0 .. ``agree``
             primitive that the demonstrator performs
    fall     - ``fallen``                                   at a fall   - ``fallen`` .. 0
    ======== ============================================== =========== ====================

    So a return lies between - ``fallen`` and ``agree`` / (-ln gamma). The episode ends after
    ``deadline_s``.

    The task's observation, C = capacity:

    =========== =========================================================== ========
    num         meaning                                                     bounds
    =========== =========================================================== ========
    0..C-1      1 at the slot of the motion recognised last                 0, 1
    C..2C-1     how likely each primitive comes after that                  0 .. 1
    2C..3C-1    how likely each primitive comes after this one              0 .. 1
    3C          time since the recognised motion began, as a share of how   0 .. 3
                long it usually takes the demonstrator
    3C+1        time left, as a share of ``deadline_s``                     0 .. 1
    =========== =========================================================== ========

    Before anything is recognised, there is no 1, and the time is that since the start, as a share
    of a median motion.

    Attributes:
        pace: Speed of the demonstrator as a share of the robot's.
        variation: Standard deviation of the logarithm of how long a motion takes.
        recognised_after: Share of a motion after which it is recognised; with 1 it is at its end.
        deadline_s: When the episode ends [s].
        agree: Reward of a second in agreement.
        fallen: Price of a fall.

    Example:
        >>> import gymnasium as gym
        >>> import mplearn_envs
        >>> task = FollowTask(pace=0.7)
        >>> env = gym.make("mplearn/PrimitiveHumanoid-v0", task=task, dynamics="kinematic")
        >>> observation, info = env.reset(seed=1)
        >>> env.observation_space["task"].contains(observation["task"])
        True
    """

    pace: float = 0.8
    variation: float = 0.1
    recognised_after: float = 0.3
    deadline_s: float = 60.0
    agree: float = 1.0
    fallen: float = 10.0
    terms: ClassVar[tuple[str, ...]] = ("agree",)
    reset_options: ClassVar[tuple[str, ...] | None] = ()

    def __post_init__(self) -> None:
        if not (np.isfinite(self.pace) and self.pace > 0):
            raise InvalidValueError(f"pace must be positive and finite, not {self.pace}")
        for name, most in (("variation", 10), ("recognised_after", 1)):
            value = getattr(self, name)
            if not (np.isfinite(value) and 0 <= value <= most):
                raise InvalidValueError(f"{name} must lie in [0, {most}], not {value}")
        if not (np.isfinite(self.deadline_s) and self.deadline_s > 0):
            raise InvalidValueError(f"deadline_s must be positive, not {self.deadline_s}")
        self._library: PrimitiveLibrary | None = None

    def space(self, repertoire: Repertoire) -> spaces.Box:
        """Return the bounds of the observation, see the table."""
        high = np.ones(3 * repertoire.capacity + 2)
        high[-2] = _LONGEST_TIME
        return spaces.Box(np.zeros_like(high), high, dtype=np.float64)

    def reset(self, scene: Scene) -> None:
        """Let the demonstrator begin.

        Raises:
            NoPathError: There is nothing that the robot could do too.
        """
        repertoire = scene.repertoire
        self._repertoire, self._rng, self.ways = repertoire, scene.rng, scene.ways
        if scene.choices.dead_end:
            raise NoPathError("the demonstrator can begin with nothing that the robot can do")
        self._first = scene.choices
        known = self._library
        self._look_at(repertoire)
        if self._library is not known:
            self._usual_s = {
                id: repertoire.skills.duration_s(id) / self.pace for id in repertoire.feasible_ids
            }
            self._median_s = float(np.median(list(self._usual_s.values())))
        self._ids: list[int] = []
        self._ends_s: list[float] = []
        self._known_s: list[float] = []  # when each motion is recognised
        self._n_recognised = 0
        self._doing: int | None = None
        self._time_s, self._agreed_s = 0.0, 0.0
        clock = Clock.of(repertoire, scene.discount)
        self._scale = Scale(self.agree * clock.held(self.deadline_s), 0.0)
        self._go_on(scene.time_s)

    def observe(self) -> FloatArray:
        """Return what was recognised and when, what is predicted, and the time left."""
        n, capacity = self._n_recognised, self._repertoire.capacity
        out = np.zeros(3 * capacity + 2)
        usual_s = self._median_s
        if n:
            out[self._repertoire.slots[self._ids[n - 1]]] = 1.0
            usual_s = self._usual_s[self._ids[n - 1]]
        out[capacity : 2 * capacity], out[2 * capacity : -2] = self._prediction()
        began_s = self._ends_s[n - 2] if n > 1 else 0.0
        out[-2] = min((self._time_s - began_s) / usual_s, _LONGEST_TIME)
        out[-1] = max(0.0, 1.0 - self._time_s / self.deadline_s)
        return out

    def bonuses(self, choice: Choice) -> dict[str, float]:
        """Return nothing: agreement is paid while it lasts."""
        self._doing = choice.primitive
        return {}

    def rates(self, report: TrackingReport) -> dict[str, FloatArray]:
        """Return the term ``agree``."""
        time_s = self._time_s + report.time_s
        self._go_on(float(time_s[-1]))
        together = np.zeros(len(time_s))
        if self._doing is not None:
            turn = np.searchsorted(self._ends_s, time_s, side="left")
            same = np.array([id == self._doing for id in self._ids])
            together[same[turn]] = 1.0
            self._agreed_s += float(together.mean() * report.duration_s)
        return {"agree": self.agree * together}

    def arrive(self, scene: Scene) -> dict[str, float]:
        """Let time pass: more is recognised."""
        self._look_at(scene.repertoire)
        self._time_s = scene.time_s
        self._go_on(scene.time_s)
        self._n_recognised = int(np.searchsorted(self._known_s, scene.time_s, side="right"))
        return {}

    @property
    def done(self) -> bool:
        """Whether the time is over."""
        return self._time_s >= self.deadline_s

    def report(self) -> dict[str, Any]:
        """Return the share of time in agreement, and the slot of what the demonstrator does now.

        ``best_return`` is that of agreement from the start to the deadline, as a twin of the
        demonstrator would have: no agent reaches it, and what it misses of it is its regret.
        """
        now = int(np.searchsorted(self._ends_s, self._time_s, side="right"))
        return {
            "agreement": self._agreed_s / self._time_s if self._time_s > 0 else 0.0,
            "demonstrator": self._repertoire.slots[self._ids[now]],
            **self._scale.report(),
        }

    def recognised(self, time_s: float) -> list[int]:
        """Return the ids of what is recognised by a time that has come, in its order."""
        return self._ids[: int(np.searchsorted(self._known_s, time_s, side="right"))]

    def likely(self, slot: int, time_s: float) -> FloatArray:
        """Return how the demonstrator really goes on, shape (capacity,): for oracles.

        Args:
            slot: Of what was performed before.
            time_s: Time in the episode [s].
        """
        if self.ways is not None:
            return self.ways.prior(slot, time_s)
        return self._following(self._repertoire.primitive(slot)).prior

    # ---- the demonstrator

    def _look_at(self, repertoire: Repertoire) -> None:
        """Take what the robot knows by now."""
        self._repertoire = repertoire
        if self._library is not repertoire.library:
            self._library = repertoire.library
            self._predicted: dict[tuple[int | None, ...], FloatArray | None] = {}

    def _go_on(self, time_s: float) -> None:
        """Perform until after a time."""
        repertoire = self._repertoire
        while not self._ends_s or self._ends_s[-1] <= time_s:
            began_s = self._ends_s[-1] if self._ends_s else 0.0
            prior = self._first.prior
            if self._ids:
                prior = self.likely(repertoire.slots[self._ids[-1]], began_s)
            id = repertoire.primitive(drawn_slot(prior, self._rng))
            assert id is not None  # `_following` never leaves hold alone
            lasts_s = self._usual_s[id] * float(
                np.exp(self.variation * self._rng.standard_normal())
            )
            self._known_s.append(began_s + self.recognised_after * lasts_s)
            self._ends_s.append(began_s + lasts_s)
            self._ids.append(id)

    def _following(self, id: int | None) -> Choices:
        """Return what the demonstrator may do next; at a dead end he begins anew."""
        if id is None:
            return self._first
        choices = self._repertoire.after(id)
        return self._first if choices.dead_end else choices

    # ---- the prediction

    def _prediction(self) -> tuple[FloatArray, FloatArray]:
        """Return how likely each slot is next, and after that, shape (capacity,) each."""
        n, repertoire = self._n_recognised, self._repertoire
        history = tuple(self._ids[max(0, n - repertoire.library.graph.order) : n])
        then = self._next_after(history)
        after = np.zeros_like(then)
        for slot in np.flatnonzero(then > 0.01).tolist():
            after += then[slot] * self._next_after((*history, repertoire.primitive(slot)))
        return then, after / max(after.sum(), 1e-300)

    def _next_after(self, history: tuple[int | None, ...]) -> FloatArray:
        """Return how likely each slot comes next; where that is unknown, one begins anew."""
        if history not in self._predicted:
            self._predicted[history] = self._predict(history)
        predicted = self._predicted[history]
        return self._first.prior if predicted is None else predicted

    def _predict(self, history: tuple[int | None, ...]) -> FloatArray | None:
        """Return the library's prediction among what the robot can do, shape (capacity,), or None.

        It depends on the library alone, not on the episode.
        """
        if not history or self._repertoire.after(history[-1] or 0).dead_end:
            return None
        repertoire = self._repertoire
        graph = repertoire.library.graph
        out = np.zeros(repertoire.capacity)
        for id, probability in zip(graph.ids, graph.probabilities(history), strict=True):
            if id in repertoire.slots and repertoire.skills.feasibility(id).feasible:
                out[repertoire.slots[id]] = probability
        out[HOLD] = 0.0
        return np.asarray(out / out.sum()) if out.sum() > 0 else None
