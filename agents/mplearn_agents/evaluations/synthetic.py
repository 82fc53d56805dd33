"""Experiments on sessions like the paper's: 16 minutes, 22 types, by the synthetic demonstrator."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING

from .setting import Setting

if TYPE_CHECKING:
    from mplearn.evaluation import Table


def learning(setting: Setting) -> Iterator[Table]:
    """First presentation: the paper's main experiment."""
    from mplearn.evaluation.experiments import learning_table

    yield learning_table(
        "Sessions like the paper's, of the synthetic demonstrator", setting.paper_outcomes
    )


def presentations(setting: Setting) -> Iterator[Table]:
    """Presented once, twice, by halves and all at once."""
    from mplearn.evaluation.experiments import presentation_table

    yield presentation_table(setting.paper_seen)


def peers(setting: Setting) -> Iterator[Table]:
    """The posture motion graph, fed the same stream."""
    from mplearn.evaluation.experiments import peers_table

    yield peers_table(setting.seeds[0])


def prediction(setting: Setting) -> Iterator[Table]:
    """What comes next, against perfect labels."""
    from mplearn.evaluation.experiments import foretell_paper_sessions, prediction_table

    yield prediction_table(
        "The next primitive, in sessions like the paper's", foretell_paper_sessions(setting.seeds)
    )


def rejection(setting: Setting) -> Iterator[Table]:
    """Motions of unknown kinds against the stated rate at which they may be accepted."""
    from mplearn.evaluation.experiments import rejection_table

    yield rejection_table(setting.paper_seen)


def anomaly(setting: Setting) -> Iterator[Table]:
    """Planted wrong motions and wrong orders."""
    from mplearn.evaluation.experiments import anomaly_table, judge_paper_session

    yield anomaly_table(judge_paper_session(seed) for seed in setting.seeds)


def shards(setting: Setting) -> Iterator[Table]:
    """Sessions learned apart and merged, against one learner for all."""
    from mplearn.evaluation.experiments import demonstrated_shards, shard_table

    learned, asked = demonstrated_shards(setting.seeds)
    yield shard_table("a shard is half a session like the paper's", learned, asked)


def group_tests(setting: Setting) -> Iterator[Table]:
    """Tests that compare groups: false alarms in 1,000 studies without a difference."""
    from mplearn.evaluation.experiments import group_test_table

    yield group_test_table()


def inverse_kinematics(setting: Setting) -> Iterator[Table]:
    """Joint angles against the demonstrator's."""
    from mplearn.evaluation.experiments import joint_error_table

    yield joint_error_table(setting.seeds)


def walks(setting: Setting) -> Iterator[Table]:
    """The robot walks at random on what was learned."""
    from ..walk_table import walk_table

    libraries = [(name, each.learner.snapshot()) for name, each in setting.paper_outcomes]
    yield walk_table(libraries, setting.seeds)


EVALUATIONS = {
    "learning": learning,
    "presentations": presentations,
    "walks": walks,
    "prediction": prediction,
    "rejection": rejection,
    "anomaly": anomaly,
    "peers": peers,
    "inverse-kinematics": inverse_kinematics,
    "shards": shards,
    "group-tests": group_tests,
}
