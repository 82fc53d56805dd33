"""A corpus is learned in shards, each into a store of its own; these are merged as a tree.

Shards and the tree depend on the takes alone. So what comes out is the same, byte by byte, whatever
the number of workers, the order in which they are done, and how often they die on the way.
"""

from __future__ import annotations

import gc
import json
import os
import shutil
import threading
import time
from collections import Counter
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import FIRST_COMPLETED, Future, wait
from contextlib import contextmanager
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, TypeVar

from ..errors import (
    CorpusError,
    InvalidValueError,
    MPLearnError,
    RecordingError,
    StoreError,
    StoreWriteError,
)
from ..learner import LearnerConfig, MotionLearner
from ..learner.learner_state import FILES
from ..merging import merged_learner, merged_state
from ..mocap import TakeFiles, find_takes
from ..state import from_plain, to_plain
from ..store import learner_of
from ..threads import one_thread
from .dealing import SHARD_TAKES, Shard, deal
from .executors import Executor, room, workers
from .progress import Progress
from .reading import Reading, probe
from .shard import ShardJournal, ShardReport, ShardTask, learn_shard

_TRIES = 3  # of what dies without a trace of progress
_FAN_IN = 8  # of the tree of merging: few levels, as each reads and writes what it merges
_LOOK_S = 0.5  # between two looks at how far it is

T = TypeVar("T")


@dataclass(frozen=True, eq=False)
class Corpus:
    r"""What came of a corpus.

    Attributes:
        learner: What was learned of it all, and goes on learning; None where it was stopped.
        shards: How it was dealt.
        reports: What came of each shard.
        refused: Why not, by name, for takes that could not be learned.
        progress: How far it came.
        merging_s: Time that the merging took [s].

    Example:
        >>> from pathlib import Path
        >>> _ = Path("takes").mkdir(exist_ok=True)
        >>> rows = "".join(f"{k / 50:.2f},{k % 7}\n" for k in range(200))
        >>> _ = Path("takes", "slow.csv").write_text("time_s,elbow\n" + rows)
        >>> _ = Path("takes", "torn.csv").write_text("time_s,elbow\n0.1,up\n")
        >>> corpus = learn_corpus("takes", "takes-learned", jobs=0)
        >>> corpus.progress.learned, list(corpus.refused)
        (1, ['torn'])
    """

    learner: MotionLearner | None
    shards: tuple[Shard, ...]
    reports: tuple[ShardReport, ...]
    progress: Progress
    merging_s: float

    @property
    def refused(self) -> dict[str, str]:
        """Why not, by name, for takes that could not be read or learned."""
        return dict(self.progress.refused)

    @property
    def keys(self) -> tuple[str, ...]:
        """What the takes are known by in a store: `LifelongLearner(learner, done=keys)`."""
        return tuple(key for report in self.reports for key in report.keys)


