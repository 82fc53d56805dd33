"""The robot of the page: what may come next, and what comes of it in the simulator.

All of it takes time, so it is done in one thread, one thing after the other. A motion is shown
while it is simulated, which takes less time than the motion.
"""

from __future__ import annotations

from collections.abc import Callable
from concurrent.futures import Future, ThreadPoolExecutor
from dataclasses import dataclass, field

import numpy as np

from mplearn.errors import InvalidValueError, MPLearnError, NoPathError
from mplearn.library import PrimitiveLibrary
from mplearn_envs.data.library_source import LibrarySource
from mplearn_envs.execution.modes import make_performer
from mplearn_envs.execution.performer import Performer
from mplearn_envs.execution.simulation import Simulation
from mplearn_envs.robot import Robot
from mplearn_envs.skills.action_choices import HOLD, Choices
from mplearn_envs.skills.repertoire import Repertoire

from .messages import Poses

SHOWN_HZ = 50.0
SPEED = 0.5  # of the human's: the paper's [Kulic2012, 4.2]
_HOLD_S = 1.0
_SLOTS = 1024


@dataclass
class Performed:
    """A primitive as the robot performs it; it grows while it is simulated.

    Attributes:
        id: The primitive; None until it is chosen, or where none could be.
        poses: Where the robot's bodies were so far, shape (B, 7) each.
        fallen: Whether it fell.
        problem: Why it was not performed at all; empty where it was.
        done: Whether nothing will be added.
    """

    id: int | None = None
    poses: list[Poses] = field(default_factory=list)
    fallen: bool = False
    problem: str = ""
    done: bool = False


