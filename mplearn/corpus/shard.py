"""A shard: some takes, learned one after the other into a store, taken up again where it died."""

from __future__ import annotations

import errno
import json
import multiprocessing
import os
import resource
import signal
import threading
import time
import warnings
from collections import Counter
from collections.abc import Iterator, Mapping
from contextlib import contextmanager, suppress
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from ..errors import (
    MPLearnError,
    RecordingError,
    StoreError,
    StoreInUseError,
    StoreWarning,
    StoreWriteError,
)
from ..learner import Event, FramesLost, LearnerConfig, MotionLearner
from ..mocap import TakeFiles
from ..recording import Recording
from ..store import LifelongLearner, Store
from ..store.life import source_key
from .reading import Reading

DEATHS = 2  # of the process, while it learns a take, after which that take is left out
_AT_ONCE = 100  # frames between two looks at whether to stop
_PATIENCE_S = 20.0
_CHECKPOINT_S = 300.0  # of stream that may be learned again after a death


@dataclass(frozen=True)
class ShardTask:
    """What a worker needs to learn a shard, on this machine or on another that sees the files.

    Attributes:
        store: Where it is learned into.
        takes: What is learned, in order.
        reading: How takes become streams.
        config: Of the learner.
        stop: A file; once there is one, learning stops.
    """

    store: Path
    takes: tuple[TakeFiles, ...]
    reading: Reading
    config: LearnerConfig
    stop: Path


@dataclass(frozen=True)
class ShardReport:
    """What came of a shard so far.

    Attributes:
        learned: Names of takes that were learned.
        refused: Why not, by name, for those that could not be.
        watched_s: Length of what was learned [s].
        learning_s: Time that it took, reading included [s].
        keys: What each is known by in a store (`mplearn.store.life.source_key`).
        take_s: Time that each take took, in the order in which they were learned [s].
        primitives: Number of primitives known.
        memory_bytes: Most memory that the process ever had [byte].
        deaths: How often a process died while it learned here.

    Example:
        >>> report = ShardReport(learned=("bow",), refused={"torn": "ends in frame 7"})
        >>> len(report.learned), report.refused["torn"]
        (1, 'ends in frame 7')
    """

    learned: tuple[str, ...] = ()
    refused: Mapping[str, str] = field(default_factory=dict)
    watched_s: float = 0.0
    learning_s: float = 0.0
    keys: tuple[str, ...] = ()
    take_s: tuple[float, ...] = ()
    primitives: int = 0
    memory_bytes: int = 0
    deaths: int = 0


class ShardJournal:
    """What was done of a shard, a line for each take, beside its store: others read it meanwhile.

    A take stands in it once its motion is in the store, so a take that stands here needs not be
    read again. The last that was begun is in a worker's hands, and is until another is begun, for
    that one had to wait for the store; of every other that was begun and not ended, one died.

    Args:
        store: The store that it lies beside.
    """

    def __init__(self, store: Path) -> None:
        self.path = store.with_suffix(".jsonl")
        self._read, self._torn = 0, ""
        self._begun: Counter[str] = Counter()
        self._why: dict[str, str] = {}
        self._done: dict[str, dict[str, Any]] = {}
        self._in_hand = False
        self._begun_at = 0  # where the last line begins that says so
        self.refresh()

    def refresh(self) -> None:
        """Take note of what was written since."""
        try:
            with self.path.open(encoding="utf-8") as file:
                file.seek(self._read)
                text = self._torn + file.read()
                self._read = file.tell()
        except FileNotFoundError:
            return
        *lines, self._torn = text.split("\n")
        for line in lines:
            try:
                entry = json.loads(line)
            except ValueError:  # torn by a death in the middle of a line
                continue
            self._in_hand = entry["what"] == "begun"
            if self._in_hand:
                self._begun[entry["take"]] += 1
            elif entry["what"] == "stopped":
                self._begun[entry["take"]] -= 1
            elif entry["what"] == "failed":
                self._why[entry["take"]] = entry["why"]
            else:
                self._done[entry["take"]] = entry
                self._begun[entry["take"]] -= entry["what"] != "left out"

    def is_done(self, take: str) -> bool:
        """Whether a take was learned, or refused."""
        return take in self._done

    def deaths(self, take: str) -> int:
        """Return how often a process died while it learned a take."""
        return self._begun[take]

    def why(self, take: str) -> str:
        """Return why a take is left out at which processes died."""
        reason = self._why.get(take, "the process ended each time")
        return f"learning it was tried {self.deaths(take)} times: {reason}"

    def write(self, what: str, take: str, **rest: Any) -> None:
        """Write a line: all of it with one call, so that no other line tears it.

        Raises:
            StoreWriteError: It cannot be written, and is not there.
        """
        line = json.dumps({"what": what, "take": take, **rest}, ensure_ascii=True)
        try:
            torn = self.path.exists() and self.path.read_bytes()[-1:] not in (b"", b"\n")
            text = f"{chr(10) if torn else ''}{line}\n".encode()
            with self.path.open("ab", buffering=0) as file:
                before = file.tell()
                written = file.write(text)
                if written < len(text):
                    file.truncate(before)
                    raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))
        except OSError as error:
            raise StoreWriteError(f"{self.path} cannot be written: {error.strerror}") from error
        if what == "begun":
            self._begun_at = before

    def take_back(self, take: str) -> None:
        """Take note that a take that was begun last is not learned, through no fault of its own."""
        try:
            self.write("stopped", take)
        except StoreWriteError:  # no room: the line that says that it was begun goes
            with suppress(OSError):
                os.truncate(self.path, self._begun_at)

    def report(self) -> ShardReport:
        """Return what came of the shard so far."""
        learned = {name: each for name, each in self._done.items() if each["what"] == "learned"}
        refused = {name: each for name, each in self._done.items() if name not in learned}
        latest = next(reversed(learned.values()), {})
        return ShardReport(
            learned=tuple(learned),
            refused={name: each["why"] for name, each in refused.items()},
            watched_s=sum(each["watched_s"] for each in learned.values()),
            learning_s=sum(each["took_s"] for each in learned.values()),
            keys=tuple(key for each in learned.values() for key in each["keys"]),
            take_s=tuple(each["took_s"] for each in learned.values()),
            primitives=latest.get("primitives", 0),
            memory_bytes=max((each["memory"] for each in learned.values()), default=0),
            deaths=sum(self._begun.values()) - self._in_hand,
        )


