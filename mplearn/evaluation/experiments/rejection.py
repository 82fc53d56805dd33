"""Open-set rejection: how often unknown motions are taken for known ones, and the stated rate."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from ...recording import FloatArray
from ...tree import PrimitiveTree, Recogniser, TreeConfig
from ..table import Table, percent
from .seen import Seen

RATES = (None, 0.1, 0.05)
HALVES = 4
_LEARNED = 2 / 3  # of the executions of a known motion; the others are presented afterwards
COLUMNS = (
    "sessions of",
    "halves",
    "stated",
    "false acceptance",
    "worst half",
    "false rejection",
    "taken for another",
)
NOTE = (
    "Half of the motions of a session, drawn at random, are learned from two thirds of their "
    "executions; then all executions of the other half, and the last third of the known ones, are "
    "presented to the frozen recogniser. False acceptance: share of the unknown ones' executions "
    "that are taken for a known one; mean over sessions and halves, and its standard error. False "
    "rejection: share of the known motions' executions, of those that have a primitive, that are "
    "taken for unknown. No rate stated: radii as the rules give them."
)


@dataclass(frozen=True)
class Rejection:
    """What came of one half.

    Attributes:
        false_acceptance: Share of the executions of unknown motions that were recognised.
        false_rejection: Share of those of known motions that were not.
        mistaken: Share of those that were taken for another known motion.
    """

    false_acceptance: float
    false_rejection: float
    mistaken: float


def reject(
    seen: Seen, rates: Sequence[float | None], config: TreeConfig, rng: np.random.Generator
) -> list[Rejection]:
    """Learn half of the motions of a session, and present the others.

    Args:
        seen: The session.
        rates: Stated rates; None for the rules' own radii.
        config: Rules of the tree.
        rng: Source of the choice of the half.

    Returns:
        What came of it at each rate.
    """
    shown = [
        (seen.frames[segment.start : segment.end], label)
        for segment, label in zip(seen.segments, seen.labels, strict=True)
        if label and not segment.still
    ]
    total = Counter(label for _, label in shown)
    known = set(rng.permutation(sorted(total))[: len(total) // 2].tolist())
    tree = PrimitiveTree(config, seen.frames.shape[1], seen.rate_hz)
    so_far: Counter[str] = Counter()
    classes: dict[int, str] = {}
    late = []
    for frames, label in shown:
        so_far[label] += 1
        if label in known and so_far[label] <= round(_LEARNED * total[label]):
            classes[tree.insert(frames).number] = label
        elif label in known:
            late.append((frames, label))
    names = {id: _majority(classes[n] for n in tree.node(id).members) for id in tree.leaves}
    late = [(frames, label) for frames, label in late if label in names.values()]
    strange = [frames for frames, label in shown if label not in known]
    plain = tree.recogniser()
    return [
        _rejection(plain if rate is None else plain.calibrated(rate), strange, late, names)
        for rate in rates
    ]


def _rejection(
    recogniser: Recogniser,
    strange: Iterable[FloatArray],
    late: Iterable[tuple[FloatArray, str]],
    names: Mapping[int, str],
) -> Rejection:
    accepted = [recogniser.recognise(frames).primitive is not None for frames in strange]
    said = [(recogniser.recognise(frames).primitive, label) for frames, label in late]
    return Rejection(
        float(np.mean(accepted)),
        float(np.mean([id is None for id, _ in said])),
        float(np.mean([id is not None and names[id] != label for id, label in said])),
    )


def rejection_table(
    sessions: Iterable[tuple[str, Seen]],
    rates: Sequence[float | None] = RATES,
    halves: int = HALVES,
    config: TreeConfig | None = None,
) -> Table:
    """Measure false acceptance against the stated rate.

    Args:
        sessions: Name of a group of sessions (a person, say), and a session; several of a name are
            averaged.
        rates: Stated rates; None for the rules' own radii.
        halves: Random halves of the motions of each session; the same ones for each rate.
        config: Rules of the tree; the defaults where not given.

    Example:
        >>> from mplearn.demonstrator import demonstrate
        >>> session = demonstrate(["BAR", "BAL", "SQD", "SQR"] * 3, seed=1, rate_hz=50.0).recording
        >>> table = rejection_table([("anna", Seen.of(session))], rates=[0.1], halves=1)
        >>> [row[0] for row in table.rows]
        ['anna']
    """
    config = config or TreeConfig()
    outcomes: dict[tuple[str, float | None], list[Rejection]] = {}
    for number, (name, seen) in enumerate(sessions):
        for half in range(halves):
            found = reject(seen, rates, config, np.random.default_rng((half, number)))
            for rate, outcome in zip(rates, found, strict=True):
                outcomes.setdefault((name, rate), []).append(outcome)
    rows = [_row(name, rate, group) for (name, rate), group in outcomes.items()]
    return Table("Motions of unknown kinds taken for known ones", COLUMNS, tuple(rows), NOTE)


def _row(name: str, rate: float | None, group: Sequence[Rejection]) -> tuple[str, ...]:
    accepted = np.array([each.false_acceptance for each in group])
    error = accepted.std(ddof=1) / np.sqrt(len(group)) if len(group) > 1 else float("nan")
    return (
        name,
        str(len(group)),
        "-" if rate is None else percent(rate),
        f"{percent(float(accepted.mean()))} +- {percent(float(error))}",
        percent(float(accepted.max())),
        percent(float(np.mean([each.false_rejection for each in group]))),
        percent(float(np.mean([each.mistaken for each in group]))),
    )


def _majority(labels: Iterable[str]) -> str:
    return Counter(labels).most_common(1)[0][0]
