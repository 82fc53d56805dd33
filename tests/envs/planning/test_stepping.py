"""Feet that leave the ground: what is read from motions, how it is planned and performed."""

from functools import cache

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from planners import at_rest, humanoid_reference, planner
from standing_library import KICK, RATE_HZ, posture, sweep

from mplearn_envs.execution.simulation import Simulation
from mplearn_envs.experiments.model_error import disturb
from mplearn_envs.mechanics.gravity import holding_torques
from mplearn_envs.mechanics.kinematics import places
from mplearn_envs.mechanics.pendulum import JERK_WEIGHT, plan_cog, zmp_along
from mplearn_envs.mechanics.reference import sole_middles, soles
from mplearn_envs.planning import Motion, Planner, PlannerConfig
from mplearn_envs.planning.footwork import Footwork, Lift, read_footwork
from mplearn_envs.planning.stride import landing, passing
from mplearn_envs.robot import humanoid

HUMANOID = humanoid()
KNEE_UP = {"hip_pitch_r": -1.2, "knee_r": 1.4, "shoulder_pitch_l": -0.6}


@cache
def raising():
    return planner().motion(sweep({}, KNEE_UP, 1.0), RATE_HZ)


@cache
def lowering():
    return planner().motion(sweep(KNEE_UP, {}, 1.0), RATE_HZ)


def started(seed=None, feedback="steps"):
    simulation = Simulation(HUMANOID, feedback)
    if seed is not None:
        disturb(simulation.model, 0.1, np.random.default_rng(seed))
    simulation.reset()
    return simulation


def step(side, before, after, speed_hz=100.0):
    """Return a motion of one step that takes the left foot, seen from the right, to ``after``."""
    x = np.clip((np.linspace(0.0, 1.0, 101) - 0.2) / 0.6, 0.0, 1.0)
    share = (x**3 * (10 - 15 * x + 6 * x**2))[:, None]
    apart = np.array(before) * (1 - share) + np.array(after) * share
    rise = np.zeros((101, 2))
    rise[:, side] = 0.06 * np.sin(np.pi * x) ** 2
    up = np.flatnonzero(rise[:, side] > 1e-6)
    legs = np.repeat(at_rest().swing[None, :-2], 101, axis=0)
    lifts = (Lift(side, int(up[0]), int(up[-1]) + 1),)
    frames = np.repeat(at_rest().target[None], 101, axis=0)
    return Motion(frames, speed_hz, Footwork(legs, rise, apart, lifts))


def test_lifts_are_read_from_the_motion():
    there_and_back = np.vstack((sweep({}, KICK, 0.8), sweep(KICK, {}, 0.8)[1:]))
    whole = read_footwork(HUMANOID, there_and_back, RATE_HZ)
    (lift,) = whole.lifts
    assert lift.side == 0 and 5 < lift.start < 40 and 120 < lift.end < 160
    assert (whole.up_at(False), whole.up_at(True)) == (-1, -1)
    assert whole.rise[:, 1].max() == 0 and 0.15 < whole.rise[:, 0].max() < 0.3
    assert np.all(whole.rise[[0, -1]] == 0)
    assert (raising().footwork.up_at(False), raising().footwork.up_at(True)) == (-1, 1)
    assert (lowering().footwork.up_at(False), lowering().footwork.up_at(True)) == (1, -1)
    assert planner().motion(sweep({}, {"base_pitch": 0.5}, 1.0), RATE_HZ).footwork is None


def test_one_foot_after_the_other_is_two_lifts():
    other = {"hip_pitch_l": -1.2, "knee_l": 1.4}
    frames = np.vstack([sweep(a, b, 0.8) for a, b in ((KNEE_UP, {}), ({}, other), (other, {}))])
    footwork = read_footwork(HUMANOID, frames, RATE_HZ)
    assert [lift.side for lift in footwork.lifts] == [1, 0]
    assert footwork.lifts[0].start == -1 and footwork.lifts[0].end <= footwork.lifts[1].start
    assert not (footwork.rise > 0).all(axis=1).any()


def test_feet_are_seen_from_each_other():
    frame = posture({"hip_yaw_l": 0.4, "hip_roll_l": 0.3})
    footwork = read_footwork(HUMANOID, np.stack((frame, frame)), RATE_HZ)
    q = np.concatenate(([0.0, 0.0, frame[0], 1.0, 0.0, 0.0, 0.0], frame[3:]))
    left, right = places(humanoid_reference().tree, humanoid_reference().stance.feet, q[None])[0]
    np.testing.assert_allclose(footwork.left_from_right[0], left - right, atol=1e-12)


