"""A library as one robot can perform it: who has which slot, and which may come next."""

from __future__ import annotations

import copy
from collections.abc import Collection, Hashable
from itertools import takewhile
from typing import Any, NamedTuple
from weakref import WeakValueDictionary

import numpy as np

from mplearn.errors import LibraryError, RobotError
from mplearn.generation import StyleName
from mplearn.library import PrimitiveLibrary
from mplearn.recording import FloatArray
from mplearn_envs.lru_cache import LRUCache
from mplearn_envs.mechanics.reference import Reference
from mplearn_envs.robot import Robot

from .action_choices import Choices, choose_among
from .feasibility import FeasibilityConfig
from .skills import Foreknowledge, Skills
from .slots import Slots

ENTRY_GAP = 0.5  # largest difference of a tracked coordinate [rad]
HEIGHT_SCALE = 5.0  # 0.2 m of height count as much as 1 rad
_OUTCOMES = 4096  # of about 6 kB each


class Repertoire:
    """The primitives of a library, in slots of a fixed number: slot 0 is hold.

    Several environments may share a repertoire, in threads too.

    Args:
        library: The primitives and their transitions.
        robot: The robot.
        capacity: Number of slots; None is the next power of two, at least 32.
        speed: Speed of performance, as a share of the human's.
        style: How motions are generated from primitives.
        limits: What counts as feasible.
        upper_body: Whether only the upper body performs, see `Skills`.
        novel: Whether transitions are allowed that were never observed.
        growing: Whether the library will be replaced by `update`; it may be empty then.
        skills: Of the same primitives, robot, speed, style and limits; None makes them.
        known: See `Skills`.

    Attributes:
        skills: What the robot makes of them: motions, verdicts and plans.
        slots: Slot of each primitive.
        ids: Ids of the primitives that have one.
        growing: See above.
        memory: What performers remember of outcomes.

    Raises:
        LibraryError: The library is empty, is for another body, or holds more than fits.
        InvalidValueError: The capacity is not an integer above 1, or the speed not positive.

    Example:
        >>> from mplearn_envs.data.library_source import LibrarySource
        >>> from mplearn_envs.robot import humanoid
        >>> library = LibrarySource(None).now()  # the built-in one
        >>> repertoire = Repertoire(library, humanoid(), capacity=32)
        >>> slot = repertoire.slots[library["bow down"].id]
        >>> library[repertoire.primitive(slot)].name, repertoire.primitive(0) is None  # 0 is hold
        ('bow down', True)
    """

    def __init__(
        self,
        library: PrimitiveLibrary,
        robot: Robot,
        capacity: int | None = None,
        speed: float = 0.5,
        style: StyleName = "deterministic",
        limits: FeasibilityConfig | None = None,
        *,
        upper_body: bool = False,
        novel: bool = False,
        growing: bool = False,
        skills: Skills | None = None,
        known: Foreknowledge | None = None,
    ) -> None:
        if not len(library) and not growing:
            raise LibraryError("the library is empty: there is nothing to perform")
        self._slots = Slots(capacity, len(library))
        self._slots.require_room(len(library))
        self._shares_skills = skills is not None
        self.skills = skills or Skills(
            library, robot, speed, style, limits, upper_body=upper_body, known=known
        )
        self.capacity = self._slots.capacity
        self.novel = novel
        self.growing = growing
        self.memory = LRUCache(_OUTCOMES)
        self.update(library)

    @property
    def library(self) -> PrimitiveLibrary:
        """The primitives, as `update` had them last."""
        return self._library

    @property
    def robot(self) -> Robot:
        """Who performs."""
        return self.skills.robot

    def update(
        self, library: PrimitiveLibrary, known: Collection[int] | None = None
    ) -> tuple[int, ...]:
        """Take a newer snapshot; primitives that live on keep their slots.

        Args:
            library: The snapshot.
            known: Ids of those that a walk may begin with; None: all of them.

        Returns:
            Ids of primitives for which there was no slot: they cannot be chosen.

        Raises:
            LibraryError: The library is for another body.
        """
        with self.skills.lock:
            if library.primitives != self.skills.library.primitives:
                self.skills.take(library)
            self._library = library
            left_out = self._slots.update(library.ids)
            self.slots = self._slots.of
            self.ids = tuple(sorted(self.slots))
            self._known = self.ids if known is None else tuple(sorted(known))
            self._after: dict[int, Choices] = {}
            self._starts: FloatArray | None = None
        return left_out

    def forget(self) -> None:
        """Forget all and free all slots: what comes is another learner's, of other ids."""
        with self.skills.lock:
            self.skills.forget()
            self._slots.clear()

    def require_room(self, n_primitives: int) -> None:
        """Check that so many primitives fit.

        Raises:
            LibraryError: They do not.
        """
        self._slots.require_room(n_primitives)

    def primitive(self, slot: int) -> int | None:
        """Return the id of the primitive in a slot; None for hold and for free slots."""
        return self._slots.primitive(slot)

    def begins_with(self, id: int) -> bool:
        """Return whether a walk may begin with a primitive, where it starts near enough."""
        return id in self._known

    @property
    def feasible_ids(self) -> tuple[int, ...]:
        """Ids of the primitives that the robot can perform; judges them all."""
        return tuple(id for id in self.ids if self.skills.feasibility(id).feasible)

    @property
    def any_feasible(self) -> bool:
        """Whether there is a primitive that the robot can perform; judges no more than it must."""
        return any(self.skills.feasibility(id).feasible for id in self.ids)

    def after(self, id: int) -> Choices:
        """Return what may follow a primitive: observed transitions that are feasible, and hold."""
        with self.skills.lock:
            if id not in self._after:
                graph = self.library.graph
                row = graph.prior(id)
                self._after[id] = self._choices(
                    {graph.ids[i]: float(row[i]) for i in np.flatnonzero(row)}, id
                )
            return self._after[id]

    def entries(self, reference: Reference) -> Choices:
        """Return with which primitives a walk may begin somewhere: those that start near it.

        They are the feasible ones that start on the same feet, at most ``ENTRY_GAP`` farther than
        the nearest one, so that there always are some (on other feet where there is none on
        these); weighted by how often each was seen.

        Args:
            reference: Where the reference robot is.

        Raises:
            RobotError: There are primitives, and the robot can perform none of them.
        """
        if not self.ids:
            return self._choices({})
        with self.skills.lock:
            gaps, lifted = self._gaps(reference), reference.lifted
            near = sorted(self._known, key=lambda id: (gaps[id], id))
            # no more is judged than is needed
            first = next((id for id in near if self._starts_on(id, lifted)), None)
            other_feet = first is None
            if first is None:
                first = next((id for id in near if self.skills.feasibility(id).feasible), None)
            if first is None:
                raise RobotError(self._nothing_feasible(near))
            within = []
            for id in takewhile(lambda id: gaps[id] <= gaps[first] + ENTRY_GAP, near):
                verdict = self.skills.feasibility(id)
                if other_feet or not verdict.feasible or verdict.starts_up == lifted:
                    within.append(id)
            return self._choices({id: float(self.library[id].n_exemplars) for id in within})

    def from_place(self, choices: Choices, place: Reference) -> Choices:
        """Return what of some choices can be done where the robot cannot come to rest first.

        It may stand so after steps that caught a push; elsewhere it can do all of them.

        Args:
            choices: What follows what was performed, or may be done first.
            place: Where the reference robot is.
        """
        possible, refused, novel = {}, dict(choices.refused), []
        for slot in np.flatnonzero(choices.mask).tolist():
            id = self.primitive(slot)
            if id is None:
                continue
            problems = self.skills.judge_plan(self.skills.plan(place, id))
            if problems:
                refused[slot] = tuple(str(problem) for problem in problems)
            elif choices.novel[slot]:
                novel.append(slot)
            else:
                possible[slot] = float(choices.prior[slot])
        return choose_among(possible, refused, tuple(novel), self.capacity)

    def _starts_on(self, id: int, lifted: int) -> bool:
        """Return whether the robot can perform a primitive, and it starts with that foot up."""
        verdict = self.skills.feasibility(id)
        return verdict.feasible and verdict.starts_up == lifted

    def _gaps(self, reference: Reference) -> dict[int, float]:
        """Return how far from a reference each primitive starts [rad]."""
        if self._starts is None:
            self._starts = np.array([self.skills[id].motion.frames[0] for id in self.ids])
        apart = np.abs(self._starts - reference.target)
        apart[:, 0] *= HEIGHT_SCALE
        return dict(zip(self.ids, apart.max(axis=1).tolist(), strict=True))

    def _nothing_feasible(self, ids: list[int]) -> str:
        reasons = "; ".join(
            f"{self.library[id].name}: {self.skills.feasibility(id).problems[0]}" for id in ids[:6]
        )
        return (
            f"robot {self.robot.name!r} can perform none of the library's "
            f"{len(self.ids)} primitives ({reasons})"
        )

    def _choices(self, weights: dict[int, float], before: int | None = None) -> Choices:
        """Return what can be done of what was seen, after a primitive or where none was before."""
        possible, refused = {}, {}
        limits = self.skills.limits
        if limits is None or not limits.transitions:
            before = None
        for id, weight in weights.items():
            slot = self.slots.get(id)
            if slot is None:
                continue
            problems = self.skills.feasibility(id).problems
            if not problems and before is not None:
                problems = self.skills.follows(before, id)
            if problems:
                refused[slot] = tuple(str(problem) for problem in problems)
            else:
                possible[slot] = weight
        novel = tuple(self.slots[id] for id in self.feasible_ids) if self.novel else ()
        return choose_among(possible, refused, novel, self.capacity)

    def __deepcopy__(self, memo: dict[int, Any]) -> Repertoire:
        """Share what does not change; copy what grows."""
        if not self.growing:
            return self
        twin = object.__new__(Repertoire)
        memo[id(self)] = twin
        if self._shares_skills:
            memo[id(self.skills)] = self.skills
        twin.__setstate__(copy.deepcopy(self.__getstate__(), memo))
        return twin

    def __getstate__(self) -> dict[str, Any]:
        """Leave out what can be worked out again, and is large."""
        return {name: value for name, value in self.__dict__.items() if name != "memory"}

    def __setstate__(self, state: dict[str, Any]) -> None:
        self.__dict__.update(state)
        self.memory = LRUCache(_OUTCOMES)


