from dataclasses import dataclass
from functools import cache, cached_property

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from mplearn.errors import InvalidValueError
from mplearn.generation import (
    STYLES,
    Trajectory,
    estimate_dynamics,
    gaps_filled,
    generate,
)
from mplearn.hmm import LeftRightHMM, fit
from mplearn.maths.filters import lowpass

RATE = 100.0
CHANNELS = ("a", "b", "c")
POSTURES = np.array([[0.0, 0.0, 0.0], [1.0, -0.5, 0.3], [0.2, 1.2, -0.8]])


@dataclass(frozen=True)
class Example:
    id: int
    hmm: LeftRightHMM
    exemplars: tuple
    mean_duration_s: float

    @cached_property
    def dynamics(self):
        return estimate_dynamics(self.hmm, self.exemplars, RATE)


def demonstration(source, target, n_frames, rng, noise=0.003):
    s = np.linspace(0, 1, n_frames)[:, None]
    course = 10 * s**3 - 15 * s**4 + 6 * s**5
    motion = POSTURES[source] + (POSTURES[target] - POSTURES[source]) * course
    return motion + noise * rng.standard_normal(motion.shape)


def primitive(id, source, target, seed=0):
    rng = np.random.default_rng(seed + 10 * id)
    motions = [demonstration(source, target, n, rng) for n in (95, 110, 120, 101, 89)]
    lengths = [len(motion) for motion in motions]
    return Example(id, fit(motions, 8), tuple(motions), float(np.mean(lengths)) / RATE)


@cache
def walk():
    return [primitive(4, 0, 1), primitive(7, 1, 2), primitive(7, 1, 2), primitive(9, 2, 0)]


rng = np.random.default_rng


@pytest.mark.parametrize("style", STYLES)
def test_every_style_performs_the_path(style):
    motion = generate(walk(), CHANNELS, RATE, style=style, rng=rng(0))
    assert motion.path == (4, 7, 7, 9)
    durations = np.diff(np.append(motion.starts, len(motion))) / RATE
    np.testing.assert_allclose(durations, [p.mean_duration_s for p in walk()], atol=1 / RATE)
    for position, one in enumerate(walk()):
        piece = motion.piece(position)
        assert set(piece.primitive_ids.tolist()) == {one.id}
    # each primitive ends where it was demonstrated to end (7 after 7 has to jump back first)
    for position, posture in ((0, POSTURES[1]), (2, POSTURES[2]), (3, POSTURES[0])):
        np.testing.assert_allclose(motion.piece(position).frames[-1], posture, atol=0.12)


@pytest.mark.parametrize("style", STYLES)
@pytest.mark.parametrize("rate_hz", [20.0, 31.7, 250.0])
def test_any_rate_gives_the_same_motion(style, rate_hz):
    path = walk()[:2]
    at_own = generate(path, CHANNELS, RATE, style=style, rng=rng(1))
    other = generate(path, CHANNELS, RATE, style=style, rng=rng(1), rate_hz=rate_hz)
    assert other.duration_s == pytest.approx(at_own.duration_s, abs=2 / rate_hz)
    times = (np.arange(len(other)) + 0.5) / rate_hz
    own_times = (np.arange(len(at_own)) + 0.5) / RATE
    for d in range(3):
        expected = np.interp(times, own_times, at_own.frames[:, d])
        np.testing.assert_allclose(other.frames[:, d], expected, atol=0.12)


@pytest.mark.parametrize("style", STYLES)
@settings(max_examples=15, deadline=None)
@given(start=st.lists(st.floats(-3, 3), min_size=3, max_size=3))
def test_a_given_posture_is_the_first_frame_and_nothing_jumps(style, start):
    motion = generate(walk()[:2], CHANNELS, RATE, style=style, rng=rng(2), start=np.array(start))
    np.testing.assert_allclose(motion.frames[0], start, atol=1e-5)
    np.testing.assert_allclose(motion.frames[1], start, atol=0.05)  # and from rest
    furthest = np.abs(np.array(start) - POSTURES[0]).max() + 1.5
    assert np.abs(motion.velocities).max() < 1.9 * furthest / 0.2
    np.testing.assert_allclose(motion.frames[-1], POSTURES[2], atol=0.12)


def test_deterministic_unfiltered_is_the_papers():
    one = walk()[0]
    motion = generate([one], CHANNELS, RATE, cutoff_hz=np.inf)
    postures, stays = np.unique(motion.frames, axis=0, return_counts=True)
    assert len(postures) == one.hmm.n_states
    order = np.argsort(one.hmm.means[:, 0])
    np.testing.assert_array_equal(np.sort(postures[:, 0]), one.hmm.means[order, 0])
    assert stays.sum() == round(one.mean_duration_s * RATE)
    # 1 / (1 - a_ii), as the maximum-likelihood model without a prior has it
    decoded = np.mean(
        [np.bincount(one.hmm.decode(frames), minlength=8) for frames in one.exemplars], axis=0
    )
    np.testing.assert_allclose(stays, decoded[np.argsort(one.hmm.means[:, 0])], atol=1)


def test_filtered_deterministic_is_the_filter_of_the_steps():
    steps = generate(walk(), CHANNELS, RATE, cutoff_hz=np.inf)
    np.testing.assert_array_equal(
        generate(walk(), CHANNELS, RATE, cutoff_hz=4.0).frames, lowpass(steps.frames, RATE, 4.0)
    )


