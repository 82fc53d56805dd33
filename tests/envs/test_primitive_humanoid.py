"""The environment: compliance, masks and priors, determinism, saving, bad input."""

import copy
import json
import os
import pickle
import subprocess
import sys
import zipfile

import gymnasium
import numpy as np
import pytest
from standing_library import CHANNELS, JUMP, MOTIONS, RATE_HZ, standing_library, sweep

import mplearn_envs  # noqa: F401  (registers the environment)
from mplearn.errors import InvalidValueError, LibraryError, MPLearnError, RobotError
from mplearn.graph import TransitionGraph
from mplearn.hmm import fit
from mplearn.library import Primitive, PrimitiveLibrary
from mplearn_envs.tasks import Choice, FreeTask, Task

ID = "mplearn/PrimitiveHumanoid-v0"
SLOT = {motion[0]: slot for slot, motion in enumerate(MOTIONS, start=1)}


def make(names=None, **options):
    return gymnasium.make(ID, library=standing_library(names), **options)


def walk(env, n, seed):
    """Return what a random walk by the prior sees: rewards, postures and actions."""
    _, info = env.reset(seed=seed)
    env.action_space.seed(seed)
    seen = []
    for _ in range(n):
        action = env.action_space.sample(probability=info["transition_prior"])
        observation, reward, terminated, truncated, info = env.step(action)
        assert not terminated
        seen.append((int(action), float(reward), observation["posture"].tobytes(), truncated))
    return seen


def legal(info):
    return set(np.flatnonzero(info["action_mask"]).tolist())


# ---- what may come next


def test_the_start_offers_what_starts_near():
    _, info = make().reset()
    assert legal(info) == {0, *(SLOT[n] for n in ("arms up", "bow down", "squat", "kick", "wave"))}
    assert info["transition_prior"][0] == 0.0
    assert set(info["infeasible"]) == {SLOT["jump"]}
    assert "flight" in info["infeasible"][SLOT["jump"]][0]


def test_after_a_primitive_its_observed_feasible_followers_are_legal():
    env = make()
    env.reset()
    *_, info = env.step(SLOT["arms up"])
    assert legal(info) == {0, SLOT["arms down"]}
    assert info["transition_prior"][SLOT["arms down"]] == 1.0
    *_, info = env.step(SLOT["arms down"])
    assert info["primitive_name"] == "arms down"
    # counts 1, 2, 3, 4, 5, 6 of arms up, bow down, squat, kick, wave and jump, which is too much
    expected = {"arms up": 1, "bow down": 2, "squat": 3, "kick": 4, "wave": 5}
    for name, count in expected.items():
        assert info["transition_prior"][SLOT[name]] == pytest.approx(count / 15)
    assert info["transition_prior"].sum() == pytest.approx(1.0)
    assert set(info["infeasible"]) == {SLOT["jump"]}


def test_holding_keeps_the_followers():
    env = make()
    env.reset()
    *_, before = env.step(SLOT["arms up"])
    observation, _, _, _, after = env.step(0)
    assert legal(after) == legal(before)
    assert after["primitive_name"] == "arms up" and not after["illegal"]
    assert after["duration_s"] == pytest.approx(0.5, abs=0.02)
    assert observation["current_primitive"] == SLOT["arms up"]


def test_a_dead_end_is_left_by_holding():
    env = make()
    env.reset()
    *_, info = env.step(SLOT["wave"])
    assert info["dead_end"] and legal(info) == {0} and info["transition_prior"][0] == 1.0
    observation, _, _, _, info = env.step(0)
    assert observation["current_primitive"] == 0 and info["primitive"] == -1
    assert len(legal(info)) > 1 and info["transition_prior"][0] == 0.0


def test_where_nothing_starts_near_the_nearest_is_legal():
    env = make(("arms down", "bow up"))  # both start far from rest
    _, info = env.reset()
    assert legal(info) == {0, 2}  # the bow, not the raised arms


def test_a_random_walk_goes_on_and_on():
    env = make(max_steps=1000)
    seen = walk(env, 120, 3)
    performed = {action for action, *_ in seen}
    assert performed == {0, *(SLOT[m[0]] for m in MOTIONS if m[0] != "jump")}


def test_slots_are_stable_and_free_ones_illegal():
    small, large = make(("arms up", "arms down")), make(capacity=64)
    assert small.action_space.n == 32 and large.action_space.n == 64
    assert small.unwrapped.repertoire.primitive(1) == large.unwrapped.repertoire.primitive(1)
    _, info = large.reset()
    assert not info["action_mask"][10:].any()
    np.testing.assert_array_equal(large.unwrapped.action_masks(), info["action_mask"] == 1)