def learn_shard(task: ShardTask) -> ShardReport:
    """Learn what of a shard is not learned yet; return what came of it.

    A take that cannot be read or learned is refused, with the reason, and costs nothing else; so is
    one at which the process died `DEATHS` times.

    Raises:
        StoreError: The store cannot be opened or written.
    """
    journal = ShardJournal(task.store)
    left = [take for take in task.takes if not journal.is_done(take.name)]
    if not left:
        return journal.report()
    life = _opened(task)
    journal.refresh()  # an earlier worker may have ended its take since
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", StoreWarning)  # what cannot be written is an error here
            for take in left:
                if not journal.is_done(take.name) and not _learn_take(life, take, task, journal):
                    break
    except BaseException:  # what is known may be half of something: the log alone is kept
        if isinstance(life.store, Store):
            store, life.store = life.store, None
            store.close()
        raise
    life.close()
    journal.refresh()
    return journal.report()


def _opened(task: ShardTask) -> LifelongLearner:
    """Open the store; where an earlier worker is about to end with its parent, wait for that."""
    patience = time.monotonic() + _PATIENCE_S
    while True:
        try:
            return LifelongLearner.open(
                task.store, lambda: MotionLearner(task.config), checkpoint_s=_CHECKPOINT_S
            )
        except StoreInUseError:
            if time.monotonic() > patience:
                raise
            time.sleep(0.2)


def _learn_take(
    life: LifelongLearner, take: TakeFiles, task: ShardTask, journal: ShardJournal
) -> bool:
    """Learn a take, and write what came of it; say whether to go on."""
    if journal.deaths(take.name) >= DEATHS:
        journal.write("left out", take.name, why=journal.why(take.name))
        return True
    journal.write("begun", take.name)
    try:
        return _learn_begun(life, take, task, journal)
    except StoreError:
        journal.take_back(take.name)
        raise


def _learn_begun(
    life: LifelongLearner, take: TakeFiles, task: ShardTask, journal: ShardJournal
) -> bool:
    began = time.perf_counter()
    try:
        with _ended_on_purpose(journal, take.name):
            watched = _learn(life, take, task)
    except StoreError:
        raise
    except MPLearnError as error:
        life.end_stream()
        journal.write("refused", take.name, why=str(error))
        return True
    except Exception as error:
        journal.write("failed", take.name, why=f"{type(error).__name__}: {error}")
        raise
    if watched is None:
        journal.write("stopped", take.name)
        return False
    life.flush()
    journal.write(
        "learned",
        take.name,
        keys=[source_key(each) for each in watched],
        watched_s=sum(each.duration_s for each in watched),
        took_s=time.perf_counter() - began,
        primitives=len(life.learner.tree.leaves),
        memory=most_memory(),
    )
    return True


@contextmanager
def _ended_on_purpose(journal: ShardJournal, take: str) -> Iterator[None]:
    """While this lasts, a worker that is told to end (SIGTERM) did not die of the take."""

    def end(number: int, frame: object) -> None:
        journal.take_back(take)
        os._exit(128 + number)  # nothing is closed on the way: what is known may be half of it

    worker = multiprocessing.parent_process() is not None
    if not worker or threading.current_thread() is not threading.main_thread():
        yield
        return
    before = signal.signal(signal.SIGTERM, end)
    try:
        yield
    finally:
        signal.signal(signal.SIGTERM, before)


def _learn(life: LifelongLearner, take: TakeFiles, task: ShardTask) -> tuple[Recording, ...] | None:
    """Learn a take; return its streams, or None where it was stopped in the middle."""
    streams = task.reading.streams(take, task.config)
    for recording in streams:
        lost, why = 0, ""
        already = life.taken(recording)
        for events in life.learn_recording(recording, _AT_ONCE):
            for event in _lost(events):
                lost, why = lost + event.end - event.start, event.reason
            if task.stop.exists():
                return None
        if lost == len(recording) - already > 0:
            raise RecordingError(why)
    return streams


def _lost(events: list[Event]) -> list[FramesLost]:
    return [event for event in events if isinstance(event, FramesLost)]


def most_memory() -> int:
    """Return the most memory that this process ever had [byte]."""
    kilobytes = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    return int(kilobytes) * (1 if os.uname().sysname == "Darwin" else 1024)