@pytest.mark.parametrize("settled", [True, False])
def test_the_pendulums_plan_is_the_least_squares_optimum(settled):
    """Against a dense solution of the same problem."""
    n, dt, height = 120, 0.02, 0.8
    zmp = np.zeros((n + 1, 2))
    zmp[:, 1] = np.interp(np.arange(n + 1), [0, 45, 75, n], [0, 0, 0.09, 0.09])
    start, end = zmp[0], zmp[-1]
    ours = plan_cog(zmp, start, end, settled, height, dt)
    size = n - 1 if settled else n
    rows, right = [], []

    def add(coefficients, first, value):
        row, value = np.zeros(size), np.array(value, float)
        for i, weight in enumerate(coefficients):
            k = first + i
            if k <= 0:
                value -= weight * start
            elif settled and k >= n:
                value -= weight * end
            else:
                row[min(k, n) - 1] += weight
        rows.append(row)
        right.append(value)

    lean, jerk = height / 9.81 / dt**2, np.sqrt(JERK_WEIGHT) / dt**3
    for k in range(-1, n + 2):
        if 1 <= k <= n:
            add((-lean, 1 + 2 * lean, -lean), k - 1, zmp[k])
        add((-jerk, 3 * jerk, -3 * jerk, jerk), k - 1, (0.0, 0.0))
    dense = np.linalg.lstsq(np.array(rows), np.array(right), rcond=None)[0]
    np.testing.assert_allclose(ours[1 : size + 1], dense, atol=1e-9)
    assert np.abs(zmp_along(ours, height, dt) - zmp).max() < 0.03


@pytest.mark.parametrize("speed", [0.5, 1.0])
def test_a_raised_knee_is_performed_held_and_lowered(speed):
    simulation = started(seed=1)
    up = planner().plan(at_rest(), raising(), speed)
    assert up.end.lifted == 1 and up.error.max() < 1e-6 and up.zmp_margin_m.min() > 0.02
    first = simulation.perform(up)
    held = simulation.perform(planner().hold(up.end, 3.0))
    # the leg is where the demonstrator had it
    names = [HUMANOID.joint_names.index(name) for name in ("hip_pitch_r", "knee_r")]
    assert np.abs(simulation.data.qpos[7:][names] - (-1.2, 1.4)).max() < np.deg2rad(2.0)
    soles = simulation.soles()[..., 2]
    assert soles[0].max() < 0.004 and soles[1].min() > 0.7 * raising().footwork.rise[-1, 1]
    down = planner().plan(up.end, lowering(), speed)
    last = simulation.perform(down)
    assert down.end.lifted == -1
    for performance in (first, held, last):
        assert not performance.fallen
        assert performance.cog_deviation_m.max() < 0.01
        assert np.rad2deg(performance.tracking_error_rad.max()) < 1.0
        assert performance.zmp_margin_m.min() > 0.0


def test_the_weight_need_not_return_to_the_middle():
    down = planner().plan(planner().plan(at_rest(), raising(), 1.0).end, lowering(), 1.0)
    left, _ = sole_middles(humanoid_reference(), humanoid_reference().ground)
    assert abs(down.cog[-1, 1] - left[1]) < 0.07
    hold = planner().hold(down.end, 2.0)
    assert abs(hold.cog[-1, 1]) < 1e-4
    assert hold.steps and not planner().hold(hold.end, 2.0).steps


def test_where_another_foot_is_up_it_is_exchanged_first():
    up = planner().plan(at_rest(), raising(), 1.0)
    left = {name.replace("_r", "_l"): value for name, value in KNEE_UP.items()}
    motion = planner().motion(sweep(left, {}, 1.0), RATE_HZ)
    plan = planner().plan(up.end, motion, 1.0)
    changes = plan.up[np.flatnonzero(np.diff(plan.up, prepend=9))]
    assert changes.tolist() == [1, -1, 0, -1]
    simulation = started(seed=2)
    assert not simulation.perform(up).fallen
    assert not simulation.perform(plan).fallen


def test_the_weight_takes_the_time_it_needs_from_where_it_rests():
    """After a foot has landed quickly the weight is still over the other one."""
    knee = {"hip_pitch_l": -1.2, "knee_l": 1.4}
    other = planner().motion(sweep({}, knee, 0.8), RATE_HZ)
    here = planner().plan(planner().plan(at_rest(), raising(), 2.0).end, lowering(), 2.0).end
    plan = planner().plan(here, other, 2.0)
    moving = np.linalg.norm(plan.zmp - plan.cog[:, :2], axis=1)
    config = planner().config
    assert np.all(plan.zmp_margin_m > config.zmp_margin_m + config.model_error * moving - 2e-3)
    bold = Planner(HUMANOID, PlannerConfig(zmp_margin_m=-1.0)).plan(here, other, 2.0)
    assert bold.zmp_margin_m.min() < 0.0 and bold.duration_s < plan.duration_s < 2.0


LEG_AHEAD = {"hip_pitch_r": -1.6, "hip_roll_r": 0.1}


