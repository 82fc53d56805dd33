"""Other libraries beside ours, on the same data in the same run: activities, and boundaries."""

from __future__ import annotations

import time
import tracemalloc
from collections.abc import Callable, Iterable, Iterator, Sequence
from functools import partial
from importlib import import_module
from importlib.util import find_spec
from itertools import pairwise
from typing import Any, TypeVar

import numpy as np
from scipy.cluster.hierarchy import fcluster, linkage

from ...activities import find_activities, postures_of
from ...body import view_of
from ...errors import InvalidValueError
from ...mocap import resample
from ...recording import FloatArray, IntArray, Recording, Segment
from ..boundaries import BoundaryScore, score_boundaries
from ..executions import split_repetitions
from ..observing import observe
from ..ownership import frame_labels
from ..partitions import agreement
from ..table import Table, percent
from .other_segmenters import PEERS, moseq

ACTIVITY_HZ = 10.0
"""Rate at which activities are looked for by other libraries: kernels grow as its square [1/s]."""
BOUNDARY_HZ = 30.0
TOLERANCE_S = 0.25

_Found = TypeVar("_Found")
Partition = Callable[[FloatArray, float, int, int], IntArray]


def _ours(postures: FloatArray, rate_hz: float, classes: int, changes: int) -> IntArray:
    return find_activities(postures, rate_hz)


def _pelt(
    postures: FloatArray, rate_hz: float, classes: int, changes: int, noise: float = 1.0
) -> IntArray:
    n, width = postures.shape
    penalty = float(np.log(n) * width * noise * postures.var(axis=0).mean())
    ruptures: Any = import_module("ruptures")
    search = ruptures.Pelt(min_size=round(rate_hz)).fit(postures)
    return _grouped(postures, search.predict(pen=penalty), classes)


def _kernel(postures: FloatArray, rate_hz: float, classes: int, changes: int) -> IntArray:
    ruptures: Any = import_module("ruptures")
    search = ruptures.KernelCPD(kernel="rbf", min_size=round(rate_hz)).fit(postures)
    return _grouped(postures, search.predict(n_bkps=changes), classes)


def _clasp(postures: FloatArray, rate_hz: float, classes: int, changes: int) -> IntArray:
    claspy: Any = import_module("claspy.segmentation")
    found = claspy.BinaryClaSPSegmentation().fit_predict(postures)
    return _grouped(postures, [*map(int, found), len(postures)], classes)


def _moseq(postures: FloatArray, rate_hz: float, classes: int, changes: int) -> IntArray:
    return _grouped(postures, [*moseq(postures, rate_hz), len(postures)], classes)


def _grouped(postures: FloatArray, ends: Iterable[int], classes: int) -> IntArray:
    """Return the class of each frame: stretches by the mean and spread of their postures, Ward."""
    edges = [0, *sorted({int(end) for end in ends if end > 0})]
    looks = np.array(
        [np.r_[postures[a:b].mean(axis=0), postures[a:b].std(axis=0)] for a, b in pairwise(edges)]
    )
    labels = np.ones(len(looks), dtype=np.int64)
    if len(looks) > 1:
        labels = fcluster(linkage(looks, "ward"), classes, "maxclust").astype(np.int64)
    return np.repeat(labels, np.diff(edges))


METHODS: dict[str, tuple[str, str, Partition]] = {
    "ours, find_activities": ("", "nothing", _ours),
    "ruptures, PELT + Ward": ("ruptures", "number of classes", _pelt),
    "ruptures, kernel + Ward": ("ruptures", "numbers of classes and changes", _kernel),
    "PELT, noise 10 % + Ward": ("ruptures", "number of classes", partial(_pelt, noise=0.1)),
    "PELT, noise 1 % + Ward": ("ruptures", "number of classes", partial(_pelt, noise=1e-2)),
    "claspy, ClaSP + Ward": ("claspy", "number of classes", _clasp),
    "MoSeq, AR-HMM + Ward": ("jax_moseq", "number of classes", _moseq),
}
"""By name: the library, what it is told of the truth, and how it works."""


def activity_peers_table(recordings: Iterable[Recording]) -> Table:
    """Find the activities of labelled recordings by each library that is installed."""
    rows, left_out, found = [], [], []
    for each in recordings:
        if len({label.label for label in each.labels}) > 1:
            found.append((each, observe(each)))
        elif each.labels:
            left_out.append(f"{each.name} (one activity: there is nothing to tell apart)")
    for name, (library, _, _) in METHODS.items():
        if library and find_spec(library) is None:
            left_out.append(f"{name} (not installed: pip install {library})")
            continue
        for recording, seen in found:
            row = partial(_activity_row, name, recording, seen)
            rows += _tried(library, f"{name}, of {recording.name}", row, left_out)
    note = (
        "The same postures of the same recordings. Ours is run at the recording's rate and told "
        f"nothing; the others at {ACTIVITY_HZ:g} Hz and told what the table says: they find change "
        "points, so their stretches are grouped by Ward's method into the true number of classes. "
        "PELT has the penalty of the Bayesian information criterion, with all variance, or a share "
        "of it, for that of noise, the kernel is Gaussian with "
        "ruptures' own width, ClaSP has its defaults, MoSeq's autoregressive HMM those of "
        "keypoint-MoSeq. Change points match within 1 %. Time is the "
        "processor's, without importing; memory is the most that was allocated on the way."
    )
    columns = (
        *("recording", "method", "told", "ARI", "covering", "change points, F1", "classes"),
        *("time", "memory"),
    )
    return Table(
        "Activities, by other libraries and by ours",
        columns,
        tuple(rows),
        f"{note} Left out: {'; '.join(left_out)}." if left_out else note,
    )


