"""One person, presented once, twice, or by halves; and what all segments at once would give.

The protocols of [Kulic2012, section 4]. A session is observed and segmented once and shared by all
of them.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ...recording import IntArray, LabelledSegment
from ...tree import Placement, PrimitiveTree, TreeConfig
from ...tree.exemplars import normalisation
from ...tree.exemplars.bank import ExemplarBank
from ...tree.exemplars.spread import ChannelSpread, pairs
from ..rates import LearningRates, rate_learning
from ..table import Table, percent
from .seen import Seen

PAPER = {
    "first presentation": ("17 of 22", "3.5 %", "6.7 %", "77 %"),
    "second presentation": ("22 of 22", "-", "-", "-"),
    "first half / second half": ("10 of 22", "4.8 %", "19.9 %", "-"),
}
NOTE = (
    "First presentation: learned on-line. Second: the same session again, learned on. Halves: the "
    "first half is learned, then the second is recognised without learning. All at once: "
    "average-link clustering of all segments of the session, cut where it agrees best with the "
    "truth: a bound that no learner can know. Rates as in the other tables, shares of the found "
    "segments of what is presented; mean over sessions, the worst in brackets."
)


@dataclass(frozen=True)
class Presented:
    """What came of one protocol.

    Attributes:
        extracted: Classes that have a primitive at the end.
        n_classes: Classes that the truth holds.
        false_positive: Share of the found segments that were recognised wrongly.
        false_negative: Share of them that were not recognised in spite of a model.
        inside: Share of the motions inside a right primitive; NaN where it is not defined.
    """

    extracted: int
    n_classes: int
    false_positive: float
    false_negative: float
    inside: float


def learn(seen: Seen, config: TreeConfig) -> tuple[PrimitiveTree, LearningRates]:
    """Learn a session on-line."""
    tree = PrimitiveTree(config, seen.frames.shape[1], seen.rate_hz)
    placements: list[Placement | None] = [
        None if s.still else tree.insert(seen.frames[s.start : s.end]) for s in seen.segments
    ]
    return tree, rate_learning(seen.truth, seen.segments, placements, seen.rate_hz)


def first_presentation(seen: Seen, config: TreeConfig) -> Presented:
    """Learn a session once."""
    rates = learn(seen, config)[1]
    return Presented(
        len(rates.extracted),
        rates.n_classes,
        rates.false_positive,
        rates.false_negative,
        rates.coverage,
    )


def second_presentation(seen: Seen, config: TreeConfig) -> Presented:
    """Learn a session twice; what was said the second time counts."""
    once, both = learn(seen, config)[1], learn(seen.twice(), config)[1]
    n = max(1, both.n_found - once.n_found)
    return Presented(
        len(both.extracted),
        both.n_classes,
        (both.n_wrong - once.n_wrong) / n,
        (both.n_missed - once.n_missed) / n,
        both.coverage,
    )


def halves(seen: Seen, config: TreeConfig) -> Presented:
    """Learn the first half of the segments, recognise the second without learning."""
    middle = len(seen.segments) // 2
    tree, rates = learn(seen.part(0, middle), config)
    recogniser = tree.recogniser()
    known = set(rates.extracted)
    wrong = missed = found = 0
    for segment, label in zip(seen.segments[middle:], seen.labels[middle:], strict=True):
        if segment.still:
            continue
        found += 1
        primitive = recogniser.recognise(seen.frames[segment.start : segment.end]).primitive
        if primitive is None:
            missed += label in known
        else:
            wrong += not label or rates.classes[primitive] != label
    n_classes = len({label.label for label in seen.truth})
    found = max(found, 1)
    return Presented(len(known), n_classes, wrong / found, missed / found, float("nan"))


def all_at_once(seen: Seen, config: TreeConfig) -> Presented:
    """Cluster all segments together, cut where that agrees best with the truth."""
    from scipy.cluster.hierarchy import fcluster, linkage

    chosen = [
        (seen.frames[s.start : s.end], label)
        for s, label in zip(seen.segments, seen.labels, strict=True)
        if not s.still
    ]
    labels = np.array([label for _, label in chosen])
    points = [normalisation.points_of(frames, config.normalisation) for frames, _ in chosen]
    spread = ChannelSpread(np.zeros(seen.frames.shape[1], np.int64))
    for each in points:
        spread.update(each)
    floor = config.variance_floor**2 * spread.variances()
    bank = ExemplarBank(config, len(floor), floor)
    for number, (each, (frames, _)) in enumerate(zip(points, chosen, strict=True)):
        bank.add(number, bank.model(normalisation.centred(each, config.normalisation), len(frames)))
    distances = pairs(bank.matrix(range(len(points))))
    merges = linkage(distances, "average")
    cuts = np.linspace(0.1, 0.7, 31) * distances.mean()
    outcomes = [
        _agreement(
            fcluster(merges, cut, "distance").astype(np.int64),
            labels,
            seen.truth,
            config.min_exemplars,
        )
        for cut in cuts
    ]
    return max(outcomes, key=lambda o: o.inside - o.false_positive)


def _agreement(
    clusters: IntArray, labels: NDArray[np.str_], truth: Sequence[LabelledSegment], least: int
) -> Presented:
    groups: dict[int, list[str]] = {}
    for cluster, label in zip(clusters, labels, strict=True):
        groups.setdefault(int(cluster), []).append(str(label))
    wrong = inside = 0
    extracted: set[str] = set()
    loose: list[str] = []
    for group in groups.values():
        label, count = Counter(group).most_common(1)[0]
        if len(group) < least:
            loose += group
            continue
        inside += count if label else 0
        wrong += len(group) - count if label else len(group)
        extracted |= {label} - {""}
    missed = sum(label in extracted for label in loose)
    n = max(1, len(labels))
    n_classes = len({each.label for each in truth})
    return Presented(len(extracted), n_classes, wrong / n, missed / n, inside / max(1, len(truth)))


PROTOCOLS = {
    "first presentation": first_presentation,
    "second presentation": second_presentation,
    "first half / second half": halves,
    "all at once": all_at_once,
}


def presentation_table(
    sessions: Iterable[tuple[str, Seen]], config: TreeConfig | None = None
) -> Table:
    """Put sessions through all protocols.

    Args:
        sessions: Name of a group of sessions (a person, say), and a session; several of a name are
            averaged.
        config: Rules of the tree; the defaults where not given.

    Example:
        >>> from mplearn.demonstrator import demonstrate
        >>> session = demonstrate(["BAR", "BAL"] * 4, seed=1, rate_hz=50.0).recording
        >>> table = presentation_table([("anna", Seen.of(session))])
        >>> table.columns[:2], len(table.rows)
        (('sessions of', 'protocol'), 7)
    """
    config = config or TreeConfig()
    outcomes: dict[tuple[str, str], list[Presented]] = {}
    for name, seen in sessions:
        for protocol, run in PROTOCOLS.items():
            outcomes.setdefault((protocol, name), []).append(run(seen, config))
    rows = [("paper", protocol, "1", *cells) for protocol, cells in PAPER.items()]
    rows += [
        (name, protocol, str(len(group)), *_cells(group))
        for (protocol, name), group in sorted(outcomes.items(), key=_order)
    ]
    columns = (
        "sessions of",
        "protocol",
        "sessions",
        "extracted",
        "false positives",
        "false negatives",
        "inside at the end",
    )
    return Table("Presented once, twice, by halves, and all at once", columns, tuple(rows), NOTE)


def _order(item: tuple[tuple[str, str], list[Presented]]) -> tuple[int, str]:
    (protocol, name), _ = item
    return list(PROTOCOLS).index(protocol), name


def _cells(group: Sequence[Presented]) -> tuple[str, str, str, str]:
    def cell(values: list[float], worst: float) -> str:
        mean = percent(float(np.mean(values)))
        return mean if len(values) == 1 or mean == "-" else f"{mean} ({percent(worst)})"

    positives = [each.false_positive for each in group]
    negatives = [each.false_negative for each in group]
    inside = [each.inside for each in group]
    extracted = f"{np.mean([each.extracted for each in group]):.1f}"
    return (
        f"{extracted} of {np.mean([each.n_classes for each in group]):.1f}",
        cell(positives, max(positives)),
        cell(negatives, max(negatives)),
        cell(inside, min(inside)),
    )
