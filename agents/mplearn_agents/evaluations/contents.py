"""Experiments on takes whose names tell what they show, and in which style."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING

from .activities import rates, rhythm
from .setting import Setting

if TYPE_CHECKING:
    from mplearn.evaluation import Table


def contents(setting: Setting) -> Iterator[Table]:
    """Contents told apart, in each style and in all styles in one stream."""
    from mplearn.evaluation.experiments import content_table

    yield content_table(setting.bodies)


EVALUATIONS = {"contents": contents, "rhythm": rhythm, "rates": rates}