def test_an_illegal_action_holds_and_costs():
    env = make(illegal_penalty=3.0)
    env.reset()
    observation, reward, terminated, _, info = env.step(SLOT["jump"])
    assert info["illegal"] and not terminated
    assert info["reward_terms"]["illegal"] == -3.0
    assert reward == pytest.approx(sum(info["reward_terms"].values()))
    assert observation["current_primitive"] == 0
    assert info["duration_s"] == pytest.approx(0.5, abs=0.02)
    strict = make(illegal="raise")
    strict.reset()
    with pytest.raises(InvalidValueError, match="illegal here; legal are"):
        strict.step(31)


# ---- macro steps and rewards


def test_a_macro_step_lasts_as_long_as_the_primitive():
    durations = {}
    for speed in (0.5, 1.0):
        env = make(speed=speed)
        env.reset()
        *_, info = env.step(SLOT["squat"])
        durations[speed] = info["duration_s"]
        assert info["discount"] == pytest.approx(0.95 ** info["duration_s"])
        assert info["speed"] == speed
    assert durations[0.5] == pytest.approx(2 * durations[1.0], rel=0.05)


def test_the_free_task_pays_what_its_formulas_say():
    task = FreeTask(alive=0.1, likely=0.5, varied=0.5, memory=4)
    fresh = task.bonuses(Choice(7, True, 0.25, (1, 2, 3)))
    assert fresh == {"likely": 0.125, "varied": 0.5}
    assert task.bonuses(Choice(7, True, 1.0, (9, 7, 1, 7, 2)))["varied"] == 0.25
    assert task.bonuses(Choice(None, True, 1.0, ())) == {"likely": 0.0, "varied": 0.0}
    env = make(task=task, discount=0.9)
    env.reset()
    *_, info = env.step(SLOT["bow down"])
    integral = 0.1 * (1 - 0.9 ** info["duration_s"]) / -np.log(0.9)
    assert info["reward_terms"]["alive"] == pytest.approx(integral, rel=0.01)


def test_users_bring_their_own_task():
    class Calm(Task):
        def bonuses(self, choice):
            return {"calm": 1.0 if choice.primitive is None else 0.0}

        def rates(self, performance):
            return {"steady": -performance.cog_deviation_m}

        def fall(self):
            return -1.0

    env = make(task=Calm())
    env.reset()
    *_, info = env.step(0)
    assert info["reward_terms"]["calm"] == 1.0 and -0.01 < info["reward_terms"]["steady"] <= 0.0


def test_truncation_and_stepping_on():
    env = make(max_steps=2)
    env.reset()
    assert not env.step(0)[3] and env.step(0)[3]
    with pytest.raises(InvalidValueError, match="call reset"):
        fallen = make().unwrapped
        fallen.step(0)


def test_a_push_makes_it_fall_and_ends_the_episode():
    env = make()
    env.reset()
    env.unwrapped.simulation.data.qvel[0] = 3.0  # [m/s], forward
    observation, reward, terminated, _, info = env.step(0)
    for _ in range(4):
        if terminated:
            break
        observation, reward, terminated, _, info = env.step(0)
    assert terminated and info["fallen"] and info["reward_terms"]["fall"] < -5.0 and reward < 0
    assert env.observation_space.contains(observation)
    with pytest.raises(InvalidValueError, match="call reset"):
        env.step(0)
    env.reset()
    assert not env.step(0)[2]


def test_balance_is_reported():
    env = make()
    observation, _ = env.reset()
    assert observation["support_margin"][0] == pytest.approx(0.12, abs=0.01)
    np.testing.assert_allclose(observation["cog"][:2], 0.0, atol=0.002)
    assert np.abs(observation["velocity"]).max() < 1e-2
    *_, info = env.step(SLOT["bow down"])
    assert info["cog_deviation_m"] < 0.01 and np.rad2deg(info["tracking_rmse_rad"]) < 1.0
    assert info["zmp_margin_m"] > 0.05


# ---- the same again


def test_the_same_seed_gives_the_same_in_a_new_process():
    here = walk(make(), 6, 5)
    code = (
        "import test_primitive_humanoid as t, hashlib;"
        "print(hashlib.sha256(repr(t.walk(t.make(), 6, 5)).encode()).hexdigest())"
    )
    path = os.pathsep.join(p for p in (os.path.dirname(__file__), *sys.path) if p)  # noqa: PTH120
    there = subprocess.run(
        [sys.executable, "-c", code],
        capture_output=True,
        text=True,
        check=True,
        env={**os.environ, "PYTHONPATH": path},
    ).stdout.strip()
    import hashlib

    assert there == hashlib.sha256(repr(here).encode()).hexdigest()


def test_an_episode_does_not_depend_on_what_was_before():
    env = make()
    walk(env, 5, 1)
    assert walk(env, 4, 2) == walk(make(), 4, 2)


@pytest.mark.parametrize("copied", [copy.deepcopy, lambda e: pickle.loads(pickle.dumps(e))])
def test_copies_go_on_bit_for_bit(copied):
    env = make().unwrapped
    env.reset(seed=0)
    env.step(SLOT["bow down"])
    twin = copied(env)
    env.frame_callback = lambda: None  # not shared
    for action in (SLOT["bow up"], SLOT["squat"], 0):
        ours, theirs = env.step(action), twin.step(action)
        for key, value in ours[0].items():
            assert np.array_equal(value, theirs[0][key]), key
        assert ours[1:4] == theirs[1:4]


