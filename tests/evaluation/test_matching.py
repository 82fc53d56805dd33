"""Matching by hand-made cases and invariants, and the error rates of a session told by hand."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from mplearn.errors import InvalidValueError
from mplearn.evaluation.matching import match_segments, tolerant_iou
from mplearn.evaluation.rates import rate_learning
from mplearn.recording import LabelledSegment, Segment
from mplearn.tree import Merge, Placement, Split


def truth(*spans):
    return [LabelledSegment(a, b, label) for a, b, label in spans]


def test_overlap_by_hand():
    motion = LabelledSegment(100, 200, "a")
    assert tolerant_iou(motion, Segment(100, 200), 0) == 1
    assert tolerant_iou(motion, Segment(150, 250), 0) == pytest.approx(50 / 150)
    assert tolerant_iou(motion, Segment(120, 220), 25) == 1  # both boundaries within the tolerance
    assert tolerant_iou(motion, Segment(100, 226), 25) == pytest.approx(100 / 126)
    assert tolerant_iou(motion, Segment(300, 400), 25) == 0
    short = LabelledSegment(100, 120, "a")
    assert tolerant_iou(short, Segment(120, 140), 25) == 0  # not even beside it


def test_cuts_joins_junk_and_pauses():
    motions = truth((0, 100, "a"), (100, 200, "b"), (260, 360, "c"), (360, 460, "d"))
    found = [
        Segment(0, 95),
        Segment(95, 140),  # the smaller part of b
        Segment(140, 205),  # the larger part of b
        Segment(205, 258, still=True),
        Segment(258, 460),  # c and d in one
    ]
    matching = match_segments(motions, found, 100.0)
    assert matching.labels == ("a", "", "b", "", "")
    assert matching.truth_of == (0, -1, 1, -1, -1)
    assert matching.found_of == (0, 2, -1, -1)
    assert matching.n_matched == 2


@given(st.integers(0, 10_000))
@settings(max_examples=60, deadline=None)
def test_matching_is_one_to_one_and_every_pair_overlaps(seed):
    rng = np.random.default_rng(seed)

    def cut(low, high):
        ends = np.cumsum(rng.integers(low, high, 12))
        return [(int(a), int(b)) for a, b in zip([0, *ends[:-1]], ends, strict=True)]

    motions = [LabelledSegment(a, b, f"{a}") for a, b in cut(20, 150)]
    found = [Segment(a, b, still=bool(rng.random() < 0.2)) for a, b in cut(20, 150)]
    matching = match_segments(motions, found, 100.0)
    for j, i in enumerate(matching.truth_of):
        if i >= 0:
            assert matching.found_of[i] == j
            assert matching.labels[j] == motions[i].label
            assert not found[j].still
            assert tolerant_iou(motions[i], found[j], 25) > 0.5
    assert sum(i >= 0 for i in matching.found_of) == matching.n_matched
    itself = match_segments(motions, [Segment(m.start, m.end) for m in motions], 100.0)
    assert itself.truth_of == tuple(range(len(motions)))


def test_bad_input_is_named():
    with pytest.raises(InvalidValueError, match="rate_hz"):
        match_segments([], [], 0.0)
    with pytest.raises(InvalidValueError, match="1 segments"):
        rate_learning([], [Segment(0, 9)], [], 100.0)


def say(number, node=0, recognised=False, **more):
    return Placement(number, node, recognised, 1.0, 0.5 if recognised else math.inf, **more)


def found_all(labels):
    """Motions of these labels, each of which was found exactly."""
    motions = [LabelledSegment(10 * i, 10 * i + 10, label) for i, label in enumerate(labels)]
    return motions, [Segment(m.start, m.end) for m in motions]


def test_rates_of_a_session_told_move_by_move():
    motions, found = found_all("abaaababbac")
    told = [
        say(0),
        say(1),
        say(2),
        say(3, 1, born=(1,), moved=((0, 1), (2, 1))),  # a: after three demonstrations
        say(4, 1, recognised=True),
        say(5, 1, recognised=True),  # b taken for a
        say(6),  # a missed
        say(7),
        say(8, 2, born=(2,), moved=((1, 2), (7, 2))),  # b: its fourth
        say(9, 1, recognised=True),
        say(10),  # c, of which there is no model: no error
    ]
    rates = rate_learning(motions, found, told, 10.0)
    assert rates.classes == {1: "a", 2: "b"}
    assert rates.extracted == ("a", "b")
    assert (rates.n_classes, rates.n_motions, rates.n_found) == (3, 11, 11)
    assert (rates.n_wrong, rates.n_missed, rates.n_recognised) == (1, 1, 2)
    assert rates.false_positive == rates.false_negative == pytest.approx(1 / 11)
    assert rates.coverage == pytest.approx(8 / 11)
    assert rates.demonstrations == {"a": 3, "b": 4}
    assert rates.n_spurious == rates.n_duplicates == 0


def test_spurious_duplicate_split_and_merged_primitives():
    motions, found = found_all("aabbaaab")
    told = [
        say(0),
        say(1),
        say(2),
        say(3, 1, born=(1,), moved=((0, 1), (1, 1), (2, 1))),  # half a, half b: spurious
        say(4, 1, recognised=True),  # and so everything in it is wrong
        say(
            5, 2, recognised=True, born=(2, 3),
            splits=(Split(1, (2, 3)),), moved=((0, 2), (1, 2), (4, 2), (2, 3), (3, 3)),
        ),
        say(6, 4, born=(4,)),  # a again
        say(7, 3, recognised=True),
    ]  # fmt: skip
    rates = rate_learning(motions, found, told, 10.0)
    assert rates.classes == {2: "a", 3: "b", 4: "a"}
    assert rates.n_duplicates == 1
    assert rates.n_wrong == 2
    assert rates.coverage == 1
    merged = rate_learning(
        motions, found, [*told[:7], say(7, 3, recognised=True, merges=(Merge(2, 4),))], 10.0
    )
    assert merged.classes == {2: "a", 3: "b"}
    assert merged.n_duplicates == 0
    assert merged.coverage == 1


def test_a_primitive_of_junk_is_spurious_and_junk_recognised_is_wrong():
    motions = truth((0, 100, "a"))
    found = [Segment(0, 100), Segment(100, 130), Segment(130, 160), Segment(160, 190)]
    told = [say(0), say(1), say(2, 1, born=(1,), moved=((1, 1),)), say(3, 1, recognised=True)]
    rates = rate_learning(motions, found, told, 100.0)
    assert rates.classes == {1: ""}
    assert rates.n_spurious == 1
    assert rates.n_wrong == 1
    assert rates.coverage == 0
