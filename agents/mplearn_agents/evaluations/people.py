"""Experiments on people's takes, each of which repeats one movement, with labelled repetitions."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING

from .setting import Setting

if TYPE_CHECKING:
    from mplearn.evaluation import Table


def boundaries(setting: Setting) -> Iterator[Table]:
    """Boundaries between repetitions, in the takes as they are."""
    from mplearn.evaluation.experiments import boundary_table

    yield boundary_table(setting.takes)


def learning(setting: Setting) -> Iterator[Table]:
    """First presentation, one person at a time."""
    from mplearn.evaluation.experiments import learning_table

    yield learning_table("Sessions made of each person's takes", setting.people_outcomes)


def presentations(setting: Setting) -> Iterator[Table]:
    """Presented once, twice, by halves and all at once."""
    from mplearn.evaluation.experiments import presentation_table

    yield presentation_table(setting.seen)


def together(setting: Setting) -> Iterator[Table]:
    """All people in one stream, the person unknown: block-wise and interleaved."""
    from mplearn.evaluation.experiments import learn_together, people_table

    if len({take.person for take in setting.takes}) > 1:
        yield people_table(list(learn_together(setting.takes, setting.orders)))


def prediction(setting: Setting) -> Iterator[Table]:
    """What comes next, against perfect labels: each repetition once, then four times."""
    from mplearn.evaluation.experiments import (
        foretell_sessions,
        observed_sessions,
        prediction_table,
    )

    title = "The next primitive, in sessions made of each person's takes"
    yield prediction_table(title, foretell_sessions(setting.sessions))
    often = observed_sessions(setting.takes, orders=1, executions=4)
    yield prediction_table(f"{title}, each repetition used four times", foretell_sessions(often))


def rejection(setting: Setting) -> Iterator[Table]:
    """Motions of unknown kinds against the stated rate at which they may be accepted."""
    from mplearn.evaluation.experiments import rejection_table

    yield rejection_table(setting.seen)


def anomaly(setting: Setting) -> Iterator[Table]:
    """Planted wrong motions and orders, and motions performed wrongly on purpose."""
    from mplearn.evaluation.experiments import anomaly_table, judge_people

    yield from _filled(anomaly_table(judge_people(setting.takes, setting.wrong_takes)))


def scaffolding(setting: Setting) -> Iterator[Table]:
    """Boundaries with and without what is known."""
    from mplearn.evaluation.experiments import scaffolding_table

    yield scaffolding_table(
        session for i, (_, session) in enumerate(setting.sessions) if i % setting.orders < 2
    )


def generation(setting: Setting) -> Iterator[Table]:
    """Generated motions against repetitions kept back."""
    from mplearn.evaluation.experiments import generation_table

    yield from _filled(generation_table(setting.takes))


def chains(setting: Setting) -> Iterator[Table]:
    """Factorial models against longer chains."""
    from mplearn.evaluation.experiments import factorial_table

    yield from _filled(factorial_table(setting.takes))


def inverse_kinematics(setting: Setting) -> Iterator[Table]:
    """Distance of the body's markers from the measured ones."""
    from mplearn.evaluation.experiments import marker_residual_table

    yield from _filled(marker_residual_table(take for take in setting.takes if take.is_markers))


def walks(setting: Setting) -> Iterator[Table]:
    """The robot walks at random on what was learned, and in any order."""
    from mplearn.learner import LearnerConfig, MotionLearner
    from mplearn_envs.experiments import learned_table

    from ..walk_table import walk_table

    takes = setting.takes
    learner = MotionLearner(LearnerConfig(takes[0].channels, takes[0].rate_hz))
    for take in takes:
        for _ in learner.learn_recording(take):
            pass
    walked = [("all takes", learner.snapshot())]
    walked += [
        (name, each.learner.snapshot()) for name, each in setting.people_outcomes[:: setting.orders]
    ]
    performable = [(name, library) for name, library in walked if library.body and len(library)]
    if performable:
        yield walk_table(performable, setting.seeds)
        yield learned_table(performable, setting.seeds)


def shards(setting: Setting) -> Iterator[Table]:
    """People learned apart and merged, against one learner for all."""
    from mplearn.evaluation.experiments import shard_table, shards_of_people

    if len({take.person for take in setting.takes}) > 1:
        learned, asked = shards_of_people(setting.takes)
        yield shard_table("a shard is a person", learned, asked)


def quality(setting: Setting) -> Iterator[Table]:
    """Motions performed wrongly on purpose, judged against right ones."""
    from mplearn.evaluation.experiments import quality_table

    if setting.wrong_takes:
        yield from _filled(quality_table(setting.takes, setting.wrong_takes))


def _filled(table: Table) -> Iterator[Table]:
    """Yield a table that has rows: where there was too little to measure it has none."""
    if table.rows:
        yield table


EVALUATIONS = {
    "boundaries": boundaries,
    "learning": learning,
    "presentations": presentations,
    "together": together,
    "prediction": prediction,
    "rejection": rejection,
    "anomaly": anomaly,
    "generation": generation,
    "inverse-kinematics": inverse_kinematics,
    "scaffolding": scaffolding,
    "chains": chains,
    "shards": shards,
    "quality": quality,
    "walks": walks,
}
