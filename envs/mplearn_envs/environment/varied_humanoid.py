"""``mplearn/PrimitiveHumanoid-v1``: many primitives, long ways, several people."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from hashlib import blake2b
from itertools import pairwise
from typing import Any, ClassVar, Literal, cast

import numpy as np

from mplearn.errors import InvalidValueError
from mplearn.graph import TransitionGraph
from mplearn.recording import FloatArray
from mplearn_envs.data.library_source import LibrarySource
from mplearn_envs.execution.bodies import Body
from mplearn_envs.execution.modes import Dynamics
from mplearn_envs.mechanics.reference import rest_reference
from mplearn_envs.robot import Robot, humanoid
from mplearn_envs.skills.action_choices import HOLD, Choices
from mplearn_envs.skills.repertoire import Repertoire, shared_repertoire
from mplearn_envs.tasks import FollowTask, FreeTask, GoalTask, ReciteTask, Scene, Task
from mplearn_envs.varied.changes import NOTHING, Changes, make_changes
from mplearn_envs.varied.changing_person import ChangingPerson, People
from mplearn_envs.varied.people import foreknowledge, library_of, people_of, starts

from .episode import Episode, EpisodeState, Seen
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

    ## Changes

    With ``changes`` the task ``follow`` becomes a life in small: the robot knows what it has seen,
    and what the demonstrator shows becomes a legal action; habits change, and people. See
    `Changes`, and its levels in `CHANGES`: "none" (the default), "growing", "habits", "people",
    "all". ``info["person"]`` is who is there now, and ``info["changed"]`` has ``n_primitives``,
    ``n_ways`` (how many the robot knows by now; all, where that does not grow) and
    ``n_new_ways`` (of this step). ``library_version`` tells one state of knowledge from another.

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
        changes: What changes in an episode, see above.

    Raises:
        InvalidValueError: There is no such split or person, changes are wanted in another task than
            ``follow``, or another option is wrong.

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
        changes: Changes | str | Mapping[str, Any] = "none",
    ) -> None:
        self.people = people_of(from_plain(people))
        self.person = self.people[0]
        self.changes = make_changes(from_plain(changes))
        self._changing: ChangingPerson | None = None
        self._seen: Seen | None = None
        self._n_new_ways = 0
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
        if self.changes != NOTHING and not isinstance(self.task, FollowTask):
            raise InvalidValueError(
                "changes are those of a demonstrator whom one follows: choose the task 'follow'"
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
        if self.changes != NOTHING:
            self._people = People.of(self._repertoires, self._beginnings(first))
        if self.changes.watched is not None:
            self._growing = Repertoire(
                library_of(self.person),
                self.robot,
                **self._manner()._asdict(),
                growing=True,
                skills=first.skills,
            )
            self._growing.memory = first.memory
            return self._growing
        return self._repertoires[self.person]

    def _beginnings(self, repertoire: Repertoire) -> FloatArray:
        """Return with what an episode begins, each as likely as the other, shape (C,)."""
        if self._starts is None:
            begins = repertoire.entries(rest_reference(self.robot)).prior > 0
        else:
            begins = np.zeros(repertoire.capacity, dtype=np.bool_)
            begins[[repertoire.slots[id] for id in self._starts]] = True
        return np.asarray(begins / begins.sum())

    def _begin(self, options: Mapping[str, Any]) -> None:
        rng = self.streams.demonstrator
        drawn = self.people[int(rng.integers(len(self.people)))]
        self._first = float(rng.random())
        person = options.get("person", drawn)
        if person not in self._repertoires:
            raise InvalidValueError(f"person must be one of {self.people}, not {person!r:.80}")
        self._turn_to(int(person))
        if self.changes == NOTHING:
            return
        seed = int(rng.integers(2**63))
        self._changing = ChangingPerson(self._people, self.person, self.changes, seed)
        if self.changes.watched is not None:
            begins = np.flatnonzero(self._people.starts)
            first = int(begins[int(self._first * len(begins))])
            empty = TransitionGraph(order=1)
            self._seen = Seen(replace(library_of(self.person), graph=empty), frozenset())
            self._n_new_ways = 0
            self._see(self._changing.walked(first, self.changes.watched))

    def _meanwhile(self, duration_s: float) -> None:
        """Let what the demonstrator does be seen."""
        if self._changing is None:
            return
        time_s = self._begun().time_s + duration_s
        self._turn_to(self._changing.person_at(time_s))
        if self._seen is not None:
            assert isinstance(self.task, FollowTask)
            done, before = self.task.recognised(time_s), self._seen.n_motions
            self._n_new_ways = 0
            if len(done) > before:
                self._see([self.repertoire.slots[id] for id in done[max(0, before - 1) :]])
                self._seen = self._seen._replace(n_motions=len(done))

    def _see(self, slots: Sequence[int]) -> None:
        """Count motions, the first of which may have been counted, and the ways between them."""
        assert self._changing is not None and self._seen is not None
        library, known = self._seen.library, set(self._seen.ids)
        ids = [self._growing.primitive(slot) for slot in slots]
        graph, n_before = library.graph.copy(), library.graph.n_edges
        for (before, after), (a, b) in zip(pairwise(ids), pairwise(slots), strict=True):
            if before is not None and after is not None and self._changing.is_way(a, b):
                graph.observe(before, after, 0.0)
        known.update(id for id in ids if id is not None)
        if graph.n_transitions > library.graph.n_transitions or known != self._seen.ids:
            library = replace(library, graph=graph)
            self._n_new_ways = graph.n_edges - n_before
            self._seen = self._seen._replace(library=library, ids=frozenset(known))
            self._growing.update(library, known)

    def _turn_to(self, person: int) -> None:
        """Let a person's graph be the one that counts, where it is known."""
        self.person = person
        if self.changes.watched is None:
            self.repertoire = self._repertoires[person]

    def _scene(self, episode: Episode, options: Mapping[str, Any]) -> Scene:
        return super()._scene(episode, options)._replace(ways=self._changing)

    def _entries(self) -> Choices:
        """Return the one primitive with which an episode may begin."""
        repertoire = self.repertoire
        if self._starts is None:
            slots = np.flatnonzero(repertoire.entries(self.performer.reference).prior)
        else:
            seen = self._starts if self._seen is None else self._seen.ids
            slots = np.array([repertoire.slots[id] for id in self._starts if id in seen])
        slot = int(slots[int(self._first * len(slots))])
        mask, prior = np.zeros(self.capacity, np.int8), np.zeros(self.capacity)
        mask[HOLD] = mask[slot] = prior[slot] = 1
        return Choices(mask, prior, np.zeros(self.capacity, np.int8), {}, slot == HOLD)

    def state(self) -> EpisodeState:
        """Return where the episode is, with whom, and what was seen."""
        return super().state()._replace(person=self.person, seen=self._seen)

    def load_state(self, state: EpisodeState) -> tuple[Observation, dict[str, Any]]:
        """Go on from there; see `PrimitiveHumanoidEnv`."""
        if state.person not in self._repertoires:
            raise InvalidValueError(
                f"the state is of person {state.person}, and here are {self.people}"
            )
        ways = state.task.ways if isinstance(state.task, FollowTask) else None
        if (ways.changes if isinstance(ways, ChangingPerson) else NOTHING) != self.changes:
            raise InvalidValueError("the state is of an environment with other changes")
        self._turn_to(state.person)
        if state.seen is not None:
            self._seen = state.seen
            self._growing.update(state.seen.library, state.seen.ids)
        super().load_state(state)
        if isinstance(self.task, FollowTask):
            self._changing = cast("ChangingPerson | None", self.task.ways)
        return self._observation(), self._info()

    def _info(
        self, step: StepInfo | None = None, terms: Mapping[str, float] | None = None
    ) -> dict[str, Any]:
        info = super()._info(step, terms) | {"person": self.person}
        if self.changes == NOTHING:
            return info
        graph = self.library.graph
        n_known = len(self.library) if self._seen is None else len(self._seen.ids)
        info["changed"] = {
            "n_primitives": n_known,
            "n_ways": graph.n_edges,
            "n_new_ways": self._n_new_ways,
        }
        return info

    @property
    def _version(self) -> str:
        """What tells states of knowledge apart; of what is seen, without the primitives."""
        if self._seen is None:
            return super()._version
        seen = np.array(sorted(self._seen.ids)), self._seen.library.graph.edge_rows()
        return blake2b(b"".join(part.tobytes() for part in seen), digest_size=8).hexdigest()
