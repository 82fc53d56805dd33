"""Gaps: what is seen passes, what is hidden is predicted, what flies is not believed."""

from __future__ import annotations

import json
import subprocess
import sys

import numpy as np
import pytest
from mocap_writers import person
from scipy.spatial.transform import Rotation

from mplearn.errors import FrameError, InvalidValueError
from mplearn.mocap import GapConfig, GapTracker


def turning_body(rate_hz: float, duration_s: float = 4.0, n_markers: int = 6) -> np.ndarray:
    """A rigid body that swings and sways, (T, M, 3)."""
    time = np.arange(int(duration_s * rate_hz)) / rate_hz
    body = np.random.default_rng(1).uniform(-0.15, 0.15, (n_markers, 3))
    turn = Rotation.from_euler("yz", np.stack([np.sin(3 * time), 2 * time], axis=1)).as_matrix()
    sway = np.stack([0.3 * np.sin(2 * time), 0.1 * time, 1.0 + 0.2 * np.cos(4 * time)], axis=1)
    return np.einsum("tij,mj->tmi", turn, body) + sway[:, None]


def track(tracker: GapTracker, frames: np.ndarray) -> np.ndarray:
    return np.array([tracker.update(frame) for frame in frames])


def test_what_is_seen_passes_unchanged() -> None:
    frames = person(200, 10)
    assert np.array_equal(track(GapTracker(10, 100.0), frames), frames)


@pytest.mark.parametrize("rate_hz", [20.0, 60.0, 100.0, 250.0])
def test_a_rigid_neighbourhood_shows_where_a_marker_is(rate_hz: float) -> None:
    frames = turning_body(rate_hz)
    start, end = int(2.0 * rate_hz), int(2.4 * rate_hz)
    hidden = frames.copy()
    hidden[start:end, 2] = np.nan
    filled = track(GapTracker(6, rate_hz), hidden)
    assert filled == pytest.approx(frames, abs=1e-9)


def test_neighbours_that_move_differently_count_less() -> None:
    frames = turning_body(100.0)
    others = person(len(frames), 5, seed=3)
    others += 0.3 * np.sin(np.arange(len(frames)) / 20.0)[:, None, None]
    both = np.concatenate([frames, others], axis=1)
    hidden = both.copy()
    hidden[300:340, 2] = np.nan
    filled = track(GapTracker(11, 100.0), hidden)
    assert np.abs(filled - both)[300:340, 2].max() < 0.01  # it moves by 0.2 m meanwhile


@pytest.mark.parametrize("rate_hz", [20.0, 100.0, 250.0])
def test_alone_a_marker_coasts_with_fading_velocity(rate_hz: float) -> None:
    config = GapConfig(coast_s=0.1)
    time = np.arange(int(3 * rate_hz)) / rate_hz
    frames = (0.5 * time)[:, None, None] * np.array([1.0, 0.0, 0.0]) + 1.0
    start = int(2 * rate_hz)
    hidden = frames.copy()
    hidden[start : start + int(0.4 * rate_hz)] = np.nan
    filled = track(GapTracker(1, rate_hz, config), hidden)
    gone = np.arange(1, int(0.4 * rate_hz) + 1)
    fade = np.exp(-1 / (rate_hz * config.coast_s))
    way = 0.5 / rate_hz * np.array([(fade ** np.arange(1, n + 1)).sum() for n in gone])
    at = filled[start : start + len(gone), 0, 0]
    assert at == pytest.approx(frames[start - 1, 0, 0] + way, abs=1e-6)


@pytest.mark.parametrize("rate_hz", [20.0, 100.0, 250.0])
def test_given_up_after_the_stated_gap_and_taken_up_again(rate_hz: float) -> None:
    gap_frames = round(0.5 * rate_hz)
    frames = turning_body(rate_hz)
    hidden = frames.copy()
    start, end = int(rate_hz), int(2 * rate_hz)
    hidden[start:end, 0] = np.nan
    filled = track(GapTracker(6, rate_hz), hidden)
    lost = np.flatnonzero(np.isnan(filled[:, 0]).any(axis=1))
    assert lost.tolist() == list(range(start + gap_frames, end))
    assert np.array_equal(filled[end:, 0], frames[end:, 0])


def test_not_seen_yet_is_nan() -> None:
    frames = person(30, 4)
    hidden = frames.copy()
    hidden[:10, 1] = np.nan
    filled = track(GapTracker(4, 100.0), hidden)
    assert np.array_equal(filled, hidden, equal_nan=True)


