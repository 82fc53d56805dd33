import numpy as np
import pytest

from mplearn.errors import InvalidValueError, MPLearnError, RecordingError, UnknownPrimitiveError
from mplearn.recording import LabelledSegment, Recording, Segment, marker_channels


def markers(t: int = 10) -> Recording:
    frames = np.arange(t * 6, dtype=float).reshape(t, 6)
    labels = (LabelledSegment(0, 4, "a"), LabelledSegment(4, 8, "b"))
    return Recording(frames, 100.0, marker_channels(("A", "B")), "take", "s01", labels)


def test_markers_are_a_view_with_one_row_a_marker() -> None:
    recording = markers()
    assert recording.marker_names == ("A", "B")
    assert recording.markers.shape == (10, 2, 3)
    assert recording.markers[3, 1].tolist() == recording.frames[3, 3:].tolist()
    assert np.shares_memory(recording.markers, recording.frames)


def test_channels_out_of_order_are_not_markers() -> None:
    recording = Recording(np.zeros((2, 3)), 100.0, ("A.y", "A.x", "A.z"))
    assert not recording.is_markers
    with pytest.raises(RecordingError, match=r"A\.y"):
        _ = recording.marker_names


def test_slices_shift_labels_and_drop_cut_ones() -> None:
    part = markers().sliced(3, 9)
    assert len(part) == 6
    assert part.labels == (LabelledSegment(1, 5, "b"),)
    with pytest.raises(InvalidValueError, match="11"):
        markers().sliced(3, 11)


@pytest.mark.parametrize(
    ("frames", "rate", "channels", "said"),
    [
        (np.zeros(3), 100.0, ("a", "b", "c"), r"\(3,\)"),
        (np.zeros((3, 2)), 100.0, ("a",), "2 columns"),
        (np.zeros((3, 1)), 0.0, ("a",), "0.0"),
        (np.zeros((3, 1)), np.nan, ("a",), "nan"),
        (np.full((3, 1), np.inf), 100.0, ("a",), "infinite"),
        (np.zeros((3, 2)), ("a", "b"), 100.0, "channels must be names, one a column, not 100.0"),
        (np.zeros((3, 2)), 100.0, "ab", "'ab'"),
        (np.zeros((3, 1)), "100", ("a",), "a positive, finite number, not '100'"),
        (np.zeros((3, 2)), 100.0, {"a", "b"}, "names, one a column"),
        ([["a"]], 100.0, ("a",), "numbers"),
    ],
)
def test_a_recording_refuses_what_is_not_one(
    frames: np.ndarray, rate: float, channels: tuple[str, ...], said: str
) -> None:
    with pytest.raises(RecordingError, match=said):
        Recording(frames, rate, channels)


def test_a_rate_may_be_as_numpy_keeps_it() -> None:
    recording = Recording(np.zeros((3, 1)), np.array(50.0), ("a",))  # type: ignore[arg-type]
    assert recording.rate_hz == 50.0
    assert isinstance(recording.rate_hz, float)


@pytest.mark.parametrize("kind", [Segment, lambda s, e: LabelledSegment(s, e, "x")])
@pytest.mark.parametrize(("start", "end"), [(-1, 2), (3, 3), (4, 2)])
def test_a_segment_is_not_empty(kind, start: int, end: int) -> None:
    with pytest.raises(InvalidValueError, match=str(end)):
        kind(start, end)


def test_errors_print_their_sentence() -> None:
    error = UnknownPrimitiveError("no primitive 7; known are 1, 2")
    assert isinstance(error, MPLearnError)
    assert str(error) == "no primitive 7; known are 1, 2"