def _activity_row(name: str, recording: Recording, seen: Recording) -> tuple[str, ...]:
    library, told, method = METHODS[name]
    own = seen if not library else resample(seen, min(ACTIVITY_HZ, seen.rate_hz))
    postures = postures_of(own.frames, own.channels)
    truth = frame_labels(recording.labels, len(recording))
    labelled = truth != ""
    changes = int((truth[labelled][1:] != truth[labelled][:-1]).sum())
    asked = (postures, own.rate_hz, len(set(truth[labelled].tolist())), changes)
    peak = _most_allocated(partial(method, *asked))
    classes, took_s = _timed(partial(method, *asked))
    at = np.arange(len(truth)) * own.rate_hz / recording.rate_hz
    frames = classes[np.minimum(at.astype(np.int64), len(classes) - 1)]
    score = agreement(truth[labelled], frames[labelled])
    return (
        recording.name,
        name,
        told,
        f"{score.ari:.2f}",
        f"{score.covering:.2f}",
        f"{score.change_f1:.2f}",
        f"{score.n_found} of {score.n_true}",
        f"{took_s:.2g} s",
        f"{peak / 2**20:.1f} MB",
    )


def boundary_peers_table(takes: Iterable[Recording]) -> Table:
    """Cut takes of repeated movements by each library that is installed.

    Raises:
        InvalidValueError: There is no take of repeated movements.
    """
    seen = [
        (each, (own := observe(resample(each, BOUNDARY_HZ))), view_of(own.channels).see(own.frames))
        for each in split_repetitions(list(takes))
    ]
    if not seen:
        raise InvalidValueError("there is no take of repeated movements: at least one is needed")
    rows, left_out = [], []
    for name, (library, _, _) in PEERS.items():
        if library and find_spec(library) is None:
            left_out.append(f"{name} (not installed: pip install {library})")
            continue
        row = partial(_boundary_row, name, seen)
        rows += _tried(library, name, row, left_out)
    note = (
        f"{len(seen)} takes of repeated movements, seen as a learner sees them, at "
        f"{BOUNDARY_HZ:g} Hz. True boundaries are the joins of repetitions and the reversal inside "
        f"each; matched one to one within {TOLERANCE_S} s. Ours is the default segmenter, on-line; "
        "PELT has the penalty of the Bayesian information criterion, with all variance, or a share "
        "of it, for that of noise; the others have their defaults. Memory is that of the longest. "
        "ClaSP and FLOSS look for changes of the activity, not for turns of a motion."
    )
    return Table(
        "Boundaries of primitives, by other libraries and by ours",
        ("method", "on-line", "recall", "precision", "F1", "time for a minute", "memory"),
        tuple(rows),
        f"{note} Left out: {'; '.join(left_out)}." if left_out else note,
    )


def _boundary_row(
    name: str, seen: Sequence[tuple[Recording, Recording, FloatArray]]
) -> tuple[str, ...]:
    _, online, cut = PEERS[name]
    longest = max((frames for _, _, frames in seen), key=len)
    peak = _most_allocated(partial(cut, longest, BOUNDARY_HZ))
    scores, took_s = [], 0.0
    for take, own, frames in seen:
        cuts, own_s = _timed(partial(cut, frames, BOUNDARY_HZ))
        took_s += own_s
        scores.append(_scored(take, own, cuts))
    score = BoundaryScore.pooled(scores)
    minutes = sum(own.duration_s for _, own, _ in seen) / 60
    return (
        name,
        "yes" if online else "no",
        percent(score.recall),
        percent(score.precision),
        f"{score.f1:.3f}",
        f"{took_s / minutes:.2f} s",
        f"{peak / 2**20:.0f} MB",
    )


def _tried(
    library: str, what: str, row: Callable[[], tuple[str, ...]], left_out: list[str]
) -> list[tuple[str, ...]]:
    """Return a row; none, and why, where another's library breaks: the page goes on without it."""
    try:
        return [row()]
    except Exception as error:
        if not library:  # ours
            raise
        left_out.append(f"{what} ({type(error).__name__}: {error})")
        return []


def _scored(take: Recording, own: Recording, cuts: list[int]) -> BoundaryScore:
    scale = take.rate_hz / own.rate_hz
    edges = sorted({0, *(round(cut * scale) for cut in cuts if cut > 0), len(take)})
    segments = [Segment(a, b, decided_at=b) for a, b in pairwise(edges)]
    return score_boundaries(segments, take.labels, take.rate_hz, tolerance_s=TOLERANCE_S)


def _timed(work: Callable[[], _Found]) -> tuple[_Found, float]:
    """Return what some work returns, and its time [s]."""
    begin = time.process_time()
    result = work()
    return result, time.process_time() - begin


def _most_allocated(work: Callable[[], object]) -> int:
    """Return the most that some work allocates [byte]."""
    work()  # compiles, and imports
    tracemalloc.start()
    try:
        work()
        return tracemalloc.get_traced_memory()[1]
    finally:
        tracemalloc.stop()


def page_of_peers(
    activities: Iterable[Recording], repetitions: Iterable[Recording]
) -> Iterator[Table]:
    """Return the tables of the page, one after the other."""
    yield activity_peers_table(activities)
    yield boundary_peers_table(repetitions)
