"""Alarms of the learner: as often false as asked for, and raised at what is planted."""

import numpy as np
import pytest
from scipy.stats import binom

from mplearn import LearnerConfig, MotionLearner
from mplearn.demonstrator import demonstrate
from mplearn.errors import InvalidValueError
from mplearn.evaluation.observing import observe
from mplearn.graph import TransitionGraph
from mplearn.learner import Anomaly, SegmentClosed
from mplearn.learner.chain import Chain
from mplearn.recording import Segment
from mplearn.tree import Placement

ALLOWED = 0.05


@pytest.fixture(scope="module")
def learned(features):
    """A learner of four motions that recur, and what it said."""
    config = LearnerConfig(features.channels, features.rate_hz, false_alarms=ALLOWED)
    learner = MotionLearner(config)
    return learner, [event for events in learner.learn_recording(features) for event in events]


def alarms(events, kind):
    return [event for event in events if isinstance(event, Anomaly) and event.kind == kind]


def test_motions_that_recur_are_seldom_an_alarm(learned):
    _, events = learned
    closed = [e for e in events if isinstance(e, SegmentClosed) and e.placement is not None]
    false = alarms(events, "motion") + alarms(events, "order")
    assert len(false) <= binom.ppf(0.999, 2 * len(closed), ALLOWED)


def test_motions_that_were_never_shown_are_alarms(learned):
    learner = MotionLearner.from_state(learned[0].state())
    planted = demonstrate(["BAR", "BAL", "SQD", "SQR"], seed=4)
    before = learner.n_frames
    said = [e for events in learner.learn_recording(observe(planted.recording)) for e in events]
    raised = alarms(said, "motion")
    for motion in planted.truth:
        start, end = before + motion.start, before + motion.end
        inside = [a for a in raised if min(a.segment.end, end) - max(a.segment.start, start) > 50]
        assert len(inside) == (motion.label in ("SQD", "SQR")), motion
    assert all(a.p_value <= ALLOWED and a.score > 1 for a in raised)


def followed(chain, sequence, *, start=0):
    """Feed a chain with recognised segments; return which transitions it was surprised by."""
    surprised = []
    for i, id in enumerate(sequence, start=start):
        placement = Placement(i, int(id), True, 0.1, 0.5, nearest=int(id))
        events = chain.follow(Segment(100 * i, 100 * i + 100), placement, ALLOWED)
        surprised.append([e for e in events if isinstance(e, Anomaly)])
    return surprised


def walk(rng, n):
    """A walk over eight primitives of which each is followed by two others, by one seldom."""
    at, out = 1, []
    for _ in range(n):
        at = at % 8 + 1 if rng.random() < 0.9 else (at + 2) % 8 + 1
        out.append(at)
    return out


def chain_of(n):
    graph = TransitionGraph()
    for id in range(1, n + 1):
        graph.add_node(id)
    return Chain(graph, 100.0, 2.0)


@pytest.mark.parametrize("seed", range(3))
def test_usual_orders_are_seldom_an_alarm_and_a_planted_one_is(seed):
    rng = np.random.default_rng(seed)
    chain = chain_of(8)
    sequence = walk(rng, 600)
    followed(chain, sequence)
    later = walk(rng, 400)
    false = followed(chain, later, start=600)[1:]
    assert sum(map(len, false)) <= binom.ppf(0.999, len(false), ALLOWED)
    wrong = later[-1]  # nothing is ever followed by itself
    (alarm,) = followed(chain, [wrong], start=1000)[0]
    assert alarm.kind == "order"
    assert alarm.p_value <= ALLOWED
    assert alarm.score > -np.log(ALLOWED)


def test_too_little_was_seen_for_an_alarm():
    chain = chain_of(4)
    assert not any(followed(chain, [1, 2, 3, 4, 1, 2, 3, 4, 4]))


def test_the_nearest_primitive_stands_in_for_what_is_not_recognised():
    chain = chain_of(4)
    followed(chain, [1, 2, 3, 4] * 5)
    unknown = Placement(20, 0, False, 2.0, 1.3, nearest=2)
    chain.follow(Segment(2000, 2100), unknown, ALLOWED)
    assert chain.foresee(1)[0].id == 3
    assert chain.graph.n_transitions == 19  # it foretells, but is not counted
    chain.broken()
    assert chain.foresee(1)[0].id in chain.graph


def test_a_learner_foretells_what_comes_next(learned):
    learner, _ = learned
    assert MotionLearner(learner.config).predict_next() == ()
    predictions = learner.predict_next(2)
    assert len(predictions) == 2
    assert predictions[0].probability >= predictions[1].probability
    again = MotionLearner.from_state(learner.state())
    assert again.predict_next(2) == predictions
    with pytest.raises(InvalidValueError, match="k must be at least 1"):
        learner.predict_next(0)


@pytest.mark.parametrize("share", [0.0, 1.0, float("nan")])
def test_a_share_of_false_alarms_lies_between_none_and_all(share):
    with pytest.raises(InvalidValueError, match="false_alarms"):
        LearnerConfig(("a",), false_alarms=share)