def test_returned_arrays_are_fresh():
    env = make()
    observation, info = env.reset()
    kept = copy.deepcopy(observation)
    for array in (*observation.values(), info["action_mask"], info["transition_prior"]):
        if isinstance(array, np.ndarray):
            array[...] = 0
    again, _ = env.reset()
    for key, value in kept.items():
        np.testing.assert_array_equal(again[key], value)


def test_frames_can_be_taken_within_a_step():
    env = make(frame_rate_hz=25.0).unwrapped
    env.reset()
    heads = []
    env.frame_callback = lambda: heads.append(env.simulation.data.body("head").xpos[2])
    *_, info = env.step(SLOT["bow down"])
    assert len(heads) == pytest.approx(25 * info["duration_s"], abs=2)
    assert heads[0] - heads[-1] > 0.1 and np.abs(np.diff(heads)).max() < 0.05


# ---- bad input


def library_like(**changes):
    library = standing_library()
    given = {
        "primitives": library.primitives,
        "graph": library.graph,
        "channels": library.channels,
        "rate_hz": library.rate_hz,
        "body": library.body,
    }
    return PrimitiveLibrary(**(given | changes))


@pytest.mark.parametrize(
    ("library", "message"),
    [
        (lambda: library_like(body="human"), "not for this robot: motions of body 'human'"),
        (lambda: library_like(channels=("x", *CHANNELS[1:])), r"not for this robot.*'x'"),
        (lambda: library_like(primitives=(), graph=TransitionGraph()), "empty"),
        (lambda: 7, "must be a PrimitiveLibrary"),
        (lambda: "no_such_file.mplearn", "no file"),
    ],
)
def test_a_library_that_does_not_fit_is_refused(library, message):
    with pytest.raises(LibraryError, match=message):
        gymnasium.make(ID, library=library())


def test_a_damaged_file_is_refused(tmp_path):
    path = standing_library().save(tmp_path / "one.mplearn")
    assert gymnasium.make(ID, library=path).unwrapped.library.version == standing_library().version
    data = bytearray(path.read_bytes())
    data[len(data) // 2] ^= 0xFF
    path.write_bytes(data)
    with pytest.raises(LibraryError):
        gymnasium.make(ID, library=path)
    path.write_bytes(b"not ours")
    with pytest.raises(LibraryError):
        gymnasium.make(ID, library=path)


def test_a_file_of_another_version_is_refused(tmp_path):
    path = standing_library().save(tmp_path / "one.mplearn")
    with zipfile.ZipFile(path) as archive:
        parts = {name: archive.read(name) for name in archive.namelist()}
    header = json.loads(parts["header.json"])
    for schema, message in ((99, "newer mplearn"), ("one", "damaged")):
        parts["header.json"] = json.dumps(header | {"schema": schema}).encode()
        with zipfile.ZipFile(path, "w") as archive:
            for name, data in parts.items():
                archive.writestr(name, data)
        with pytest.raises(LibraryError, match=message):
            gymnasium.make(ID, library=path)


def test_a_library_the_robot_cannot_perform_is_refused_with_reasons():
    frames = [sweep({}, JUMP, 0.8)] * 4
    jump = Primitive.from_exemplars(1, fit(frames, 8, variance_floor=1e-4), frames, RATE_HZ)
    graph = TransitionGraph()
    graph.add_node(1)
    env = gymnasium.make(ID, library=PrimitiveLibrary((jump,), graph, CHANNELS, RATE_HZ, "robot"))
    with pytest.raises(RobotError, match=r"none of the library's 1 primitives.*flight"):
        env.reset()


@pytest.mark.parametrize(
    "options",
    [
        {"capacity": 5},
        {"capacity": 12.5},
        {"speed": 0.0},
        {"speed": np.nan},
        {"task": "fly"},
        {"illegal": "ignore"},
        {"discount": 1.5},
        {"hold_s": 0.0},
        {"max_steps": 0},
        {"frame_rate_hz": 0.0},
        {"illegal_penalty": np.inf},
        {"style": "wild"},
        {"dynamics": "dreamt"},
        {"flat": "yes"},
        {"novel_penalty": np.nan},
        {"max_steps": 2.5},
        {"width": 0},
    ],
)
def test_bad_options_are_refused(options):
    with pytest.raises(MPLearnError):
        make(**options).reset()


@pytest.mark.parametrize("action", [-1, 32, 1.5, np.nan, "hold", None, np.array([1, 2]), True])
def test_bad_actions_are_refused(action):
    env = make().unwrapped
    env.reset()
    with pytest.raises(InvalidValueError, match=r"an integer in \[0, 32\)"):
        env.step(action)
