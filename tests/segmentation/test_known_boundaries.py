"""Boundaries that are known: exactly, in made signals; from people's takes, in real ones."""

import itertools
import sys

import numpy as np
import pytest
from data_folder import DATA, needs_data
from known_motions import bell_motions

from mplearn.evaluation.boundaries import BoundaryScore, score_boundaries
from mplearn.evaluation.executions import split_repetitions, without_gaps
from mplearn.evaluation.sessions import make_session
from mplearn.segmentation import (
    KohlmorgenLemm,
    KohlmorgenLemmConfig,
    ZeroVelocity,
    ZeroVelocityConfig,
    make_segmenter,
)

both = pytest.mark.parametrize("name", ["kohlmorgen-lemm", "zero-velocity"])


@both
@pytest.mark.parametrize("rate_hz", [20.0, 25.0, 50.0, 100.0, 200.0, 250.0])
def test_bell_shaped_motions_are_cut_where_they_meet(name, rate_hz):
    frames, labels = bell_motions(40, 6, rate_hz, seed=1, noise=2e-4)
    segments = make_segmenter(name, 6, rate_hz).segment(frames)
    score = score_boundaries(segments, labels, rate_hz, tolerance_s=0.1)
    assert score.f1 >= 0.97
    assert score.median_error_s <= max(0.02, 1.0 / rate_hz)
    assert score.median_delay_s <= 0.35


@both
def test_pauses_are_still_segments(name):
    frames, labels = bell_motions(40, 6, 100.0, seed=2, noise=2e-4)
    segments = make_segmenter(name, 6, 100.0).segment(frames)
    gaps = [(a.end, b.start) for a, b in itertools.pairwise(labels) if b.start > a.end]
    still = [(s.start, s.end) for s in segments[1:] if s.still]
    assert len(still) == len(gaps) + 1  # the last motion is followed by one, too
    for (a, b), (c, d) in zip(gaps, still, strict=False):
        assert abs(a - c) <= 15
        assert abs(b - d) <= 15


@both
@pytest.mark.parametrize("scale", [1e-3, 57.3, 1e4])
def test_the_unit_does_not_matter(name, scale):
    frames, _ = bell_motions(15, 4, 100.0, seed=3)
    plain = make_segmenter(name, 4, 100.0).segment(frames)
    scaled = make_segmenter(name, 4, 100.0).segment(scale * frames)
    assert [(s.start, s.end) for s in plain] == [(s.start, s.end) for s in scaled]


def test_a_long_motion_is_closed_in_time():
    t = np.arange(6000) / 100.0
    frames = np.column_stack([t, 2.0 * t]) + 0.01 * np.sin(9.0 * t)[:, None]
    config = ZeroVelocityConfig(max_length_s=4.0)
    segments = ZeroVelocity(2, 100.0, config).segment(frames)
    assert max(s.length_frames for s in segments) <= 401
    assert any(s.confidence == 0.0 for s in segments)


def test_sure_boundaries_are_deeper():
    """A full stop is surer than a slowing down."""
    t = np.arange(400) / 100.0
    speed = np.abs(np.sin(np.pi * t / 0.8)) + 0.15 * (t > 2.0)
    segments = ZeroVelocity(1, 100.0).segment(np.cumsum(speed)[:, None] / 100.0)
    stops = [s for s in segments if s.end < 190]
    slowings = [s for s in segments if 210 < s.end < 380]
    assert min(s.confidence for s in stops) > max(s.confidence for s in slowings)


def calls_for(segmenter, frame):
    """How many functions a frame calls."""
    calls = 0

    def count(_frame, event, _argument):
        nonlocal calls
        calls += event in ("call", "c_call")

    sys.setprofile(count)
    try:
        segmenter.update(frame)
    finally:
        sys.setprofile(None)
    return calls


def size_of(state):
    if isinstance(state, dict):
        return sum(map(size_of, state.values()))
    return getattr(state, "nbytes", 8)


@both
def test_a_frame_costs_the_same_few_calls_and_no_memory_however_many_came_before(name):
    calls = {}
    for n_channels in (3, 30):
        frames, _ = bell_motions(30, n_channels, 100.0, seed=4)
        segmenter = make_segmenter(name, n_channels, 100.0)
        segmenter.segment(frames[:100])  # compiles
        calls[n_channels] = [calls_for(segmenter, frame) for frame in frames[:1000]]
        size = size_of(segmenter.state())
        for frame in frames[1000:-1000]:
            segmenter.update(frame)
        late = [calls_for(segmenter, frame) for frame in frames[-1000:]]
        assert size_of(segmenter.state()) == size
        assert set(late) == set(calls[n_channels])
    assert set(calls[3]) == set(calls[30])
    assert max(calls[30]) < 20


