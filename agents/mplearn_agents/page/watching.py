"""The process that watches and learns: a live source in, what is known and what happens out."""

from __future__ import annotations

import itertools
import math
import os
import queue
import signal
import threading
import time
import warnings
from collections import deque
from contextlib import suppress
from dataclasses import dataclass
from multiprocessing.connection import Connection
from pathlib import Path
from typing import Any, TextIO

import numpy as np

from mplearn.body import human_body
from mplearn.demonstrator import demonstrate
from mplearn.errors import InvalidValueError, MPLearnError, RecordingWarning, StoreWarning
from mplearn.learner import LearnerConfig, MotionLearner, learnable_rate
from mplearn.library import PrimitiveLibrary
from mplearn.sources import Block, BufferedSource, Change, Observe, open_source
from mplearn.store import LifelongLearner, Store
from mplearn.tree import PrimitiveTree, TreeConfig
from mplearn_agents.learning.pauses import short_pauses
from mplearn_agents.learning.waiting import waiting_for_learner

from .figures import CLIP_HZ, motions_of, shapes_of
from .happenings import happening, tell
from .knowledge import knowledge
from .messages import Header, brief, clip, literal, mention, number, unpack
from .outbox import Message, Outbox
from .shelf import Sender
from .teaching import do, history
from .watched_figure import WatchedFigure

STATUS_S, KNOWLEDGE_S = 0.25, 0.2
_WARM_UP = ("BAR", "BAL") * 4
_KINDS = 14  # more primitives than are compared one by one
_TEACHERS, _STREAM = 0, 1  # who comes first
_FORESEEN, _TOLD = 8, 3  # motions that may come next: looked at, and told
_TOLD_UNDOABLE = 10  # commands, the latest: more do not stand on a page
_DELAYS = 500  # frames over which the delay is measured


@dataclass(frozen=True)
class Watch:
    """What is watched.

    Attributes:
        source: See `mplearn.sources.open_source`.
        observe: What is learned: see `mplearn.sources.open_source`.
        speed: Times as fast as it was recorded; None for what the source does.
        store: File in which all is kept; empty for memory alone.
    """

    source: str
    observe: Observe = "robot"
    speed: float | None = None
    store: str = ""


def watch(settings: Watch, connection: Connection) -> None:
    """Watch and learn until the other end of the connection is closed: what a process runs."""
    for each in (signal.SIGINT, signal.SIGTERM):  # who serves the page ends it
        signal.signal(each, signal.SIG_IGN)
    outbox = Outbox(connection)
    try:
        Watcher(settings, connection, outbox).run()
    except MPLearnError as error:
        outbox.post({"kind": "failed", "text": str(error)})
    finally:
        outbox.close()


