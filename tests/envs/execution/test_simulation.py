"""The simulation: what it does is MuJoCo's, bit for bit, however it is cut up."""

import copy
import pickle
import sys
import threading
from functools import cache

import mujoco
import numpy as np
import pytest
from planners import planner
from standing_library import BOW, RATE_HZ, sweep

from mplearn.errors import InvalidValueError
from mplearn_envs.control.ankle_feedback import correct, make_ankle_feedback
from mplearn_envs.execution.simulation import Simulation
from mplearn_envs.mechanics import rest_reference
from mplearn_envs.mechanics.reference import tracked_columns
from mplearn_envs.mechanics.views import Views
from mplearn_envs.planning import Motion, Planner
from mplearn_envs.robot import humanoid

HUMANOID = humanoid()
MOTION = Motion(sweep({}, BOW, 1.0)[:, tracked_columns(HUMANOID)], RATE_HZ)


@cache
def bowing():
    return planner().plan(rest_reference(HUMANOID), MOTION, 1.0)


STATE = mujoco.mjtState.mjSTATE_INTEGRATION


def test_nothing_is_performed_before_the_robot_stands():
    new = Simulation(HUMANOID)
    for each in (new, copy.deepcopy(new), pickle.loads(pickle.dumps(new))):
        with pytest.raises(InvalidValueError, match=r"call reset\(\)"):
            each.perform(bowing())
    new.reset()
    for each in (copy.deepcopy(new), pickle.loads(pickle.dumps(new))):
        assert not each.perform(bowing()).fallen


def test_a_body_that_is_certain_settles_once(monkeypatch):
    new = Simulation(HUMANOID)
    new.reset()
    began = new.state()
    monkeypatch.setattr(mujoco, "mj_step", lambda *_: pytest.fail("it settles again"))
    for draw in (1, 2):
        new.embody(draw)
        new.reset()
        assert (new.state() == began).all()


@pytest.fixture
def simulation():
    simulation = Simulation(HUMANOID)
    simulation.reset()
    return simulation


def step_by_step(simulation, commands):
    """Return the state after MuJoCo's own steps."""
    model, data = simulation.model, mujoco.MjData(simulation.model)
    mujoco.mj_setState(model, data, simulation.state(), STATE)
    for command in commands:
        data.ctrl[:] = command
        mujoco.mj_step(model, data)
    out = np.empty(mujoco.mj_stateSize(model, STATE))
    mujoco.mj_getState(model, data, out, STATE)
    return out


def test_performing_is_mujocos_steps(simulation):
    expected = step_by_step(simulation, bowing().commands)
    performance = simulation.perform(bowing())
    assert simulation.state().tobytes() == expected.tobytes()
    assert not performance.fallen and performance.duration_s == pytest.approx(bowing().duration_s)


def test_taking_pictures_changes_nothing(simulation):
    start = simulation.state()
    whole = simulation.perform(bowing())
    end = simulation.state()
    simulation.load_state(start)
    heights = []
    parts = simulation.perform(bowing(), lambda: heights.append(simulation.data.time), 12)
    assert simulation.state().tobytes() == end.tobytes()
    for one, other in zip(whole, parts, strict=True):
        np.testing.assert_array_equal(one, other)
    assert len(heights) == -(-len(bowing().commands) // 15) and np.all(np.diff(heights) > 0)


@pytest.mark.parametrize("on_frame", [None, lambda: None])
def test_a_fall_ends_it_where_it_is_seen(simulation, on_frame):
    simulation.data.qvel[0] = 2.0
    start = pickle.loads(pickle.dumps(simulation))
    performance = simulation.perform(bowing(), on_frame)
    assert performance.fallen and performance.duration_s < bowing().duration_s
    n_steps = round(performance.duration_s / simulation.model.opt.timestep)
    expected = step_by_step(start, bowing().commands[:n_steps])
    assert simulation.state().tobytes() == expected.tobytes()
    assert len(performance.zmp_margin_m) == n_steps // 5


def test_applied_forces_go_on_acting(simulation):
    simulation.data.xfrc_applied[1, 0] = 30.0
    expected = step_by_step(simulation, bowing().commands)
    simulation.perform(bowing())
    assert simulation.state().tobytes() == expected.tobytes()


def test_guided_steps_are_mujocos_with_the_guides_corrections(simulation):
    simulation.feedback = "always"
    model, data = simulation.model, mujoco.MjData(simulation.model)
    mujoco.mj_setState(model, data, simulation.state(), STATE)
    mujoco.mj_kinematics(model, data)
    mujoco.mj_comPos(model, data)
    guide = make_ankle_feedback(HUMANOID, bowing())
    views = Views.of(data, np.array([model.body(name).id for name in HUMANOID.feet]))
    changed = 0
    for step, command in enumerate(bowing().commands):
        mujoco.mj_step1(model, data)  # the feedback is by where the robot is now
        mujoco.mj_subtreeVel(model, data)
        data.ctrl[:] = command
        correct(guide, step, views)
        changed += (data.ctrl != command).any()
        mujoco.mj_step2(model, data)
    expected = np.empty(mujoco.mj_stateSize(model, STATE))
    mujoco.mj_getState(model, data, expected, STATE)
    simulation.perform(bowing())
    assert simulation.state().tobytes() == expected.tobytes()
    assert changed > 0.9 * len(bowing().commands)


@pytest.mark.parametrize("feedback", ["always", "never"])
def test_other_threads_go_on_meanwhile(simulation, feedback):
    simulation.feedback = feedback
    plan = Planner(HUMANOID).hold(rest_reference(HUMANOID), 20.0)
    simulation.perform(bowing())  # compiled by now
    simulation.reset()
    begun, over = threading.Event(), threading.Event()

    def work():
        begun.set()
        assert not simulation.perform(plan).fallen
        over.set()

    interval = sys.getswitchinterval()
    sys.setswitchinterval(1000.0)  # who has Python's lock keeps it until it gives it away
    try:
        worker = threading.Thread(target=work)
        worker.start()
        begun.wait()
        went_on = not over.is_set()
        worker.join()
    finally:
        sys.setswitchinterval(interval)
    assert went_on


def test_a_copy_shares_the_model_and_goes_on_bit_for_bit(simulation):
    simulation.perform(bowing())
    copied = copy.deepcopy(simulation)
    assert copied.model is simulation.model and copied.data is not simulation.data
    before = simulation.state().tobytes()
    copied.perform(bowing())
    assert simulation.state().tobytes() == before
    simulation.perform(bowing())
    assert copied.state().tobytes() == simulation.state().tobytes()
    copied.reset()
    simulation.reset()
    assert copied.state().tobytes() == simulation.state().tobytes()
