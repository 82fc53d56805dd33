"""Cycles of motion whose phase is known, and cuts that lie where they were put."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from mplearn.demonstrator import demonstrate
from mplearn.evaluation.cycles import Bout, find_oscillation, find_steps, score_cuts
from mplearn.evaluation.experiments import rhythm_table

RATE_HZ = 60.0


def swing(seconds, hz, amplitude=0.3):
    t = np.arange(round(seconds * RATE_HZ)) / RATE_HZ
    return amplitude * np.cos(2 * np.pi * hz * t)


def lifted(ahead, height=0.08):
    """The ankle that comes ahead is up on its way."""
    speed = np.gradient(ahead)
    return height * speed / np.abs(speed).max()


@pytest.mark.parametrize("hz", [0.4, 0.9, 1.7])
def test_steps_turn_where_a_cosine_does(hz):
    rng = np.random.default_rng(0)
    ahead = swing(20, hz) + rng.normal(0, 0.005, 1200) + 0.1
    (bout,) = find_steps(ahead, lifted(swing(20, hz)), RATE_HZ)
    phase = 2 * hz * bout.turns / RATE_HZ  # turns lie at whole numbers
    inner = phase[1:-1]
    assert np.abs(inner - np.round(inner)).max() < 0.1
    assert np.array_equal(np.diff(np.round(inner)), np.ones(len(inner) - 1))
    assert abs(bout.n_cycles - 20 * hz) <= 1.0


def test_only_what_repeats_is_a_bout():
    still = np.zeros(300)
    ahead = np.concatenate([still, swing(6, 1.0), still, swing(6, 0.5), still])
    lift = np.concatenate([still, lifted(swing(6, 1.0)), still, lifted(swing(6, 0.5)), still])
    bouts = find_steps(ahead, lift, RATE_HZ)
    assert len(bouts) == 2
    assert 290 <= bouts[0].turns[0] <= 320 and 640 <= bouts[0].turns[-1] <= 690
    assert find_steps(swing(10, 1.0, amplitude=0.02), np.zeros(600), RATE_HZ) == []
    assert find_steps(still, still, RATE_HZ) == find_steps(still[:10], still[:10], RATE_HZ) == []
    assert find_oscillation("still", np.zeros((300, 2)), RATE_HZ) == []


def test_raised_knees_are_no_steps():
    ahead = swing(10, 0.8)
    assert len(find_steps(ahead, 0.4 * ahead, RATE_HZ)) == 1  # running: the foot behind is up
    assert find_steps(ahead, 1.1 * ahead, RATE_HZ) == []


def test_where_no_foot_leaves_the_floor_or_passes_the_other_are_no_steps():
    ahead = swing(10, 0.8)
    assert len(find_steps(ahead, lifted(ahead), RATE_HZ)) == 1
    assert find_steps(ahead, lifted(ahead, height=0.01), RATE_HZ) == []  # the trunk turns
    assert len(find_steps(ahead, -lifted(ahead), RATE_HZ)) == 1  # backward
    assert find_steps(ahead + 0.5, lifted(ahead), RATE_HZ) == []  # a boxer's stance


def test_a_kick_ends_a_bout_of_steps():
    ahead = swing(12, 1.0)
    above = lifted(ahead)
    kick = slice(round(5.9 * RATE_HZ), round(6.1 * RATE_HZ))
    above[kick] = 0.8
    first, second = find_steps(ahead, above, RATE_HZ)
    assert first.turns[-1] < kick.start and kick.stop <= second.turns[0]


def test_the_main_oscillation_is_found_in_any_direction():
    rng = np.random.default_rng(1)
    direction = rng.normal(size=6)
    motion = swing(12, 0.8)[:, None] * direction + rng.normal(0, 0.01, (720, 6))
    (bout,) = find_oscillation("squat", motion, RATE_HZ)
    assert bout.label == "squat" and abs(bout.n_cycles - 12 * 0.8) <= 1.5


@given(st.floats(0.0, 0.45), st.integers(4, 30), st.integers(10, 80))
def test_cuts_at_one_phase_have_no_spread(phase, halves, frames):
    bout = Bout("walk", np.arange(halves + 1) * frames * 10)
    at = [round((k + phase) * frames * 10) for k in range(halves)]
    score = score_cuts(bout, at)
    assert score.spread == pytest.approx(0.0, abs=0.5 / frames)
    assert abs(score.per_cycle - 2.0) <= 2.0 / halves + 1e-9


def test_cuts_by_hand():
    bout = Bout("walk", np.arange(9) * 50)  # four cycles
    every_turn = score_cuts(bout, bout.turns)
    assert every_turn.per_cycle == pytest.approx(2.0)
    assert every_turn.spread == pytest.approx(0.0)
    once = score_cuts(bout, [30, 130, 230, 330, 900])
    assert (once.per_cycle, once.spread) == (1.0, pytest.approx(0.0))
    late = score_cuts(bout, [35, 125, 235, 325])  # 0.05 of a cycle off each way
    assert late.spread == pytest.approx(0.05)
    none = score_cuts(bout, [])
    assert none.per_cycle == 0.0 and none.spread != none.spread


@given(st.lists(st.integers(0, 400), min_size=40, max_size=80, unique=True))
def test_cuts_anywhere_are_spread(cuts):
    score = score_cuts(Bout("walk", np.arange(9) * 50), cuts)
    assert 0.0 <= score.spread <= 0.26  # uniform in a half of a cycle: 0.5 / sqrt(12) = 0.144


def test_a_table_of_steps_and_of_labelled_rhythm():
    shown = demonstrate(["BAR", "BAL"] * 8, seed=3)
    label = shown.truth[0].__class__(0, len(shown.recording), "arms")
    take = shown.recording.__class__(
        shown.recording.frames, shown.recording.rate_hz, shown.recording.channels, "t", "", (label,)
    )
    table = rhythm_table([take], rates_hz=(50.0,))
    rows = {row[:2]: row for row in table.rows}
    assert {rate for _, rate in rows} == {"100 Hz", "50 Hz"}
    assert ("arms", "100 Hz") in rows and ("all", "50 Hz") in rows
    assert float(rows["arms", "100 Hz"][4]) > 1.0
