"""``mplearn/OnlinePrimitiveHumanoid-v0``: the humanoid acts while its demonstrator goes on."""

from __future__ import annotations

import copy
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import replace
from itertools import count
from typing import Any, Literal

import numpy as np

from mplearn.errors import InvalidValueError
from mplearn.learner import (
    LearnerConfig,
    MotionLearner,
    PrimitiveBorn,
    PrimitiveForgotten,
    PrimitiveMerged,
    PrimitiveSplit,
    Recognised,
    TransitionSeen,
)
from mplearn.learner.events import Event
from mplearn.recording import IntArray
from mplearn_envs.data.library_source import LibrarySource
from mplearn_envs.execution.bodies import Body
from mplearn_envs.execution.modes import Dynamics
from mplearn_envs.robot import Robot
from mplearn_envs.skills.repertoire import Repertoire
from mplearn_envs.tasks import FollowTask, Task

from .episode import EpisodeState
from .live_demonstrator import DemonstratorLike, open_demonstrator
from .macro_step import MacroStepEnv, StepInfo
from .options import ActionOptions, MotionOptions, PictureOptions, require_number
from .plain import from_plain

CAPACITY = 64


class OnlinePrimitiveHumanoidEnv(MacroStepEnv):
    """A humanoid that performs what a demonstrator, who is still moving, has shown so far.

    While the robot performs for ``info["duration_s"]``, the demonstrator moves on for the same
    time, and a `MotionLearner` watches: tree and graph grow within the episode ([Kulic2012], figure
    1). A new primitive takes a free slot and becomes a legal action where it was seen to follow; a
    primitive that turns out to be another, or several, leaves its slot. Before there is any, only
    hold is legal.

    Actions, observations and rewards are those of `PrimitiveHumanoidEnv`. When there are more
    primitives than slots, the newest have none.

    ## Info

    Besides: ``learner``, a dict of ``watched_s`` (in this episode, warm-up included),
    ``n_primitives``, ``n_without_slot``, and of what happened during this step by slot, int64 of
    shape (capacity,): ``recognised`` (how often), ``born`` and ``gone``. ``env.unwrapped.events``
    has the learner's events themselves.

    ## Start

    The demonstrator begins anew, drawn by the environment's seed. The learner starts with nothing
    and watches ``warm_up_s``; with ``carry_over`` it goes on with all it knows, and warms up once.
    An episode depends on the seed alone, and with ``carry_over`` on the episodes before.

    Args:
        demonstrator: "synthetic", a `Recording` (shown again and again), or a `LiveDemonstrator`.
        learner: How to learn; None is the default. Channels and rate are the demonstrator's.
        warm_up_s: Time watched before the first action [s].
        carry_over: Whether what was learned outlives the episode.
        robot: See `PrimitiveHumanoidEnv`, as for all that follow.
        task: Any but "follow", whose demonstrator is another.
        dynamics: See there.
        discount: See there.
        flat: See there.
        motion: See there.
        actions: See there; the capacity is 64 unless given.
        pictures: See there.
        render_mode: See there.
        body: See there.
        library: Must be None: it is learned.

    Raises:
        InvalidValueError: An option is wrong, a library is given, or the task is "follow".

    Example:
        >>> import gymnasium as gym
        >>> import mplearn_envs
        >>> options = {"dynamics": "kinematic", "warm_up_s": 5.0}
        >>> env = gym.make("mplearn/OnlinePrimitiveHumanoid-v0", **options)
        >>> observation, info = env.reset(seed=1)
        >>> info["learner"]["watched_s"], int(info["action_mask"].sum())  # hold alone
        (5.0, 1)
        >>> env.close()
    """

    def __init__(
        self,
        demonstrator: DemonstratorLike | Mapping[str, Any] = "synthetic",
        *,
        learner: LearnerConfig | Mapping[str, Any] | None = None,
        warm_up_s: float = 60.0,
        carry_over: bool = False,
        robot: Robot | str | None = None,
        task: str | Task | Mapping[str, Any] = "free",
        dynamics: Dynamics = "simulated",
        discount: float = 0.95,
        flat: bool = False,
        motion: MotionOptions | Mapping[str, Any] | None = None,
        actions: ActionOptions | Mapping[str, Any] | None = None,
        pictures: PictureOptions | Mapping[str, Any] | None = None,
        render_mode: Literal["human", "rgb_array"] | None = None,
        body: Body | str | Mapping[str, Any] = "nominal",
        library: None = None,
    ) -> None:
        if library is not None:
            raise InvalidValueError("an online environment learns its library: give none")
        require_number("warm_up_s", warm_up_s, 0.0, 1e6, "in [0, 1e6] s")
        self.demonstrator = open_demonstrator(from_plain(demonstrator))
        channels, rate_hz = self.demonstrator.channels, self.demonstrator.rate_hz
        config = from_plain(learner) or LearnerConfig(channels, rate_hz)
        self.learner_config = replace(config, channels=channels, rate_hz=rate_hz)
        self.warm_up_s = warm_up_s
        self.carry_over = carry_over
        self.learner = MotionLearner(self.learner_config)
        actions = ActionOptions.of(from_plain(actions), "actions")
        if actions.capacity is None:
            actions = replace(actions, capacity=CAPACITY)
        source = LibrarySource(self.learner)
        super().__init__(
            source,
            robot=robot,
            task=task,
            dynamics=dynamics,
            discount=discount,
            flat=flat,
            motion=motion,
            actions=actions,
            pictures=pictures,
            render_mode=render_mode,
            body=body,
        )
        if isinstance(self.task, FollowTask):
            raise InvalidValueError(
                "the task 'follow' draws a demonstrator of its own from a library that is known: "
                "choose another task in an online environment"
            )

    def ahead(self, period_s: float = 0.1) -> Iterator[tuple[float, Repertoire]]:
        """Yield what will be known when, whatever the robot does: for oracles.

        A copy of demonstrator and learner goes on for as long as it is asked to, at the usual cost
        of learning; the environment itself does not.

        Args:
            period_s: Between the moments at which it is looked at [s].

        Yields:
            Time from now [s] and the repertoire then: first that of now, then after each change.
            It is the same object every time.

        Raises:
            InvalidValueError: ``period_s`` is not positive; or the episode has not begun.

        Example:
            >>> import gymnasium as gym
            >>> import mplearn_envs
            >>> options = {"dynamics": "kinematic", "warm_up_s": 5.0}
            >>> env = gym.make("mplearn/OnlinePrimitiveHumanoid-v0", **options)
            >>> observation, info = env.reset(seed=1)
            >>> coming = env.unwrapped.ahead()
            >>> now_s, repertoire = next(coming)
            >>> now_s, repertoire.ids == env.unwrapped.repertoire.ids
            (0.0, True)
            >>> next(coming)[0] > 0.0
            True
        """
        require_number("period_s", period_s, 1e-3, 1e6, "in [1e-3, 1e6] s")
        self._begun()
        twin = copy.copy(self)
        alone = copy.deepcopy((self.demonstrator, self.learner, self.repertoire))
        twin.demonstrator, twin.learner, twin.repertoire = alone
        yield 0.0, twin.repertoire
        for k in count(1):
            known = twin.library
            twin._meanwhile(period_s)
            if twin.library is not known:
                yield k * period_s, twin.repertoire

    def _begin(self, options: Mapping[str, Any]) -> None:
        known = self.carry_over and self.learner.n_frames > 0
        if known:
            self.learner.end_stream()
        else:
            self.learner = MotionLearner(self.learner_config)
        self.demonstrator.restart(self.streams.demonstrator)
        self._owed_s = 0.0
        self._n_watched = 0
        self._left_out: tuple[int, ...] = ()
        if not known:
            self._watch(self.warm_up_s)
            self.repertoire.forget()
        self._left_out = self.repertoire.update(self.learner.snapshot())
        self.events: tuple[Event, ...] = ()
        self._news = {name: self._by_slot(()) for name in ("recognised", "born", "gone")}

    def _meanwhile(self, duration_s: float) -> None:
        before = dict(self.repertoire.slots)
        self.events = tuple(self._watch(duration_s))
        kinds = (PrimitiveBorn, PrimitiveForgotten, PrimitiveMerged, PrimitiveSplit, TransitionSeen)
        if any(isinstance(event, kinds) for event in self.events):
            self._left_out = self.repertoire.update(self.learner.snapshot())
        now = self.repertoire.slots
        seen = (e.primitive for e in self.events if isinstance(e, Recognised))
        self._news = {
            "recognised": self._by_slot(now[id] for id in seen if id in now),
            "born": self._by_slot(now[id] for id in now.keys() - before.keys()),
            "gone": self._by_slot(before[id] for id in before.keys() - now.keys()),
        }

    def _by_slot(self, slots: Iterable[int]) -> IntArray:
        """Return how often each slot is among some, shape (capacity,)."""
        return np.bincount(np.fromiter(slots, np.int64), minlength=self.capacity)

    def _watch(self, duration_s: float) -> list[Event]:
        """Let the demonstrator go on, and learn."""
        self._owed_s += duration_s
        n_frames = int(self._owed_s * self.demonstrator.rate_hz)
        self._owed_s -= n_frames / self.demonstrator.rate_hz
        self._n_watched += n_frames
        events: list[Event] = []
        while n_frames > 0:
            frames, ended = self.demonstrator.take(n_frames)
            n_frames -= len(frames)
            events.extend(self.learner.learn_many(frames))
            if ended:
                events.extend(self.learner.end_stream())
        return events

    def _info(
        self, step: StepInfo | None = None, terms: Mapping[str, float] | None = None
    ) -> dict[str, Any]:
        report = {
            "watched_s": self._n_watched / self.demonstrator.rate_hz,
            "n_primitives": len(self.library),
            "n_without_slot": len(self._left_out),
        }
        news = {name: slots.copy() for name, slots in self._news.items()}
        return super()._info(step, terms) | {"learner": report | news}

    def state(self) -> EpisodeState:
        """Refuse: the learner belongs to the state.

        Raises:
            InvalidValueError: Always; ``copy.deepcopy(env)`` copies it all.
        """
        raise InvalidValueError("the state of an online environment is all of it: deepcopy it")
