"""Plans: limits, continuity, speed, caching, and the paper's motions on the simulated robot."""

import mujoco
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from planners import at_rest, humanoid_reference, planner
from standing_library import ARMS, BOW, RATE_HZ, SQUAT, sweep

from mplearn.errors import FrameError, InvalidValueError
from mplearn_envs.control import StandingController, UpperBodyTracker
from mplearn_envs.execution.simulation import Simulation
from mplearn_envs.mechanics.reference import tracked_columns
from mplearn_envs.mechanics.support import convex_hull, support_margin
from mplearn_envs.planning import Motion, Planner
from mplearn_envs.planning.splines import refine
from mplearn_envs.robot import humanoid

HUMANOID = humanoid()
TRACKED = tracked_columns(HUMANOID)


def there_and_back(posture, seconds):
    frames = np.vstack((sweep({}, posture, seconds), sweep(posture, {}, seconds)[1:]))
    return Motion(frames[:, TRACKED], RATE_HZ)


@pytest.mark.parametrize("speed", [0.5, 1.0])
@pytest.mark.parametrize(
    "posture",
    [ARMS, {"base_pitch": np.pi / 4}, {"base_height": -0.18}, BOW, SQUAT],
    ids=["both arms", "bow 45 deg", "squat 18 cm", "bow and nod", "squat and arm"],
)
def test_the_robot_stays_upright_balanced_and_on_track(posture, speed):
    plan = planner().plan(at_rest(), there_and_back(posture, 1.0), speed)
    simulation = Simulation(HUMANOID)
    simulation.reset()
    performance = simulation.perform(plan)
    assert not performance.fallen
    assert performance.cog_deviation_m.max() < 0.01
    assert np.rad2deg(np.sqrt(np.mean(performance.tracking_error_rad**2))) < 1.0
    assert performance.zmp_margin_m.min() > 0.02


def test_the_robot_stays_upright_with_a_wrong_model():
    """Masses, gains and friction differ from what was planned with."""
    plan = planner().plan(at_rest(), there_and_back(BOW, 1.0), 0.5)
    rng = np.random.default_rng(0)
    for friction in (0.6, 1.0):
        simulation = Simulation(HUMANOID)
        simulation.reset()
        model = simulation.model
        model.body_mass[1:] *= rng.uniform(0.8, 1.2, model.nbody - 1)
        gain = rng.uniform(0.8, 1.2, model.nu)
        model.actuator_gainprm[:, 0] *= gain
        model.actuator_biasprm[:, 1] *= gain
        model.body_ipos[1:] += rng.uniform(-0.02, 0.02, (model.nbody - 1, 3))
        model.geom_friction[:, 0] = friction
        assert not simulation.perform(plan).fallen


unit = st.floats(0.0, 1.0)


@settings(max_examples=25, deadline=None)
@given(
    st.lists(unit, min_size=21, max_size=21),
    st.lists(unit, min_size=21, max_size=21),
    st.floats(0.1, 2.0),
    st.floats(0.2, 3.0),
)
def test_no_command_ever_leaves_the_limits(first, last, seconds, speed):
    """Any motion between any two postures: positions and velocities keep their limits."""
    low, high = humanoid_reference().limits.T
    ends = np.array([first, last]) * 1.4 - 0.2  # beyond the limits, too
    x = np.linspace(0, 1, max(2, round(100 * seconds)))[:, None]
    frames = low + (ends[0] * (1 - x) + ends[1] * x) * (high - low)
    plan = planner().plan(at_rest(), Motion(frames, 100.0), speed)
    limits = HUMANOID.position_limits
    assert (plan.commands >= limits[:, 0]).all() and (plan.commands <= limits[:, 1]).all()
    velocity = np.abs(np.diff(plan.q[:, 7:], axis=0)) / plan.knot_s
    upper = humanoid_reference().upper
    allowed = HUMANOID.per_joint("velocity")
    assert (velocity[:, upper] <= allowed[upper] * (1 + 1e-6)).all()
    assert np.isfinite(plan.commands).all()
    assert len(plan.commands) == (len(plan.q) - 1) * 5


