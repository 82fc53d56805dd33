"""The process that performs: the humanoid in MuJoCo.

What it does is simulated in a thread of its own (`robot`), while its poses are shown at its pace.
"""

from __future__ import annotations

import signal
import time
from collections import deque
from concurrent.futures import Future
from multiprocessing.connection import Connection

from mplearn.body import human_body
from mplearn.errors import InvalidValueError, MPLearnError
from mplearn.library import PrimitiveLibrary
from mplearn_envs.execution.simulation import Simulation
from mplearn_envs.robot import humanoid

from .figures import shapes_of
from .happenings import happening
from .messages import Header, Poses, literal, mention, number, unpack
from .outbox import Outbox
from .robot import SHOWN_HZ, SPEED, PageRobot, Performed, pose_of
from .shelf import Receiver

MOST_ASKED = 64  # primitives that wait to be performed
_AHEAD = 5  # frames that are simulated before they are shown
_STATUS_S = 0.25


def perform(connection: Connection) -> None:
    """Perform until the other end of the connection is closed: what a process runs."""
    for each in (signal.SIGINT, signal.SIGTERM):  # who serves the page ends it
        signal.signal(each, signal.SIG_IGN)
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
        body = humanoid()
        simulation = Simulation(body)
        simulation.reset()
        self._standing = pose_of(simulation)
        self._xml = body.xml
        self._robot = PageRobot(body)
        self._asked: deque[int] = deque()
        self._steps_left = 0  # of a walk
        self._paths: list[tuple[int, Future[list[int]], Header]] = []  # that are looked for
        self._next: Performed | None = None
        self._playing: Performed | None = None
        self._frame = 0
        self._status_at = 0.0
        self._ended = False

    def run(self) -> None:
        """Perform until nobody listens any more."""
        self._outbox.post({"kind": "bodies"} | _bodies(self._xml))
        self._pose(self._standing)
        self._robot.warm_up()
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
        self._robot.close()

    # ---- what comes

    def _take(self, header: Header, blob: bytes) -> None:
        if header["kind"] == "end":
            self._ended = True
            return
        if header["kind"] == "library":
            try:
                self._library = self._receiver.receive(header["content"], blob)
                self._robot.renew(self._library)
            except MPLearnError:  # this process is newer than the learner
                self._outbox.post({"kind": "undelivered"})
            return
        reply = {"kind": "reply", "client": header.get("client"), "ref": header.get("ref")}
        try:
            text = self._do(header, reply)
            if text:
                self._outbox.post(reply | {"ok": True, "text": text})
        except MPLearnError as error:
            self._outbox.post(reply | {"ok": False, "text": literal(error)})
        self._status_at = 0.0

    def _do(self, asked: Header, reply: Header) -> str:
        """Do what a teacher asks, and return what will be done; nothing where that comes later.

        Raises:
            MPLearnError: It cannot be done.
        """
        library = self._library
        if asked["do"] == "stop":
            self._queue([])
            return "the robot stops after this"
        if library is None or not len(library):
            raise InvalidValueError("nothing is learned yet: there is nothing to perform")
        if self._robot.cannot:
            raise InvalidValueError(f"the robot can perform nothing of this: {self._robot.cannot}")
        match asked["do"]:
            case "perform":
                id = library[number(asked, "id")].id
                self._queue([id])
                return f"the robot performs {mention(id)}"
            case "walk":
                length = number(asked, "length")
                if not 1 <= length <= MOST_ASKED:
                    raise InvalidValueError(f"a walk has 1 to {MOST_ASKED} steps, not {length}")
                self._queue([], length)
                return f"the robot walks {length} steps"
            case "path":
                goal = library[number(asked, "id")].id
                self._paths.append((goal, self._robot.path(goal), reply))
                return ""
            case other:
                raise InvalidValueError(f"nobody knows how to {other[:40]!r}")

    def _queue(self, ids: list[int], steps: int = 0) -> None:
        """Let the robot do this next, and nothing else of what it was asked."""
        self._asked = deque(ids[:MOST_ASKED])
        self._steps_left = steps

    # ---- what the robot does

    def _tick(self) -> None:
        """Show the next frame, and see that there is one after it."""
        if self._robot.broken is not None:
            raise self._robot.broken  # another process begins anew
        self._take_paths()
        playing = self._playing
        if playing is not None:
            if self._frame + 1 < len(playing.poses):
                self._frame += 1
            elif playing.done:
                self._finished(playing)
        if self._playing is None and self._next is not None:
            self._start(self._next)
        if self._next is None:
            self._simulate()
        if self._playing is not None:
            self._pose(self._playing.poses[self._frame])
        self._robot.prepare()
        now = time.monotonic()
        if now - self._status_at > _STATUS_S:
            self._status_at = now
            self._outbox.post(self._status(), key="status")

    def _take_paths(self) -> None:
        """Let the robot go where a way was found, and say so."""
        while self._paths and self._paths[0][1].done():
            goal, found, reply = self._paths.pop(0)
            try:
                path = found.result()
            except MPLearnError as error:
                text = f"{mention(goal)}: {literal(error)}"
                self._outbox.post(reply | {"ok": False, "text": text})
                continue
            self._queue(path)
            text = "the robot goes " + " → ".join(mention(id) for id in path)
            self._outbox.post(reply | {"ok": True, "text": text})

    def _pose(self, pose: Poses) -> None:
        self._outbox.post({"kind": "robot-pose", "bodies": len(pose)}, pose.tobytes(), "pose")

    def _start(self, performed: Performed) -> None:
        """Begin to show what is simulated, if enough of it is there."""
        if not performed.done and len(performed.poses) < _AHEAD:
            return
        self._next = None
        if performed.problem:
            what = "walk on" if performed.id is None else f"perform {mention(performed.id)}"
            text = f"the robot cannot {what}: {literal(performed.problem)}"
            self._outbox.post(happening("robot", text, 0.0, performed.id))
            self._queue([], 0 if performed.id is None else self._steps_left)
            return
        if performed.poses:
            self._playing, self._frame = performed, 0
            self._status_at = 0.0

    def _finished(self, performed: Performed) -> None:
        self._playing = None
        self._status_at = 0.0
        if performed.fallen:
            text = f"the robot fell at {mention(performed.id)}; it stands up"
            self._outbox.post(happening("robot", text, 0.0))
            self._queue([])
            self._next = None  # it was simulated from where the robot lay
            self._robot.reset()
            self._pose(self._standing)

    def _simulate(self) -> None:
        """Begin to simulate what is asked next, if there is something."""
        if self._asked:
            self._next = self._robot.perform(self._asked.popleft())
        elif self._steps_left > 0:
            self._steps_left -= 1
            self._next = self._robot.perform(None)

    def _status(self) -> Header:
        playing = self._playing
        return {
            "kind": "robot",
            "primitive": None if playing is None else playing.id,
            "left": len(self._asked) + self._steps_left + (self._next is not None),
            "cannot": self._robot.cannot,
            "speed": SPEED,
        }


def _bodies(robot_xml: str) -> Header:
    """Return the shapes of both figures."""
    import mujoco

    return {
        "person": shapes_of(human_body().model()),
        "robot": shapes_of(mujoco.MjModel.from_xml_string(robot_xml)),
    }
