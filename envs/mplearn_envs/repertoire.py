"""A library as one robot can perform it: motions, verdicts, slots, and which may come next."""

from __future__ import annotations

import copy
from collections import OrderedDict
from collections.abc import Hashable
from functools import cached_property
from threading import RLock
from typing import Any
from weakref import WeakValueDictionary

import numpy as np

from mplearn.errors import InvalidValueError, LibraryError, RobotError
from mplearn.generation import StyleName
from mplearn.library import PrimitiveLibrary
from mplearn.recording import FloatArray

from .choices import Choices, choose_among
from .control.controller import tracked_columns
from .control.planner import Motion, Plan, Planner
from .control.reference import Reference, rest_reference
from .feasibility import Feasibility, FeasibilityCheck, FeasibilityConfig
from .robot import Retargeting, Robot
from .slots import Slots

ENTRY_GAP = 0.5  # largest difference of a tracked coordinate [rad]
_MEMORY = 4096  # outcomes of about 6 kB each
HEIGHT_SCALE = 5.0  # 0.2 m of height count as much as 1 rad


class Repertoire:
    """The primitives of a library, in slots of a fixed number: slot 0 is hold.

    What is found out about a primitive is kept until it changes; it depends on nothing else, so
    several environments may share a repertoire, in threads too.

    Args:
        library: The primitives and their transitions.
        robot: The robot.
        capacity: Number of slots; None is the next power of two, at least 32.
        speed: Speed of performance, as a share of the human's.
        style: How motions are generated from primitives.
        limits: What counts as feasible.
        novel: Whether transitions are allowed that were never observed.
        growing: Whether the library will be replaced by `update`; it may be empty then.

    Attributes:
        slots: Slot of each primitive.
        ids: Ids of the primitives that have one.
        growing: See above.
        memory: What performers remember; see `remember` and `recall`.
        lock: Held while anything here changes.

    Raises:
        LibraryError: The library is empty, is for another body, or holds more than fits.
        InvalidValueError: The capacity is not an integer above 1, or the speed not positive.
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
        novel: bool = False,
        growing: bool = False,
    ) -> None:
        if not (np.isfinite(speed) and speed > 0):
            raise InvalidValueError(f"speed must be positive and finite, not {speed}")
        if not len(library) and not growing:
            raise LibraryError("the library is empty: there is nothing to perform")
        self.robot = robot
        self.speed = float(speed)
        self.style = style
        self.limits = limits
        self.novel = novel
        self.growing = growing
        self._tracked = tracked_columns(robot)
        self._slots = Slots(capacity, len(library))
        self.capacity = self._slots.capacity
        self._slots.require_room(len(library))
        self._frames: dict[int, tuple[FloatArray, float]] = {}
        self._motions: dict[int, Motion] = {}
        self._verdicts: dict[int, Feasibility] = {}
        self._revision: dict[int, int] = {}
        self._check: FeasibilityCheck | None = None
        self.memory: OrderedDict[Hashable, Any] = OrderedDict()
        self.lock = RLock()
        self.update(library)

    @cached_property
    def planner(self) -> Planner:
        """Plans for the robot."""
        return Planner(self.robot)

    def update(self, library: PrimitiveLibrary) -> tuple[int, ...]:
        """Take a newer snapshot; primitives that live on keep their slots.

        Returns:
            Ids of primitives for which there was no slot: they cannot be chosen.

        Raises:
            LibraryError: The library is for another body.
        """
        retargeting = _retargeting(library, self.robot)
        with self.lock:
            left_out = self._slots.update(library.ids)
            self.library = library
            self.slots = self._slots.of
            self.ids = tuple(sorted(self.slots))
            self._retargeting = retargeting
            self._frames = {id: self._frames[id] for id in self.ids if id in self._frames}
            self._motions = {id: self._motions[id] for id in self.ids if id in self._motions}
            self._verdicts = {id: self._verdicts[id] for id in self.ids if id in self._verdicts}
            self._fresh: set[int] = set()  # ids whose frames are known to be this library's
            self._after: dict[int, Choices] = {}
            self._starts: FloatArray | None = None
        return left_out

    def forget(self) -> None:
        """Free all slots: what comes is another learner's, whose ids mean something else."""
        with self.lock:
            self._slots.clear()
            self._frames.clear()
            self._motions.clear()
            self._verdicts.clear()

    def require_room(self, n_primitives: int) -> None:
        """Check that so many primitives fit.

        Raises:
            LibraryError: They do not.
        """
        self._slots.require_room(n_primitives)

    def primitive(self, slot: int) -> int | None:
        """Return the id of the primitive in a slot; None for hold and for free slots."""
        return self._slots.primitive(slot)

    def frames(self, id: int) -> tuple[FloatArray, float]:
        """Return a primitive's motion in the robot's channels, (T, 3 + n), and its rate [1/s]."""
        with self.lock:
            if id not in self._fresh:
                self._generate(id)
                self._fresh.add(id)
            return self._frames[id]

    def _generate(self, id: int) -> None:
        motion = self.library.generate([id], style=self.style)
        frames = self._retargeting(motion.frames)
        if len(frames) == 1:
            frames = np.repeat(frames, 2, axis=0)
        known = self._frames.get(id)
        if known is None or known[1] != motion.rate_hz or not np.array_equal(known[0], frames):
            self._frames[id] = (np.ascontiguousarray(frames), motion.rate_hz)
            self._motions.pop(id, None)
            self._verdicts.pop(id, None)
            self._revision[id] = self._revision.get(id, 0) + 1

    def feasibility(self, id: int) -> Feasibility:
        """Return whether the robot can perform a primitive; judged once."""
        with self.lock:
            frames, rate_hz = self.frames(id)
            if id not in self._verdicts:
                if self._check is None:
                    self._check = FeasibilityCheck(self.planner, self.limits)
                self._verdicts[id] = self._check.judge(frames, rate_hz, self.speed)
            return self._verdicts[id]

    @property
    def feasible_ids(self) -> tuple[int, ...]:
        """Ids of the primitives that the robot can perform; judges them all."""
        return tuple(id for id in self.ids if self.feasibility(id).feasible)

    def key(self, id: int) -> tuple[int, int]:
        """Return what tells a primitive's motion from all others, earlier versions included."""
        self.frames(id)
        return id, self._revision[id]

    def plan(self, start: Reference, id: int) -> Plan:
        """Return the commands that perform a primitive from the present reference."""
        with self.lock:
            frames, rate_hz = self.frames(id)
            if id not in self._motions:
                self._motions[id] = self.planner.motion(frames, rate_hz)
            speed = self.feasibility(id).speed
            plan = self.planner.plan(start, self._motions[id], speed, self.key(id))
        return plan._replace(end=self._settled(plan.end))

    def hold(self, start: Reference, duration_s: float) -> Plan:
        """Return the commands that come to rest in the present posture."""
        with self.lock:
            plan = self.planner.hold(start, duration_s)
        return plan._replace(end=self._settled(plan.end))

    def _settled(self, end: Reference) -> Reference:
        """Return where a motion ends, such that the same place recurs, to the last bit.

        The legs are solved for to about 1e-5 and depend that much on the way; and with both feet
        down it does not matter how they swung.
        """
        if end.lifted >= 0:
            return end
        q = np.round(end.q, 4)
        q[3:7] /= np.linalg.norm(q[3:7])
        return end._replace(q=q, swing=self._rest.swing, swing_velocity=self._rest.swing_velocity)

    @cached_property
    def _rest(self) -> Reference:
        return rest_reference(self.robot)

    def recall(self, key: Hashable) -> Any:
        """Return what was kept under a key; None if that is not, or no longer, in `memory`."""
        with self.lock:
            if key not in self.memory:
                return None
            self.memory.move_to_end(key)
            return self.memory[key]

    def remember(self, key: Hashable, value: Any) -> None:
        """Keep a value in `memory`, of which the ``_MEMORY`` used last are kept."""
        with self.lock:
            self.memory[key] = value
            if len(self.memory) > _MEMORY:
                self.memory.popitem(last=False)

    def duration_s(self, id: int) -> float:
        """Return how long a primitive that it can perform takes the robot from where it starts."""
        frames, rate_hz = self.frames(id)
        return (len(frames) - 1) / rate_hz / self.feasibility(id).tempo

    def after(self, id: int) -> Choices:
        """Return what may follow a primitive: observed transitions that are feasible, and hold."""
        with self.lock:
            if id not in self._after:
                graph = self.library.graph
                row = graph.prior(id)
                self._after[id] = self._choices(
                    {graph.ids[i]: float(row[i]) for i in np.flatnonzero(row)}
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
        with self.lock:
            if self._starts is None:
                self._starts = np.array([self.frames(id)[0][0, self._tracked] for id in self.ids])
            apart = np.abs(self._starts - reference.target)
            apart[:, 0] *= HEIGHT_SCALE
            gaps = dict(zip(self.ids, apart.max(axis=1).tolist(), strict=True))
            near = sorted(self.ids, key=lambda id: (gaps[id], id))
            able = [id for id in near if self.feasibility(id).feasible]
            if not able:
                raise RobotError(self._nothing_feasible(near))
            here = [id for id in able if self.feasibility(id).starts_up == reference.lifted]
            reach = gaps[(here or able)[0]] + ENTRY_GAP
            other_feet = set(able) - set(here) if here else set()
            within = [id for id in near if gaps[id] <= reach and id not in other_feet]
            return self._choices({id: float(self.library[id].n_exemplars) for id in within})

    def _nothing_feasible(self, ids: list[int]) -> str:
        reasons = "; ".join(
            f"{self.library[id].name}: {self.feasibility(id).problems[0]}" for id in ids[:6]
        )
        return (
            f"robot {self.robot.name!r} can perform none of the library's "
            f"{len(self.ids)} primitives ({reasons})"
        )

    def _choices(self, weights: dict[int, float]) -> Choices:
        possible, refused = {}, {}
        for id, weight in weights.items():
            slot = self.slots.get(id)
            if slot is None:
                continue
            verdict = self.feasibility(id)
            if verdict.feasible:
                possible[slot] = weight
            else:
                refused[slot] = tuple(str(problem) for problem in verdict.problems)
        novel = tuple(self.slots[id] for id in self.feasible_ids) if self.novel else ()
        return choose_among(possible, refused, novel, self.capacity)

    def __deepcopy__(self, memo: dict[int, Any]) -> Repertoire:
        """Share what does not change; copy what grows."""
        if not self.growing:
            return self
        twin = object.__new__(Repertoire)
        memo[id(self)] = twin
        twin.__setstate__(copy.deepcopy(self.__getstate__(), memo))
        return twin

    def __getstate__(self) -> dict[str, Any]:
        """Leave out what can be worked out again, and is large."""
        left_out = ("lock", "memory", "planner", "_check")
        return {name: value for name, value in self.__dict__.items() if name not in left_out}

    def __setstate__(self, state: dict[str, Any]) -> None:
        self.__dict__.update(state)
        self._check = None
        self.memory = OrderedDict()
        self.lock = RLock()


def _retargeting(library: PrimitiveLibrary, robot: Robot) -> Retargeting:
    try:
        return Retargeting(library.channels, library.body, robot)
    except RobotError as error:
        raise LibraryError(f"the library is not for this robot: {error}") from error


_SHARED: WeakValueDictionary[Hashable, Repertoire] = WeakValueDictionary()


def shared_repertoire(
    library: PrimitiveLibrary,
    robot: Robot,
    capacity: int | None,
    speed: float,
    style: StyleName,
    limits: FeasibilityConfig | None,
    novel: bool,
) -> Repertoire:
    """Return the repertoire of a library that will not change; arguments as `Repertoire`'s.

    All environments of a process that ask for the same get the same.
    """
    key = (library.version, robot, capacity, speed, style, limits, novel)
    found = _SHARED.get(key)
    if found is None:
        found = Repertoire(library, robot, capacity, speed, style, limits, novel=novel)
        _SHARED[key] = found
    return found
