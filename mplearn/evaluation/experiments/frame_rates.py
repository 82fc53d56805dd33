"""Whether the same motion is cut at the same times, whatever the frame rate."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

import numpy as np

from ...body import view_of
from ...errors import MPLearnError
from ...learner import learnable_rate
from ...mocap import resample
from ...recording import FloatArray, Recording
from ...segmentation import make_segmenter
from ..boundaries import Boundary, BoundaryScore, match_boundaries
from ..observing import observe
from ..table import Table

RATES_HZ = (20.0, 24.0, 30.0, 40.0, 60.0, 100.0, 250.0)
TOLERANCE_S = 0.1
_TICKS_HZ = 1000  # in which cuts of all rates are compared [1/s]
NOTE = (
    "Each take is resampled, without aliasing, and cut on-line at each rate. F1 of its cuts "
    "against those at its own rate, matched one to one within 0.1 s; in brackets how many there "
    "are. "
    "All: of all takes together."
)


def frame_rate_table(takes: Iterable[Recording], rates_hz: Sequence[float] = RATES_HZ) -> Table:
    """Cut takes on-line at several frame rates, and hold the cuts against each other.

    Args:
        takes: Takes, labelled or not.
        rates_hz: The rates [1/s].

    Returns:
        A row for each take, and one for all.

    Example:
        >>> from mplearn.demonstrator import demonstrate
        >>> take = demonstrate(["BAR", "BAL"] * 3, seed=1).recording
        >>> table = frame_rate_table([take], rates_hz=(50.0,))
        >>> table.columns, len(table.rows)
        (('take', 'own rate', 'cuts', '50 Hz'), 2)
    """
    rows: list[tuple[str, ...]] = []
    pooled: list[list[BoundaryScore]] = [[] for _ in rates_hz]
    left_out: list[str] = []
    n_own = 0
    for take in takes:
        own_hz = learnable_rate(take.rate_hz)
        try:
            own = _cuts(take, own_hz)
            found = [_score(own, _cuts(take, rate_hz)) for rate_hz in rates_hz]
        except MPLearnError as error:  # the others can be cut nevertheless
            left_out.append(f"{take.name} ({error})")
            continue
        n_own += len(own)
        for scores, score in zip(pooled, found, strict=True):
            scores.append(score)
        rows.append((take.name, f"{own_hz:g} Hz", str(len(own)), *map(_cell, found)))
    together = map(BoundaryScore.pooled, pooled)
    rows.append(("all", "", str(n_own), *map(_cell, together)))
    return Table(
        "The same cuts at other frame rates",
        ("take", "own rate", "cuts", *(f"{rate_hz:g} Hz" for rate_hz in rates_hz)),
        tuple(rows),
        f"{NOTE} Left out: {'; '.join(left_out)}." if left_out else NOTE,
    )


def _cuts(take: Recording, rate_hz: float) -> FloatArray:
    """Return the times at which a take is cut at a rate [s]."""
    features = observe(resample(take, rate_hz))
    seen = view_of(features.channels).see(features.frames)
    segments = make_segmenter("kohlmorgen-lemm", seen.shape[1], rate_hz).segment(seen)
    return np.array([segment.end for segment in segments][:-1]) / rate_hz


def _score(own: FloatArray, found: FloatArray) -> BoundaryScore:
    truth, cuts = (
        [Boundary(tick, tick) for tick in np.rint(times * _TICKS_HZ).astype(int).tolist()]
        for times in (own, found)
    )
    pairs = match_boundaries(truth, cuts, round(TOLERANCE_S * _TICKS_HZ))
    errors_s = np.array([truth[i].distance(cuts[j]) for i, j in pairs], dtype=float) / _TICKS_HZ
    return BoundaryScore(len(truth), len(cuts), errors_s, np.zeros(len(pairs)))


def _cell(score: BoundaryScore) -> str:
    return f"{score.f1:.3f} ({score.n_found})"
