"""The process that performs: the humanoid in MuJoCo, and the figures of primitives.

The robot simulates a primitive faster than it takes; what was simulated is then played at the
robot's own pace, while the next one is simulated.
"""

from __future__ import annotations

import signal
import time
from collections import deque
from concurrent.futures import Future, ThreadPoolExecutor
from dataclasses import dataclass
from multiprocessing.connection import Connection

import numpy as np

from mplearn.body import human_body
from mplearn.errors import InvalidValueError, MPLearnError, NoPathError
from mplearn.library import PrimitiveLibrary
from mplearn.recording import FloatArray
from mplearn_envs.execution.modes import make_performer
from mplearn_envs.execution.performer import Performer
from mplearn_envs.execution.simulation import Simulation
from mplearn_envs.robot import humanoid
from mplearn_envs.skills.action_choices import HOLD
from mplearn_envs.skills.repertoire import Repertoire

from .figures import has_figure, human_poses, shapes_of
from .happenings import happening
from .messages import Header, Poses, clip, unpack
from .outbox import Outbox
from .shelf import Receiver

SHOWN_HZ = 50.0
CLIP_HZ = 30.0
SPEED = 0.5  # of the human's: the paper's [Kulic2012, 4.2]
MOST_ASKED = 64  # primitives that wait to be performed
_HOLD_S = 1.0
_STATUS_S = 0.25


@dataclass(frozen=True)
class Played:
    """A primitive as the robot performed it.

    Attributes:
        id: The primitive.
        poses: Where the robot's bodies were, shape (T, B, 7).
        fallen: Whether it fell.
        problem: Why it was not performed at all; empty where it was.
    """

    id: int
    poses: Poses
    fallen: bool = False
    problem: str = ""