def test_a_foot_passes_the_other_one_and_does_not_meet_it():
    inwards = LEG_AHEAD | {"hip_roll_r": 0.25}
    raise_it = planner().motion(sweep({}, inwards, 1.0), RATE_HZ)
    still = planner().motion(np.stack([posture({})] * 50), RATE_HZ)
    up = planner().plan(at_rest(), raise_it, 0.5)
    down = planner().plan(up.end, still, 0.5)
    for plan in (up, down):
        assert plan.error.max() < 0.01
        for q in plan.q:
            left, right = soles(HUMANOID, q)
            apart = np.maximum(
                left.min(axis=0) - right.max(axis=0), right.min(axis=0) - left.max(0)
            )
            assert apart.max() > 0.01 or apart[2] > 0.0
    simulation = started(seed=4)
    assert not simulation.perform(up).fallen and not simulation.perform(down).fallen


def test_out_of_a_deep_squat_the_robot_rises_before_it_raises_a_leg():
    deep = planner().motion(sweep({}, {"base_height": -0.38, "base_pitch": 0.6}, 1.0), RATE_HZ)
    held = planner().motion(np.stack([posture(LEG_AHEAD)] * 50), RATE_HZ)
    squat = planner().plan(at_rest(), deep, 0.5)
    assert squat.error.max() < 1e-3
    plan = planner().plan(squat.end, held, 0.5)
    assert plan.end.lifted == 1 and plan.error.max() < 0.01
    simulation = started(seed=5)
    assert not simulation.perform(squat).fallen and not simulation.perform(plan).fallen


NARROW = [0.0, 0.18, 0.0]
WALKS = {
    "forward": [(1, NARROW, [-0.2, 0.18, 0]), (0, [-0.2, 0.18, 0], [0.2, 0.18, 0])],
    "sideways": [(0, NARROW, [0, 0.36, 0]), (1, [0, 0.36, 0], NARROW)],
    "turn": [(0, NARROW, [0, 0.2, 0.5]), (1, [0, 0.2, 0.5], NARROW)],
}


@pytest.mark.parametrize("name", WALKS)
def test_steps_end_where_the_motion_ends_them(name):
    simulation = started(seed=3)
    here = at_rest()
    for side, before, after in WALKS[name]:
        plan = planner().plan(here, step(side, before, after), 1.0)
        assert not simulation.perform(plan).fallen
        here = plan.end
    left, right = places(
        humanoid_reference().tree, humanoid_reference().stance.feet, simulation.data.qpos[None]
    )[0]
    c, s = np.cos(right[2]), np.sin(right[2])
    x, y, turn = left - right
    wanted = WALKS[name][-1][2]
    np.testing.assert_allclose([c * x + s * y, c * y - s * x], wanted[:2], atol=0.005)
    assert turn == pytest.approx(wanted[2], abs=0.01)
    moved = {"forward": right[0] - 0.2, "sideways": right[1] - 0.09, "turn": right[2] - 0.5}
    assert abs(moved[name]) < 0.03


def test_a_foot_lands_beside_the_other_not_on_it():
    ground = np.array([[0.3, 0.09, 0.0], [0.0, -0.09, 0.0]])
    place = landing(humanoid_reference(), ground, 0, np.array([0.0, 0.05, 0.0]))
    width = np.ptp(humanoid_reference().corners[0, :, 1])
    assert place[1] + 0.09 > width
    np.testing.assert_array_equal(  # almost where it stood is where it stood
        landing(humanoid_reference(), humanoid_reference().ground, 1, np.array([0.03, 0.2, 0.1])),
        humanoid_reference().ground[1],
    )


@cache
def slow_step():
    return step(1, (0.0, 0.18, 0.0), (-0.35, 0.17, 0.1), 200.0)  # a stride ahead of the left foot


@cache
def other_step():
    """Return a step past the right foot, as in walking."""
    return step(0, (-0.35, 0.17, 0.1), (0.35, 0.17, 0.1), 200.0)


def test_a_foot_that_moves_over_the_floor_is_clear_of_it():
    """However slowly it rises: here by a millimetre in the first tenth of the step."""
    lift = slow_step().footwork.lifts[0]
    rise = slow_step().footwork.rise.copy()
    rise[:, 1] = np.where(rise[:, 1] > 0, np.maximum(rise[:, 1] ** 2 / 0.06, 0.015), 0.0)
    motion = slow_step()._replace(footwork=slow_step().footwork._replace(rise=rise, lifts=(lift,)))
    plan = planner().plan(at_rest(), motion, 0.5)
    moves = np.linalg.norm(np.diff(plan.ground[:, 1, :2], axis=0), axis=1) / plan.knot_s
    heights = np.array([soles(HUMANOID, q)[1, :, 2].min() for q in plan.q[1:]])
    assert moves.max() > 0.2
    assert heights[moves > 0.05].min() > 0.005