def test_slow_motions_keep_leg_velocities_too():
    plan = planner().plan(at_rest(), there_and_back(SQUAT, 0.15), 3.0)
    velocity = np.abs(np.diff(plan.q[:, 7:], axis=0)) / plan.knot_s
    assert (velocity <= HUMANOID.per_joint("velocity") * 1.001).all()
    assert plan.speed < 3.0


def test_plans_join_without_a_jump():
    up = Motion(sweep({}, ARMS, 1.0)[:, TRACKED], RATE_HZ)
    bow = Motion(sweep({}, BOW, 1.0)[:, TRACKED], RATE_HZ)  # starts elsewhere than "up" ends
    one = planner().plan(at_rest(), up, 1.0)
    two = planner().plan(one.end, bow, 1.0)
    np.testing.assert_allclose(two.q[0], one.q[-1], atol=1e-6)
    q = np.vstack((one.q, two.q[1:]))[:, 7:]
    jump = np.abs(np.diff(q, n=2, axis=0)) / one.knot_s**2
    at_join = jump[len(one.q) - 4 : len(one.q) + 2].max()
    assert at_join < 40.0  # [rad/s^2]; a step of the posture would give thousands
    assert np.abs(two.q[-1, 7:] - planner().plan(at_rest(), bow, 1.0).q[-1, 7:]).max() < 1e-5


def test_half_speed_takes_twice_as_long():
    motion = there_and_back(ARMS, 1.0)
    full, half = (planner().plan(at_rest(), motion, speed) for speed in (1.0, 0.5))
    assert full.duration_s == pytest.approx(motion.duration_s, abs=0.03)
    assert half.duration_s == pytest.approx(2 * motion.duration_s, abs=0.03)
    assert (full.speed, half.speed) == (1.0, 0.5)


def test_holding_comes_to_rest_where_it_is():
    moving = planner().plan(at_rest(), Motion(sweep({}, ARMS, 1.0)[:60, TRACKED], RATE_HZ), 1.0)
    assert np.abs(moving.end.velocity).max() > 0.5
    hold = planner().hold(moving.end, 1.0)
    assert np.abs(hold.end.velocity).max() < 1e-3
    np.testing.assert_allclose(hold.end.target, moving.end.target, atol=1e-4)


def test_plans_are_pure_and_cached():
    motion = there_and_back(BOW, 1.0)
    planner = Planner(HUMANOID)
    first = planner.plan(at_rest(), motion, 0.5, key="bow")
    assert planner.plan(at_rest(), motion, 0.5, key="bow") is first
    fresh = Planner(HUMANOID).plan(at_rest(), motion, 0.5)
    assert fresh is not first
    assert fresh.commands.tobytes() == first.commands.tobytes()
    assert planner.hold(at_rest(), 0.5).duration_s != planner.hold(at_rest(), 1.0).duration_s
    # the same posture recurs exactly, so that a walk in a circle is planned once
    second = planner.plan(first.end, motion, 0.5, key="bow")
    third = planner.plan(second.end, motion, 0.5, key="bow")
    assert third.end.q.tobytes() == second.end.q.tobytes()


@pytest.mark.parametrize("speed", [0.0, -1.0, np.nan, np.inf])
def test_a_bad_speed_is_refused(speed):
    with pytest.raises(InvalidValueError, match="speed must be positive"):
        planner().plan(at_rest(), there_and_back(BOW, 1.0), speed)


def test_bad_motions_are_refused():
    frames = there_and_back(BOW, 1.0).frames
    with pytest.raises(InvalidValueError, match="shape"):
        planner().plan(at_rest(), Motion(frames[:, :5], 100.0))
    with pytest.raises(InvalidValueError, match="shape"):
        planner().plan(at_rest(), Motion(frames[:1], 100.0))
    broken = frames.copy()
    broken[3, 4] = np.nan
    with pytest.raises(InvalidValueError, match="finite"):
        planner().plan(at_rest(), Motion(broken, 100.0))
    whole = sweep({}, BOW, 1.0)
    with pytest.raises(InvalidValueError, match="shape"):
        planner().motion(whole[:, :5], 100.0)
    with pytest.raises(InvalidValueError, match="rate_hz"):
        planner().motion(whole, 0.0)
    whole[3, -1] = np.nan  # a leg's joint
    with pytest.raises(InvalidValueError, match="finite"):
        planner().motion(whole, 100.0)


