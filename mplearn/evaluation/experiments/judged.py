"""Scores of what is right and of what is wrong: how well they tell them apart, at what cost."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass

import numpy as np

from ...library import AnomalyScore
from ..table import Table, percent

ALARM = 0.05


@dataclass(frozen=True)
class Judged:
    """Scores of what is right and of what is wrong in one way."""

    right: tuple[AnomalyScore, ...]
    wrong: tuple[AnomalyScore, ...]

    @property
    def auc(self) -> float:
        """Chance that a wrong one scores higher than a right one; ties count half."""
        right = np.array([each.score for each in self.right])
        wrong = np.array([each.score for each in self.wrong])
        if not (right.size and wrong.size):
            return float("nan")
        return float((right[:, None] < wrong).mean() + 0.5 * (right[:, None] == wrong).mean())

    def alarms(self, which: str) -> float:
        """Return the share of the ``"right"`` or the ``"wrong"`` ones that raise an alarm."""
        scores: tuple[AnomalyScore, ...] = getattr(self, which)
        return float(np.mean([each.p_value <= ALARM for each in scores])) if scores else np.nan


def anomaly_table(results: Iterable[tuple[str, Mapping[str, Judged]]]) -> Table:
    """Return a table of what `judge_paper_session` and `judge_people` yielded, and all together.

    Example:
        >>> from mplearn.library import AnomalyScore
        >>> right, wrong = AnomalyScore(0.8, 0.6), AnomalyScore(4.0, 0.01)
        >>> table = anomaly_table([("anna", {"motion": Judged((right,), (wrong,))})])
        >>> dict(zip(table.columns, table.rows[0], strict=True))["found"]
        '100.0 %'
    """
    rows = []
    pooled: dict[str, list[Judged]] = {}
    for name, kinds in results:
        for kind, judged in kinds.items():
            rows.append((name, *_cells(kind, judged, judged.auc)))
            pooled.setdefault(kind, []).append(judged)
    for kind, each in pooled.items():
        right = tuple(score for judged in each for score in judged.right)
        wrong = tuple(score for judged in each for score in judged.wrong)
        areas = [judged.auc for judged in each if judged.right and judged.wrong]
        auc = float(np.mean(areas)) if areas else float("nan")
        rows.append(("mean", *_cells(kind, Judged(right, wrong), auc)))
    return Table(
        "Planted anomalies, told by a library from what is usual",
        ("session", "planted", "right / wrong", "AUC", "false alarms", "found"),
        tuple(rows),
        f"Alarm at a p-value of {ALARM} at most. Right motions: those of the stream after the "
        "three quarters of it that were learned, of classes that have a primitive. Wrong motions: "
        "of classes never shown; right ones of which half the channels follow another motion; "
        "right ones that go half as far; and the same person's incorrect executions of what was "
        "learned, alone and as whole repetitions (mean score of the two halves). Wrong orders: a "
        "recognised primitive is replaced by one that never follows in the truth; right ones are "
        "the successions themselves.",
    )


def _cells(kind: str, judged: Judged, auc: float) -> tuple[str, ...]:
    return (
        kind,
        f"{len(judged.right)} / {len(judged.wrong)}",
        f"{auc:.3f}",
        percent(judged.alarms("right")),
        percent(judged.alarms("wrong")),
    )
