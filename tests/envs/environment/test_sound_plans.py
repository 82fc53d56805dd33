"""Nothing is performed whose plan from where the robot stands cannot be: masks, modes, plans."""

import copy
import pickle

import gymnasium
import numpy as np
import pytest
from stance_library import stance_library

import mplearn_envs  # noqa: F401  (registers the environment)
from mplearn_envs.data.library_source import LibrarySource
from mplearn_envs.lru_cache import LRUCache
from mplearn_envs.mechanics import rest_reference
from mplearn_envs.planning import Planner
from mplearn_envs.robot import humanoid
from mplearn_envs.skills.repertoire import Repertoire
from mplearn_envs.skills.skills import Skills
from mplearn_envs.skills.soonest import performed
from mplearn_envs.varied.people import foreknowledge, varied_library

ID = "mplearn/PrimitiveHumanoid-v0"
NAMES = ("lunge", "side lunge", "kick", "retract")


def make(dynamics, **options):
    env = gymnasium.make(ID, library=stance_library(), dynamics=dynamics, **options)
    return env.unwrapped


def sound(plan):
    """Whether feet, weight and base come where they shall, and the soles carry it, throughout."""
    series = (plan.commands, plan.q, plan.error, plan.zmp_margin_m, *plan.end)
    finite = all(np.isfinite(part).all() for part in series)
    return finite and plan.error.max() <= 0.01 and plan.zmp_margin_m.min() >= 0.0075


@pytest.mark.parametrize("speeds, length", [((1.0,), 3), ((1.0, 1.5), 2)])
def test_every_plan_of_every_walk_can_be_performed(speeds, length):
    """All walks of so many primitives, lunges and kicks in any order, that the mask allows."""
    env = make("kinematic", actions={"speeds": speeds, "novel_penalty": 0.1})
    skills, n_walks, by_way_of_rest = env.repertoire.skills, 0, set()
    rest = rest_reference(humanoid())

    def walk(names):
        nonlocal n_walks
        n_walks += len(names) == length
        state, mask = env.state(), env.action_masks()
        assert mask.reshape(len(speeds), -1)[:, : len(NAMES) + 1].all()
        for action in np.flatnonzero(mask) if len(names) < length else ():
            block, slot = divmod(int(action), env.capacity)
            id, here = env.repertoire.primitive(slot), env.performer.reference
            if id is None:
                continue
            plan = env.performer.plan(id, speeds[block])
            assert sound(plan) and sound(skills.planner.home(plan.end))
            np.testing.assert_array_equal(plan.q[0], here.q)
            if not sound(skills.at_once(here, id, speeds[block])):
                by_way_of_rest.add((*names, NAMES[slot - 1]))
                still = np.abs(plan.q[:, 7:] - rest.q[7:]).max(axis=1) < 1e-3
                assert still.any()
            observation, *_, info = env.step(int(action))
            assert np.isfinite(observation["posture"]).all() and not info["fallen"]
            walk((*names, NAMES[slot - 1]))
            env.load_state(state)

    env.reset(seed=1)
    walk(())
    assert n_walks == 64
    assert by_way_of_rest == ({("side lunge", "kick", "lunge")} if length == 3 else set())


def test_both_modes_go_by_way_of_rest_and_go_on_bit_for_bit():
    novel = {"novel_penalty": 0.1}
    simulated, kinematic = (make(mode, actions=novel) for mode in ("simulated", "kinematic"))
    for env in (simulated, kinematic):
        env.reset(seed=1)
    seen = []
    for name in ("side lunge", "kick", "lunge", "retract"):
        slot = NAMES.index(name) + 1
        assert np.array_equal(simulated.action_masks(), kinematic.action_masks())
        if name == "lunge":
            twins = copy.deepcopy(simulated), pickle.loads(pickle.dumps(simulated))
            futures = [twin.step(slot)[0]["posture"] for twin in twins]
        ours, theirs = simulated.step(slot), kinematic.step(slot)
        assert not ours[4]["fallen"] and ours[4]["duration_s"] == theirs[4]["duration_s"]
        np.testing.assert_allclose(ours[0]["posture"], theirs[0]["posture"], atol=0.05)
        seen.append(ours[0]["posture"])
    for future in futures:
        np.testing.assert_array_equal(future, seen[2])


def test_where_the_robot_cannot_come_to_rest_the_mask_says_what_it_can_do(monkeypatch):
    """As after steps that caught a push; what can be begun at once, and leads back, is legal."""
    env = make("kinematic", actions={"novel_penalty": 0.1})
    env.reset(seed=1)
    env.step(NAMES.index("side lunge") + 1)
    skills, wide = env.repertoire.skills, env.performer.reference.ground
    home = Planner.home

    def out_of_reach(self, start):
        plan = home(self, start)
        stranded = np.allclose(start.ground, wide, atol=1e-3)
        return plan._replace(error=plan.error + 0.1) if stranded else plan

    monkeypatch.setattr(Planner, "home", out_of_reach)
    monkeypatch.setattr(env.repertoire, "memory", LRUCache(100))
    monkeypatch.setattr(skills._check, "_leads_home", LRUCache(100))
    env.reset(seed=1)
    *_, info = env.step(NAMES.index("side lunge") + 1)
    here = env.performer.reference
    plans = [skills.at_once(here, id) for id in env.repertoire.ids]
    possible = [sound(plan) and sound(skills.planner.home(plan.end)) for plan in plans]
    assert any(possible) and not all(possible)
    assert info["action_mask"].astype(bool)[1 : 1 + len(NAMES)].tolist() == possible
    refused = {slot for slot, can in enumerate(possible, start=1) if not can}
    assert set(env.infeasible()) == refused and all(env.infeasible().values())
    assert info["transition_prior"].sum() == pytest.approx(1.0)
    *_, info = env.step(1 + possible.index(True))
    assert info["action_mask"][1 : 1 + len(NAMES)].all()


def test_the_built_in_primitives_are_begun_at_once_from_wherever_they_lead():
    """Every place of version 0: so what was measured with it stays as it was."""
    repertoire = Repertoire(LibrarySource(None).now(), humanoid())
    skills, rest = repertoire.skills, rest_reference(humanoid())
    queue = [(rest, id) for id in performed(repertoire, repertoire.entries(rest))]
    seen = set()
    for here, id in queue:
        plan = skills.plan(here, id)
        assert sound(plan) and plan is not None
        np.testing.assert_array_equal(plan.q, skills.at_once(here, id).q)
        place = (id, *(part.tobytes() for part in plan.end))
        if place not in seen:
            seen.add(place)
            queue += [(plan.end, after) for after in performed(repertoire, repertoire.after(id))]
    assert {id for id, *_ in seen} == set(repertoire.feasible_ids) == set(repertoire.ids)


def test_what_is_known_beforehand_can_be_performed_from_rest_and_back():
    library = varied_library()
    skills = Skills(library, humanoid(), known=foreknowledge())
    for id in library.ids[::35]:
        for plan in skills._from_rest(id, skills.feasibility(id).speed):
            assert sound(plan)