def learn_corpus(
    folder: str | os.PathLike[str],
    into: str | os.PathLike[str],
    *,
    reading: Reading | None = None,
    rate_hz: float | None = None,
    configure: Callable[[LearnerConfig], LearnerConfig] = lambda config: config,
    jobs: int = 1,
    executor: Executor | None = None,
    shard_takes: int = SHARD_TAKES,
    people: Sequence[str] = (),
    show: Callable[[Progress], object] = lambda progress: None,
    stop: threading.Event | None = None,
) -> Corpus:
    r"""Learn all recordings of a folder, and of the folders in it.

    Takes are dealt into shards by person where names of files or folders tell, each shard is
    learned into a store, and what they know is merged as a tree, in a fixed order. Stopped or
    killed at any moment, the same call goes on; takes that came since are learned, too.

    Where ``jobs`` is positive, a script needs ``if __name__ == "__main__":``, as everything
    that starts processes.

    Args:
        folder: The recordings.
        into: Folder in which stores, and what was done, are kept; made where there is none.
        reading: What of the takes is learned.
        rate_hz: Rate at which it is learned [1/s]; the usual one of the takes by default.
        configure: Returns the learner's configuration, given what `probe` found.
        jobs: Processes; 0 learns in this one.
        executor: Who does the work instead of processes of this machine.
        shard_takes: Most takes in a shard.
        people: Whose takes are learned; everybody's where there are none.
        show: Called about twice a second with how far it is.
        stop: Once it is set, learning stops: the result has no learner.

    Raises:
        RecordingError: There are no recordings, or none can be learned.
        InvalidValueError: ``into`` was made with other rules, or nobody can be given the work.
        CorpusError: Workers die, whatever they are given.
        StoreError: A store cannot be opened.
        StoreWriteError: A store, or what is beside it, cannot be written: the disk is full. Nothing
            that is finished is lost; the same call goes on once there is room.

    Example:
        >>> import numpy as np
        >>> from pathlib import Path
        >>> t = np.arange(600) / 50.0
        >>> swing = np.where(t % 2 < 1, np.sin(np.pi * t) ** 2, 0.0)
        >>> rows = "".join(f"{time:.2f},{value:.5f}\n" for time, value in zip(t, swing))
        >>> for person in ("anna", "ben"):
        ...     Path("swings", person).mkdir(parents=True, exist_ok=True)
        ...     _ = Path("swings", person, "slow.csv").write_text("time_s,elbow\n" + rows)
        >>> corpus = learn_corpus("swings", "swings-learned", jobs=0)
        >>> len(corpus.shards), corpus.progress.learned, len(corpus.learner.snapshot())
        (2, 2, 2)
    """
    folder, into = Path(folder).absolute(), Path(into).absolute()  # workers may be elsewhere
    reading = reading or Reading()
    own = workers(executor, jobs)
    found = find_takes(folder)
    takes = [take for take in found.takes if not people or take.person in people]
    if not takes:
        known = ", ".join(sorted({take.person or "a person unnamed" for take in found.takes}))
        raise RecordingError(f"no take of {' or '.join(people)} in {folder}; there are: {known}")
    try:
        into.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise StoreError(f"there cannot be a folder {into}: {error.strerror}") from error
    unreadable = {name: str(error) for name, error in found.unreadable.items()}
    try:
        with one_thread():
            plan = _planned(into, takes, reading, rate_hz, configure, shard_takes, own)
            run = _Run(into, takes, reading, plan, own, unreadable, show, stop or threading.Event())
            return run.result()
    finally:
        if executor is None:
            own.close()


@dataclass(frozen=True)
class _Plan:
    """What is learned by which rules, and how it is dealt: kept, so that it stays the same."""

    config: LearnerConfig
    shards: tuple[Shard, ...]


def _planned(
    into: Path,
    takes: Sequence[TakeFiles],
    reading: Reading,
    rate_hz: float | None,
    configure: Callable[[LearnerConfig], LearnerConfig],
    shard_takes: int,
    executor: Executor,
) -> _Plan:
    path = into / "plan.json"
    asked = _plain(reading)
    dealt: tuple[Shard, ...] = ()
    if path.exists():
        try:
            kept = json.loads(path.read_text(encoding="utf-8"))
            usual, config = (from_plain(LearnerConfig, kept[key]) for key in ("usual", "config"))
            dealt = tuple(Shard(str(who), tuple(names)) for who, names in kept["shards"])
        except (ValueError, KeyError, TypeError, MPLearnError) as error:
            raise InvalidValueError(f"{path} is damaged, or of something else: {error}") from error
        if rate_hz is not None:
            usual = replace(usual, rate_hz=rate_hz)
        if kept["reading"] != asked or configure(usual) != config:
            raise InvalidValueError(
                f"{into} was made by other rules ({path}): ask for the same, or take another folder"
            )
    else:
        usual = probe(takes, reading, rate_hz, executor)
        config = configure(usual)
    shards = deal(takes, shard_takes, dealt)
    if shards != dealt:
        content = {
            "usual": usual.to_dict(),
            "config": config.to_dict(),
            "reading": asked,
            "shards": shards,
        }
        temporary = path.with_suffix(".new")
        try:
            temporary.write_text(json.dumps(content, indent=1), encoding="utf-8")
            temporary.replace(path)
        except OSError as error:
            raise StoreWriteError(f"{path} cannot be written: {error.strerror}") from error
    return _Plan(config, shards)