def perform(connection: Connection) -> None:
    """Perform until the other end of the connection is closed: what a process runs."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    outbox = Outbox(connection)
    try:
        Stage(connection, outbox).run()
    finally:
        outbox.close()


class Stage:
    """The robot, what it is asked to do, and what it does.

    Args:
        connection: Where libraries and requests come from.
        outbox: Where poses, figures and replies go.
    """

    def __init__(self, connection: Connection, outbox: Outbox) -> None:
        self._connection, self._outbox = connection, outbox
        self._receiver = Receiver()
        self._library: PrimitiveLibrary | None = None
        self._robot = humanoid()
        simulation = Simulation(self._robot)
        simulation.reset()
        self._standing = _pose_of(simulation)
        self._performer: Performer | None = None
        self._cannot = ""  # why the robot can perform nothing of this library
        self._asked: deque[int] = deque()
        self._steps_left = 0  # of a walk
        self._rng = np.random.default_rng()
        self._worker = ThreadPoolExecutor(1, thread_name_prefix="simulation")
        self._next: Future[Played] | None = None
        self._playing: Played | None = None
        self._frame = 0
        self._last: int | None = None  # what the robot performs, or did last
        self._chosen: int | None = None  # what was simulated last
        self._status_at = 0.0
        self._ended = False

    def run(self) -> None:
        """Perform until nobody listens any more."""
        self._outbox.post({"kind": "bodies"} | _bodies(self._robot.xml))
        self._stand()
        due = time.monotonic()
        while not (self._outbox.broken or self._ended):
            try:
                while self._connection.poll(max(0.0, due - time.monotonic())):
                    header, blob = unpack(self._connection.recv_bytes())
                    self._take(header, blob)
            except (EOFError, OSError):
                break
            due = max(due + 1.0 / SHOWN_HZ, time.monotonic())
            self._tick()
        self._worker.shutdown(wait=False, cancel_futures=True)

    # ---- what comes

    def _take(self, header: Header, blob: bytes) -> None:
        if header["kind"] == "end":
            self._ended = True
            return
        if header["kind"] == "library":
            try:
                self._library = self._receiver.receive(header["content"], blob)
                self._renew(self._library)
            except MPLearnError as error:  # this process is newer than the learner
                self._cannot = str(error)
                self._outbox.post({"kind": "undelivered"})
            return
        reply = {"kind": "reply", "client": header.get("client"), "ref": header.get("ref")}
        try:
            self._outbox.post(reply | {"ok": True, "text": self._do(header)})
        except MPLearnError as error:
            self._outbox.post(reply | {"ok": False, "text": str(error)})
        self._status_at = 0.0

    def _renew(self, library: PrimitiveLibrary) -> None:
        """Let the robot know what is known now."""
        if self._performer is None:
            try:
                repertoire = Repertoire(library, self._robot, 1024, SPEED, growing=True)
            except MPLearnError as error:
                self._cannot = str(error)
                return
            self._performer = make_performer("simulated", repertoire, _HOLD_S)
            self._performer.reset()
        else:
            self._performer.repertoire.update(library)
        self._cannot = ""

    def _do(self, asked: Header) -> str:
        """Do what a teacher asks, and return what will be done.

        Raises:
            MPLearnError: It cannot be done.
        """
        library = self._library
        if asked["do"] == "stop":
            self._asked.clear()
            self._steps_left = 0
            return "the robot stops after this"
        if library is None or not len(library):
            raise InvalidValueError("nothing is learned yet: there is nothing to perform")
        match asked["do"]:
            case "show":
                primitive = library[_number(asked, "id")]
                self._show(library, primitive.id, asked)
                return f"{{{primitive.id}}}"
            case "perform":
                self._require_robot()
                id = library[_number(asked, "id")].id
                self._queue([id])
                return f"the robot performs {{{id}}}"
            case "walk":
                self._require_robot()
                length = _number(asked, "length")
                if not 1 <= length <= MOST_ASKED:
                    raise InvalidValueError(f"a walk has 1 to {MOST_ASKED} steps, not {length}")
                self._asked.clear()
                self._steps_left = length
                return f"the robot walks {length} steps"
            case "path":
                performer = self._require_robot()
                path = self._path(performer, library, library[_number(asked, "id")].id)
                self._queue(path)
                return "the robot goes " + " → ".join(f"{{{id}}}" for id in path)
            case other:
                raise InvalidValueError(f"nobody knows how to {other[:40]!r}")

    def _show(self, library: PrimitiveLibrary, id: int, asked: Header) -> None:
        """Send the figure of a primitive, with its demonstrations."""
        if not has_figure(library.channels):
            raise InvalidValueError("these channels are no body's: there is no figure to show")
        primitive, rate_hz = library[id], library.rate_hz
        motions: list[FloatArray] = [library.generate([id]).frames, *primitive.exemplars]
        poses = []
        for motion in motions:
            n = max(2, round(len(motion) / rate_hz * CLIP_HZ))
            at = np.linspace(0, len(motion) - 1, n).round().astype(np.int64)
            poses.append(human_poses(motion[at], library.channels))
        header = {"kind": "clip", "client": asked.get("client")}
        self._outbox.post(header, clip(_number(asked, "ref"), CLIP_HZ, poses))

    def _path(self, performer: Performer, library: PrimitiveLibrary, goal: int) -> list[int]:
        """Return the way to a primitive from what the robot did last, or from where it stands."""
        if self._last is not None and self._last in library and self._last != goal:
            try:
                return list(library.path(self._last, goal))[1:]
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
            raise NoPathError(f"no way leads to {{{goal}}} from where the robot stands")
        return min(paths, key=len)

    def _queue(self, ids: list[int]) -> None:
        self._steps_left = 0
        self._asked.clear()
        self._asked.extend(ids[:MOST_ASKED])

    def _require_robot(self) -> Performer:
        if self._performer is None:
            raise InvalidValueError(f"the robot can perform nothing of this: {self._cannot}")
        return self._performer

    # ---- what the robot does

    def _tick(self) -> None:
        """Show the next frame, and see that there is one after it."""
        if self._playing is not None:
            self._frame += 1
            if self._frame >= len(self._playing.poses):
                self._finished(self._playing)
        if self._playing is None and self._next is not None and self._next.done():
            self._start(self._next.result())
        if self._next is None:
            self._simulate()
        if self._playing is not None:
            self._pose(self._playing.poses[self._frame])
        now = time.monotonic()
        if now - self._status_at > _STATUS_S:
            self._status_at = now
            self._outbox.post(self._status(), key="status")

    def _pose(self, pose: Poses) -> None:
        self._outbox.post({"kind": "robot-pose", "bodies": len(pose)}, pose.tobytes(), "pose")

    def _stand(self) -> None:
        """Stand upright, and show it."""
        if self._performer is not None:
            self._performer.reset()
        self._pose(self._standing)

    def _start(self, played: Played) -> None:
        self._next = None
        if played.problem:
            text = f"the robot cannot perform {{{played.id}}}: {played.problem}"
            self._outbox.post(happening("robot", text, 0.0, played.id))
            if not self._steps_left:
                self._asked.clear()
            return
        if len(played.poses):
            self._playing, self._frame, self._last = played, 0, played.id
            self._status_at = 0.0

    def _finished(self, played: Played) -> None:
        self._playing = None
        self._status_at = 0.0
        if played.fallen:
            self._outbox.post(
                happening("robot", f"the robot fell at {{{played.id}}}; it stands up", 0.0)
            )
            if self._next is not None:
                self._next.result()
                self._next = None
            self._asked.clear()
            self._steps_left, self._last, self._chosen = 0, None, None
            self._stand()

    def _simulate(self) -> None:
        """Begin to simulate what is asked next, if there is something."""
        performer = self._performer
        if performer is None:
            return
        if self._asked:
            id = self._asked.popleft()
        elif self._steps_left > 0:
            self._steps_left -= 1
            chosen = self._step(performer)
            if chosen is None:
                return
            id = chosen
        else:
            return
        self._chosen = id
        self._next = self._worker.submit(_simulated, performer, id)

    def _step(self, performer: Performer) -> int | None:
        """Draw what a walk performs next, as likely as the demonstrator does it."""
        repertoire, last = performer.repertoire, self._chosen
        try:
            choices = None
            if last is not None and last in repertoire.library:
                choices = repertoire.after(last)
            if choices is None or not choices.mask[HOLD + 1 :].any():  # a dead end: begin anew
                choices = repertoire.entries(performer.reference)
        except MPLearnError as error:
            self._outbox.post(happening("robot", str(error), 0.0))
            self._steps_left = 0
            return None
        weights = choices.prior * choices.mask
        weights[HOLD] = 0.0
        if not weights.sum() > 0:
            self._outbox.post(happening("robot", "the walk ends: nothing can follow", 0.0))
            self._steps_left = 0
            return None
        slot = int(self._rng.choice(len(weights), p=weights / weights.sum()))
        return repertoire.primitive(slot)

    def _status(self) -> Header:
        playing = self._playing
        return {
            "kind": "robot",
            "primitive": None if playing is None else playing.id,
            "done": 0.0 if playing is None else round(self._frame / len(playing.poses), 3),
            "left": len(self._asked) + self._steps_left + (self._next is not None),
            "cannot": self._cannot,
            "speed": SPEED,
        }


def _simulated(performer: Performer, id: int) -> Played:
    """Perform a primitive, and return what came of it."""
    nothing: Poses = np.empty((0, 0, 7), np.float32)
    try:
        verdict = performer.repertoire.skills.feasibility(id)
        if not verdict.feasible:
            return Played(id, nothing, problem=str(verdict.problems[0]))
        poses: list[Poses] = []
        step_s = performer.repertoire.skills.planner.config.period_s
        outcome = performer.perform(
            id,
            lambda: poses.append(_pose_of(performer.simulation)),
            max(1, round(1.0 / (SHOWN_HZ * step_s))),
        )
    except MPLearnError as error:
        return Played(id, nothing, problem=str(error))
    return Played(id, np.array(poses, np.float32), outcome.report.fallen)


def _pose_of(simulation: Simulation) -> Poses:
    data = simulation.data
    return np.concatenate((data.xpos[1:], data.xquat[1:]), axis=1, dtype=np.float32)


def _bodies(robot_xml: str) -> Header:
    """Return the shapes of both figures."""
    import mujoco

    return {
        "person": shapes_of(human_body().model()),
        "robot": shapes_of(mujoco.MjModel.from_xml_string(robot_xml)),
    }


def _number(asked: Header, key: str) -> int:
    value = asked.get(key)
    if type(value) is not int or not 0 <= value < 2**32:
        raise InvalidValueError(f"{key} must be a whole number, not {value!r:.40}")
    return value
