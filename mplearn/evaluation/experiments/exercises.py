"""Activities learned as they come: which of them own primitives, and how much lies in these."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

import numpy as np

from ...errors import MPLearnError
from ...learner import LearnerConfig, MotionLearner, learnable_rate
from ...mocap import resample
from ...recording import Recording
from ..hearing import hear
from ..ownership import Heard, OwnershipRates, frame_labels, rate_ownership
from ..table import Table, percent

RATES_HZ = (60.0, 30.0)
"""Rates at which takes are learned beside their own [1/s]."""

COLUMNS = (
    "take",
    "rate",
    "primitives",
    "activities owned",
    "purity",
    "inside at the end",
    "recognised",
    "false positives",
    "demonstrations",
)
NOTE = (
    "One presentation, on-line, from nothing: each take by itself, and the takes of one person one "
    "after another. A segment shows the activity to which more than half of its frames belong; a "
    "primitive's activity is that of more than half of the labelled frames in it. Purity: share "
    "of the labelled frames in primitives that are of the commonest activity there. Inside: share "
    "of the labelled moving time that lies in a primitive of its activity at the end; recognised: "
    "that was recognised rightly as it came. Moving is what lies in no pause found; what the "
    "learner lost counts against it. False positives: share of the moving segments that were "
    "recognised as another activity. Demonstrations: mean number of segments of an activity up to "
    "its first primitive; where a cycle is two segments, two cycles are four."
)


def hear_takes(takes: Sequence[Recording]) -> list[Heard]:
    """Learn takes of the same channels and rate one after another, from nothing."""
    learner = MotionLearner(LearnerConfig(takes[0].channels, takes[0].rate_hz))
    return [hear(learner, take) for take in takes]


def exercise_table(
    annotated: Iterable[tuple[str, Sequence[Recording]]], rates_hz: Sequence[float] = RATES_HZ
) -> Table:
    """Learn takes whose labels are activities, at their own rate and at others.

    Args:
        annotated: Groups of takes with labels, of the same channels, by the name of what labelled
            them ("" for what lies beside each take). Each take is learned by itself, and those of
            one person in a group also together.
        rates_hz: Lower rates at which they are learned too [1/s].

    Returns:
        A row for each take and rate, for each person with several takes, and the means over takes.

    Example:
        >>> import numpy as np
        >>> from mplearn import LabelledSegment, Recording
        >>> t = np.arange(2000) / 50.0
        >>> frames = np.stack((np.sin(4 * t) * (t < 20), np.sin(5 * t) * (t >= 20)), axis=1)
        >>> labels = LabelledSegment(0, 1000, "arms"), LabelledSegment(1000, 2000, "legs")
        >>> take = Recording(frames, 50.0, ("arm", "leg"), name="both", labels=labels)
        >>> table = exercise_table([("", [take])], rates_hz=())
        >>> table.columns[:4], len(table.rows)
        (('take', 'rate', 'primitives', 'activities owned'), 2)
    """
    rows = []
    left_out: list[str] = []
    alone: dict[str, list[OwnershipRates]] = {}
    heard: dict[tuple[tuple[str, ...], float], list[Heard]] = {}
    for source, labelled in annotated:
        for takes in _together(labelled):
            own_hz = learnable_rate(takes[0].rate_hz)
            for rate_hz in _rates(own_hz, rates_hz):
                resampled = [resample(take, rate_hz) for take in takes]
                key = (tuple(take.name for take in takes), rate_hz)
                try:
                    if key not in heard:  # another annotator changes no word of the learner
                        heard[key] = hear_takes(resampled)
                except MPLearnError as error:  # the others can be learned nevertheless
                    left_out.append(f"{_title(source, takes)} at {rate_hz:g} Hz ({error})")
                    continue
                rates = rate_ownership(
                    (frame_labels(take.labels, len(take)), said)
                    for take, said in zip(resampled, heard[key], strict=True)
                )
                rate = f"{rate_hz:g} Hz" + (" (own)" if rate_hz == own_hz else "")
                if len(takes) == 1:
                    alone.setdefault(rate, []).append(rates)
                rows.append((_title(source, takes), rate, *_cells(rates)))
    rows += [("mean of single takes", rate, *_mean(each)) for rate, each in alone.items()]
    note = f"{NOTE} Left out: {'; '.join(left_out)}." if left_out else NOTE
    return Table("Primitives of activities, learned as they come", COLUMNS, tuple(rows), note)


def _together(labelled: Sequence[Recording]) -> list[list[Recording]]:
    """Return each take by itself, then the takes of each person who has several."""
    people: dict[str, list[Recording]] = {}
    for take in labelled:
        people.setdefault(take.person, []).append(take)
    return [[take] for take in labelled] + [own for own in people.values() if len(own) > 1]


def _rates(own_hz: float, others_hz: Sequence[float]) -> list[float]:
    return [own_hz, *(rate_hz for rate_hz in others_hz if rate_hz < 0.99 * own_hz)]


def _title(source: str, takes: Sequence[Recording]) -> str:
    names = " + ".join(take.name for take in takes)
    return f"{names} ({source})" if source else names


def _cells(rates: OwnershipRates) -> tuple[str, ...]:
    missing = [name for name in rates.activities if name not in rates.owned]
    owned = f"{len(rates.owned)} of {len(rates.activities)}"
    return (
        str(len(rates.primitives)),
        owned + (f" (not {', '.join(missing)})" if missing else ""),
        percent(rates.purity),
        percent(rates.inside),
        percent(rates.recognised),
        percent(rates.false_positive),
        f"{rates.mean_demonstrations:.1f}",
    )


def _mean(each: Sequence[OwnershipRates]) -> tuple[str, ...]:
    def mean(values: Iterable[float]) -> float:
        known = [value for value in values if value == value]
        return float(np.mean(known)) if known else float("nan")

    return (
        f"{mean(len(r.primitives) for r in each):.1f}",
        percent(mean(len(r.owned) / max(1, len(r.activities)) for r in each)),
        percent(mean(r.purity for r in each)),
        percent(mean(r.inside for r in each)),
        percent(mean(r.recognised for r in each)),
        percent(mean(r.false_positive for r in each)),
        f"{mean(r.mean_demonstrations for r in each):.1f}",
    )
