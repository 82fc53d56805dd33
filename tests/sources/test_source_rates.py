"""Streams at another rate."""

import numpy as np
import pytest
from played import Given, blocks, frames_of

from mplearn.errors import InvalidValueError
from mplearn.learner import learnable_rate
from mplearn.sources import Block, Stream, open_source
from mplearn.sources.rate import ResampledSource


def wave(rate_hz: float, seconds: float = 4.0) -> np.ndarray:
    times = np.arange(round(seconds * rate_hz)) / rate_hz
    return np.stack([np.sin(2 * np.pi * times), np.cos(3.0 * times)], axis=1)


@pytest.mark.parametrize("size", [1, 7, 1000])
@pytest.mark.parametrize(
    ("old", "new"), [(500.0, 100.0), (100.0, 60.0), (15.0, 30.0), (240.0, 100.0)]
)
def test_a_slow_wave_stays_what_it_is(old: float, new: float, size: int) -> None:
    source = ResampledSource(Given(blocks(Stream(("a", "b"), old), wave(old), size=size)), new)
    items = [item for item in source if isinstance(item, Block)]
    times = np.concatenate([b.times_s for b in items])
    np.testing.assert_allclose(times, np.arange(len(times)) / new, atol=1e-12)
    expected = np.stack([np.sin(2 * np.pi * times), np.cos(3.0 * times)], axis=1)
    np.testing.assert_allclose(
        frames_of(items)[2:], expected[2:], atol=0.06 if old == 15.0 else 0.01
    )
    assert len(times) >= 4.0 * new - 4
    assert {b.rate_hz for b in items} == {new}


def test_blocks_of_any_size_give_the_same() -> None:
    stream = Stream(("a", "b"), 90.0)
    given = (Given(blocks(stream, wave(90.0), size=n)) for n in (1, 50))
    one, many = (frames_of(list(ResampledSource(each, 50.0))) for each in given)
    np.testing.assert_array_equal(one, many)


def test_what_is_faster_than_the_new_rate_can_show_is_left_out() -> None:
    fast = np.sin(2 * np.pi * 190.0 * np.arange(2000) / 500.0)[:, None]
    source = ResampledSource(Given(blocks(Stream(("a",), 500.0), fast)), 100.0)
    assert np.abs(frames_of(list(source))[5:]).max() < 0.1


def test_gaps_stay_gaps() -> None:
    frames = np.ones((100, 1))
    frames[40:60] = np.nan
    items = list(ResampledSource(Given(blocks(Stream(("a",), 100.0), frames)), 50.0))
    came = frames_of(items)[:, 0]
    assert np.isnan(came[20:30]).all()
    assert (came[~np.isnan(came)] == 1.0).all()
    assert np.isnan(came).sum() in (10, 11)


def test_the_same_rate_passes_untouched() -> None:
    frames = wave(100.0)
    with ResampledSource(
        Given(blocks(Stream(("a", "b"), 100.0), frames)), learnable_rate
    ) as source:
        np.testing.assert_array_equal(frames_of(list(source)), frames)


def test_a_rate_that_cannot_be_learned_is_changed() -> None:
    with open_source("demonstrator", speed=float("inf"), rate_hz=500.0, at_hz=learnable_rate) as s:
        rates = set()
        for _, item in zip(range(40), s, strict=False):
            if isinstance(item, Block):
                rates.add(item.rate_hz)
    assert rates == {250.0}
    with pytest.raises(InvalidValueError, match="rate_hz must lie in"):
        open_source("demonstrator", at_hz=0.1)
