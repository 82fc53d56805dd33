"""Which experiments there are for which data."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from typing import TYPE_CHECKING, TypeAlias

from .activities import EVALUATIONS as ACTIVITIES
from .activities import glitches, loops, peers, rates, rhythm
from .contents import EVALUATIONS as CONTENTS
from .people import EVALUATIONS as PEOPLE
from .people import inverse_kinematics
from .robot import EVALUATIONS as ROBOT
from .sessions import EVALUATIONS as SESSIONS
from .setting import Setting
from .synthetic import EVALUATIONS as SYNTHETIC

if TYPE_CHECKING:
    from mplearn.evaluation import LabelKind, Table

Evaluation: TypeAlias = Callable[[Setting], "Iterator[Table]"]

#: Sources of data that need no file.
BUILT_IN: Mapping[str, Mapping[str, Evaluation]] = {"paper-session": SYNTHETIC, "robot": ROBOT}


#: Experiments on recordings, by what their labels are.
OF_LABELS: Mapping[LabelKind, Mapping[str, Evaluation]] = {
    "repetitions": PEOPLE,
    "primitives": SESSIONS,
    "activities": ACTIVITIES,
    "contents": CONTENTS,
}

#: Experiments on people without labels.
UNLABELLED: Mapping[str, Evaluation] = {
    "rhythm": rhythm,
    "rates": rates,
    "loops": loops,
    "glitches": glitches,
    "peers": peers,
    "inverse-kinematics": inverse_kinematics,
}


def evaluations_for(setting: Setting) -> Mapping[str, Evaluation]:
    """Return the experiments on a source of data, by name, in the order they are run.

    Example:
        >>> list(evaluations_for(Setting("paper-session")))[:3]
        ['learning', 'presentations', 'walks']
    """
    if setting.data in BUILT_IN:
        return BUILT_IN[setting.data]
    return UNLABELLED if setting.unlabelled else OF_LABELS[setting.kind]