def test_a_foot_is_led_round_the_other_one():
    stands = np.array([0.0, -0.09, 0.0])
    x = np.linspace(0.0, 1.0, 50)[:, None]
    way = np.array([-0.45, 0.03, 0.0]) * (1 - x) + np.array([0.45, 0.03, 0.0]) * x
    led = passing(humanoid_reference(), stands, 0, way)
    length, width, _ = np.ptp(humanoid_reference().corners[0], axis=0)
    beside = np.abs(led[:, 0]) < length
    assert (led[beside, 1] + 0.09 > width + 0.019).all()
    np.testing.assert_array_equal(led[[0, -1]], way[[0, -1]])
    right = passing(humanoid_reference(), stands * (1, -1, 1), 1, way * (1, -1, 1))
    np.testing.assert_allclose(right, led * (1, -1, 1), atol=1e-15)


def test_strides_follow_each_other_without_a_fall():
    simulation, here = started(), at_rest()
    for motion in (slow_step(), other_step(), slow_step(), other_step()):
        plan = planner().plan(here, motion, 0.4)
        assert plan.error.max() < 0.01 and plan.zmp_margin_m.min() > 0.01
        assert not simulation.perform(plan).fallen
        here = plan.end


def test_what_cannot_be_done_from_a_stride_is_done_from_where_the_feet_are_side_by_side():
    """A squat is too deep for the ankles with one foot a third of a metre ahead."""
    squat = {"base_height": -0.2, "shoulder_pitch_l": -1.0}
    deep = planner().motion(sweep({}, squat, 2.0), RATE_HZ)
    simulation = started()
    stride = planner().plan(at_rest(), slow_step(), 0.4)
    assert abs(stride.end.ground[0, 0] - stride.end.ground[1, 0]) > 0.3
    plan = planner().plan(stride.end, deep, 0.5)
    assert plan.error.max() < 0.01
    assert not simulation.perform(stride).fallen and not simulation.perform(plan).fallen


def test_steps_are_a_pure_function_and_cached():
    first = planner().plan(at_rest(), raising(), 0.5, key="raise")
    assert planner().plan(at_rest(), raising(), 0.5, key="raise") is first
    fresh = Planner(HUMANOID).plan(at_rest(), raising(), 0.5)
    assert fresh.commands.tobytes() == first.commands.tobytes()
    states = []
    for _ in range(2):
        simulation = started()
        simulation.perform(first)
        states.append(simulation.state().tobytes())
    assert states[0] == states[1]


def test_holding_torques_are_those_of_a_robot_on_one_foot():
    simulation = started()
    up = planner().plan(at_rest(), raising(), 0.5)
    simulation.perform(up)
    hold = planner().hold(up.end, 2.0)
    simulation.perform(hold)
    middles = sole_middles(humanoid_reference(), hold.ground[-1:])
    expected = holding_torques(
        humanoid_reference(), hold.q[-1:], hold.share[-1:], hold.cog[-1:, :2], middles
    )[0]
    assert np.abs(expected).max() > 20.0
    np.testing.assert_allclose(simulation.data.actuator_force, expected, atol=2.5)


def test_feedback_of_the_ankles_damps_a_push():
    largest = {}
    for feedback in ("never", "always"):
        simulation = started(feedback=feedback)
        simulation.data.qvel[0] += 0.12
        performance = simulation.perform(planner().hold(at_rest(), 1.0))
        assert not performance.fallen
        largest[feedback] = performance.cog_deviation_m.max()
    assert largest["always"] < 0.9 * largest["never"]


unit = st.floats(0.0, 1.0)


@settings(max_examples=12, deadline=None)
@given(
    st.lists(unit, min_size=33, max_size=33),
    st.lists(unit, min_size=33, max_size=33),
    st.floats(0.2, 1.5),
    st.floats(0.3, 2.0),
)
def test_no_command_ever_leaves_the_limits_on_one_foot_either(first, last, seconds, speed):
    """Any motion of the whole body between any two postures."""
    limits = HUMANOID.position_limits
    low = np.concatenate((humanoid_reference().limits[:3, 0], limits[:, 0]))
    high = np.concatenate((humanoid_reference().limits[:3, 1], limits[:, 1]))
    ends = np.array([first, last]) * 1.2 - 0.1
    x = np.linspace(0, 1, max(2, round(50 * seconds)))[:, None]
    frames = low + (ends[0] * (1 - x) + ends[1] * x) * (high - low)
    plan = planner().plan(at_rest(), planner().motion(frames, 50.0), speed)
    assert np.isfinite(plan.commands).all()
    assert (plan.commands >= limits[:, 0]).all() and (plan.commands <= limits[:, 1]).all()
    assert len(plan.commands) == (len(plan.q) - 1) * 5 and np.isfinite(plan.end.q).all()
