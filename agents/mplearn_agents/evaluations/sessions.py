"""Experiments on recordings whose labels are primitives: each recording is a session as it is."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING

from .setting import Setting

if TYPE_CHECKING:
    from mplearn.evaluation import Table


def learning(setting: Setting) -> Iterator[Table]:
    """First presentation of each session."""
    from mplearn.evaluation.experiments import learn_session, learning_table

    outcomes = [(take.name, learn_session(take)) for take in setting.takes]
    yield learning_table("Sessions as they were recorded", outcomes)


def presentations(setting: Setting) -> Iterator[Table]:
    """Presented once, twice, by halves and all at once."""
    from mplearn.evaluation.experiments import Seen, presentation_table

    yield presentation_table((take.name, Seen.of(take)) for take in setting.takes)


def prediction(setting: Setting) -> Iterator[Table]:
    """What comes next, against perfect labels."""
    from mplearn.evaluation.experiments import foretell_sessions, prediction_table

    yield prediction_table(
        "The next primitive, in sessions as they were recorded",
        foretell_sessions((take.name, take) for take in setting.takes),
    )


EVALUATIONS = {"learning": learning, "presentations": presentations, "prediction": prediction}
