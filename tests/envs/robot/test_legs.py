"""Legs that are in each other's way."""

import itertools

import mujoco
import numpy as np
import pytest

from mplearn_envs.execution.bodies import Body, body_model
from mplearn_envs.execution.reflexes import Pushes
from mplearn_envs.execution.simulation import Simulation
from mplearn_envs.mechanics import rest_reference
from mplearn_envs.planning import Planner
from mplearn_envs.robot import humanoid

PARTS = ("thigh", "shank", "foot")


@pytest.fixture(scope="module")
def robot():
    return humanoid()


def _shapes(model, side):
    """Return what collides of a leg, each shape by its number."""
    bodies = {model.body(f"{part}_{side}").id for part in PARTS}
    collides = (model.geom_contype != 0) | (model.geom_conaffinity != 0)
    return [g for g in np.flatnonzero(collides) if model.geom_bodyid[g] in bodies]


def _leg_contacts(model, data):
    """Return the sides of what touches each other, the floor left out."""
    names = (
        [model.body(model.geom_bodyid[g]).name for g in (contact.geom1, contact.geom2)]
        for contact in data.contact
    )
    return {tuple(sorted(name[-1] for name in pair)) for pair in names if "world" not in pair}


def test_each_leg_collides_with_the_other_and_never_with_itself(robot):
    model = body_model(robot, Body(steps=True))
    data = mujoco.MjData(model)
    rng, seen = np.random.default_rng(0), set()
    low, high = robot.position_limits.T
    legs = robot.leg_joints
    for _ in range(300):  # any posture, high above the floor
        data.qpos[:] = rest_reference(robot).q
        data.qpos[2] = 3.0
        data.qpos[7 + legs] = rng.uniform(low[legs], high[legs])
        mujoco.mj_forward(model, data)
        seen |= _leg_contacts(model, data)
    assert seen == {("l", "r")}
    parts = {model.body(model.geom_bodyid[g]).name[:-2] for g in _shapes(model, "l")}
    assert parts == set(PARTS)


def test_who_takes_no_steps_is_what_it_was_and_legs_add_no_mass(robot):
    was, steps = robot.model(), body_model(robot, Body(steps=True))
    alone = body_model(robot, Body())
    for name in ("geom_contype", "geom_conaffinity", "geom_type", "body_mass", "body_inertia"):
        assert np.array_equal(getattr(alone, name), getattr(was, name))
    for name in ("body_mass", "body_inertia", "geom_size", "geom_friction"):
        assert np.array_equal(getattr(steps, name), getattr(was, name))


@pytest.mark.parametrize("angle", [45.0, 135.0, 225.0, 315.0])
def test_steps_that_catch_a_push_keep_legs_apart(robot, angle):
    """Those are the pushes after which legs went 3 to 5 cm through each other."""
    simulation, planner = Simulation(robot, body=Body(steps=True)), Planner(robot)
    model, data, apart = simulation.model, simulation.data, []
    between = np.zeros(6)
    pairs = list(itertools.product(_shapes(model, "l"), _shapes(model, "r")))

    def look():
        apart.append(
            min(mujoco.mj_geomDistance(model, data, *pair, 0.05, between) for pair in pairs)
        )

    towards = np.array([[np.cos(np.radians(angle)), np.sin(np.radians(angle)), 0.0]])
    push = Pushes(model.body("chest").id, np.array([[25, 50]]), 360.0 * towards)
    simulation.reset()
    report = simulation.perform(planner.hold(rest_reference(robot), 1.0), look, 5, push)
    assert not report.fallen and report.n_steps >= 1
    assert min(apart) > 0.0
