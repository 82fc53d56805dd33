"""Bodies that differ from what the robot believes: drawn the same from the same seed."""

import copy
import pickle
from dataclasses import fields, replace

import gymnasium as gym
import numpy as np
import pytest
from gymnasium.envs.registration import EnvSpec

import mplearn_envs  # noqa: F401
from mplearn.errors import InvalidValueError
from mplearn_envs.execution.bodies import BODIES, Body, body_model, draw_pushes, embody, make_body
from mplearn_envs.robot import humanoid

ENV = "mplearn/PrimitiveHumanoid-v0"
#: All that can differ, but for pushes, which the tests of reflexes have.
OTHER = replace(BODIES["harsh"], push_ns=0.0, pushes_per_minute=0.0, steps=False, delay_s=0.0)


def test_levels_and_values_by_name():
    assert make_body("harsh") is BODIES["harsh"]
    assert make_body({"level": "harsh", "masses": 0.0}) == replace(BODIES["harsh"], masses=0.0)
    assert make_body({"masses": 0.3}) == Body(masses=0.3)
    assert Body().certain and not BODIES["randomised"].certain


@pytest.mark.parametrize(
    ("given", "message"),
    [
        ("soft", "nominal"),
        ({"mass": 0.1}, "masses"),
        ({"masses": -0.1}, "masses must be in"),
        ({"masses": "much"}, "masses must be in"),
        ({"level": "soft"}, "level must be one of"),
        ({"level": ["harsh"]}, "level must be one of"),
        ({"pushes_per_minute": 3.0}, "steps=True"),
        ({"steps": 2}, "steps must be"),
        (7, "body must be one of"),
    ],
)
def test_wrong_bodies_are_named(given, message):
    with pytest.raises(InvalidValueError, match=message):
        make_body(given)


def test_a_draw_is_the_same_whatever_was_drawn_before():
    robot = humanoid()
    one, other = body_model(robot, OTHER), body_model(robot, OTHER)
    embody(one, robot, OTHER, 5)
    embody(other, robot, OTHER, 6)
    assert not np.array_equal(one.body_mass, other.body_mass)
    drawn = embody(other, robot, OTHER, 5)
    for name in ("body_mass", "body_inertia", "actuator_gainprm", "geom_friction", "hfield_data"):
        assert np.array_equal(getattr(one, name), getattr(other, name)), name
    assert np.array_equal(one.opt.gravity, other.opt.gravity)
    assert np.ptp(drawn.off) > 0 and not drawn.off[robot.leg_joints].any()


def test_errors_are_as_large_as_stated_and_gravity_leans_by_the_slope():
    robot, body = humanoid(), replace(OTHER, payload_kg=0.0, bumps_m=0.0)
    model, believed = body_model(robot, body), robot.model()
    for draw in range(5):
        embody(model, robot, body, draw)
        share = model.body_mass[1:] / believed.body_mass[1:] - 1.0
        assert np.abs(share).max() <= body.masses + 1e-12
        strength = model.actuator_gainprm[:, 0] / believed.actuator_gainprm[:, 0]
        assert np.abs(strength - 1.0).max() <= body.gains + 1e-12
        assert model.actuator_biasprm[:, 1] == pytest.approx(-model.actuator_gainprm[:, 0])
        assert np.linalg.norm(model.opt.gravity) == pytest.approx(9.81)
        lean = np.arccos(-model.opt.gravity[2] / 9.81)
        assert 0.0 <= lean <= body.slope_rad + 1e-9


def test_pushes_come_as_often_and_as_hard_as_stated():
    robot, body = humanoid(), BODIES["harsh"]
    model = body_model(robot, Body())
    found = [draw_pushes(model, robot, body, 3, count, 10.0) for count in range(300)]
    n = sum(len(pushes.steps) for pushes in found)
    assert n == pytest.approx(300 * 10.0 / 60.0 * body.pushes_per_minute, rel=0.2)
    sizes = np.concatenate([np.linalg.norm(pushes.force, axis=1) for pushes in found]) * 0.1
    assert sizes.max() <= body.push_ns and sizes.max() > 0.9 * body.push_ns
    assert not len(draw_pushes(model, robot, Body(), 3, 0, 10.0).steps)


def _episode(env, seed, n=3):
    out = [env.reset(seed=seed)[0]]
    for _ in range(n):
        mask = env.unwrapped.action_masks()
        out.append(env.step(int(np.flatnonzero(mask)[-1]))[0])
    return out


def _same(one, other):
    return all(np.array_equal(a[key], b[key]) for a, b in zip(one, other, strict=True) for key in a)


def test_nominal_is_what_was():
    with gym.make(ENV) as plain, gym.make(ENV, body="nominal") as named:
        assert _same(_episode(plain, 3), _episode(named, 3))


def test_seeds_copies_pickles_and_states_give_the_same_episode():
    with gym.make(ENV, body=OTHER) as env:
        first = _episode(env, 3)
        assert not _same(first, _episode(env, 4))
        assert _same(first, _episode(env, 3))
        env.reset(seed=3)
        inner = env.unwrapped
        others = [copy.deepcopy(inner), pickle.loads(pickle.dumps(inner))]
        state = inner.state()
        with gym.make(EnvSpec.from_json(env.spec.to_json())) as again:
            assert again.unwrapped.body == OTHER
            again.reset(seed=99)
            again.unwrapped.load_state(state)
            action = int(np.flatnonzero(inner.action_masks())[-1])
            expected = env.step(action)[0]
            for other in (*others, again.unwrapped):
                assert _same([expected], [other.step(action)[0]])


def test_every_value_is_documented():
    for each in fields(Body):
        assert f"{each.name}:" in Body.__doc__


def test_kinematic_mode_has_no_body_whose_falls_were_never_counted():
    with pytest.raises(InvalidValueError, match="simulated"):
        gym.make(ENV, dynamics="kinematic", body={"level": "harsh", "masses": 0.1})
