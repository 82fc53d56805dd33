"""What the page shows: the last that was heard, and who looks at it."""

from __future__ import annotations

import asyncio
import itertools
from collections import OrderedDict, deque

import numpy as np

from mplearn.errors import MPLearnError

from . import messages
from .happenings import happening
from .messages import Header, Poses, as_text, literal
from .performing import perform
from .teaching import COMMANDS
from .watching import Watch, watch
from .workers import Worker

TICK_S = 1.0 / 40.0
SHOWN_S = 10.0  # of the stream, for who has just come
MOST_SEGMENTS, MOST_EVENTS = 80, 200
MOST_BEHIND = 400  # messages that wait for a client before it is told all anew
_ROWS = 2048  # of the stream that are kept, 50 a second
_NO_POSE: Poses = np.empty((0, 7), np.float32)
#: What a page may ask of the learner, and of the robot.
LEARNER = {*COMMANDS, "undo", "redo", "history", "show"}
ROBOT = {"perform", "walk", "path", "stop"}


class Client:
    """One page that looks on.

    Of what is only worth knowing as it is now, it gets the latest as fast as it reads; what happens
    is told in order. Neither waits for it.

    Attributes:
        number: Counted from 1.
        changed: Set when there is something to send.
    """

    def __init__(self, number: int) -> None:
        self.number = number
        self.changed = asyncio.Event()
        self.row = 0  # first row of the stream that was not sent
        self._latest: OrderedDict[str, str] = OrderedDict()
        self._told: deque[str | bytes] = deque()

    @property
    def behind(self) -> bool:
        """Whether so much waits that it should be told all anew."""
        return len(self._told) > MOST_BEHIND

    def forget(self) -> None:
        """Drop what waits."""
        self._told.clear()
        self._latest.clear()

    def tell(self, message: str | bytes) -> None:
        """Send what happened."""
        self._told.append(message)
        self.changed.set()

    def show(self, kind: str, message: str) -> None:
        """Send how something is now; what waits of the same kind is replaced."""
        self._latest[kind] = message
        self.changed.set()

    def take(self) -> list[str | bytes]:
        """Return what is to be sent now."""
        taken: list[str | bytes] = [*self._latest.values(), *self._told]
        self.forget()
        return taken


