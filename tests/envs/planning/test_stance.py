"""Stances as they are shown: feet apart, a heel raised, and what balances where no chair is."""

import mujoco
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from planners import at_rest, humanoid_reference, planner
from stance_library import between, shown
from standing_library import BOW, RATE_HZ, sweep

from mplearn.maths.plane import turn_in_plane
from mplearn_envs.execution.simulation import Simulation
from mplearn_envs.experiments.model_error import disturb
from mplearn_envs.mechanics.heels import bearing_corners, foot_places, raised_foot
from mplearn_envs.mechanics.kinematics import places
from mplearn_envs.mechanics.reference import sole_middles, soles
from mplearn_envs.planning.clearance import outline_gap
from mplearn_envs.planning.stride import left_from_right
from mplearn_envs.robot import humanoid
from mplearn_envs.skills.feasibility import FeasibilityCheck

HUMANOID = humanoid()
SPLIT = np.array([-0.5, 0.2, 0.0])  # the left foot behind


def lunge():
    high, low = shown(SPLIT, (0.5, 0.0), (-0.1, 0, 0.1)), shown(SPLIT, (0.9, 0.0), (-0.3, 0, 0.1))
    return planner().motion(between(high, low), RATE_HZ)


@settings(max_examples=50, deadline=None)
@given(st.floats(-3.0, 3.0), st.floats(0.0, 1.2), st.integers(0, 1))
def test_a_raised_heel_leaves_the_front_edge_where_it_is(yaw, heel, side):
    place = np.array([0.3, -0.2, yaw])
    corners, flat = (
        humanoid_reference().corners[side],
        humanoid_reference().stance.foot_rotation[side],
    )
    height = humanoid_reference().stance.foot_position[side, 2]
    before, after = (
        corners @ rotation.T + position
        for position, rotation in (
            raised_foot(corners, flat, height, place, angle) for angle in (0.0, heel)
        )
    )
    np.testing.assert_allclose(after[:2], before[:2], atol=1e-12)
    length = np.ptp(corners[:, 0])
    np.testing.assert_allclose(after[2:, 2] - after[:2, 2], length * np.sin(heel), atol=1e-12)
    position, _ = raised_foot(corners, flat, height, place, heel)
    found = foot_places(
        humanoid_reference().corners, np.stack((place, place)), np.array([heel, heel])
    )[side]
    np.testing.assert_allclose(found, (position[0], position[1], yaw), atol=1e-9)


def test_who_stands_on_toes_stands_on_the_front_edge():
    flat, tilted = np.zeros(2), np.array([0.0, 0.6])
    assert bearing_corners(humanoid_reference().corners, flat) is humanoid_reference().corners
    left, right = bearing_corners(humanoid_reference().corners, tilted)
    np.testing.assert_array_equal(left, humanoid_reference().corners[0])
    assert np.ptp(right[:, 0]) == 0.0 and np.ptp(right[:, 1]) == np.ptp(
        humanoid_reference().corners[1, :, 1]
    )
    moved = sole_middles(humanoid_reference(), humanoid_reference().ground, tilted)
    moved -= sole_middles(humanoid_reference(), humanoid_reference().ground)
    half = 0.5 * np.ptp(humanoid_reference().corners[1, :, 0])
    np.testing.assert_allclose(moved, [[0.0, 0.0], [half, 0.0]], atol=1e-12)


def test_stances_are_read_from_the_motion():
    motion = lunge()
    np.testing.assert_allclose(motion.stance.place, SPLIT, atol=0.02)
    np.testing.assert_allclose(motion.stance.heel[[0, -1]], [[0.5, 0.0], [0.9, 0.0]], atol=0.02)
    assert motion.footwork is None
    beside = planner().motion(sweep({}, BOW, 1.0), RATE_HZ).stance
    np.testing.assert_array_equal(beside.place, left_from_right(humanoid_reference().ground))
    assert not beside.heel.any()


def test_a_foot_far_away_that_seems_high_stands():
    """A base that is measured 4 degrees too far on one side raises a foot 0.6 m away by 4 cm."""
    place = np.array([0.0, 0.6, 0.4])
    frames = np.tile(shown(place, (0.0, 0.0), (-0.15, 0.0, 0.2)), (50, 1))
    frames[:, 1] += 0.07
    assert planner().motion(frames, RATE_HZ).footwork is None


