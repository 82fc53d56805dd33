"""Samples as a network brings them: each ends in one place of the even stream, or is counted."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from played import frames_of, texts_of

from mplearn.sources import Block, Change, Stream, Tally
from mplearn.sources.clock import measured_pace
from mplearn.sources.inbox import Inbox, Sample
from mplearn.sources.sequencer import FILLED_S, PATIENCE_FRAMES, Sequencer

STREAM = Stream(("a",), 100.0)


def sample(
    number: int | None, value: float, arrived_s: float, time_s: float | None = None, **more: object
) -> Sample:
    stream = more.pop("stream", STREAM)
    return Sample(stream, np.array([value]), arrived_s, number, time_s, **more)


def run(samples: list[Sample], **options: object) -> tuple[list[Block | Change], Tally]:
    tally = Tally()
    sequencer = Sequencer(tally, **{"ordered": False, **options})
    items = []
    for each in samples:
        items += sequencer.take([each], each.arrived_s)
    return items + sequencer.finish(), tally


def numbered(numbers: list[int]) -> list[Sample]:
    return [sample(n, float(n), 0.01 * i) for i, n in enumerate(numbers)]


def places(items: list[Block | Change]) -> dict[int, float]:
    """Return the frames that came by their places."""
    found = {}
    for block in items:
        if isinstance(block, Block):
            for t, row, gap in zip(block.times_s, block.frames, block.gaps, strict=True):
                assert gap == np.isnan(row[0])
                if not gap:
                    found[round(t * block.rate_hz)] = float(row[0])
    return found


@settings(max_examples=60, deadline=None)
@given(st.data())
def test_every_sample_is_in_its_place_or_counted(data: st.DataObject) -> None:
    n = data.draw(st.integers(1, 60))
    kept = [i for i in range(n) if i == 0 or data.draw(st.booleans(), label=f"keep {i}")]
    twice = data.draw(st.lists(st.sampled_from(kept), max_size=10))
    shaken = sorted(
        (i + data.draw(st.floats(0, 4.0)) * (i > 0), k) for k, i in enumerate(kept + twice)
    )
    order = [(kept + twice)[k] for _, k in shaken]
    if order[0] != 0:
        order = [0, *order]
    items, tally = run(numbered(order))
    found = places(items)
    assert all(place == value for place, value in found.items())
    assert tally.frames == len(found)
    assert tally.frames + tally.doubled + tally.late == len(order)
    blocks = [item for item in items if isinstance(item, Block)]
    times = np.concatenate([b.times_s for b in blocks])
    np.testing.assert_allclose(np.diff(times), 0.01)
    assert tally.lost == len(times) - len(found)
    assert (tally.lost, tally.doubled, tally.late) == (
        sum(b.lost for b in blocks),
        tally.doubled,
        tally.late,
    )


def test_a_frame_that_is_late_by_a_few_is_waited_for() -> None:
    items, tally = run(numbered([0, 2, 3, 1, 4]))
    assert frames_of(items)[:, 0].tolist() == [0, 1, 2, 3, 4]
    assert tally == Tally(frames=5)


def test_one_that_is_later_is_given_up_and_counted() -> None:
    order = [0, *range(2, 4 + PATIENCE_FRAMES), 1, 30]
    items, tally = run(numbered(order))
    assert np.isnan(frames_of(items)[1, 0])
    assert tally.late == 1
    assert 1.0 not in places(items).values()


def test_time_passing_ends_the_wait() -> None:
    tally = Tally()
    sequencer = Sequencer(tally, ordered=False)
    assert len(sequencer.take([sample(0, 0, 0.0), sample(2, 2, 0.02)], 0.02)) == 1
    assert sequencer.waits
    assert sequencer.take([], 0.03) == []
    (block,) = sequencer.take([], 0.2)
    assert isinstance(block, Block)
    assert block.lost == 1


def test_a_long_gap_begins_another_stretch() -> None:
    late = [sample(1000 + i, 1.0, 10.0 + 0.01 * i) for i in range(3)]
    items, tally = run(numbered([0, 1]) + late)
    blocks = [item for item in items if isinstance(item, Block)]
    assert [len(b) for b in blocks][-1] >= 1
    assert [b.joins for b in blocks if b.times_s[0] == 10.0] == [False]
    assert tally.lost == 998
    assert "998 frames are missing" in texts_of(items, "gap")[0]


@pytest.mark.parametrize("to", [-5000, 5_000_000])
def test_numbers_that_jump_cost_nothing(to: int) -> None:
    samples = numbered(list(range(20)))
    samples += [sample(to + i, 20.0 + i, 0.2 + 0.01 * i) for i in range(10)]
    items, tally = run(samples)
    assert frames_of(items)[:, 0].tolist() == list(range(30))
    assert all(b.joins for b in items[1:] if isinstance(b, Block))
    assert texts_of(items, "clock") == [f"the sender's numbers jumped from 19 to {to}"]
    assert tally == Tally(frames=30)


def test_numbers_that_start_again_after_a_pause_begin_another_stretch() -> None:
    samples = numbered(list(range(500, 520)))
    samples += [sample(i, 20.0 + i, 8.0 + 0.01 * i) for i in range(10)]
    items, tally = run(samples)
    assert [b.joins for b in items if isinstance(b, Block)].count(False) == 2
    assert tally.lost == round((8.0 - 0.19) * 100) - 1


@pytest.mark.parametrize("jump_s", [3600.0, -3600.0, 1e9])
@pytest.mark.parametrize("ordered", [True, False])
def test_a_clock_that_jumps_costs_nothing(jump_s: float, ordered: bool) -> None:
    samples = [
        sample(None, float(i), 0.01 * i, 0.01 * i + (jump_s if i >= 20 else 0.0)) for i in range(40)
    ]
    items, tally = run(samples, ordered=ordered)
    assert frames_of(items)[:, 0].tolist() == list(range(40))
    assert len(texts_of(items, "clock")) == 1
    assert tally == Tally(frames=40)


def test_numbers_win_over_a_clock_that_jumps() -> None:
    samples = [
        sample(i, float(i), 0.01 * i, 0.01 * i - (50.0 if i >= 20 else 0.0)) for i in range(40)
    ]
    items, tally = run(samples)
    assert frames_of(items)[:, 0].tolist() == list(range(40))
    assert texts_of(items, "clock") == ["the sender's clock jumped by -50.000 s"]
    assert tally == Tally(frames=40)


@pytest.mark.parametrize("ordered", [True, False])
def test_lost_frames_show_in_times_alone(ordered: bool) -> None:
    rng = np.random.default_rng(0)
    kept = [i for i in range(300) if i == 0 or rng.random() > 0.05]
    samples = [sample(None, float(i), 0.01 * i, 7.0 + 0.01 * i) for i in kept]
    items, tally = run(samples, ordered=ordered)
    assert places(items) == {i: float(i) for i in kept}
    assert tally.lost == kept[-1] + 1 - len(kept)


def test_stamps_of_a_reliable_network_may_jitter() -> None:
    rng = np.random.default_rng(1)
    stamps = np.sort(np.arange(500) * 0.01 + rng.exponential(0.008, 500))
    samples = [sample(None, float(i), t, t) for i, t in enumerate(stamps)]
    items, tally = run(samples, ordered=True)
    came = frames_of(items)[:, 0]
    assert came[~np.isnan(came)].tolist() == list(range(500))
    assert tally.doubled == 0
    assert tally.lost < 15  # until the jitter is known


def test_a_clock_that_is_a_little_fast_is_followed() -> None:
    samples = [sample(None, float(i), 0.01 * i, 0.01003 * i) for i in range(5000)]
    items, tally = run(samples)
    assert frames_of(items)[:, 0].tolist() == list(range(5000))
    assert tally == Tally(frames=5000)


def test_what_waits_too_long_is_dropped_and_counted() -> None:
    inbox = Inbox(capacity=10)
    for i in range(30):
        inbox.put(sample(i, float(i), 0.01 * i))
    waiting = inbox.take(0.0)
    inbox.put(sample(30, 30.0, 0.3))
    samples = [s for s in [*waiting, *inbox.take(0.0)] if isinstance(s, Sample)]
    items, tally = run(samples)
    assert places(items) == {**{i: float(i) for i in range(10)}, 30: 30.0}
    assert (tally.overrun, tally.lost, tally.frames) == (20, 0, 11)
    assert texts_of(items, "overrun") == ["20 frames found the queue full"]


def test_what_was_dropped_for_long_begins_another_stretch() -> None:
    samples = numbered(list(range(20)))
    samples += [sample(1020 + i, 1.0, 0.5 + 0.01 * i, dropped=1000 * (i == 0)) for i in range(5)]
    items, tally = run(samples)
    assert (tally.overrun, tally.lost, tally.frames) == (1000, 0, 25)
    assert texts_of(items, "clock") == []
    assert texts_of(items, "gap")[0].startswith("1000 frames are missing")
    assert max(places(items)) == 1024


def test_without_numbers_and_times_what_was_dropped_still_has_a_place() -> None:
    samples = [sample(None, 0.0, 0.0), sample(None, 1.0, 0.01, dropped=5), sample(None, 2.0, 0.02)]
    items, tally = run(samples, ordered=True)
    assert places(items) == {0: 0.0, 6: 1.0, 7: 2.0}
    assert (tally.overrun, tally.lost) == (5, 0)


def test_another_subject_is_counted_and_followed_when_the_first_is_gone() -> None:
    anna, ben = Stream(("a",), 100.0, subject="Anna"), Stream(("a",), 100.0, subject="Ben")
    samples = []
    for i in range(100):
        if i < 50:
            samples.append(sample(i, 1.0, 0.05 * i, stream=anna))
        samples.append(sample(i, 2.0, 0.05 * i + 0.001, stream=ben))
    items, tally = run(samples)
    said = texts_of(items, "subject")
    assert said[0] == "'Ben' appeared; 'Anna' is followed"
    assert said[1] == "'Ben' is followed now: 'Anna' is gone"
    assert len(said) == 2
    assert tally.foreign + tally.frames == len(samples)
    values = frames_of(items)[:, 0]
    assert values[0] == 1.0
    assert values[-1] == 2.0
    assert [b.joins for b in items if isinstance(b, Block)].count(False) == 2


def test_a_frame_of_another_width_is_damaged() -> None:
    wide = Sample(STREAM, np.zeros(3), 0.01, 1)
    _, tally = run([sample(0, 0.0, 0.0), wide, sample(2, 2.0, 0.02)])
    assert (tally.damaged, tally.lost, tally.frames) == (1, 1, 2)


def test_the_description_may_change_between_frames() -> None:
    other = Stream(("b", "c"), 100.0)
    samples = [sample(i, float(i), 0.01 * i) for i in range(5)]
    samples += [Sample(other, np.array([1.0, 2.0]), 0.01 * i, i) for i in range(5, 9)]
    items, tally = run(samples)
    blocks = [item for item in items if isinstance(item, Block)]
    assert [b.channels for b in blocks] == [("a",)] * 5 + [("b", "c")] * 4
    assert all(b.joins for b in blocks[1:])
    assert tally == Tally(frames=9)


@pytest.mark.parametrize("rate_hz", [59.94, 60.0, 100.0, 33.3, 240.0])
def test_a_rate_that_is_not_said_is_measured(rate_hz: float) -> None:
    stream = Stream(("a",), 0.0)
    samples = [
        sample(4 * i, float(i), i / rate_hz, 100 + i / rate_hz, stream=stream) for i in range(400)
    ]
    items, tally = run(samples)
    (found,) = {b.rate_hz for b in items if isinstance(b, Block)}
    assert found == pytest.approx(rate_hz, rel=0.012)
    assert frames_of(items)[:, 0].tolist() == list(range(400))
    assert tally == Tally(frames=400)


def test_uneven_times_are_interpolated() -> None:
    rng = np.random.default_rng(2)
    times = np.cumsum(rng.uniform(0.008, 0.025, 400))
    stream = Stream(("a",), 0.0)
    samples = [sample(None, math.sin(t), t, t, stream=stream) for t in times]
    items, _ = run(samples)
    blocks = [item for item in items if isinstance(item, Block)]
    at = np.concatenate([b.times_s for b in blocks]) + times[0]
    np.testing.assert_allclose(frames_of(items)[:, 0], np.sin(at), atol=2e-3)
    np.testing.assert_allclose(np.diff(at), 1.0 / blocks[0].rate_hz)
    assert at[-1] == pytest.approx(times[-1], abs=0.03)


def test_a_hint_of_the_rate_wins() -> None:
    samples = [sample(i, float(i), 0.02 * i, stream=Stream(("a",), 30.0)) for i in range(10)]
    items, _ = run(samples, rate_hz=50.0)
    assert {b.rate_hz for b in items if isinstance(b, Block)} == {50.0}


def test_measured_pace_knows_no_rate_from_nothing() -> None:
    assert measured_pace([None] * 3, [0.0, 0.0, 0.0]) is None
    assert measured_pace([5, 5, 5, 5], [0.0, 0.1, 0.2, 0.3]) is None
    assert FILLED_S > 0
    assert measured_pace([None] * 20, list(1e-12 * np.arange(20))) is None
    assert measured_pace([None] * 20, list(1e6 * np.arange(20))) is None


def test_a_clock_that_stands_holds_nothing_for_ever() -> None:
    silent = Stream(("a",), 0.0)
    samples = [sample(None, 1.0, 0.01 * i, 5.0, stream=silent) for i in range(5000)]
    sequencer = Sequencer(Tally(), ordered=False)
    items = [item for each in samples for item in sequencer.take([each], each.arrived_s)]
    assert sequencer.n_pending < 2048
    assert all("show no rate" in text for text in texts_of(items, "damaged"))
    assert len(texts_of(items, "damaged")) == 2
