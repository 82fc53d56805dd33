"""Motions performed wrongly on purpose, against right ones that were not learned."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Sequence

import numpy as np
from scipy import stats

from ...learner import LearnerConfig, MotionLearner
from ...library import PrimitiveLibrary, RecognisedSegment, SegmentTable
from ...recording import FloatArray, Recording
from ...statistics import quality
from ...tables import recognise_recording
from ..sessions import make_session
from ..table import Table, percent
from .sessions import by_person

LEVEL = 0.05
_LEAST = 4  # repetitions of a take, to be halved


def quality_table(takes: Iterable[Recording], wrong: Iterable[Recording], seed: int = 0) -> Table:
    """Judge how each person's wrong executions differ from his or her right ones.

    Args:
        takes: Right executions, labelled repetitions, of at least four each.
        wrong: Wrong ones of the same movements and people.
        seed: Of the order of presentation.

    Example:
        >>> import numpy as np
        >>> from mplearn import LabelledSegment, Recording
        >>> wave = 1 - np.cos(2 * np.pi * np.arange(400) / 100)  # four repetitions
        >>> def take(name, size, person="anna"):
        ...     labels = tuple(LabelledSegment(100 * k, 100 * k + 100, name) for k in range(4))
        ...     frames = size * wave[:, None]
        ...     return Recording(frames, 100.0, ("elbow",), name=name, labels=labels, person=person)
        >>> right, wrong = [take("up", 1.0), take("out", -1.0)], [take("up", 0.6)]
        >>> table = quality_table(right, wrong)
        >>> table.columns[:3]
        ('person', 'right', 'wrong')
    """
    wrongly = by_person(wrong)
    rows = []
    for person, own in by_person(takes).items():
        halves = [_halves(take) for take in own if len(take.labels) >= _LEAST]
        if not wrongly.get(person) or not halves:
            continue
        library = _learned([first for first, _ in halves], seed)
        right = _recognised(library, [second for _, second in halves])
        reference, judged = _alternately(right)
        good = _known(quality(judged, reference))
        bad = _known(quality(_recognised(library, wrongly[person]), reference))
        if not (len(good) and len(bad)):
            continue
        u = stats.mannwhitneyu(good, bad).statistic / (len(good) * len(bad))
        rows.append(
            (
                person,
                str(len(good)),
                str(len(bad)),
                f"{np.median(good):.2f}",
                f"{np.median(bad):.2f}",
                percent(float((good <= LEVEL).mean())),
                percent(float((bad <= LEVEL).mean())),
                f"{float(u):.2f}",
            )
        )
    return Table(
        "Quality of executions, against right ones",
        (
            *("person", "right", "wrong", "median quality, right", "wrong"),
            *("right, below 5 %", "wrong, below 5 %", "right above wrong"),
        ),
        tuple(rows),
        "The first half of each take is learned. Of the other half, every second execution of a "
        "primitive is the reference, the others are judged by it, and so are the segments of "
        "motions performed wrongly on purpose. Right above wrong: chance that a right one is "
        "judged better than a wrong one (area under the curve). A wrong execution holds segments "
        "that are right.",
    )


def _halves(take: Recording) -> tuple[Recording, Recording]:
    middle = take.labels[len(take.labels) // 2].start
    return take.sliced(0, middle), take.sliced(middle, len(take))


def _learned(takes: Sequence[Recording], seed: int) -> PrimitiveLibrary:
    session = make_session(takes, np.random.default_rng(seed))
    learner = MotionLearner(LearnerConfig(session.channels, session.rate_hz))
    for _ in learner.learn_recording(session, 128):
        pass
    return learner.snapshot()


def _recognised(library: PrimitiveLibrary, takes: Iterable[Recording]) -> SegmentTable:
    return SegmentTable(row for take in takes for row in recognise_recording(library, take))


def _alternately(table: SegmentTable) -> tuple[SegmentTable, SegmentTable]:
    """Deal the executions of each primitive to two tables in turn."""
    parts: tuple[list[RecognisedSegment], list[RecognisedSegment]] = [], []
    turns: Counter[str] = Counter()
    for row in table:
        parts[turns[row.nearest] % 2].append(row)
        turns[row.nearest] += 1
    return SegmentTable(parts[0]), SegmentTable(parts[1])


def _known(shares: FloatArray) -> FloatArray:
    return shares[np.isfinite(shares)]
