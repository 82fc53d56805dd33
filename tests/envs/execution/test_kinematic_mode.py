"""The kinematic mode against the simulated one, and episodes whose state is saved."""

import copy
import pickle

import gymnasium
import numpy as np
import pytest
from standing_library import MOTIONS, standing_library

import mplearn_envs  # noqa: F401  (registers the environment)
from mplearn.errors import InvalidValueError
from mplearn_envs.tasks import FollowTask, GoalTask, ReciteTask

ID = "mplearn/PrimitiveHumanoid-v0"
SLOT = {motion[0]: slot for slot, motion in enumerate(MOTIONS, start=1)}


def make(dynamics, library=None, **options):
    return gymnasium.make(ID, library=library or standing_library(), dynamics=dynamics, **options)


def equal(a, b):
    if isinstance(a, dict):
        return a.keys() == b.keys() and all(equal(a[key], b[key]) for key in a)
    return np.array_equal(a, b)


@pytest.mark.parametrize(
    "task",
    [FollowTask(), ReciteTask(), GoalTask(), "free"],
    ids=lambda t: getattr(t, "kind", str(t)[:6]),
)
def test_both_modes_differ_by_little(task):
    """Spaces, masks, priors and durations are the same; the rest is within these bounds."""
    simulated = make("simulated", task=copy.deepcopy(task))
    kinematic = make("kinematic", task=copy.deepcopy(task))
    assert simulated.observation_space == kinematic.observation_space
    assert simulated.action_space == kinematic.action_space
    (ours, info), (theirs, other) = kinematic.reset(seed=2), simulated.reset(seed=2)
    rng = np.random.default_rng(2)
    bounds = {"posture": 0.005, "velocity": 0.05, "cog": 0.002, "support_margin": 0.002}
    for _ in range(10):
        for key, bound in bounds.items():
            np.testing.assert_allclose(ours[key], theirs[key], atol=bound, err_msg=key)
        for key in ("current_primitive", "action_mask", "transition_prior"):
            np.testing.assert_array_equal(ours[key], theirs[key])
        np.testing.assert_allclose(ours["task"], theirs["task"], atol=0.03)
        assert info.keys() == other.keys()
        action = rng.choice(np.flatnonzero(info["action_mask"]))
        ours, reward, terminated, _, info = kinematic.step(action)
        theirs, actual, over, _, other = simulated.step(action)
        assert info["duration_s"] == pytest.approx(other["duration_s"], abs=1e-9)
        assert reward == pytest.approx(actual, abs=0.01) and terminated == over
        assert info["zmp_margin_m"] == pytest.approx(other["zmp_margin_m"], abs=0.025)
        assert info["cog_deviation_m"] == pytest.approx(other["cog_deviation_m"], abs=0.005)
        assert not other["fallen"]
        if over:
            break


def test_what_is_remembered_is_what_was_found_out():
    """The same walk, with a memory that forgets at once and with one that has seen it all."""
    walks = []
    for forget in (True, False, False):
        env = make("kinematic")
        observation, info = env.reset(seed=0)
        rng, seen = np.random.default_rng(7), []
        for _ in range(25):
            if forget:
                env.unwrapped.repertoire.memory.clear()
                env.unwrapped.repertoire.skills.planner._cache.clear()
            action = rng.choice(np.flatnonzero(info["action_mask"]))
            observation, reward, _, _, info = env.step(action)
            seen.append((observation["posture"].tobytes(), observation["cog"].tobytes(), reward))
        walks.append(seen)
    assert walks[0] == walks[1] == walks[2]


def test_memory_is_bounded(monkeypatch):
    env = make("kinematic")
    memory = env.unwrapped.repertoire.memory
    memory.clear()
    monkeypatch.setattr(memory, "capacity", 3)
    _, info = env.reset(seed=0)
    for _ in range(20):
        action = env.action_space.sample(info["action_mask"])
        *_, info = env.step(action)
        assert len(memory) <= 3
    assert len(memory) == 3