@pytest.mark.parametrize("part", ["target", "q", "ground"])
def test_a_robot_that_is_nowhere_is_refused(part):
    here = at_rest()
    lost = here._replace(**{part: np.full_like(getattr(here, part), np.nan)})
    for plan in (
        lambda: planner().plan(lost, there_and_back(BOW, 1.0)),
        lambda: planner().hold(lost, 1.0),
        lambda: planner().home(lost),
    ):
        with pytest.raises(InvalidValueError, match=f"must be finite; {part} is not"):
            plan()


def test_refining_reproduces_a_parabola_exactly():
    t = np.arange(8) * 0.02
    knots = np.stack((t**2, 3 * t - t**2), axis=1)
    fine = np.arange(1, 36) * 0.004
    position, rate = refine(knots, 0.02, 5)
    np.testing.assert_allclose(
        position, np.stack((fine**2, 3 * fine - fine**2), axis=1), atol=1e-12
    )
    np.testing.assert_allclose(rate, np.stack((2 * fine, 3 - 2 * fine), axis=1), atol=1e-10)


def test_the_live_controller_follows_a_stream_and_balances():
    """The paper's law, one frame at a time: same motion, without knowing what comes."""
    controller = StandingController(HUMANOID)
    model = HUMANOID.model()
    data = mujoco.MjData(model)
    data.qpos[:] = humanoid_reference().rest
    frames = np.vstack((sweep({}, BOW, 2.0), sweep(BOW, ARMS, 2.0), sweep(ARMS, {}, 2.0)))
    limits = HUMANOID.position_limits
    soles = convex_hull(np.array([[-0.09, -0.145], [0.15, -0.145], [0.15, 0.145], [-0.09, 0.145]]))
    at = np.arange(0, len(frames) - 1, 0.4)
    for i, x in enumerate(at):
        command = controller.update(frames[int(x)] * (1 - x % 1) + frames[int(x) + 1] * (x % 1))
        assert (command >= limits[:, 0]).all() and (command <= limits[:, 1]).all()
        data.ctrl[:] = command
        mujoco.mj_step(model, data)
        if i % 50 == 0:
            assert support_margin(soles, data.subtree_com[1, :2]) > 0.1
    reference = controller.reference
    assert controller._balance.cog_error_m(reference) < 5e-4
    assert np.abs(data.qpos[7:] - reference.q[7:]).max() < 0.02
    np.testing.assert_allclose(reference.target, frames[-1][TRACKED], atol=2e-3)
    # where the stream ends, the law ends where a plan does
    planned = planner().plan(at_rest(), Motion(frames[:, TRACKED], RATE_HZ), 1.0).end
    np.testing.assert_allclose(reference.q[7:], planned.q[7:], atol=5e-3)


def test_the_live_controller_limits_velocities_and_refuses_bad_frames():
    controller = StandingController(HUMANOID)
    before = controller.reference.target
    controller.update(sweep(ARMS, ARMS, 0.1)[0])  # a jump of 2.2 rad
    step = np.abs(controller.reference.target - before)
    assert (step <= humanoid_reference().velocity * 0.004 + 1e-12).all() and step.max() > 0.03
    with pytest.raises(FrameError, match="33 values"):
        controller.update(np.zeros(5))
    with pytest.raises(FrameError, match="finite"):
        controller.update(np.full(33, np.nan))
    controller.reset()
    np.testing.assert_array_equal(controller.reference.target, before)
    with pytest.raises(InvalidValueError, match="period"):
        UpperBodyTracker(humanoid_reference().limits, humanoid_reference().velocity, 0.0)