def pelvis_features(recording):
    """Key markers in a frame that goes with the pelvis, and its height, shape (T, 43) [m]."""
    points = without_gaps(recording.frames).reshape(len(recording), -1, 3)
    at = recording.marker_names.index
    front_l, front_r, back_l, back_r = (points[:, at(n)] for n in ("LASI", "RASI", "LPSI", "RPSI"))
    pelvis = (front_l + front_r + back_l + back_r) / 4
    across = front_l + back_l - front_r - back_r
    angle = np.arctan2(across[:, 1], across[:, 0])
    key = [
        "LFHD",
        "C7",
        "LSHO",
        "LELB",
        "LWRA",
        "RSHO",
        "RELB",
        "RWRA",
        "LKNE",
        "LANK",
        "LTOE",
        "RKNE",
        "RANK",
        "RTOE",
    ]
    offset = points[:, [at(n) for n in key]] - pelvis[:, None]
    c, s = np.cos(angle)[:, None], np.sin(angle)[:, None]
    x, y = offset[..., 0], offset[..., 1]
    turned = np.stack([c * x + s * y, c * y - s * x, offset[..., 2]], axis=2)
    return np.column_stack([turned.reshape(len(points), -1), pelvis[:, 2]])


@needs_data
@both
@pytest.mark.parametrize("person", ["s04", "s05"])
def test_boundaries_of_people_no_setting_was_chosen_on(name, person):
    from mplearn.mocap import open_recording

    assert DATA is not None
    takes = [open_recording(DATA / "ui_prmd", take=f"m{m:02d}_{person}") for m in (1, 2, 4, 7, 9)]
    scores = []
    for take in split_repetitions(takes):
        segments = make_segmenter(name, 43, 100.0).segment(pelvis_features(take))
        scores.append(score_boundaries(segments, take.labels, 100.0))
    assert BoundaryScore.pooled(scores).f1 >= 0.95
    session = make_session(takes, np.random.default_rng(0))
    segments = make_segmenter(name, 43, 100.0).segment(pelvis_features(session))
    score = score_boundaries(segments, session.labels, 100.0)
    assert score.f1 >= 0.9
    assert score.median_delay_s <= 0.2


def there_and_back(rate_hz):
    """Return motions up, back and a rest, each its own mirror image in time.

    Also the frame of each top, and of each rest the first and the last frame.
    """
    length = round(rate_hz)
    x = np.arange(1, length + 1) / length
    up = x**3 * (10 - 15 * x + 6 * x**2)
    rest = np.zeros(length)
    frames = np.concatenate([rest, *[up, 1 - up, rest] * 6])
    begins = length + 3 * length * np.arange(6)
    rests = zip(begins[:-1] + 2 * length - 1, begins[1:] - 1, strict=True)
    return frames[:, None], begins + length - 1, list(rests)


def assert_no_lateness(late, what, within=1):
    assert np.abs(late).max() < within, f"{what}: boundaries are {np.median(late):+g} frames late"


@both
@pytest.mark.parametrize("rate_hz", [25.0, 50.0, 100.0, 200.0])
def test_no_boundary_is_a_frame_late_or_early(name, rate_hz):
    """Of what is its own mirror image in time, boundaries are: at the top, around a rest."""
    frames, tops, rests = there_and_back(rate_hz)
    segments = make_segmenter(name, 1, rate_hz).segment(frames)
    dips = [s.end for s in segments if s.cause == "dip"]
    assert_no_lateness(np.subtract(dips, tops), f"{name} at {rate_hz:g} Hz, dips of the speed")
    still = [(s.start, s.end - 1) for s in segments if s.still][1:-1]
    middles = np.sum(still, axis=1) / 2 - np.sum(rests, axis=1) / 2
    assert_no_lateness(middles, f"{name} at {rate_hz:g} Hz, rests")


@pytest.mark.parametrize("phase", [0.0, 0.7])
def test_no_turn_is_frames_late_or_early(phase):
    """What never rests is cut where it reverses along its longest axis."""
    turn = 30  # frames from one reversal to the next
    angles = np.pi * np.arange(1000) / turn + phase
    frames = np.column_stack([np.sin(angles), 0.8 * np.cos(angles)])
    segments = make_segmenter("kohlmorgen-lemm", 2, 50.0).segment(frames)
    ends = np.array([s.end for s in segments if s.cause == "turn"][4:])  # the axis is known
    assert len(ends) > 20
    reversals = turn * (0.5 - phase / np.pi)
    late = (ends - reversals + turn / 2) % turn - turn / 2
    assert_no_lateness(late, "turns", within=2)


@pytest.mark.parametrize("exact", [False, True])
@pytest.mark.parametrize("embedding", [1, 3])
def test_no_change_of_state_is_frames_late_or_early(embedding, exact):
    """Two clouds of postures by turns: which frame is of which is known."""
    length = 100
    sides = np.repeat([-1.0, 1.0] * 4, length)
    noise = 0.05 * np.random.default_rng(0).normal(size=(len(sides), 2))
    config = KohlmorgenLemmConfig(
        density="posture",
        embedding=embedding,
        window_s=0.3,
        fifo_s=5.0,
        sigma=0.8,
        exact=exact,
        zero_velocity=ZeroVelocityConfig(max_length_s=30.0),
    )
    segments = KohlmorgenLemm(2, 50.0, config).segment(np.outer(sides, [1.0, -0.5]) + noise)
    ends = [s.end for s in segments if s.cause == "state"]
    assert len(ends) == 7
    assert_no_lateness(np.subtract(ends, length * np.arange(1, 8)), "changes of state", within=2)