class Hub:
    """Hears the learner and the robot, and tells the clients.

    Args:
        settings: What is watched.
        robot: Whether a robot performs.

    Attributes:
        begun: Done when the source is open, or the learner ended before it was.
        failed: Done, with the reason, when the source cannot be opened at all.
        clients: Who looks on.
    """

    def __init__(self, settings: Watch, *, robot: bool = True) -> None:
        self.settings = settings
        loop = asyncio.get_running_loop()
        self.failed: asyncio.Future[str] = loop.create_future()
        self.begun: asyncio.Future[None] = loop.create_future()
        self.clients: set[Client] = set()
        self._numbers = itertools.count(1)
        self._latest: dict[str, Header] = {}
        self._segments: deque[Header] = deque(maxlen=MOST_SEGMENTS)
        self._events: deque[Header] = deque(maxlen=MOST_EVENTS)
        self._n_events = 0
        self._rows: Poses = np.zeros((_ROWS, 0), np.float32)
        self._n_rows = 0
        self._person, self._robot_pose = _NO_POSE, _NO_POSE
        self._learner = Worker("learner", watch, (settings,), self.hear, self._learner_ended)
        self._robot = (
            Worker("robot", perform, (), self.hear, self._robot_ended, grace_s=0.2)  # keeps nothing
            if robot
            else None
        )
        self._state = {"learner": "starting", "robot": "starting" if robot else "none"}

    @property
    def pids(self) -> dict[str, int | None]:
        """Number of each process beside this one."""
        workers = [self._learner] + ([self._robot] if self._robot else [])
        return {worker.name: worker.pid for worker in workers}

    @property
    def behind_s(self) -> float:
        """How much of the stream waits to be learned, as was heard last [s]."""
        return float(self._latest.get("status", {}).get("behind_s", 0.0))

    def start(self) -> None:
        """Start the processes."""
        self._learner.start()
        if self._robot is not None:
            self._robot.start()

    async def close(self) -> None:
        """End the processes."""
        workers = [self._learner] + ([self._robot] if self._robot else [])
        await asyncio.gather(*(worker.close() for worker in workers))

    # ---- clients

    def enter(self) -> Client:
        """Let somebody look on: all is told, then what comes."""
        client = Client(next(self._numbers))
        self.clients.add(client)
        self.tell_all(client)
        self._tell_processes()
        return client

    def leave(self, client: Client) -> None:
        """Let somebody go."""
        self.clients.discard(client)
        self._tell_processes()

    def tell_all(self, client: Client) -> None:
        """Tell a client all that there is to know."""
        client.forget()
        hello = {"kind": "hello", "you": client.number}
        client.show("hello", as_text(hello))
        for kind, header in self._latest.items():
            client.show(kind, as_text(header))
        happened = {"segments": list(self._segments), "events": list(self._events)}
        client.show("past", as_text({"kind": "past"} | happened))
        client.row = max(0, self._n_rows - round(SHOWN_S * 50))

    def tick(self, client: Client) -> bytes:
        """Return what moves, as it is now, with the rows that the client has not got."""
        first = max(client.row, self._n_rows - _ROWS)
        client.row = self._n_rows
        rows = self._rows[np.arange(first, self._n_rows) % _ROWS]
        return messages.tick(self._person, self._robot_pose, first, rows)

    def ask(self, client: Client, text: str) -> None:
        """Pass on what a client asks for."""
        asked: Header = {}
        try:
            asked = messages.request(text)
            what = asked["do"]
            asked |= {"kind": "ask", "client": client.number}
            asked["by"] = _who(asked.get("by"), client)
            if what in LEARNER:
                self._learner.send(asked)
            elif what in ROBOT and self._robot is not None:
                self._robot.send(asked)
            elif what in ROBOT:
                raise MPLearnError("there is no robot here")
            else:
                raise MPLearnError(f"nobody knows how to {what[:40]!r}")
        except MPLearnError as error:
            reply = {"kind": "reply", "ref": asked.get("ref"), "ok": False, "text": literal(error)}
            client.tell(as_text(reply))

    # ---- processes

    def hear(self, header: Header, blob: bytes = b"") -> None:
        """Take what a process says."""
        match header["kind"]:
            case "live":
                self._take_live(header, blob)
            case "robot-pose":
                self._robot_pose = np.frombuffer(blob, np.float32).reshape(-1, 7)
                self._wake()
            case "library":
                if self._robot is not None:
                    self._robot.send(header, blob)
            case "undelivered":
                self._learner.send({"do": "forget-deliveries"})
            case "clip" | "reply":
                self._pass_on(header, blob)
            case "failed":
                self._fail(header["text"])
            case "event":
                self._happened(header)
            case "segment":
                self._segments.append(header)
                self._tell(header)
            case "person":  # who watches knows what a person looks like, also where no robot is
                known = self._latest.get("bodies", {"robot": []})
                self._show(known | {"kind": "bodies", "person": header["shapes"]})
            case "bodies":
                self._set("robot", "there")
                self._learner.send({"do": "forget-deliveries"})
                self._show(header)
            case "stream":
                self._begin(header)
                self._show(header)
            case "status":
                if self._state["learner"] != "there":
                    self._set("learner", "there")
                    self._has_begun()
                self._show(header)
            case _:
                self._show(header)

    def _take_live(self, header: Header, blob: bytes) -> None:
        n_pose = header["bodies"] * 7
        values = np.frombuffer(blob, np.float32)
        self._person = values[:n_pose].reshape(-1, 7)
        rows = values[n_pose:].reshape(header["n"], -1)
        if rows.shape[1] != self._rows.shape[1]:
            self._rows = np.zeros((_ROWS, rows.shape[1]), np.float32)
        kept = rows[-_ROWS:]
        self._n_rows = header["first"] + len(rows)
        self._rows[np.arange(self._n_rows - len(kept), self._n_rows) % _ROWS] = kept
        self._wake()

    def _begin(self, header: Header) -> None:
        """Begin another stream: rows and segments are counted anew."""
        self._learner.settled()
        self._n_rows = 0
        self._segments.clear()
        for client in self.clients:
            client.row = 0

    def _pass_on(self, header: Header, blob: bytes) -> None:
        for client in self.clients:
            if client.number == header["client"]:
                client.tell(blob if header["kind"] == "clip" else as_text(header))

    def _fail(self, text: str) -> None:
        """Take note that the source cannot be opened: at the beginning that is the end."""
        if "stream" not in self._latest and not self.failed.done():
            self.failed.set_result(text)
        self._happened(happening("source", literal(text), 0.0))

    def _has_begun(self) -> None:
        if not self.begun.done():
            self.begun.set_result(None)

    def _learner_ended(self, reason: str) -> None:
        self._has_begun()
        self._person = _NO_POSE
        self._set("learner", "stopped")
        then = "it goes on from the store" if self.settings.store else "it begins anew"
        self._happened(happening("process", f"the learner stopped ({reason}): {then}", 0.0))

    def _robot_ended(self, reason: str) -> None:
        self._robot_pose = _NO_POSE
        self._set("robot", "stopped")
        self._happened(happening("process", f"the robot stopped ({reason}), and begins anew", 0.0))

    def _set(self, name: str, state: str) -> None:
        self._state[name] = state
        self._tell_processes()

    def _tell_processes(self) -> None:
        self._show({"kind": "processes", "clients": len(self.clients)} | self._state)

    # ---- telling

    def _happened(self, header: Header) -> None:
        self._n_events += 1
        header = header | {"seq": self._n_events}
        self._events.append(header)
        self._tell(header)

    def _tell(self, header: Header) -> None:
        text = as_text(header)
        for client in self.clients:
            if client.behind:
                self.tell_all(client)
            else:
                client.tell(text)

    def _show(self, header: Header) -> None:
        self._latest[header["kind"]] = header
        text = as_text(header)
        for client in self.clients:
            client.show(header["kind"], text)

    def _wake(self) -> None:
        for client in self.clients:
            client.changed.set()


def _who(name: object, client: Client) -> str:
    """Return who asks: the name given, if it is one."""
    if isinstance(name, str) and name.strip() and name.isprintable() and len(name) <= 40:
        return name.strip()
    return f"teacher {client.number}"
