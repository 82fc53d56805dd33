"""A library as one robot can perform it: motions, verdicts, slots, and which may come next."""

from __future__ import annotations

from importlib.resources import files
from pathlib import Path
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from mplearn.errors import InvalidValueError, LibraryError, RobotError
from mplearn.generation import StyleName
from mplearn.library import PrimitiveLibrary
from mplearn.recording import FloatArray

from .control.controller import tracked_columns
from .control.planner import Motion, Plan, Planner
from .control.reference import Reference
from .feasibility import Feasibility, FeasibilityCheck, FeasibilityConfig

HOLD = 0
ENTRY_GAP = 0.5  # largest difference of a tracked coordinate [rad]
HEIGHT_SCALE = 5.0  # 0.2 m of height count as much as 1 rad


class Choices(NamedTuple):
    """What may be done next.

    Attributes:
        mask: 1 where an action is legal, shape (capacity,).
        prior: How likely the demonstrator makes each legal choice, shape (capacity,); sums to 1.
        refused: Slots that the demonstrator might choose and the robot cannot perform, and why.
        dead_end: Whether nothing but holding is left.
    """

    mask: NDArray[np.int8]
    prior: FloatArray
    refused: dict[int, tuple[str, ...]]
    dead_end: bool


class Repertoire:
    """The primitives of a library, in slots of a fixed number: slot 0 is hold.

    Args:
        library: The primitives and their transitions.
        planner: Plans for the robot.
        capacity: Number of slots; None is the next power of two, at least 32.
        speed: Speed of performance, as a share of the human's.
        style: How motions are generated from primitives.
        limits: What counts as feasible.

    Raises:
        LibraryError: The library is empty, is for another body, or holds more than fits.
        InvalidValueError: The capacity is not an integer above 1, or the speed not positive.
    """

    def __init__(
        self,
        library: PrimitiveLibrary,
        planner: Planner,
        capacity: int | None = None,
        speed: float = 0.5,
        style: StyleName = "deterministic",
        limits: FeasibilityConfig | None = None,
    ) -> None:
        _require_fit(library, planner)
        if not (np.isfinite(speed) and speed > 0):
            raise InvalidValueError(f"speed must be positive and finite, not {speed}")
        needed = len(library) + 1
        if capacity is None:
            capacity = max(32, 1 << (needed - 1).bit_length())
        if isinstance(capacity, bool) or not isinstance(capacity, (int, np.integer)):
            raise InvalidValueError(f"capacity must be an integer, not {capacity!r}")
        if capacity < needed:
            raise LibraryError(
                f"the library holds {len(library)} primitives and needs a capacity of at least "
                f"{needed}, one slot more for hold; capacity is {capacity}"
            )
        self.library = library
        self.planner = planner
        self.capacity = int(capacity)
        self.speed = float(speed)
        self.style = style
        self.limits = limits
        self.ids = tuple(sorted(library.ids))
        self.slots = {id: slot for slot, id in enumerate(self.ids, start=1)}
        columns = {name: i for i, name in enumerate(library.channels)}
        self._columns = [columns[name] for name in planner.robot.channels]
        self._tracked = tracked_columns(planner.robot)
        self._frames: dict[int, tuple[FloatArray, float]] = {}
        self._verdicts: dict[int, Feasibility] = {}
        self._after: dict[int, Choices] = {}
        self._check: FeasibilityCheck | None = None

    def primitive(self, slot: int) -> int | None:
        """Return the id of the primitive in a slot; None for hold and for free slots."""
        return self.ids[slot - 1] if 1 <= slot <= len(self.ids) else None

    def frames(self, id: int) -> tuple[FloatArray, float]:
        """Return a primitive's motion in the robot's channels, (T, 3 + n), and its rate [1/s]."""
        if id not in self._frames:
            motion = self.library.generate([id], style=self.style)
            frames = motion.frames[:, self._columns]
            if len(frames) == 1:
                frames = np.repeat(frames, 2, axis=0)
            self._frames[id] = (np.ascontiguousarray(frames), motion.rate_hz)
        return self._frames[id]

    def feasibility(self, id: int) -> Feasibility:
        """Return whether the robot can perform a primitive; judged once."""
        if id not in self._verdicts:
            if self._check is None:
                self._check = FeasibilityCheck(self.planner, self.limits)
            self._verdicts[id] = self._check.judge(*self.frames(id), self.speed)
        return self._verdicts[id]

    def plan(self, start: Reference, id: int) -> Plan:
        """Return the commands that perform a primitive from the present reference."""
        frames, rate_hz = self.frames(id)
        motion = Motion(frames[:, self._tracked], rate_hz)
        return self.planner.plan(start, motion, self.feasibility(id).speed, id)

    def after(self, id: int) -> Choices:
        """Return what may follow a primitive: observed transitions that are feasible, and hold."""
        if id not in self._after:
            graph = self.library.graph
            row = graph.prior(id)
            weights = {graph.ids[i]: float(row[i]) for i in np.flatnonzero(row)}
            self._after[id] = self._choices(weights)
        return self._after[id]

    def entries(self, posture: FloatArray) -> Choices:
        """Return with which primitives a walk may begin in a posture: those that start near it.

        They are the feasible ones that start at most ``ENTRY_GAP`` farther than the nearest one, so
        that there always are some; weighted by how often each was seen.

        Args:
            posture: Tracked coordinates, shape (U,) [m, rad].

        Raises:
            RobotError: The robot can perform none of the primitives.
        """
        gaps = {id: self._gap(posture, id) for id in self.ids}
        nearest = sorted(self.ids, key=lambda id: (gaps[id], id))
        first = next((id for id in nearest if self.feasibility(id).feasible), None)
        if first is None:
            reasons = "; ".join(
                f"{self.library[id].name}: {self.feasibility(id).problems[0]}" for id in nearest[:6]
            )
            raise RobotError(
                f"robot {self.planner.robot.name!r} can perform none of the library's "
                f"{len(self.ids)} primitives ({reasons})"
            )
        return self._choices(
            {
                id: float(self.library[id].n_exemplars)
                for id in nearest
                if gaps[id] <= gaps[first] + ENTRY_GAP
            }
        )

    def _gap(self, posture: FloatArray, id: int) -> float:
        difference = self.frames(id)[0][0, self._tracked] - posture
        difference[0] *= HEIGHT_SCALE
        return float(np.abs(difference).max())

    def _choices(self, weights: dict[int, float]) -> Choices:
        mask, prior = np.zeros(self.capacity, np.int8), np.zeros(self.capacity)
        mask[HOLD] = 1
        refused = {}
        for id, weight in weights.items():
            verdict = self.feasibility(id)
            if verdict.feasible:
                mask[self.slots[id]] = 1
                prior[self.slots[id]] = weight
            else:
                refused[self.slots[id]] = tuple(str(problem) for problem in verdict.problems)
        total = prior.sum()
        if total == 0:
            prior[HOLD] = 1.0
        else:
            prior /= total
        return Choices(mask, prior, refused, bool(total == 0))


def _require_fit(library: PrimitiveLibrary, planner: Planner) -> None:
    robot = planner.robot
    if not len(library):
        raise LibraryError("the library is empty: there is nothing to perform")
    missing = [name for name in robot.channels if name not in library.channels]
    if missing or library.body not in ("", robot.name):
        raise LibraryError(
            f"the library is for body {library.body!r} with channels {library.channels[:4]}...; "
            f"robot {robot.name!r} needs {len(robot.channels)} channels"
            + (f" and misses {missing[:4]}" if missing else "")
        )


def open_library(library: PrimitiveLibrary | str | Path | None) -> PrimitiveLibrary:
    """Return a library, the one of a file, or the built-in one.

    Raises:
        LibraryError: The file is missing or damaged, or this is no library.
    """
    if library is None:
        return PrimitiveLibrary.load(Path(str(files(__package__) / "data" / "default.mplearn")))
    if isinstance(library, (str, Path)):
        return PrimitiveLibrary.load(library)
    if not isinstance(library, PrimitiveLibrary):
        raise LibraryError(
            f"library must be a PrimitiveLibrary, a file or None, not {type(library).__name__}"
        )
    return library
