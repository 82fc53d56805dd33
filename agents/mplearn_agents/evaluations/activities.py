"""Experiments on recordings whose labels are activities, coarser than primitives."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING

from .setting import Setting

if TYPE_CHECKING:
    from mplearn.evaluation import Table


def activities(setting: Setting) -> Iterator[Table]:
    """Which activity goes on when, the number of activities not given."""
    from mplearn.evaluation.experiments import activity_table

    yield activity_table(setting.takes)


EVALUATIONS = {"activities": activities}
