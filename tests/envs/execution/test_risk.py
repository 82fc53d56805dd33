"""Falls by chance where nothing is simulated: as often as said, and the same again."""

import copy
import pickle

import gymnasium
import numpy as np
import pytest
from standing_library import standing_library

import mplearn_envs
from mplearn.errors import InvalidValueError
from mplearn_envs.execution import risk
from mplearn_envs.execution.risk import FallRisk, strain_of

CERTAIN = FallRisk((50.0, 0.0, 0.0, 0.0, 0.0))


def make(body="harsh", **options):
    return gymnasium.make(
        "mplearn/PrimitiveHumanoid-v0",
        library=standing_library(),
        dynamics="kinematic",
        body=body,
        disable_env_checker=True,
        **options,
    ).unwrapped


def walk(env, seed, n=40):
    _, info = env.reset(seed=seed)
    rng, fallen = np.random.default_rng(seed), []
    for _ in range(n):
        action = int(rng.choice(np.flatnonzero(info["action_mask"])))
        strain = strain_of(env.performer.plan(env.repertoire.primitive(action)))
        before = env.state()
        _, reward, terminated, _, info = env.step(action)
        chance = env.performer._risk.probability(strain, info["duration_s"])
        fallen.append((bool(info["fallen"]), chance, reward))
        assert terminated == info["fallen"]
        if terminated:
            assert info["reward_terms"]["fall"] < -5.0
            break
    return fallen, before, action


def test_the_robot_falls_as_often_as_is_said():
    env = make()
    seen = [each for seed in range(150) for each in walk(env, seed)[0]]
    whole = [(fell, chance) for fell, chance, _ in seen if not fell]  # of a fall the time is cut
    falls, expected = sum(fell for fell, *_ in seen), sum(chance for _, chance in whole)
    assert falls > 20
    assert abs(falls - expected) < 4.0 * np.sqrt(expected)


def test_luck_belongs_to_the_state():
    env = make()
    env.reset(seed=1)
    one = walk(env, 7)
    assert one[0] == walk(env, 7)[0] == walk(pickle.loads(pickle.dumps(env)), 7)[0]
    twin = copy.deepcopy(env)
    twin.reset(seed=99)
    twin.load_state(one[1])
    *_, info = twin.step(one[2])
    assert bool(info["fallen"]) == one[0][-1][0]


def test_a_fall_ends_the_macro_step_early(monkeypatch):
    monkeypatch.setattr("mplearn_envs.execution.kinematic.risk_of", lambda body: CERTAIN)
    env, calm = make(), make("nominal")
    _, info = env.reset(seed=2)
    action = int(np.flatnonzero(info["action_mask"])[-1])
    *_, info = env.step(action)
    monkeypatch.undo()
    calm.reset(seed=2)
    *_, whole = calm.step(action)
    assert info["fallen"] and not whole["fallen"]
    assert 0.0 < info["duration_s"] <= whole["duration_s"]


def test_a_body_as_believed_never_falls_and_others_must_be_known():
    assert risk.risk_of(mplearn_envs.execution.bodies.NOMINAL) is None
    with pytest.raises(InvalidValueError, match="knows how often bodies of the levels"):
        make({"masses": 0.2})
    assert make({"level": "harsh"}).body == make().body


def test_what_strains_the_balance():
    env = make("nominal")
    env.reset(seed=1)
    names = {env.library[id].name: id for id in env.repertoire.feasible_ids}
    hold = strain_of(env.performer.plan(None))
    kick = strain_of(env.performer.plan(names["kick"]))
    assert hold == pytest.approx([1.0, 0.0, hold[2], 0.0, 0.0], abs=1e-3)
    assert 0.1 < kick[1] <= 1.0 and kick[3] > 0.0 and kick[4] > 0.0
    fast = strain_of(env.performer.plan(names["kick"], 1.5))
    assert fast[4] > kick[4]