@pytest.mark.parametrize("rate_hz", [20.0, 100.0, 250.0])
def test_a_flying_marker_is_not_believed(rate_hz: float) -> None:
    frames = turning_body(rate_hz)
    wrong = frames.copy()
    at = int(2 * rate_hz)
    wrong[at : at + 2, 3] += [1.5, -1.0, 0.7]
    filled = track(GapTracker(6, rate_hz), wrong)
    assert filled == pytest.approx(frames, abs=1e-9)


def test_a_marker_that_stays_elsewhere_is_believed_in_the_end() -> None:
    frames = np.zeros((200, 4, 3)) + person(1, 4)
    frames[100:, 0] += 20.0
    filled = track(GapTracker(4, 100.0), frames)
    assert np.array_equal(filled[:100], frames[:100])
    assert filled[100:150, 0] == pytest.approx(frames[:50, 0])
    assert np.array_equal(filled[152:], frames[152:])


@pytest.mark.parametrize("rate_hz", [20.0, 100.0])
def test_the_fastest_human_motion_is_believed(rate_hz: float) -> None:
    time = np.arange(int(2 * rate_hz)) / rate_hz
    speed = 12.0  # a fist or a foot [m/s]
    swing = 1.2 * np.sin(speed / 1.2 * time)
    frames = person(1, 5) + swing[:, None, None] * np.array([1.0, 0.0, 0.0])
    assert np.array_equal(track(GapTracker(5, rate_hz), frames), frames)


def test_many_gaps_at_once_leave_nothing_infinite() -> None:
    rng = np.random.default_rng(0)
    frames = person(400, 12)
    hidden = frames.copy()
    hidden[rng.random(frames.shape[:2]) < 0.5] = np.nan
    hidden[200:230] = np.nan
    filled = track(GapTracker(12, 100.0), hidden)
    known = ~np.isnan(filled)
    assert known[20:].all()
    assert np.abs(filled - frames)[20:].max() < 0.2


def test_resumes_bit_for_bit() -> None:
    rng = np.random.default_rng(0)
    frames = turning_body(100.0)
    frames[rng.random(frames.shape[:2]) < 0.2] = np.nan
    whole = track(GapTracker(6, 100.0), frames)
    first = GapTracker(6, 100.0)
    track(first, frames[:151])
    state = first.state()
    track(first, frames[151:200])  # must not reach into the state
    second = GapTracker(6, 100.0)
    second.load_state(state)
    track(first, frames[:3])
    assert np.array_equal(track(second, frames[151:]), whole[151:], equal_nan=True)
    with pytest.raises(InvalidValueError, match="6 markers, not of 5"):
        GapTracker(5, 100.0).load_state(state)


def test_input_is_left_alone_and_output_is_fresh() -> None:
    tracker = GapTracker(3, 100.0)
    frame = person(1, 3)[0]
    kept = frame.copy()
    out = tracker.update(frame)
    out[:] = 99.0
    assert np.array_equal(frame, kept)
    frame[0] = np.nan
    assert tracker.update(frame)[0] == pytest.approx(kept[0])


@pytest.mark.parametrize("shape", [(3,), (4, 3), (3, 2), (9,)])
def test_wrong_width(shape: tuple[int, ...]) -> None:
    with pytest.raises(FrameError, match=r"\(3, 3\)"):
        GapTracker(3, 100.0).update(np.zeros(shape))


def test_infinite_position() -> None:
    with pytest.raises(FrameError, match="infinite"):
        GapTracker(1, 100.0).update(np.array([[np.inf, 0.0, 0.0]]))


def test_wrong_settings() -> None:
    with pytest.raises(InvalidValueError, match="n_markers"):
        GapTracker(0, 100.0)
    with pytest.raises(InvalidValueError, match="rate_hz"):
        GapTracker(3, np.nan)
    with pytest.raises(InvalidValueError, match="max_gap_s"):
        GapConfig(max_gap_s=0.0)


def test_importing_the_room_imports_nothing_heavy() -> None:
    code = "import sys, json, mplearn.mocap; print(json.dumps(list(sys.modules)))"
    out = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, check=True
    ).stdout
    loaded = set(json.loads(out))
    assert not loaded & {"filterpy", "matplotlib", "ezc3d", "dm_control", "pandas"}
