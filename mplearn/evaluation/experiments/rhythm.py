"""Whether rhythmic motion is cut at one phase of its cycles, at several frame rates."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterable, Sequence
from itertools import pairwise

import numpy as np

from ...body import view_of
from ...errors import MPLearnError
from ...learner import learnable_rate
from ...mocap import resample
from ...recording import FloatArray, Recording
from ...segmentation import make_segmenter
from ..cycles import Bout, CutScore, find_oscillation, find_steps, score_cuts, shifted
from ..observing import observe
from ..ownership import frame_labels
from ..table import Table, percent

RATES_HZ = (60.0, 30.0)
SHORTEST_S = 1.5  # of a labelled stretch in which cycles are sought
NOTE = (
    "Truth is found with look-ahead. Steps turn where one ankle is farthest ahead of the other, "
    "about where a foot strikes, wherever in a take that repeats, by at least 10 cm, one lifted "
    "past the other by at least 2.5 cm; labelled stretches without steps turn at the extremes of "
    "their main oscillation (first principal component from 0.2 to 4 Hz). A bout holds at least "
    "1.5 cycles that are alike, 2 of steps. Cuts a cycle: all boundaries of the segmenter, those "
    "within an eighth of a cycle of a bout's ends count half; wanted are 2, one at each turn. "
    "Spread of the phase: root mean square distance from the mean phase of a half of the cycle. "
    "Missed: bouts with fewer than 0.8 cuts a cycle. Median over bouts."
)


def bouts_of(take: Recording, seen: FloatArray, channels: Sequence[str]) -> list[Bout]:
    """Return the rhythmic bouts of a take: steps wherever they are, and others by label.

    Args:
        take: The take, with its labels.
        seen: What a learner sees of it, shape (T, V).
        channels: Names of what it sees.
    """
    points = [i for i, name in enumerate(channels) if name.endswith((".x", ".y", ".z"))]
    posture = seen[:, points] if points else seen
    bouts: list[Bout] = []
    if {"ankle_l.x", "ankle_r.x"} <= set(channels):
        ahead, above = (
            seen[:, channels.index(f"ankle_l.{axis}")] - seen[:, channels.index(f"ankle_r.{axis}")]
            for axis in "xz"
        )
        bouts = find_steps(ahead, above, take.rate_hz)
    stepping = np.zeros(len(seen), dtype=np.bool_)
    for bout in bouts:
        stepping[bout.turns[0] : bout.turns[-1]] = True
    names = frame_labels(take.labels, len(seen))
    edges = [0, *(np.flatnonzero(names[1:] != names[:-1]) + 1).tolist(), len(names)]
    for start, end in pairwise(edges):
        long_enough = end - start >= SHORTEST_S * take.rate_hz
        if names[start] and long_enough and stepping[start:end].mean() < 0.5:
            found = find_oscillation(str(names[start]), posture[start:end], take.rate_hz)
            bouts += [shifted(bout, start) for bout in found]
    return bouts


def rhythm_table(takes: Iterable[Recording], rates_hz: Sequence[float] = RATES_HZ) -> Table:
    """Cut takes on-line, and hold the cuts against the cycles of their rhythmic motion.

    Args:
        takes: Takes of people, labelled or not.
        rates_hz: Lower rates at which they are cut too [1/s].

    Returns:
        A row for steps, for each label, and for all, at each rate.

    Example:
        >>> from mplearn.demonstrator import demonstrate
        >>> take = demonstrate(["BAR", "BAL"] * 4, seed=1, rate_hz=50.0).recording
        >>> table = rhythm_table([take], rates_hz=())
        >>> table.columns[:3]
        ('motion', 'rate', 'bouts')
    """
    scores: dict[tuple[str, str], list[CutScore]] = defaultdict(list)
    left_out: list[str] = []
    for take in takes:
        own_hz = learnable_rate(take.rate_hz)
        for rate_hz in (own_hz, *(each for each in rates_hz if each < 0.99 * own_hz)):
            try:
                found = _scores(resample(take, rate_hz))
            except MPLearnError as error:  # the others can be cut nevertheless
                left_out.append(f"{take.name} at {rate_hz:g} Hz ({error})")
                continue
            for score in found:
                scores[score.bout.label, f"{rate_hz:g} Hz"].append(score)
                scores["all", f"{rate_hz:g} Hz"].append(score)
    first = sorted(
        scores,
        key=lambda key: (key[0] != "steps", key[0] == "all", key[0], -float(key[1].split()[0])),
    )
    return Table(
        "Cuts of rhythmic motion",
        (
            "motion",
            "rate",
            "bouts",
            "cycles",
            "cuts a cycle",
            "quartiles",
            "missed",
            "2.0 +- 0.1",
            "spread of the phase",
            "worst",
        ),
        tuple((*key, *_cells(scores[key])) for key in first),
        f"{NOTE} Left out: {'; '.join(left_out)}." if left_out else NOTE,
    )


def _scores(take: Recording) -> list[CutScore]:
    features = observe(take)
    view = view_of(features.channels)
    seen = view.see(features.frames)
    segmenter = make_segmenter("kohlmorgen-lemm", seen.shape[1], take.rate_hz)
    cuts = [segment.end for segment in segmenter.segment(seen)][:-1]
    return [score_cuts(bout, cuts) for bout in bouts_of(take, seen, view.channels)]


def _cells(scores: Sequence[CutScore]) -> tuple[str, ...]:
    cuts = np.array([score.per_cycle for score in scores])
    spreads = [score.spread for score in scores if score.spread == score.spread]
    low, middle, high = np.percentile(cuts, [25, 50, 75])
    return (
        str(len(scores)),
        f"{sum(score.bout.n_cycles for score in scores):.0f}",
        f"{middle:.2f}",
        f"{low:.2f} - {high:.2f}",
        percent(float(np.mean(cuts < 0.8)), 0),
        percent(float(np.mean(np.abs(cuts - 2) <= 0.1)), 0),
        f"{np.median(spreads):.3f}" if spreads else "-",
        f"{max(spreads):.3f}" if spreads else "-",
    )
