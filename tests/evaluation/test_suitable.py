import numpy as np
import pytest

from mplearn.errors import RecordingError
from mplearn.evaluation import alike, kind_of_labels, repeating
from mplearn.recording import LabelledSegment, Recording


def take(labels, name="take", rate_hz=100.0, channels=("a", "b"), length=20):
    parts = [LabelledSegment(length * i, length * (i + 1), each) for i, each in enumerate(labels)]
    rng = np.random.default_rng(0)
    return Recording(
        frames=rng.normal(size=(length * max(1, len(parts)), len(channels))),
        rate_hz=rate_hz,
        channels=channels,
        name=name,
        labels=tuple(parts),
    )


@pytest.mark.parametrize(
    ("labels", "kind"),
    [
        (["mmmm", "nn", "", "o"], "repetitions"),
        (["abababab", "bababacac"], "primitives"),
        (["abcab"], "activities"),
        (["mm", "abc", "de"], "activities"),
        (["a", "b", "c"], "activities"),
    ],
)
def test_labels_tell_what_they_are(labels, kind):
    assert kind_of_labels([take(each) for each in labels]) == kind


def test_nothing_labelled_is_refused():
    with pytest.raises(RecordingError, match="no recording has labels"):
        kind_of_labels([take(""), take("")])


def test_takes_without_two_whole_repetitions_are_left_out():
    takes = [take("mm", "two"), take("m", "one"), take("", "none"), take("mn", "other")]
    takes.append(take("mm", "short", length=9))
    assert [each.name for each in repeating(takes)] == ["two"]


def test_recordings_are_brought_to_the_lowest_rate_of_the_usual_channels():
    fast, slow = take("mm", "fast", 100.0), take("mm", "slow", 50.0)
    near, odd = take("mm", "near", 50.004), take("mm", "odd", 20.0, ("a",))
    chosen = {each.name: each for each in alike([fast, slow, near, odd])}
    assert {name: each.rate_hz for name, each in chosen.items()} == dict.fromkeys(chosen, 50.0)
    assert set(chosen) == {"fast", "slow", "near"}
    assert len(chosen["fast"]) == len(fast) // 2
    assert [label.end for label in chosen["fast"].labels] == [10, 20]
    assert np.array_equal(chosen["near"].frames, near.frames)
    assert alike([]) == ()