class Watcher:
    """Learns from a source, does what teachers ask, and says what is known.

    Args:
        settings: What is watched.
        connection: Where requests come from.
        outbox: Where messages go.
    """

    def __init__(self, settings: Watch, connection: Connection, outbox: Outbox) -> None:
        self._settings, self._connection, self._outbox = settings, connection, outbox
        self._inbox: queue.PriorityQueue[tuple[int, int, str, Any]] = queue.PriorityQueue()
        self._numbers = itertools.count()
        self._lifelong: LifelongLearner | None = None
        self._library: PrimitiveLibrary | None = None  # what was told last
        self._figure: WatchedFigure | None = None
        self._source: BufferedSource | None = None
        self._over = False  # nothing more will come of it
        self._rate_hz = 0.0
        self._sender = Sender()
        self._told_revision = -1
        self._told_at = self._status_at = 0.0
        self._delays: deque[float] = deque(maxlen=_DELAYS)
        self._arrivals: deque[tuple[float, int]] = deque(maxlen=_DELAYS)
        self._doubled = self._late = 0
        self._state = "compiling, which takes a while the first time"
        self._last_motion = -1  # frame at which the last motion began
        self._rows: list[np.ndarray[Any, Any]] = []
        self._n_rows = 0
        self._lock = threading.Lock()

    def run(self) -> None:
        """Watch until nobody listens any more.

        Raises:
            MPLearnError: The source cannot be opened.
        """
        warnings.simplefilter("always")
        warnings.showwarning = self._warned
        settings = self._settings
        options: dict[str, Any] = {} if settings.speed is None else {"speed": settings.speed}
        try:
            if settings.store and Path(settings.store).exists():
                self._lifelong = LifelongLearner.open(settings.store)
                self._rate_hz = self._lifelong.learner.config.rate_hz
            source = open_source(
                settings.source,
                observe=settings.observe,
                at_hz=self._rate_hz or learnable_rate,
                **options,
            )
            with source:
                self._outbox.post(self._status(), key="status")
                _warm_up()
                with waiting_for_learner(
                    source,
                    speed=settings.speed,
                    beside=Path(settings.store) if settings.store else None,
                    arrived=self._arrived,
                ) as buffered:
                    self._watch(buffered)
        finally:
            if self._lifelong is not None:
                self._lifelong.close()

    def _watch(self, source: BufferedSource) -> None:
        self._source = source
        self._state = "waiting for frames"
        threading.Thread(target=self._read_requests, daemon=True).start()
        with short_pauses():
            while self._step():
                pass
        self._outbox.post(self._status(), key="status")

    # ---- threads that read

    def _arrived(self) -> None:
        self._put(_STREAM, "stream")

    def _read_requests(self) -> None:
        try:
            while True:
                self._put(_TEACHERS, "request", unpack(self._connection.recv_bytes())[0])
        except (EOFError, OSError):
            self._put(_TEACHERS, "closed")

    def _put(self, before: int, what: str, item: Any = None) -> None:
        """Let something wait its turn; what teachers ask comes before the stream."""
        self._inbox.put((before, next(self._numbers), what, item))

    # ---- one thing after the other

    def _step(self) -> bool:
        """Do the next thing; say whether to go on."""
        try:
            _, _, what, item = self._inbox.get(timeout=STATUS_S)
        except queue.Empty:
            what, item = "", None
        match what:
            case "closed":
                return False
            case "request":
                self._answer(item)
            case "stream":
                self._take()
        now = time.monotonic()
        if now - self._told_at > KNOWLEDGE_S:
            self._told_at = now
            self._tell_knowledge()
        if now - self._status_at > STATUS_S:
            self._status_at = now
            self._outbox.post(self._status(), key="status")
        return not self._outbox.broken

    def _take(self) -> None:
        """Take what the source has, and look for more after what came before that."""
        source = self._source
        assert source is not None
        if self._over:
            return
        try:
            items = source.read(0.0)
        except Exception as error:  # of a source of somebody else
            self._over, self._state = True, "broken"
            self._happened("source", literal(f"the source broke: {error}"))
            return
        for item in items:
            if isinstance(item, Block):
                self._try(item)
            else:
                self._changed(item)
        if source.n_waiting:
            self._arrived()
        elif source.ended:
            self._end()

    def _try(self, block: Block) -> None:
        """Learn from a block; one that cannot be learned from costs nothing else.

        Raises:
            MPLearnError: It is the first one: nothing can be learned from this source.
        """
        try:
            self._learn(block)
        except MPLearnError as error:
            if self._figure is None:
                raise
            self._happened("source", literal(f"{len(block)} frames were not learned: {error}"))

    def _learn(self, block: Block) -> None:
        if self._figure is None:
            self._begin(block)
        lifelong, figure = self._lifelong, self._figure
        assert lifelong is not None and figure is not None
        self._state = "live"
        if not block.joins and self._arrivals:
            self._tell(lifelong.end_stream())
            figure.end_stream()
        self._tell(lifelong.learn_many(block.frames))  # dated by the clock
        came = block.arrived_s[np.isfinite(block.arrived_s)]
        now = time.monotonic()
        self._delays.extend((now - came).tolist())
        self._arrivals.append((now, len(block)))
        self._doubled += block.doubled
        self._late += block.late
        rows = figure.take(block.frames).astype(np.float32)
        if len(rows):
            with self._lock:
                self._rows.append(rows)
            self._outbox.post_later(self._live, key="live")

    def _begin(self, block: Block) -> None:
        """Begin to learn, now that it is known what comes."""
        self._rate_hz = block.rate_hz
        if self._lifelong is None:
            self._lifelong = self._new(LearnerConfig(block.channels, block.rate_hz))
        else:
            self._tell(self._lifelong.begin_stream(block.channels))
        self._figure = WatchedFigure(block.channels, block.rate_hz)
        self._outbox.post({"kind": "person", "shapes": shapes_of(human_body().model())})
        self._outbox.post(
            {
                "kind": "stream",
                "source": self._settings.source,
                "channels": [brief(name) for name in self._figure.channels],
                "rate_hz": self._rate_hz,
                "stride": self._figure.stride,
                "frame": self._lifelong.learner.n_frames,
            }
        )
        self._told_revision = -1

    def _new(self, config: LearnerConfig) -> LifelongLearner:
        """Return a learner that knows nothing yet."""
        if self._settings.store:
            return LifelongLearner.open(self._settings.store, lambda: MotionLearner(config))
        return LifelongLearner(MotionLearner(config))

    def _warned(
        self,
        message: Warning | str,
        category: type[Warning],
        filename: str,
        lineno: int,
        file: TextIO | None = None,
        line: str | None = None,
    ) -> None:
        """Tell teachers of what would be printed where nobody looks."""
        if issubclass(category, StoreWarning | RecordingWarning):
            what = "store" if issubclass(category, StoreWarning) else "source"
            self._happened(what, literal(message))

    def _changed(self, change: Change) -> None:
        if change.kind in ("connected", "disconnected"):
            self._state = "live" if change.kind == "connected" else "disconnected"
        self._happened("source", literal(change.text))

    def _end(self) -> None:
        self._over, self._state = True, "ended"
        if self._lifelong is not None:
            self._tell(self._lifelong.end_stream())
        self._happened("source", "the stream has ended")

    # ---- what is said

    def _tell(self, events: list[Any]) -> None:
        if not events:
            return
        for message in tell(events, self._rate_hz):
            if message["kind"] == "segment" and message["state"] not in ("still", "refused"):
                self._last_motion = message["start"]
            self._outbox.post(message)
        self._tell_forecast()

    def _tell_forecast(self) -> None:
        """Say what comes next, and when."""
        assert self._lifelong is not None
        coming: dict[int | None, Header] = {}  # whatever has no primitive yet is one line of it
        for each in self._lifelong.learner.predict_next(_FORESEEN):
            at = self._last_motion + each.duration_s * self._rate_hz
            known = coming.setdefault(
                each.id,
                {
                    "id": each.id,
                    "p": 0.0,
                    "frame": round(at) if math.isfinite(at) and self._last_motion >= 0 else None,
                },
            )
            known["p"] = round(known["p"] + each.probability, 3)
        likeliest = sorted(coming.values(), key=lambda each: -each["p"])[:_TOLD]
        self._outbox.post({"kind": "forecast", "next": likeliest}, key="forecast")

    def _tell_knowledge(self) -> None:
        """Say what is known, if that has changed; where much has, only after some more blocks."""
        lifelong = self._lifelong
        if lifelong is None or lifelong.revision == self._told_revision:
            return
        if not lifelong.prepare_snapshot():
            self._told_at = 0.0
            return
        self._told_revision = lifelong.revision
        library, tree = lifelong.snapshot(), lifelong.learner.tree
        self._library = library
        waiting = tree.most_repeated()
        self._outbox.post(
            knowledge(library, tree)
            | {
                "revision": self._told_revision,
                "waiting": {
                    "n": waiting.n_unplaced,
                    "times": waiting.times,
                    "of": tree.config.min_exemplars,
                },
            }
        )
        content, blob = self._sender.send(library)
        self._outbox.post({"kind": "library", "content": content}, blob)

    def _status(self) -> Header:
        delays = sorted(self._delays)
        now = time.monotonic()
        recent = [(at, n) for at, n in self._arrivals if now - at < 2.0]
        span = now - recent[0][0] if len(recent) > 1 else 0.0
        tally = vars(self._source.tally) if self._source is not None else {}
        lifelong = self._lifelong
        return {
            "kind": "status",
            "source": self._settings.source if self._source is None else self._source.name,
            "state": self._state,
            "rate_hz": round(sum(n for _, n in recent[1:]) / span, 1) if span > 0 else 0.0,
            "delay_ms": round(1e3 * delays[len(delays) // 2], 1) if delays else None,
            "delay_99_ms": round(1e3 * delays[int(0.99 * len(delays))], 1) if delays else None,
            "behind_s": 0.0 if self._source is None else round(self._source.waiting_s, 1),
            "lost": tally.get("lost", 0),
            "faults": {name: n for name, n in tally.items() if n and name != "frames"},
            "frames": 0 if lifelong is None else lifelong.n_frames,
            "person": None if lifelong is None else lifelong.learner.person + 1,
            "people": 0 if lifelong is None else len(lifelong.learner.tree.people),
            "store": self._settings.store,
            "problem": self._problem(),
            "paused": False if lifelong is None else lifelong.learner.paused,
            "undoable": [] if lifelong is None else lifelong.reversible()[-_TOLD_UNDOABLE:],
            "redoable": [] if lifelong is None else lifelong.reversible(undone=True)[-1:],
            "entry": 0 if lifelong is None else lifelong.number - 1,
            "memory_mb": _memory_mb(),
        }

    def _problem(self) -> str:
        """Return why what is learned cannot be kept; empty where it can."""
        store = None if self._lifelong is None else self._lifelong.store
        problem = store.problem if isinstance(store, Store) else None
        return "" if problem is None else str(problem)

    def _live(self) -> Message | None:
        """Return the rows that were not sent yet, with the latest pose."""
        with self._lock:
            rows, self._rows = self._rows, []
        if not rows or self._figure is None:
            return None
        joined, pose = np.concatenate(rows), self._figure.pose
        first, self._n_rows = self._n_rows, self._n_rows + len(joined)
        header = {"kind": "live", "first": first, "n": len(joined), "bodies": len(pose)}
        return header, pose.tobytes() + joined.tobytes()

    def _happened(self, what: str, text: str, primitive: int | None = None) -> None:
        n = 0 if self._lifelong is None else self._lifelong.learner.n_frames
        time_s = n / self._rate_hz if self._rate_hz else 0.0
        self._outbox.post(happening(what, text, time_s, primitive))

    # ---- what teachers ask

    def _answer(self, asked: Header) -> None:
        if asked["do"] == "end":
            self._put(_TEACHERS, "closed")
            return
        if asked["do"] == "forget-deliveries":  # who performs begins anew
            self._sender.forget()
            self._told_revision = -1
            return
        reply = {"kind": "reply", "client": asked.get("client"), "ref": asked.get("ref")}
        try:
            if asked["do"] == "show":
                reply["text"] = self._show(asked)
            elif asked["do"] == "history":
                reply["lines"] = history(self._known(), asked)
            else:
                reply["text"], reply["entry"] = self._do(asked)
            self._outbox.post(reply | {"ok": True})
        except MPLearnError as error:
            self._outbox.post(reply | {"ok": False, "text": literal(error)})
        self._told_at = 0.0

    def _do(self, asked: Header) -> tuple[str, int]:
        """Do what a teacher asks, and return what was done, and the command's number.

        Raises:
            MPLearnError: It cannot be done.
        """
        lifelong = self._known()
        by = asked["by"]
        text, number = do(lifelong, asked, by)
        self._happened("command", f"{by}: {text}")
        self._tell_forecast()
        self._status_at = 0.0  # what can be undone is another
        return text, number

    def _show(self, asked: Header) -> str:
        """Send the figure of a primitive, with its demonstrations; return which it is."""
        if self._library is None:
            raise InvalidValueError("nothing is learned yet: there is nothing to show")
        id = number(asked, "id")
        blob = clip(number(asked, "ref"), CLIP_HZ, motions_of(self._library, id))
        self._outbox.post({"kind": "clip", "client": asked.get("client")}, blob)
        return mention(id)

    def _known(self) -> LifelongLearner:
        if self._lifelong is None:
            raise InvalidValueError("nothing has been seen yet: there is nothing to change")
        return self._lifelong


def _warm_up() -> None:
    """Learn from a demonstrator for a moment, so that all is compiled before the stream begins."""
    _warm_up_tree()
    demonstration = demonstrate(_WARM_UP, seed=0)
    recording = demonstration.recording
    learner = MotionLearner(LearnerConfig(recording.channels, recording.rate_hz))
    learner.learn_many(recording.frames)
    learner.predict_next(1)
    library = learner.snapshot()
    knowledge(library, learner.tree)
    motions_of(library, library.ids[0])
    WatchedFigure(recording.channels, recording.rate_hz).take(recording.frames)


def _warm_up_tree() -> None:
    """Let a small tree do what a tree does once it knows more, and what teachers ask of it."""
    rng = np.random.default_rng(0)
    tree = PrimitiveTree(TreeConfig(max_exemplars=4), 2, 50.0)
    t = np.linspace(0.0, 1.0, 30)[:, None]
    rises, turns = rng.normal(size=(2, _KINDS, 2))
    for n, kind in enumerate((*range(_KINDS), *range(_KINDS), *[0] * 12)):
        once = rises[kind] * np.sin(np.pi * t) ** 2 + turns[kind] * np.sin(2.0 * np.pi * t) ** 2
        if n >= 2 * _KINDS and n % 2:
            once += 0.2 * t**2  # two manners, which could be two motions
        tree.insert(once + 0.01 * rng.normal(size=once.shape))
    for id in tree.leaves[:2]:
        with suppress(InvalidValueError):
            tree.split(id)
    tree.merge(*tree.leaves[:2])


def _memory_mb() -> float:
    """Return the memory of this process [MB]; 0 where the system does not say."""
    try:
        with open("/proc/self/statm", encoding="ascii") as file:  # noqa: PTH123
            pages = int(file.read().split()[1])
    except OSError:
        return 0.0
    return round(pages * os.sysconf("SC_PAGE_SIZE") / 1e6, 1)