def _plain(reading: Reading) -> dict[str, Any]:
    hints = {
        key: value if value is None else str(value) for key, value in vars(reading.hints).items()
    }
    names = None if reading.names is None else dict(reading.names)
    return {"observe": reading.observe, "hints": hints, "names": names}


class _Run:
    """One run over a corpus."""

    def __init__(
        self,
        into: Path,
        takes: Sequence[TakeFiles],
        reading: Reading,
        plan: _Plan,
        executor: Executor,
        unreadable: dict[str, str],
        show: Callable[[Progress], object],
        stop: threading.Event,
    ) -> None:
        self._into, self._plan, self._executor = into, plan, executor
        self._unreadable, self._show, self._stop = unreadable, show, stop
        self._began = time.monotonic()
        self._stop_file = into / "stop"
        self._stop_file.unlink(missing_ok=True)
        here = {take.name: take for take in takes}
        self._tasks = [
            ShardTask(
                into / f"{k:04d}.db",
                tuple(here[name] for name in shard.takes if name in here),
                reading,
                plan.config,
                self._stop_file,
            )
            for k, shard in enumerate(plan.shards)
        ]
        self._journals = [ShardJournal(task.store) for task in self._tasks]
        self._reports = [journal.report() for journal in self._journals]
        self._n_takes = len(takes) + len(unreadable)
        done = [*here.keys() & {n for r in self._reports for n in (*r.learned, *r.refused)}]
        self._already = len(done)
        self._done: set[int] = set()
        self._merged = 0

    def result(self) -> Corpus:
        """Learn and merge."""
        self._learn()
        began = time.monotonic()
        with _uncollected():
            learner = None if self._stop.is_set() else self._merge()
        merging_s = time.monotonic() - began
        progress = self._progress()
        self._show(progress)
        return Corpus(learner, self._plan.shards, tuple(self._reports), progress, merging_s)

    # ---- learning

    def _learn(self) -> None:
        def done(k: int, report: ShardReport) -> None:
            self._reports[k] = report
            self._done.add(k)

        def died(k: int) -> int:
            path = self._journals[k].path
            return path.stat().st_size if path.exists() else 0

        self._all(learn_shard, [(task,) for task in self._tasks], done, died)
        for k, journal in enumerate(self._journals):
            journal.refresh()
            self._reports[k] = journal.report()

    def _merge(self) -> MotionLearner | None:
        """Merge what the shards know: what is of one person first, by the workers; None if stopped.

        Only then exemplars are compared. The rest is put together here, where it is needed.
        """
        parts = [
            (shard.person, task.store)
            for shard, task, report in zip(
                self._plan.shards, self._tasks, self._reports, strict=True
            )
            if report.learned
        ]
        if not parts:
            refused = self._progress().refused
            name, why = next(iter(refused.items()))
            raise RecordingError(f"none of {len(refused)} takes can be learned; {name}: {why}")
        folder = self._into / "merged"
        depth = 0
        while len(groups := _by_person(parts)) > 1 and len(groups) < len(parts):
            parts = self._merged_groups(groups, folder / f"{depth}")
            depth += 1
        learners = []
        for k, (_, part) in enumerate(parts):
            if self._stop.is_set():
                return None
            learners.append(_learner_of(part))
            self._merged += k > 0
            self._show(self._progress())
        learner = merged_learner(learners, [person for person, _ in parts])
        shutil.rmtree(folder, ignore_errors=True)
        return learner

    def _merged_groups(
        self, groups: Sequence[tuple[str, tuple[Path, ...]]], folder: Path
    ) -> list[tuple[str, Path]]:
        """Have the parts of each group merged; return the person and the file of each."""
        folder.mkdir(parents=True, exist_ok=True)
        to = [
            own[0] if len(own) == 1 else folder / f"{k:04d}.mplearn"
            for k, (_, own) in enumerate(groups)
        ]
        several = [k for k, (_, own) in enumerate(groups) if len(own) > 1]

        def done(k: int, _: None) -> None:
            self._merged += len(groups[several[k]][1]) - 1

        self._all(
            merge_files, [(groups[k][1], to[k], groups[k][0]) for k in several], done, lambda k: 0
        )
        return [(person, path) for (person, _), path in zip(groups, to, strict=True)]

    # ---- doing

    def _all(
        self,
        work: Callable[..., T],
        tasks: Sequence[tuple[Any, ...]],
        done: Callable[[int, T], None],
        died: Callable[[int], int],
    ) -> None:
        """Have all tasks done, those again whose worker died, and say how far it is meanwhile.

        Whoever works beside one that dies is lost with it: what did nothing each time is tried at
        last with nothing beside it.

        ``died`` is told of the death, and returns a number that differs where anything was done.
        """
        tries: Counter[tuple[int, int]] = Counter()
        running: dict[Future[T], int] = {}
        waiting = list(reversed(range(len(tasks))))
        lost: list[int] = []
        while waiting or running or lost:
            self._look_at_stop()
            while waiting and len(running) < room(self._executor) and not self._stop.is_set():
                k = waiting.pop()
                future = self._executor.submit(work, *tasks[k])
                running[future] = k
                if future.done():  # by this process: the others can wait until that is seen
                    break
            if not running and lost and not self._stop.is_set():
                k = lost.pop()
                running[self._executor.submit(work, *tasks[k])] = k
            if not running:
                return
            for future in wait(running, _LOOK_S, FIRST_COMPLETED).done:
                k = running.pop(future)
                error = future.exception()
                if error is None:
                    done(k, future.result())
                    continue
                if isinstance(error, MPLearnError):
                    raise error
                trace = died(k)
                tries[k, trace] += 1
                if tries[k, trace] >= _TRIES:
                    raise CorpusError(
                        f"a worker died {_TRIES} times before it did anything: "
                        f"{type(error).__name__}: {error}"
                    ) from error
                (waiting if tries[k, trace] < _TRIES - 1 else lost).append(k)
            self._show(self._progress())

    def _look_at_stop(self) -> None:
        if self._stop.is_set():
            self._stop_file.touch()

    def _progress(self) -> Progress:
        for k, journal in enumerate(self._journals):
            if k not in self._done:
                journal.refresh()
                self._reports[k] = journal.report()
        refused = dict(self._unreadable)
        for report in self._reports:
            refused |= report.refused
        return Progress(
            takes=self._n_takes,
            learned=sum(len(report.learned) for report in self._reports),
            refused=refused,
            watched_s=sum(report.watched_s for report in self._reports),
            primitives=sum(report.primitives for report in self._reports),
            shards=len(self._tasks),
            done=len(self._done),
            merged=self._merged,
            elapsed_s=time.monotonic() - self._began,
            already=self._already + len(self._unreadable),
            deaths=sum(report.deaths for report in self._reports),
        )


