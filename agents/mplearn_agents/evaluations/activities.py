"""Experiments on recordings whose labels are activities, coarser than primitives."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING

from mplearn.errors import InvalidValueError

from .setting import Setting

if TYPE_CHECKING:
    from mplearn.evaluation import Table


def activities(setting: Setting) -> Iterator[Table]:
    """Which activity goes on when, the number of activities not given."""
    from mplearn.evaluation.experiments import activity_table

    labelled = [take for take in setting.takes if take.labels]
    if not labelled:
        raise InvalidValueError(f"no recording in {setting.data} has labels")
    yield activity_table(labelled)


EVALUATIONS = {"activities": activities}