class PageRobot:
    """The simulated robot, what it can perform, and what it did last.

    Args:
        robot: The robot.

    Attributes:
        cannot: Why it can perform nothing of what is known; empty where it can.
        broken: What went wrong that should not; None where all is well.
    """

    def __init__(self, robot: Robot) -> None:
        self.cannot = ""
        self.broken: BaseException | None = None
        self._robot = robot
        self._performer: Performer | None = None
        self._last: int | None = None  # what was simulated last
        self._unjudged: list[int] = []
        self._rng = np.random.default_rng()
        self._thread = ThreadPoolExecutor(1, thread_name_prefix="robot")
        self._busy: Future[None] | None = None  # the latest that was begun

    def close(self) -> None:
        """End, after what is being done."""
        self._thread.shutdown(wait=False, cancel_futures=True)

    # ---- to be asked for; what takes time comes later

    def warm_up(self) -> None:
        """Perform once what comes with the package, so that all is compiled before it is needed."""
        self._begin(self._warm_up)

    def renew(self, library: PrimitiveLibrary) -> None:
        """Take what is known now."""
        self._begin(lambda: self._renew(library))

    def prepare(self) -> None:
        """Judge one of the primitives that are new: then it begins the sooner when asked for."""
        if self._unjudged and (self._busy is None or self._busy.done()):
            self._begin(self._judge_next)

    def reset(self) -> None:
        """Stand upright."""
        self._begin(self._reset)

    def perform(self, id: int | None) -> Performed:
        """Perform a primitive; None for what may follow, as likely as the demonstrator does it."""
        performed = Performed(id)
        self._begin(lambda: self._perform(performed))
        return performed

    def path(self, goal: int) -> Future[list[int]]:
        """Find the way to a primitive from what the robot did last, or from where it stands."""
        return self._thread.submit(self._path, goal)

    # ---- in the thread

    def _begin(self, do: Callable[[], None]) -> None:
        self._busy = self._thread.submit(self._watched, do)

    def _watched(self, do: Callable[[], None]) -> None:
        try:
            do()
        except BaseException as error:
            self.broken = error

    def _warm_up(self) -> None:
        repertoire = Repertoire(LibrarySource(None).now(), self._robot, _SLOTS, SPEED, growing=True)
        performer = make_performer("simulated", repertoire, _HOLD_S)
        performer.reset()
        first = self._drawn(repertoire, repertoire.entries(performer.reference))
        performer.perform(first, None, 1)

    def _renew(self, library: PrimitiveLibrary) -> None:
        try:
            if self._performer is None:
                repertoire = Repertoire(library, self._robot, _SLOTS, SPEED, growing=True)
                self._performer = make_performer("simulated", repertoire, _HOLD_S)
                self._performer.reset()
                before: tuple[int, ...] = ()
            else:
                before = self._performer.repertoire.ids
                self._performer.repertoire.update(library)
            self.cannot = ""
            kept = [id for id in self._unjudged if id in library]
            self._unjudged = kept + [id for id in library.ids if id not in before]
        except MPLearnError as error:
            self.cannot = str(error)

    def _judge_next(self) -> None:
        id = self._unjudged.pop(0)
        if self._performer is not None and id in self._performer.repertoire.ids:
            self._performer.repertoire.skills.feasibility(id)

    def _reset(self) -> None:
        self._last = None
        if self._performer is not None:
            self._performer.reset()

    def _perform(self, performed: Performed) -> None:
        try:
            performer = self._known()
            if performed.id is None:
                performed.id = self._chosen(performer)
            verdict = performer.repertoire.skills.feasibility(performed.id)
            if not verdict.feasible:
                performed.problem = str(verdict.problems[0])
                return
            self._last = performed.id
            step_s = performer.repertoire.skills.planner.config.period_s
            outcome = performer.perform(
                performed.id,
                lambda: performed.poses.append(pose_of(performer.simulation)),
                max(1, round(1.0 / (SHOWN_HZ * step_s))),
            )
            performed.fallen = outcome.report.fallen
        except MPLearnError as error:
            performed.problem = str(error)
        finally:
            performed.done = True

    def _chosen(self, performer: Performer) -> int:
        """Draw what a walk performs next, as likely as the demonstrator does it."""
        repertoire, last = performer.repertoire, self._last
        choices = None
        if last is not None and last in repertoire.library:
            choices = repertoire.after(last)
        if choices is None or not choices.mask[HOLD + 1 :].any():  # a dead end: begin anew
            choices = repertoire.entries(performer.reference)
        return self._drawn(repertoire, choices)

    def _drawn(self, repertoire: Repertoire, choices: Choices) -> int:
        weights = choices.prior * choices.mask
        weights[HOLD] = 0.0
        if not weights.sum() > 0:
            raise NoPathError("the walk ends: nothing can follow")
        id = repertoire.primitive(int(self._rng.choice(len(weights), p=weights / weights.sum())))
        assert id is not None  # free slots weigh nothing
        return id

    def _path(self, goal: int) -> list[int]:
        performer = self._known()
        library, last = performer.repertoire.library, self._last
        if last is not None and last in library and last != goal:
            try:
                return list(library.path(last, goal))[1:]
            except NoPathError:
                pass  # it has to begin anew
        choices = performer.repertoire.entries(performer.reference)
        starts = [performer.repertoire.primitive(int(k)) for k in np.flatnonzero(choices.mask)]
        paths = []
        for start in starts:
            if start is None:
                continue
            try:
                paths.append([start] if start == goal else list(library.path(start, goal)))
            except NoPathError:
                continue
        if not paths:
            raise NoPathError("no way leads there from where the robot stands")
        return min(paths, key=len)

    def _known(self) -> Performer:
        if self._performer is None:
            raise InvalidValueError(f"the robot can perform nothing of this: {self.cannot}")
        return self._performer


def pose_of(simulation: Simulation) -> Poses:
    """Return where the robot's bodies are, shape (B, 7): position [m] and quaternion."""
    data = simulation.data
    return np.concatenate((data.xpos[1:], data.xquat[1:]), axis=1, dtype=np.float32)
