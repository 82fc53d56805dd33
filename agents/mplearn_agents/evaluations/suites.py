"""Which experiments there are for which data."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, TypeAlias

from .activities import EVALUATIONS as ACTIVITIES
from .people import EVALUATIONS as PEOPLE
from .robot import EVALUATIONS as ROBOT
from .setting import Setting
from .synthetic import EVALUATIONS as SYNTHETIC

if TYPE_CHECKING:
    from mplearn.evaluation import Table

Evaluation: TypeAlias = Callable[[Setting], "Iterator[Table]"]

#: Sources of data that need no file.
BUILT_IN: Mapping[str, Mapping[str, Evaluation]] = {"paper-session": SYNTHETIC, "robot": ROBOT}


def evaluations_for(data: str) -> Mapping[str, Evaluation]:
    """Return the experiments on a source of data, by name, in the order they are run."""
    if data in BUILT_IN:
        return BUILT_IN[data]
    return ACTIVITIES if any(Path(data).glob("*labels*.json")) else PEOPLE
