"""A corpus is recognised by a library, some takes at a time."""

from __future__ import annotations

import os
from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import FIRST_COMPLETED, Future, wait
from functools import lru_cache
from pathlib import Path
from typing import NamedTuple

from ..errors import LibraryError, MPLearnError, StoreError
from ..learner import LearnerConfig
from ..library import PrimitiveLibrary
from ..mocap import TakeFiles, find_takes
from ..recording import are_markers
from ..tables import RecognisedSegment, SegmentTable, recognise_recording
from ..threads import one_thread
from .executors import Executor, room, workers
from .reading import Reading
from .shard import DEATHS

_CHUNK = 16  # takes


class RecognisedCorpus(NamedTuple):
    """What a library recognised in a corpus.

    Attributes:
        table: The segments of all takes, in the order of their names.
        refused: Why not, by name, for takes that could not be read, or seen by the library.
        n_takes: Takes in which it looked.

    Example:
        >>> from mplearn.library import RecognisedSegment, SegmentTable
        >>> row = RecognisedSegment("walk", 0.5, 1.7, 3, "step", "step", 0.2, 0.6)
        >>> found = RecognisedCorpus(SegmentTable([row]), {"torn": "ends in frame 7"}, n_takes=1)
        >>> len(found.table), list(found.refused)
        (1, ['torn'])
    """

    table: SegmentTable
    refused: Mapping[str, str]
    n_takes: int


class _Chunk(NamedTuple):
    rows: dict[str, list[RecognisedSegment]]
    refused: dict[str, str]


def recognise_corpus(
    library: str | os.PathLike[str],
    folder: str | os.PathLike[str],
    *,
    reading: Reading | None = None,
    jobs: int = 1,
    executor: Executor | None = None,
    show: Callable[[int, int], object] = lambda done, of: None,
) -> RecognisedCorpus:
    r"""Recognise what of a library is in all recordings of a folder, and of the folders in it.

    Args:
        library: File of a library, or a store.
        folder: The recordings.
        reading: How they are read; what is observed is what the library needs.
        jobs: Processes; 0 works in this one. See `learn_corpus`.
        executor: Who does the work instead.
        show: Called with how many takes are done, and of how many.

    Raises:
        InvalidValueError: Nobody can be given the work.
        RecordingError: There are no recordings.
        LibraryError: There is no such library.

    Example:
        >>> import numpy as np
        >>> from pathlib import Path
        >>> from mplearn import LearnerConfig, MotionLearner, open_recording
        >>> t = np.arange(600) / 50.0
        >>> swing = np.where(t % 2 < 1, np.sin(np.pi * t) ** 2, 0.0)
        >>> rows = "".join(f"{time:.2f},{value:.5f}\n" for time, value in zip(t, swing))
        >>> Path("takes").mkdir(exist_ok=True)
        >>> _ = Path("takes", "slow.csv").write_text("time_s,elbow\n" + rows)
        >>> take = open_recording("takes/slow.csv")
        >>> learner = MotionLearner(LearnerConfig(("elbow",), 50.0, segmenter="zero-velocity"))
        >>> events = list(learner.learn_recording(take))
        >>> path = learner.snapshot().save("swing.mplearn")
        >>> found = recognise_corpus(path, "takes", jobs=0)
        >>> found.table.column("name")[:3], found.n_takes
        (['P1', 'P2', 'P1'], 1)
    """
    own = workers(executor, jobs)
    library, folder = Path(library).absolute(), Path(folder).absolute()  # workers may be elsewhere
    known = PrimitiveLibrary.load(library)
    observe = "robot" if known.body else "positions" if are_markers(known.channels) else "channels"
    asked = reading or Reading()
    reading = Reading(observe, asked.hints, asked.names)  # type: ignore[arg-type]
    found = find_takes(folder)
    try:
        with one_thread():
            done = _all(library, found.takes, reading, own, show)
    finally:
        if executor is None:
            own.close()
    refused = {name: str(error) for name, error in found.unreadable.items()} | done.refused
    rows = (row for take in found.takes for row in done.rows.get(take.name, ()))
    return RecognisedCorpus(SegmentTable(rows), refused, len(done.rows))


def _all(
    library: Path,
    takes: Sequence[TakeFiles],
    reading: Reading,
    executor: Executor,
    show: Callable[[int, int], object],
) -> _Chunk:
    """Have all takes recognised; those that were lost with a worker at last, with nothing beside.

    Whoever works beside one that dies is lost with it: alone it is known who was the cause.
    """
    waiting = [takes[k : k + _CHUNK] for k in range(0, len(takes), _CHUNK)][::-1]
    lost: list[Sequence[TakeFiles]] = []
    running: dict[Future[_Chunk], Sequence[TakeFiles]] = {}
    tries: Counter[str] = Counter()
    whole = _Chunk({}, {})
    while waiting or running or lost:
        while waiting and len(running) < room(executor):
            chunk = waiting.pop()
            future = executor.submit(recognise_takes, library, chunk, reading)
            running[future] = chunk
            if future.done():
                break
        if not running:
            chunk = lost.pop()
            running[executor.submit(recognise_takes, library, chunk, reading)] = chunk
        for future in wait(running, return_when=FIRST_COMPLETED).done:
            chunk = running.pop(future)
            error = future.exception()
            if error is None:
                whole.rows.update(future.result().rows)
                whole.refused.update(future.result().refused)
            elif isinstance(error, MPLearnError):
                raise error
            elif len(chunk) > 1:
                waiting += [[take] for take in reversed(chunk)]
            else:
                name = chunk[0].name
                tries[name] += 1
                if tries[name] < DEATHS:
                    lost.append(chunk)
                else:
                    why = f"{type(error).__name__}: {error}"
                    whole.refused[name] = f"recognising it was tried {DEATHS} times: {why}"
            show(len(whole.rows) + len(whole.refused), len(takes))
    return whole


def recognise_takes(library: Path, takes: Sequence[TakeFiles], reading: Reading) -> _Chunk:
    """Recognise some takes; one that cannot be read costs nothing else.

    Raises:
        LibraryError: There is no such library.
    """
    known = _loaded(library)
    config = LearnerConfig(known.channels, known.rate_hz)
    chunk = _Chunk({}, {})
    for take in takes:
        try:
            streams = reading.streams(take, config)
            chunk.rows[take.name] = [row for s in streams for row in recognise_recording(known, s)]
        except (LibraryError, StoreError):
            raise
        except MPLearnError as error:
            chunk.refused[take.name] = str(error)
    return chunk


@lru_cache(maxsize=1)
def _loaded(library: Path) -> PrimitiveLibrary:
    return PrimitiveLibrary.load(library)