def test_environments_of_one_library_share_what_they_know():
    first, second = make("kinematic").unwrapped, make("simulated").unwrapped
    assert first.repertoire is second.repertoire
    assert make("kinematic", motion={"speed": 0.4}).unwrapped.repertoire is not first.repertoire
    assert copy.deepcopy(first).repertoire is first.repertoire
    twin = pickle.loads(pickle.dumps(first))
    assert twin.repertoire is not first.repertoire
    for id in first.repertoire.library.ids:  # what is worked out on the way stays here
        first.repertoire.skills.feasibility(id)
    assert len(pickle.dumps(first)) < 2_000_000


@pytest.mark.parametrize("dynamics", ["kinematic", "simulated"])
def test_a_saved_episode_goes_on_bit_for_bit(dynamics):
    env = make(dynamics, task=FollowTask())
    env.reset(seed=0)
    env.step(SLOT["bow down"])
    state = env.unwrapped.state()
    futures = []
    for _ in range(2):
        future = [env.step(action) for action in (SLOT["bow up"], 0, SLOT["arms up"])]
        futures.append(future)
        observation, info = env.unwrapped.load_state(state)
        assert info["primitive_name"] == "bow down"
        assert observation["current_primitive"] == SLOT["bow down"]
    for ours, theirs in zip(*futures, strict=True):
        assert equal(ours[0], theirs[0]) and ours[1:4] == theirs[1:4] and equal(ours[4], theirs[4])


def test_a_kinematic_twin_looks_ahead_of_a_simulated_one():
    env, twin = make("simulated"), make("kinematic")
    env.reset(seed=0)
    twin.reset(seed=0)
    env.step(SLOT["squat"])
    twin.unwrapped.load_state(env.unwrapped.state())
    ours, theirs = env.step(SLOT["rise"]), twin.step(SLOT["rise"])
    assert theirs[1] == pytest.approx(ours[1], abs=0.02)
    np.testing.assert_allclose(theirs[0]["posture"], ours[0]["posture"], atol=0.03)
    with pytest.raises(InvalidValueError, match="kinematic state"):
        env.unwrapped.load_state(twin.unwrapped.state())


def test_kinematic_frames_are_smooth():
    env = make("kinematic").unwrapped
    env.reset()
    env.step(SLOT["bow down"])  # remembered: it is played again all the same
    env.reset()
    heads = []
    env.frame_callback = lambda: heads.append(env.simulation.data.body("head").xpos[2])
    *_, info = env.step(SLOT["bow down"])
    assert len(heads) == pytest.approx(25 * info["duration_s"], abs=2)
    assert heads[0] - heads[-1] > 0.1 and np.abs(np.diff(heads)).max() < 0.05


# ---- transitions that were never observed


def test_novel_transitions_are_legal_at_a_price():
    env = make("simulated", actions={"novel_penalty": 0.7}, task=ReciteTask(request=("rise",)))
    _, info = env.reset()
    feasible = {env.unwrapped.repertoire.slots[id] for id in env.unwrapped.repertoire.feasible_ids}
    assert set(np.flatnonzero(info["action_mask"]).tolist()) == {0, *feasible}
    assert info["transition_prior"][SLOT["rise"]] == 0.0
    assert info["transition_prior"].sum() == pytest.approx(1.0)
    *_, info = env.step(SLOT["squat"])
    assert not info["novel"] and info["reward_terms"]["novel"] == 0.0
    *_, terminated, _, info = env.step(SLOT["arms down"])  # the arms must be raised first
    assert info["novel"] and not info["illegal"] and not info["fallen"] and not terminated
    assert info["reward_terms"]["novel"] == -0.7
    *_, info = env.step(SLOT["rise"])
    assert info["is_success"]


def test_without_a_price_they_are_illegal():
    env = make("kinematic")
    _, info = env.reset()
    assert not info["action_mask"][SLOT["rise"]]
    assert env.step(SLOT["rise"])[4]["illegal"]