def merge_files(parts: Sequence[Path], to: Path, person: str) -> None:
    """Merge what some stores, or files of learners, know of one person; write it to a file.

    Args:
        parts: The stores and files.
        to: The file.
        person: Who moves; empty where unknown, then there may be many.

    Raises:
        MPLearnError: One cannot be read.
        StoreWriteError: The file cannot be written.
    """
    with _uncollected():
        state = merged_state((_learner_of(part) for part in parts), [person] * len(parts))
        file = replace(FILES, compression=0)  # it is read once, and goes
        try:
            file.write(to, to_plain(state, whole=True))
        except MPLearnError as error:
            raise StoreWriteError(str(error)) from error


@contextmanager
def _uncollected() -> Iterator[None]:
    """Look for no garbage meanwhile: nearly all that is made when stores are read stays."""
    before = gc.isenabled()
    gc.disable()
    try:
        yield
    finally:
        if before:
            gc.enable()


def _learner_of(path: Path) -> MotionLearner:
    return learner_of(path) if path.suffix == ".db" else MotionLearner.load(path, lazily=True)


def _by_person(parts: Sequence[tuple[str, Path]]) -> list[tuple[str, tuple[Path, ...]]]:
    """Return what is merged at once: parts of one person, as many as may be."""
    people: dict[str, list[Path]] = {}
    for person, path in parts:
        people.setdefault(person, []).append(path)
    return [
        (person, tuple(paths[k : k + _FAN_IN]))
        for person, paths in people.items()
        for k in range(0, len(paths), _FAN_IN)
    ]
