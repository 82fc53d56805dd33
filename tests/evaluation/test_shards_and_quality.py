"""Libraries asked about sessions whose truth is known, and executions that are wrong."""

from dataclasses import replace

import numpy as np
import pytest

from mplearn import LearnerConfig, MotionLearner
from mplearn.demonstrator import Person, demonstrate
from mplearn.evaluation.experiments.execution_quality import quality_table
from mplearn.evaluation.experiments.shards import ask, shard_table
from mplearn.recording import LabelledSegment, Recording


def session(person: Person, seed: int, order: tuple[str, ...] = ("BAR", "BAL")) -> Recording:
    shown = demonstrate(list(order) * 8, seed=seed, person=person, rate_hz=50.0)
    return replace(shown.recording, labels=tuple(shown.truth), person=person.name)


@pytest.fixture(scope="module")
def people() -> list[Person]:
    rng = np.random.default_rng(2)
    return [Person.random(rng, name) for name in ("anna", "ben")]


@pytest.fixture(scope="module")
def learned(people: list[Person]) -> list[Recording]:
    return [session(person, seed) for seed, person in enumerate(people)]


def test_what_is_asked_is_counted(learned: list[Recording]) -> None:
    learner = MotionLearner(LearnerConfig(learned[0].channels, 50.0))
    for _ in learner.learn_recording(learned[0], 100):
        pass
    asked = ask(learner.snapshot(), learned[:1])
    assert asked.classes == ("BAL", "BAR")
    assert (asked.n_classes, asked.n_motions) == (2, 16)
    assert asked.n_right + asked.n_wrong + asked.n_missed <= asked.n_found
    assert asked.coverage > 0.8
    assert asked.false_positive < 0.1
    empty = MotionLearner(LearnerConfig(learned[0].channels, 50.0)).snapshot()
    nothing = ask(empty, learned[:1])
    assert (nothing.primitives, nothing.classes, nothing.coverage) == (0, (), 0.0)
    assert nothing.n_missed == 0


def test_shards_of_two_people_are_as_good_as_one_pass(
    people: list[Person], learned: list[Recording]
) -> None:
    again = [session(person, 10 + seed) for seed, person in enumerate(people)]
    table = shard_table("two", learned, again)
    whole, merged = table.rows
    assert whole[2] == merged[2] == "2 of 2"
    assert float(merged[-1].split()[0]) >= float(whole[-1].split()[0]) - 10


def test_wrong_executions_are_judged_worse(people: list[Person]) -> None:
    def repetitions(seed: int, reach: float) -> Recording:
        person = replace(people[0], joint_reach=dict.fromkeys(people[0].joint_reach, reach))
        shown = demonstrate(["BAR", "BAL"] * 12, seed=seed, person=person, rate_hz=50.0)
        pairs = zip(shown.truth[::2], shown.truth[1::2], strict=True)
        labels = tuple(LabelledSegment(a.start, b.end, "raise", "anna") for a, b in pairs)
        return replace(shown.recording, labels=labels, person="anna", name="raise")

    table = quality_table([repetitions(1, 1.0)], [repetitions(2, 0.5)])
    (row,) = table.rows
    assert row[0] == "anna"
    assert float(row[-1]) > 0.75  # right above wrong
