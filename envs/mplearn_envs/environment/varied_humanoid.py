"""``mplearn/PrimitiveHumanoid-v1``: many primitives, long ways, several people."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import Any, ClassVar, Literal

import numpy as np

from mplearn.errors import InvalidValueError
from mplearn_envs.data.library_source import LibrarySource
from mplearn_envs.execution.bodies import Body
from mplearn_envs.execution.modes import Dynamics
from mplearn_envs.robot import Robot, humanoid
from mplearn_envs.skills.action_choices import HOLD, Choices
from mplearn_envs.skills.repertoire import Repertoire, shared_repertoire
from mplearn_envs.tasks import FollowTask, FreeTask, GoalTask, ReciteTask, Task
from mplearn_envs.varied.people import foreknowledge, library_of, people_of, starts

from .episode import EpisodeState
from .macro_step import MacroStepEnv, StepInfo
from .observation import Observation
from .options import ActionOptions, MotionOptions, PictureOptions
from .plain import from_plain

TASKS: dict[str, Task] = {
    "goal": GoalTask("primitive", steps=(5, 15), deadline_s=90.0, hurry=0.02),
    "recite": ReciteTask(deadline_s=180.0, hurry=0.02),
    "follow": FollowTask(),
    "free": FreeTask(),
}


_kept: list[Repertoire] = []  # outlives its environments: others of the process want it again


class VariedHumanoidEnv(MacroStepEnv):
    """A humanoid with 140 primitives of several people, among which the ways are long.

    Observations, actions, rewards and ``info`` are those of `PrimitiveHumanoidEnv`, but:

    * Each episode has a person, drawn by the environment's seed among ``people``, and that person's
      graph: who was seen to do what after what, and how often. The primitives are the same for
      all, and three of four ways are shared by any two people; so what was learned with the people
      of "train" can be tried with those of "test". ``info["person"]`` says who it is, for whoever
      evaluates, and ``reset(options={"person": 7})`` asks for one.
    * An episode starts at one primitive, drawn too, which alone is legal besides hold.
    * ``task="goal"`` asks for a primitive 5 to 15 primitives away, within 90 s; a ``"recite"`` has
      180 s; a second costs 0.02 in both. A second discounts by 0.98, and ``gym.make`` truncates
      after 200 macro steps.
    * ``info["task"]`` of these two has ``best_return``, what the quickest way earns that there is,
      and ``idle_return``, what holding earns: (return - idle) / (best - idle) is the share of what
      is possible.

    All was learned by a `mplearn.MotionLearner` that watched six people, and recognised in what
    eight do (``python -m mplearn_envs.varied.build``). There are 256 actions. What the built-in
    humanoid makes of the library at the usual speed is known beforehand, so that an episode begins
    at once; with another robot, speed or style, verdicts and plans are made when they are needed.

    Args:
        people: "train" (0 to 5), "test" (6, 7), "all", a number, or some.
        robot: See `PrimitiveHumanoidEnv`, as for all that follow.
        task: A name stands for a task with the settings above.
        dynamics: See there.
        discount: See there.
        flat: See there.
        motion: See there.
        actions: See there.
        pictures: See there.
        render_mode: See there.
        body: See there.

    Raises:
        InvalidValueError: There is no such split or person, or another option is wrong.

    ## Versions

    * v1: the first of these; v0 is `PrimitiveHumanoidEnv`, with 22 primitives of one person.

    Example:
        >>> import gymnasium as gym
        >>> import mplearn_envs
        >>> env = gym.make("mplearn/PrimitiveHumanoid-v1", dynamics="kinematic", people="test")
        >>> observation, info = env.reset(seed=0)
        >>> info["person"] in (6, 7), int(info["action_mask"].sum())
        (True, 2)
        >>> env.close()
    """

    reset_options: ClassVar[tuple[str, ...]] = ("person",)

    def __init__(
        self,
        people: str | int | tuple[int, ...] = "train",
        *,
        robot: Robot | str | None = None,
        task: str | Task | Mapping[str, Any] = "goal",
        dynamics: Dynamics = "simulated",
        discount: float = 0.98,
        flat: bool = False,
        motion: MotionOptions | Mapping[str, Any] | None = None,
        actions: ActionOptions | Mapping[str, Any] | None = None,
        pictures: PictureOptions | Mapping[str, Any] | None = None,
        render_mode: Literal["human", "rgb_array"] | None = None,
        body: Body | str | Mapping[str, Any] = "nominal",
    ) -> None:
        self.people = people_of(from_plain(people))
        self.person = self.people[0]
        if isinstance(task, str) and task in TASKS:
            task = replace(TASKS[task])  # type: ignore[type-var]
        super().__init__(
            LibrarySource(library_of(self.person)),
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

    def _made_repertoire(self) -> Repertoire:
        """Return the repertoire of the first person; those of all share skills and memory."""
        usual = self.robot == humanoid() and self.motion == MotionOptions()
        what = (self.robot, self._manner(), foreknowledge() if usual else None)
        first = shared_repertoire(library_of(0), *what)
        if usual:
            _kept[:] = [first]
        self._repertoires = {
            person: shared_repertoire(library_of(person), *what, like=first)
            for person in self.people
        }
        self._starts = starts() if usual else None
        return self._repertoires[self.person]

    def _begin(self, options: Mapping[str, Any]) -> None:
        rng = self.streams.demonstrator
        drawn = self.people[int(rng.integers(len(self.people)))]
        self._first = float(rng.random())
        person = options.get("person", drawn)
        if person not in self._repertoires:
            raise InvalidValueError(f"person must be one of {self.people}, not {person!r:.80}")
        self._turn_to(int(person))

    def _turn_to(self, person: int) -> None:
        """Let a person's graph be the one that counts."""
        self.person, self.repertoire = person, self._repertoires[person]

    def _entries(self) -> Choices:
        """Return the one primitive with which an episode may begin."""
        repertoire = self.repertoire
        if self._starts is None:
            slots = np.flatnonzero(repertoire.entries(self.performer.reference).prior)
        else:
            slots = np.array([repertoire.slots[id] for id in self._starts])
        slot = int(slots[int(self._first * len(slots))])
        mask, prior = np.zeros(self.capacity, np.int8), np.zeros(self.capacity)
        mask[HOLD] = mask[slot] = prior[slot] = 1
        return Choices(mask, prior, np.zeros(self.capacity, np.int8), {}, slot == HOLD)

    def state(self) -> EpisodeState:
        """Return where the episode is, and with whom."""
        return super().state()._replace(person=self.person)

    def load_state(self, state: EpisodeState) -> tuple[Observation, dict[str, Any]]:
        """Go on from there; see `PrimitiveHumanoidEnv`."""
        if state.person not in self._repertoires:
            raise InvalidValueError(
                f"the state is of person {state.person}, and here are {self.people}"
            )
        self._turn_to(state.person)
        return super().load_state(state)

    def _info(
        self, step: StepInfo | None = None, terms: Mapping[str, float] | None = None
    ) -> dict[str, Any]:
        return super()._info(step, terms) | {"person": self.person}