@pytest.mark.parametrize("seed", [1, 2])
def test_a_lunge_is_stepped_into_and_out_of_with_a_wrong_model(seed):
    simulation = Simulation(HUMANOID)
    disturb(simulation.model, 0.1, np.random.default_rng(seed))
    simulation.reset()
    down = planner().plan(at_rest(), lunge(), 0.5)
    assert down.error.max() < 1e-3 and down.zmp_margin_m.min() > 0.01
    np.testing.assert_allclose(left_from_right(down.end.ground), SPLIT, atol=0.1)
    assert down.end.heel[0] == pytest.approx(0.9, abs=0.02) and down.end.heel[1] == 0.0
    # as one plan: no jump where one step ends and the next begins
    assert np.abs(np.diff(down.q, axis=0)).max() < 0.1
    feet = places(humanoid_reference().tree, humanoid_reference().stance.feet, down.q)
    edge = foot_places(humanoid_reference().corners, down.ground, down.heel)
    standing = down.up != 0
    np.testing.assert_allclose(feet[standing, 0, :2], edge[standing, 0, :2], atol=1e-4)
    assert not simulation.perform(down).fallen
    back = simulation.soles()[0, 2:, 2].mean()
    assert 0.1 < back < 0.24  # the heel is up
    bow = planner().plan(down.end, planner().motion(sweep({}, BOW, 1.0), RATE_HZ), 0.5)
    assert not simulation.perform(bow).fallen
    np.testing.assert_allclose(bow.end.ground, humanoid_reference().ground, atol=0.02)
    assert not bow.end.heel.any()


def test_between_stances_that_are_nearly_the_same_nobody_steps():
    """The way into a lunge and the way out of it are shown 13 cm apart: the feet stay."""
    down = planner().plan(at_rest(), lunge(), 0.5)
    nearer = np.array([SPLIT[0] + 0.13, *SPLIT[1:]])
    low, high = shown(nearer, (0.9, 0.0), (-0.3, 0, 0.1)), shown(nearer, (0.5, 0.0), (-0.1, 0, 0.1))
    rises = planner().motion(between(low, high), RATE_HZ)
    np.testing.assert_allclose(rises.stance.place, nearer, atol=0.02)
    up = planner().plan(down.end, rises, 0.5)
    assert (up.up == -1).all() and up.error.max() < 1e-3 and up.zmp_margin_m.min() > 0.014
    np.testing.assert_allclose(up.end.ground, down.end.ground, atol=1e-6)
    simulation = Simulation(HUMANOID)
    simulation.reset()
    assert not simulation.perform(down).fallen and not simulation.perform(up).fallen
    # from beside each other the feet go where they are shown
    np.testing.assert_allclose(
        left_from_right(planner().plan(at_rest(), rises, 0.5).end.ground), nearer, atol=0.02
    )


def test_feet_stand_as_wide_as_shown_or_as_a_step_reaches():
    wide = np.array([*turn_in_plane(0.0, 0.45, 0.25), 0.5])
    frames = np.tile(shown(wide, (0.0, 0.0), (-0.1, 0.0, 0.1)), (50, 1))
    np.testing.assert_allclose(planner().motion(frames, RATE_HZ).stance.place, wide, atol=0.02)
    far = np.array([-0.9, 0.2, 0.0])
    frames = np.tile(shown(far, (0.9, 0.0), (-0.3, 0.0, 0.2)), (50, 1))
    place = planner().motion(frames, RATE_HZ).stance.place
    assert 0.5 < -place[0] < 0.9


def touching(plan):
    """Return in how many postures of a plan MuJoCo finds that the feet touch each other."""
    model = HUMANOID.model()
    data = mujoco.MjData(model)
    count = 0
    for q in plan.q:
        data.qpos[:] = q
        mujoco.mj_kinematics(model, data)
        mujoco.mj_collision(model, data)
        count += any(0 not in pair for pair in data.contact.geom.tolist())
    return count


