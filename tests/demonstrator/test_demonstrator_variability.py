"""How executions, measurements and persons differ."""

from itertools import pairwise

import numpy as np
import pytest

from mplearn.body import human_body
from mplearn.demonstrator import PRIMITIVES, Person, Variability, demonstrate
from mplearn.demonstrator.channels import CHANNELS, INDEX
from mplearn.demonstrator.idling import Idling
from mplearn.demonstrator.movement import Movement
from mplearn.demonstrator.planning import Planner
from mplearn.demonstrator.stance import Stance

N = 1500
NOTHING = Variability.none()


def movements(variability, person=None, names=("BAR", "BAL"), n=N, seed=0):
    planner = Planner(
        person or Person(), variability, Stance(human_body()), np.random.default_rng(seed)
    )
    drawn, raised = [], []
    for index in range(n):
        name = names[index % len(names)]
        drawn.append(planner.plan(PRIMITIVES[name], drawn[-1] if drawn else None))
        raised.append(planner.planned.copy())
    return drawn, np.array(raised)


def test_a_single_step_is_minimum_jerk():
    movement = Movement(
        "X", 0.0, 2.0, np.array([3]), np.array([0.5]), np.array([1.0]), np.array([0.8]),
        np.array([0.0]),
    )  # fmt: skip
    times = np.linspace(0.0, 2.0, 2001)
    position, velocity = movement.displacement(times)[:, 0], movement.velocity(times)[:, 0]
    assert position[0] == 0.0 and position[-1] == 0.8
    assert (position[times <= 0.5] == 0.0).all() and (position[times >= 1.5] == 0.8).all()
    assert velocity.max() == pytest.approx(1.875 * 0.8) and times[velocity.argmax()] == 1.0
    np.testing.assert_allclose(np.gradient(position, times), velocity, atol=2e-3)
    jerk = np.diff(position, 3)[600:1400] / 1e-9
    s = times[601:1401] + 0.0005 - 0.5
    np.testing.assert_allclose(jerk, 0.8 * (60 - 360 * s + 360 * s**2), atol=1.0)


def test_durations_vary_uniformly_by_a_fifth():
    drawn, _ = movements(Variability())
    ratio = np.array([(m.end_s - m.start_s) / PRIMITIVES[m.name].duration_s for m in drawn])
    assert ratio.min() >= 0.8 and ratio.max() <= 1.2
    assert ratio.min() < 0.81 and ratio.max() > 1.19
    assert ratio.mean() == pytest.approx(1.0, abs=0.01)
    assert ratio.std() == pytest.approx(0.2 / np.sqrt(3), rel=0.05)


def test_amplitudes_vary_by_the_stated_share():
    only = {"timing_s": 0.0, "scatter_rad": 0.0, "joint_amplitude": 0.0}
    _, exact = movements(NOTHING, n=1)
    _, reached = movements(Variability(amplitude=0.15, **only))
    _, rest = movements(NOTHING, n=2)
    index = INDEX["shoulder_pitch_l"]
    ratio = (reached[::2, index] - rest[1, index]) / (exact[0, index] - rest[1, index])
    # an arm never goes beyond the vertical
    assert 0.85 <= ratio.min() < 0.86 and 1.11 < ratio.max() <= 1.15
    assert ratio.std() == pytest.approx(0.15 / np.sqrt(3), rel=0.06)
    np.testing.assert_allclose(reached[1::2, index], rest[1, index])


def test_arms_and_joints_keep_their_own_time():
    base = {"duration": 0.0, "amplitude": 0.0, "joint_amplitude": 0.0, "scatter_rad": 0.0}
    drawn, _ = movements(Variability(timing_s=0.03, side_lag_s=0.0, **base), names=("SQD", "SQR"))
    # the shoulders begin at 0, where they cannot be earlier, and end at 0.9 of a squat down
    shoulder = [int(np.flatnonzero(m.channels == INDEX["shoulder_pitch_l"])[0]) for m in drawn[::2]]
    end = [
        m.begin_s[i] + m.duration_s[i] - m.start_s
        for m, i in zip(drawn[::2], shoulder, strict=True)
    ]
    assert np.std(end) == pytest.approx(0.03, rel=0.08)
    crouch = [int(np.flatnonzero(m.channels == INDEX["crouch"])[0]) for m in drawn[::2]]
    assert np.std([m.duration_s[i] for m, i in zip(drawn[::2], crouch, strict=True)]) < 1e-9


def test_joins_have_the_stated_shares_and_lengths():
    v = Variability()
    drawn, _ = movements(v)
    gaps = np.array([b.start_s - a.end_s for a, b in pairwise(drawn)])
    assert (gaps < 0).mean() == pytest.approx(v.fluid, abs=0.04)
    assert (gaps > v.dwell_s[1]).mean() == pytest.approx(v.pause, abs=0.02)
    assert gaps.min() >= -v.overlap_s[1] and gaps.max() <= v.pause_s[1]
    assert gaps.min() < -0.25 and -gaps[gaps < 0].max() >= v.overlap_s[0]
    assert all(b.start_s > a.start_s for a, b in pairwise(drawn))


