"""Scores of boundaries, against cases worked out by hand and all matchings written out."""

from itertools import permutations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from mplearn.errors import InvalidValueError
from mplearn.evaluation.boundaries import (
    Boundary,
    BoundaryScore,
    found_boundaries,
    match_boundaries,
    score_boundaries,
    true_boundaries,
)
from mplearn.recording import LabelledSegment, Segment


def motion(start, end, delay=10):
    return Segment(start, end, 1.0, end + delay)


def pause(start, end, delay=5):
    return Segment(start, end, 1.0, end + delay, still=True)


def label(start, end):
    return LabelledSegment(start, end, "m")


def test_a_pause_is_one_boundary_with_an_extent():
    segments = [pause(0, 10), motion(10, 50), motion(50, 90), pause(90, 120), pause(120, 150),
                motion(150, 190), pause(190, 220)]  # fmt: skip
    assert found_boundaries(segments) == (
        Boundary(10, 10, 5),
        Boundary(50, 50, 10),
        Boundary(90, 150, 10),
        Boundary(190, 190, 10),
    )


def test_a_stream_of_one_kind_has_no_boundaries():
    assert found_boundaries([]) == ()
    assert found_boundaries([motion(0, 10)]) == ()
    assert found_boundaries([pause(0, 10), pause(10, 20)]) == ()


def test_truth_leaves_out_the_ends_of_the_stream():
    assert true_boundaries([label(5, 50), label(50, 90), label(120, 200)], 210, 25) == (
        Boundary(50, 50),
        Boundary(90, 120),
    )
    assert true_boundaries([label(50, 100)], 200, 25) == (Boundary(50, 50), Boundary(100, 100))


def test_overlapping_labels_are_refused():
    with pytest.raises(InvalidValueError, match="overlap"):
        true_boundaries([label(0, 50), label(40, 90)], 100, 5)


boundaries = st.lists(st.integers(0, 60), max_size=5).map(
    lambda frames: [Boundary(f, f + f % 3) for f in sorted(frames)]
)


@given(truth=boundaries, found=boundaries, tolerance=st.integers(0, 12))
@settings(max_examples=150, deadline=None)
def test_matching_is_the_largest_then_the_nearest(truth, found, tolerance):
    pairs = match_boundaries(truth, found, tolerance)
    assert len({i for i, _ in pairs}) == len({j for _, j in pairs}) == len(pairs)
    cost = [truth[i].distance(found[j]) for i, j in pairs]
    assert all(c <= tolerance for c in cost)
    padded = [*range(len(found)), *[-1] * len(truth)]
    best = (0, 0)
    for choice in set(permutations(padded, len(truth))):
        distances = [truth[i].distance(found[j]) for i, j in enumerate(choice) if j >= 0]
        if all(d <= tolerance for d in distances):
            best = min(best, (-len(distances), sum(distances)))
    assert (-len(pairs), sum(cost)) == best


def test_a_score_worked_out_by_hand():
    labels = [label(100, 200), label(200, 300), label(350, 450)]
    segments = [motion(0, 103), motion(103, 204), motion(204, 260), motion(260, 310),
                pause(310, 340), motion(340, 600)]  # fmt: skip
    score = score_boundaries(segments, labels, 100.0)
    # truth: 100, 200, [300, 350], 450; found: 103, 204, 260, [310, 340]
    assert (score.n_truth, score.n_found, score.n_matched) == (4, 4, 3)
    assert (score.recall, score.precision, score.f1) == (0.75, 0.75, 0.75)
    assert sorted(score.errors_s) == [0.0, 0.03, 0.04]
    assert score.median_delay_s == pytest.approx(0.1)


def test_pooling_counts_every_boundary_alike():
    a = BoundaryScore(4, 5, np.array([0.0, 0.1]), np.array([0.2, 0.3]))
    b = BoundaryScore(6, 3, np.array([0.2]), np.array([0.1]))
    both = BoundaryScore.pooled([a, b])
    assert (both.n_truth, both.n_found, both.n_matched) == (10, 8, 3)
    assert both.median_delay_s == pytest.approx(0.2)
    assert BoundaryScore.pooled([]).f1 == 1.0


def test_nothing_to_score_is_refused():
    with pytest.raises(InvalidValueError, match="labels"):
        score_boundaries([motion(0, 10)], [], 100.0)
