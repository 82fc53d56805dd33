"""What a macro step earns: at its start, while it lasts, and at its end."""

from __future__ import annotations

from collections.abc import Mapping

from mplearn_envs.execution.tracking_report import TrackingReport
from mplearn_envs.tasks import Task
from mplearn_envs.tasks.best import weights


def earned_meanwhile(task: Task, report: TrackingReport, discount: float) -> dict[str, float]:
    """Return what the moments of a macro step earn, by term: the discounted integral of the rates.

    Args:
        task: Which says what a moment earns.
        report: What happened in the macro step.
        discount: Discount per second.
    """
    weight = weights(report.time_s, discount)
    terms = {name: float(rate @ weight) for name, rate in task.rates(report).items()}
    if report.fallen:
        terms["fall"] = task.fall() * discount**report.duration_s
    return terms


def add(terms: dict[str, float], more: Mapping[str, float], factor: float = 1.0) -> None:
    """Add to the terms of a reward, by name."""
    for name, value in more.items():
        terms[name] = terms.get(name, 0.0) + factor * value
