"""Rates of activities, against a count frame by frame, and by hand."""

import math
from collections import Counter

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from mplearn.demonstrator import demonstrate
from mplearn.errors import InvalidValueError
from mplearn.evaluation.experiments import exercise_table
from mplearn.evaluation.ownership import Heard, frame_labels, rate_ownership
from mplearn.recording import LabelledSegment, Segment
from mplearn.tree import Merge, Placement, Split


def placed(number, node, *, recognised=False, **more):
    return Placement(number, node, recognised, 0.0, 0.0, **more)


def heard(lengths, placements):
    ends = np.cumsum(lengths).tolist()
    segments = tuple(
        Segment(end - length, end, still=placement is None)
        for end, length, placement in zip(ends, lengths, placements, strict=True)
    )
    return Heard(ends[-1], segments, tuple(placements))


def test_a_stream_by_hand():
    labels = np.array(["walk"] * 30 + [""] * 10 + ["jump"] * 20 + ["walk"] * 25)
    said = heard(
        [10, 10, 10, 10, 10, 10, 15, 10],
        [
            placed(0, 0),
            placed(1, 5, born=(5,), moved=((0, 5),)),
            placed(2, 5, recognised=True),
            None,  # a pause
            placed(3, 5, recognised=True),  # a jump, taken for a walk
            placed(4, 0),
            placed(5, 5, recognised=True),
            placed(6, 0, refused="too short"),
        ],
    )
    rates = rate_ownership([(labels, said)])
    assert rates.activities == ("jump", "walk") and rates.owned == ("walk",)
    assert rates.n_moving == 75 and rates.n_found == 6
    assert rates.inside == pytest.approx(45 / 75)
    assert rates.covered == pytest.approx(55 / 75)
    assert rates.recognised == pytest.approx(25 / 75)
    assert rates.false_positive == pytest.approx(1 / 6)
    assert rates.purity == pytest.approx(45 / 55)
    assert rates.demonstrations == {"walk": 2}


def test_merged_and_split_primitives_take_their_segments_with_them():
    labels = np.array(["a"] * 20 + ["b"] * 20 + ["a"] * 10)
    said = heard(
        [10] * 5,
        [
            placed(0, 1, born=(1,)),
            placed(1, 2, born=(2,)),
            placed(2, 1, recognised=True, merges=(Merge(1, 2),)),
            placed(
                3,
                4,
                recognised=True,
                born=(3, 4),
                splits=(Split(1, (3, 4)),),
                moved=((0, 3), (1, 3), (2, 4)),
            ),
            placed(4, 3, recognised=True),
        ],
    )
    rates = rate_ownership([(labels, said)])
    assert dict(rates.primitives) == {3: "a", 4: "b"}
    assert rates.purity == 1.0 and rates.inside == 1.0
    assert rates.n_wrong == 2  # both of b: what they were placed in was of a until the split
    assert rates.n_recognised == 10


@given(st.lists(st.tuples(st.integers(1, 9), st.integers(0, 3), st.text("ab", max_size=1))))
def test_against_a_count_frame_by_frame(pieces):
    pieces = [(3, 0, "a"), *pieces]
    labels = np.concatenate([np.full(n, label, dtype="<U1") for n, _, label in pieces])
    said = heard(
        [n for n, _, _ in pieces], [placed(i, node) for i, (_, node, _) in enumerate(pieces)]
    )
    nodes = np.concatenate([np.full(n, node) for n, node, _ in pieces])
    rates = rate_ownership([(labels, said)])
    inside = covered = purest = 0
    for node in (1, 2, 3):
        votes = Counter(labels[(nodes == node) & (labels != "")].tolist())
        covered += votes.total()
        purest += max(votes.values(), default=0)
        inside += sum(count for count in votes.values() if 2 * count > votes.total())
    assert (rates.n_covered, rates.n_inside) == (covered, inside)
    assert rates.n_moving == (labels != "").sum()
    assert math.isnan(rates.purity) if not covered else rates.purity == purest / covered


def test_labels_of_frames_overlap():
    labels = (LabelledSegment(0, 8, "move"), LabelledSegment(5, 9, "turn"))
    assert frame_labels(labels, 10).tolist() == ["move"] * 5 + ["turn"] * 4 + [""]
    assert frame_labels((), 2).tolist() == ["", ""]


def test_what_does_not_fit_is_refused():
    with pytest.raises(InvalidValueError, match="1 segments need as many placements, not 0"):
        Heard(5, (Segment(0, 5),), ())
    with pytest.raises(InvalidValueError, match="5 frames need labels, not 4"):
        rate_ownership([(np.full(4, "a"), heard([5], [placed(0, 0)]))])


def test_exercises_are_learned_at_their_own_rate_and_at_half():
    shown = demonstrate(["BAR", "BAL"] * 8 + ["BAD", "BAU"] * 8, seed=3)
    half = shown.truth[16].start
    labels = (
        LabelledSegment(0, half, "arms"),
        LabelledSegment(half, len(shown.recording), "bow"),
    )
    take = shown.recording.__class__(
        shown.recording.frames,
        shown.recording.rate_hz,
        shown.recording.channels,
        "one",
        "p",
        labels,
    )
    table = exercise_table([("", [take]), ("other", [take])], rates_hz=(50.0, 500.0))
    rows = {row[:2]: row for row in table.rows}
    own, fifty = rows["one", "100 Hz (own)"], rows["one", "50 Hz"]
    assert rows["one (other)", "50 Hz"][2:] == fifty[2:]
    assert rows["mean of single takes", "50 Hz"][4] == fifty[4]
    assert len(rows) == 6
    for row in (own, fifty):
        assert row[3] == "2 of 2"
        assert float(row[5].removesuffix(" %")) > 70.0