def test_smooth_beats_the_papers_in_error_and_in_jerk():
    errors, jerks = {}, {}
    held_out = demonstration(0, 1, 103, rng(99), noise=0.0)
    for style in ("deterministic", "smooth"):
        motion = generate(walk()[:1], CHANNELS, RATE, style=style)
        errors[style] = np.sqrt(np.mean((motion.frames - held_out) ** 2))
        jerks[style] = np.abs(np.diff(motion.frames, n=3, axis=0)).mean()
    assert errors["smooth"] < 0.5 * errors["deterministic"]
    assert jerks["smooth"] < 0.8 * jerks["deterministic"]
    assert errors["smooth"] < 0.03


def test_nearest_replays_an_exemplar():
    one = walk()[0]
    motion = generate([one], CHANNELS, RATE, style="nearest")
    n = len(motion)
    distances = []
    for frames in one.exemplars:
        place = np.linspace(0, len(frames) - 1, n)
        own = [np.interp(place, np.arange(len(frames)), frames[:, d]) for d in range(3)]
        distances.append(np.abs(motion.frames - np.transpose(own)).max())
    assert min(distances) < 1e-12
    likeliest = np.argmax([one.hmm.score(f) / len(f) for f in one.exemplars])
    assert np.argmin(distances) == likeliest


def test_averaged_is_reproducible_and_tends_to_the_expected_motion():
    few = [
        generate(walk()[:1], CHANNELS, RATE, style="averaged", rng=rng(5)).frames for _ in range(2)
    ]
    np.testing.assert_array_equal(*few)
    many = generate(walk()[:1], CHANNELS, RATE, style="averaged", rng=rng(5), n_samples=800)
    smooth = generate(walk()[:1], CHANNELS, RATE, style="smooth")
    assert np.abs(many.frames - smooth.frames).mean() < 0.06
    with pytest.raises(InvalidValueError, match="rng"):
        generate(walk()[:1], CHANNELS, RATE, style="averaged")


def test_a_primitive_without_exemplars_can_still_be_generated():
    bare = Example(3, walk()[0].hmm, (), walk()[0].mean_duration_s)
    for style in ("deterministic", "averaged", "smooth"):
        motion = generate([bare], CHANNELS, RATE, style=style, rng=rng(0))
        full = generate(walk()[:1], CHANNELS, RATE, style=style, rng=rng(0))
        assert abs(len(motion) - len(full)) <= 1
        assert np.abs(motion.frames[:100] - full.frames[:100]).max() < 0.35
    with pytest.raises(InvalidValueError, match="no exemplars"):
        generate([bare], CHANNELS, RATE, style="nearest")


def test_one_state_one_frame():
    hmm = LeftRightHMM(np.zeros((1, 3)), np.ones((1, 3)), np.zeros(1))
    tiny = Example(0, hmm, (np.zeros((1, 3)),), 0.01)
    for style in STYLES:
        motion = generate([tiny, tiny], CHANNELS, RATE, style=style, rng=rng(0), start=np.ones(3))
        assert len(motion) == 2
        np.testing.assert_allclose(motion.frames[0], 1.0, atol=1e-6)


def test_bad_requests_are_named():
    for wrong, match in (
        ({"style": "ballet"}, "style must be one of"),
        ({"rate_hz": 0.0}, "rate_hz"),
        ({"rate_hz": np.nan}, "rate_hz"),
        ({"rate_hz": 1e12}, "more than 5000000"),
        ({"blend_s": -1.0}, "blend_s"),
        ({"n_samples": 0}, "n_samples"),
        ({"start": np.zeros(2)}, r"shape \(3,\)"),
        ({"start": np.array([0, np.nan, 0])}, "finite posture"),
        ({"cutoff_hz": 0.0}, "cutoff_hz"),
        ({"cutoff_hz": np.nan}, "cutoff_hz"),
    ):
        with pytest.raises(InvalidValueError, match=match):
            generate(walk()[:1], CHANNELS, RATE, **wrong)
    with pytest.raises(InvalidValueError, match="at least one primitive"):
        generate([], CHANNELS, RATE)


def test_gaps_are_bridged_in_time_or_filled_from_the_model():
    hmm = walk()[0].hmm
    frames = walk()[0].exemplars[0].copy()
    frames[20:40, 0] = np.nan
    frames[:, 1] = np.nan
    filled = gaps_filled(frames, hmm)
    np.testing.assert_allclose(
        filled[20:40, 0], np.linspace(frames[19, 0], frames[40, 0], 22)[1:-1]
    )
    np.testing.assert_allclose(filled[[0, -1], 1], hmm.means[[0, -1], 1])
    np.testing.assert_array_equal(filled[:, 2], frames[:, 2])


def test_a_trajectory_refuses_what_it_cannot_be():
    frames, ids = np.zeros((4, 1)), np.array([3, 3, 5, 5])
    motion = Trajectory(frames, RATE, ("x",), ids)
    assert motion.starts.tolist() == [0, 2]
    assert motion.path == (3, 5)
    assert Trajectory(frames, RATE, ("x",), ids, np.array([0, 1, 2])).path == (3, 3, 5)
    for wrong in (
        {"frames": np.zeros((4, 2))},
        {"frames": np.full((4, 1), np.nan)},
        {"frames": np.zeros((0, 1)), "primitive_ids": np.zeros(0)},
        {"primitive_ids": ids[:3]},
        {"rate_hz": -1.0},
        {"starts": np.array([1, 2])},
        {"starts": np.array([0, 3])},
        {"starts": np.array([0, 2, 2])},
        {"starts": np.array([0, 2, 9])},
    ):
        arguments = {"frames": frames, "rate_hz": RATE, "channels": ("x",), "primitive_ids": ids}
        with pytest.raises(InvalidValueError):
            Trajectory(**(arguments | wrong))
    with pytest.raises(InvalidValueError, match="positions 0 to 1"):
        motion.piece(2)