_SHARED: WeakValueDictionary[Hashable, Repertoire] = WeakValueDictionary()


class Manner(NamedTuple):
    """How a library is performed; fields are arguments of `Repertoire`.

    Example:
        >>> from mplearn_envs.data.library_source import LibrarySource
        >>> from mplearn_envs.robot import humanoid
        >>> slow = Manner(64, 0.3, "smooth", None, upper_body=False, novel=False)
        >>> repertoire = shared_repertoire(LibrarySource(None).now(), humanoid(), slow)
        >>> repertoire.capacity
        64
    """

    capacity: int | None
    speed: float
    style: StyleName
    limits: FeasibilityConfig | None
    upper_body: bool
    novel: bool


def shared_repertoire(
    library: PrimitiveLibrary,
    robot: Robot,
    manner: Manner,
    known: Foreknowledge | None = None,
    like: Repertoire | None = None,
) -> Repertoire:
    """Return the repertoire of a library that will not change.

    All environments of a process that ask for the same get the same. It shares skills and memory
    with the one that it is ``like``: of the same primitives, with other transitions.

    Example:
        >>> from mplearn_envs.data.library_source import LibrarySource
        >>> from mplearn_envs.robot import humanoid
        >>> asked = LibrarySource(None).now(), humanoid(), Manner(
        ...     None, 0.5, "deterministic", None, upper_body=False, novel=False
        ... )
        >>> shared_repertoire(*asked) is shared_repertoire(*asked)
        True
    """
    key = (library.version, robot, manner)
    found = _SHARED.get(key)
    if found is None:
        skills = None if like is None else like.skills
        found = Repertoire(library, robot, **manner._asdict(), skills=skills, known=known)
        if like is not None:
            found.memory = like.memory
        _SHARED[key] = found
    return found
