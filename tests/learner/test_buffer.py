import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from mplearn.errors import InvalidValueError
from mplearn.learner.buffer import FrameBuffer


@settings(deadline=None)
@given(st.lists(st.tuples(st.integers(1, 700), st.integers(0, 900)), min_size=1, max_size=6))
def test_a_buffer_is_a_window_on_the_stream(steps: list[tuple[int, int]]) -> None:
    buffer, stream = FrameBuffer(2), []
    for appended, dropped in steps:
        for _ in range(appended):
            stream.append((len(stream), -len(stream)))
            buffer.append(np.array(stream[-1], dtype=float))
        buffer.drop_before(buffer.first + dropped)
        assert buffer.end == len(stream)
        if len(buffer):
            held = buffer.take(buffer.first, buffer.end)
            assert np.array_equal(held, np.array(stream[buffer.first :], dtype=float))
    other = FrameBuffer(2)
    other.load_state(buffer.state())
    assert (other.first, other.end) == (buffer.first, buffer.end)


def test_memory_does_not_grow_with_the_stream() -> None:
    buffer = FrameBuffer(3)
    for t in range(20_000):
        buffer.append(np.full(3, float(t)))
        buffer.drop_before(t - 99)
    assert len(buffer) == 100
    assert buffer._frames.nbytes <= 512 * 3 * 8


def test_frames_outside_are_refused() -> None:
    buffer = FrameBuffer(1)
    buffer.append(np.zeros(1))
    with pytest.raises(InvalidValueError, match=r"\[0, 2\)"):
        buffer.take(0, 2)