@pytest.mark.parametrize("pitch, roll", [(-1.6, 0.25), (-1.2, 0.35)])
def test_out_of_a_wide_stance_a_turned_foot_does_not_meet_the_other(pitch, roll):
    wide = np.array([*turn_in_plane(0.0, 0.41, 0.15), 0.29])
    frames = np.tile(shown(wide, (0.0, 0.0), (-0.1, 0.0, 0.1)), (50, 1))
    stands = planner().plan(at_rest(), planner().motion(frames, RATE_HZ), 0.5).end
    inwards = {"hip_pitch_r": pitch, "hip_roll_r": roll, "hip_yaw_r": -0.5}
    knee_up = {"hip_pitch_l": -1.2, "knee_l": 1.4}
    raises, exchanges = (
        planner().motion(sweep(*ends, 1.2), RATE_HZ)._replace(stance=None)
        for ends in (({}, inwards), (knee_up, {}))
    )
    up = planner().plan(stands, raises, 0.5)
    down = planner().plan(up.end, exchanges, 0.5)
    for plan in (up, down):
        assert plan.error.max() < 1e-3
        assert touching(plan) == 0


@settings(max_examples=100, deadline=None)
@given(*[st.floats(-0.4, 0.4)] * 2, *[st.floats(-3.0, 3.0)] * 2)
def test_the_gap_between_soles_is_that_of_their_boundaries(x, y, one_yaw, other_yaw):
    """It is positive exactly where they are disjoint, and never more than their distance."""
    around = np.linspace(-1.0, 1.0, 41)
    side = np.ones(41)
    outline = np.array([0.12, 0.055]) * np.concatenate(
        [np.column_stack(each) for each in ((side, around), (-side, around), (around, side))]
        + [np.column_stack((around, -side))]
    )
    corners = np.array([[0.12, 0.055], [0.12, -0.055], [-0.12, -0.055], [-0.12, 0.055]])

    def placed(points, dx, dy, yaw):
        return np.stack(turn_in_plane(*points.T, yaw), axis=-1) + np.array((dx, dy))

    one, other = placed(corners, 0.0, 0.0, one_yaw), placed(corners, x, y, other_yaw)
    first, second = placed(outline, 0.0, 0.0, one_yaw), placed(outline, x, y, other_yaw)
    distance = np.linalg.norm(first[:, None] - second, axis=-1).min()
    gap = outline_gap(one, other)
    inside = np.abs(np.stack(turn_in_plane(*second.T, -one_yaw), axis=-1)) < (0.12, 0.055)
    if inside.all(axis=1).any():
        assert gap < 0.0
    if gap > 0.0:
        assert gap <= distance + 1e-9
    elif gap < -1e-6:
        assert distance < 0.01  # outlines cross, as neither sole has room in the other


@pytest.mark.parametrize("speed", [0.5, 1.0])
def test_who_rises_too_fast_is_slowed_until_he_stands(speed):
    """Out of a deep squat joints and base are at their velocity limits, and soon in the air."""
    frames = sweep({"base_height": -0.42, "base_pitch": 0.5}, {"base_height": 0.0}, 0.9)
    motion = planner().motion(frames, RATE_HZ)
    low = FeasibilityCheck(planner()).way_in(motion).end
    plan = planner().plan(low, motion, speed)
    assert plan.error.max() < 0.01 and plan.zmp_margin_m.min() > 0.013


def test_who_sits_down_without_a_chair_leans_as_far_as_must_be():
    """Upright, ankles would have to bend too far; the depth is kept."""
    frames = sweep({}, {"base_height": -0.42}, 1.5)
    motion = planner().motion(frames, RATE_HZ)
    lean = motion.frames[:, 2] - frames[:, 2]
    np.testing.assert_allclose(motion.frames[:, 0], frames[:, 0], atol=1e-9)
    assert lean[0] == 0.0 and 0.05 < lean[-1] < 0.5 and lean.min() >= 0.0
    assert FeasibilityCheck(planner()).judge(motion, 0.5).feasible
    simulation = Simulation(HUMANOID)
    simulation.reset()
    assert not simulation.perform(planner().plan(at_rest(), motion, 0.5)).fallen
    assert soles(HUMANOID, simulation.data.qpos)[..., 2].max() < 0.005
    shallow = sweep({}, {"base_height": -0.1}, 1.0)
    np.testing.assert_array_equal(planner().motion(shallow, RATE_HZ).frames[:, 0], shallow[:, 0])