def test_idle_sway_is_small_slow_and_of_the_stated_size():
    idling = Idling(Variability(drift_rad=0.03), np.random.default_rng(2))
    times = np.arange(0.0, 4000.0, 0.1)
    moved = idling(times)
    elbow = moved[:, INDEX["elbow_l"]]
    slow = elbow[: len(elbow) // 300 * 300].reshape(-1, 300).mean(axis=1)
    assert slow.std() == pytest.approx(0.03, rel=0.1)
    sway = moved[:, INDEX["pelvis_x"]]
    assert sway.std() == pytest.approx(0.004, rel=0.1)
    spectrum = np.abs(np.fft.rfft(sway - sway.mean())) ** 2
    hz = np.fft.rfftfreq(len(sway), 0.1)
    assert spectrum[hz > 0.7].sum() < 1e-3 * spectrum.sum()
    assert not moved[:, [INDEX[name] for name in CHANNELS if name.startswith("foot_")]].any()
    still = Idling(NOTHING, np.random.default_rng(2))
    assert not still(times).any()


def test_noise_is_white_and_of_the_stated_size():
    script = ["BAR", "BAL", "BAD", "BAU"] * 6
    seen = demonstrate(script, 5, variability=Variability(occlusion=0.0)).recording.markers
    true = demonstrate(script, 5, variability=Variability(occlusion=0.0, noise_m=0.0))
    noise = (seen - true.recording.markers).reshape(len(seen), -1)
    assert noise.std() == pytest.approx(0.002, rel=0.01)
    assert np.abs(noise.mean(axis=0)).max() < 5 * 0.002 / np.sqrt(len(noise))
    correlation = np.corrcoef(noise[1:].ravel(), noise[:-1].ravel())[0, 1]
    assert abs(correlation) < 0.01


@pytest.mark.parametrize("rate_hz", [50.0, 100.0])
def test_occlusions_have_the_stated_share_and_lengths(rate_hz):
    script = ["BAR", "BAL", "LKR", "LKT"] * 40
    markers = demonstrate(script, 6, rate_hz=rate_hz).recording.markers
    hidden = np.isnan(markers)
    assert (hidden.all(axis=2) == hidden.any(axis=2)).all()
    hidden = hidden[..., 0]
    assert hidden.mean() == pytest.approx(0.01, rel=0.2)
    lengths = []
    for column in hidden.T:
        edges = np.flatnonzero(np.diff(np.concatenate(([0], column, [0]))))
        lengths += [
            (end - start) / rate_hz
            for start, end in edges.reshape(-1, 2)
            if start > 0 and end < len(column)
        ]
    lengths = np.array(lengths)
    assert lengths.min() >= 0.05 - 1 / rate_hz and lengths.mean() == pytest.approx(0.275, rel=0.1)
    assert np.mean(lengths > 0.5 + 1 / rate_hz) < 0.02  # two that follow each other at once


def test_persons_differ_and_each_has_habits():
    people = [Person.random(np.random.default_rng(seed)) for seed in range(60)]
    heights = np.array([person.height_m for person in people])
    assert heights.min() >= 1.55 and heights.max() <= 1.90 and np.ptp(heights) > 0.25
    assert len({person.name for person in people}) == len(people)
    asymmetry = [p.joint_reach["elbow_l"] / p.joint_reach["elbow_r"] - 1 for p in people]
    assert np.std(asymmetry) > 0.02
    assert people[3] == Person.random(np.random.default_rng(3))
    script = ["BAR", "BAL", "SQD", "SQR"]
    first, second = (
        demonstrate(script, 1, person=person, variability=NOTHING).posture for person in people[:2]
    )
    n = min(len(first), len(second))
    assert np.abs(first.frames[:n, 7:] - second.frames[:n, 7:]).max() > 0.1
    one = demonstrate(script, 1, person=people[0], variability=NOTHING).posture
    np.testing.assert_array_equal(one.frames, first.frames)


def test_left_and_right_differ_within_a_person():
    differences = []
    for seed in range(9):
        person = Person.random(np.random.default_rng(seed))
        shown = demonstrate(["BAR", "BAL"], 1, person=person, variability=NOTHING).posture
        left, right = (
            shown.frames[:, shown.channels.index(f"shoulder_pitch_{side}")] for side in "lr"
        )
        differences.append(np.abs(left - right).max())
    assert min(differences) > 0.0 and 0.05 < np.median(differences) < 0.4
    average = demonstrate(["BAR", "BAL"], 1, variability=NOTHING).posture
    left, right = (average.frames[:, average.channels.index(f"elbow_{side}")] for side in "lr")
    np.testing.assert_array_equal(left, right)
