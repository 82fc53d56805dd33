"""Steps that save a robot that was pushed."""

import numpy as np
import pytest
from standing_library import KICK, RATE_HZ, sweep

from mplearn.errors import InvalidValueError
from mplearn_envs.execution.bodies import Body
from mplearn_envs.execution.reflexes import Pushes
from mplearn_envs.execution.simulation import Simulation
from mplearn_envs.mechanics import rest_reference
from mplearn_envs.planning import Planner
from mplearn_envs.robot import humanoid


@pytest.fixture(scope="module")
def robot():
    return humanoid()


@pytest.fixture(scope="module")
def planner(robot):
    return Planner(robot)


@pytest.fixture(scope="module")
def simulation(robot):
    return Simulation(robot, body=Body(steps=True))


def _push(simulation, angle, impulse_ns):
    force = impulse_ns / 0.1 * np.array([[np.cos(angle), np.sin(angle), 0.0]])
    return Pushes(simulation.model.body("chest").id, np.array([[25, 50]]), force)


def test_a_robot_that_is_not_pushed_performs_as_if_it_could_not_step(robot, planner, simulation):
    plan = planner.hold(rest_reference(robot), 0.6)
    other = Simulation(robot, feedback="always")
    simulation.reset()
    other.reset()
    report, expected = simulation.perform(plan), other.perform(plan)
    assert np.array_equal(simulation.data.qpos, other.data.qpos)
    assert np.array_equal(simulation.data.qvel, other.data.qvel)
    assert report.n_steps == 0 and report.end is None
    assert report.duration_s == expected.duration_s


@pytest.mark.parametrize("angle", np.arange(8) * np.pi / 4)
def test_push_of_36_ns_is_survived_in_eight_directions(robot, planner, simulation, angle):
    simulation.reset()
    plan = planner.hold(rest_reference(robot), 1.0)
    report = simulation.perform(plan, pushes=_push(simulation, angle, 36.0))
    assert not report.fallen
    assert report.n_steps >= 1
    assert report.duration_s > plan.duration_s
    feet = report.end.ground  # beside each other again
    assert np.linalg.norm(feet[0, :2] - feet[1, :2] - [0.0, 0.18]) < 0.04
    after = simulation.perform(planner.hold(report.end, 1.0))
    assert not after.fallen and after.n_steps == 0


def _survived_amid_a_kick(robot, planner, simulation, share, angle, impulse_ns):
    """Push with the left foot in the air, after a share of that time; return the steps taken."""
    simulation.reset()
    plan = planner.plan(rest_reference(robot), planner.motion(sweep({}, KICK, 0.8), RATE_HZ), 0.5)
    aloft = np.flatnonzero(plan.up == 0) * (len(plan.commands) // (len(plan.q) - 1))
    start = int(aloft[int(share * len(aloft))])
    push = _push(simulation, np.radians(angle), impulse_ns)
    report = simulation.perform(plan, pushes=push._replace(steps=np.array([[start, start + 25]])))
    assert not report.fallen
    assert not simulation.perform(planner.hold(report.end, 1.0)).fallen
    return report.n_steps


@pytest.mark.parametrize("angle", [-45.0, -30.0, 0.0, 90.0])
def test_who_is_pushed_on_one_foot_puts_the_other_one_down_or_across(
    robot, planner, simulation, angle
):
    """The left foot is in the air, the right one stands: to its side only a crossing step helps."""
    assert _survived_amid_a_kick(robot, planner, simulation, 0.5, angle, 36.0) >= 1


@pytest.mark.parametrize("share", [0.2, 0.5])
def test_who_is_pushed_past_the_foot_that_stands_comes_down_and_steps_with_that(
    robot, planner, simulation, share
):
    """The left foot is in the air: it comes down, the right one steps aside, the left follows."""
    assert _survived_amid_a_kick(robot, planner, simulation, share, -90.0, 24.0) >= 3


@pytest.mark.parametrize("angle", [105.0, 120.0, 135.0, 150.0])
def test_a_foot_that_lands_on_its_toes_comes_down_on_its_whole_sole(
    robot, planner, simulation, angle
):
    """Else it stays on them, its heel in the air, and the robot falls over them."""
    assert _survived_amid_a_kick(robot, planner, simulation, 0.8, angle, 36.0) >= 1


def test_small_push_needs_no_step(robot, planner, simulation):
    simulation.reset()
    report = simulation.perform(
        planner.hold(rest_reference(robot), 1.0), pushes=_push(simulation, 0.0, 10.0)
    )
    assert not report.fallen and report.n_steps == 0


def test_pictures_change_nothing(robot, planner, simulation):
    plan, states = planner.hold(rest_reference(robot), 0.6), []
    for on_frame in (None, lambda: None):
        simulation.reset()
        report = simulation.perform(plan, on_frame, 7, _push(simulation, 1.0, 30.0))
        states.append((simulation.state(), report.duration_s, report.end.q))
    for one, other in zip(*states, strict=True):
        assert np.array_equal(one, other)


def test_a_simulation_that_diverges_on_the_way_back_is_a_fall_of_that_time(
    robot, planner, simulation, monkeypatch, tmp_path
):
    monkeypatch.chdir(tmp_path)  # MuJoCo writes what it warns of into a file there
    plan, frames = planner.hold(rest_reference(robot), 0.6), []

    def last_but_two():
        frames.append(None)
        if len(frames) == n - 2:
            simulation.data.qvel[:] = np.inf

    n = 0
    for fallen in (False, True):
        simulation.reset()
        frames.clear()
        report = simulation.perform(plan, last_but_two, 10, _push(simulation, 1.0, 30.0))
        assert report.end is not None and report.fallen == fallen
        n = len(frames)
    simulation.reset()
    assert not simulation.perform(plan).fallen


def test_who_takes_no_steps_cannot_be_pushed(robot, planner):
    simulation = Simulation(robot)
    simulation.reset()
    plan = planner.hold(rest_reference(robot), 0.2)
    with pytest.raises(InvalidValueError, match="steps=True"):
        simulation.perform(plan, pushes=_push(simulation, 0.0, 5.0))
