"""The environment: masks and priors, macro steps, what they earn."""

import gymnasium
import numpy as np
import pytest
from standing_env import SLOT, legal, make, walk
from standing_library import MOTIONS, standing_library

from mplearn.errors import InvalidValueError
from mplearn.generation import STYLES
from mplearn_envs.tasks import Choice, FreeTask, Task

# ---- what may come next


def test_the_start_offers_what_starts_near():
    env = make()
    _, info = env.reset()
    assert set(legal(info)) == {
        0,
        *(SLOT[n] for n in ("arms up", "bow down", "squat", "kick", "wave")),
    }
    assert info["transition_prior"][0] == 0.0
    assert np.flatnonzero(info["infeasible"]).tolist() == [SLOT["jump"]]
    assert "flight" in env.unwrapped.infeasible()[SLOT["jump"]][0]


def test_after_a_primitive_its_observed_feasible_followers_are_legal():
    env = make()
    env.reset()
    *_, info = env.step(SLOT["arms up"])
    assert set(legal(info)) == {0, SLOT["arms down"]}
    assert info["transition_prior"][SLOT["arms down"]] == 1.0
    *_, info = env.step(SLOT["arms down"])
    assert info["primitive_name"] == "arms down"
    # counts 1, 2, 3, 4, 5, 6 of arms up, bow down, squat, kick, wave and jump, which is too much
    expected = {"arms up": 1, "bow down": 2, "squat": 3, "kick": 4, "wave": 5}
    for name, count in expected.items():
        assert info["transition_prior"][SLOT[name]] == pytest.approx(count / 15)
    assert info["transition_prior"].sum() == pytest.approx(1.0)
    assert np.flatnonzero(info["infeasible"]).tolist() == [SLOT["jump"]]


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
    assert info["dead_end"] and set(legal(info)) == {0} and info["transition_prior"][0] == 1.0
    observation, _, _, _, info = env.step(0)
    assert observation["current_primitive"] == 0 and info["primitive"] == -1
    assert len(legal(info)) > 1 and info["transition_prior"][0] == 0.0


def test_where_nothing_starts_near_the_nearest_is_legal():
    env = make(("arms down", "bow up"))  # both start far from rest
    _, info = env.reset()
    assert set(legal(info)) == {0, 2}  # the bow, not the raised arms


def test_a_random_walk_goes_on_and_on():
    env = make(max_episode_steps=1000)
    seen = walk(env, 120, 3)
    performed = {action for action, *_ in seen}
    assert performed == {0, *(SLOT[m[0]] for m in MOTIONS if m[0] != "jump")}


def test_slots_are_stable_and_free_ones_illegal():
    small, large = make(("arms up", "arms down")), make(actions={"capacity": 64})
    assert small.action_space.n == 32 and large.action_space.n == 64
    assert small.unwrapped.repertoire.primitive(1) == large.unwrapped.repertoire.primitive(1)
    _, info = large.reset()
    assert not info["action_mask"][10:].any()
    np.testing.assert_array_equal(large.unwrapped.action_masks(), info["action_mask"] == 1)


def test_an_illegal_action_holds_and_costs():
    env = make(actions={"illegal_penalty": 3.0})
    env.reset()
    observation, reward, terminated, _, info = env.step(SLOT["jump"])
    assert info["illegal"] and not terminated
    assert info["reward_terms"]["illegal"] == -3.0
    assert reward == pytest.approx(sum(info["reward_terms"].values()))
    assert observation["current_primitive"] == 0
    assert info["duration_s"] == pytest.approx(0.5, abs=0.02)
    strict = make(actions={"illegal": "raise"})
    strict.reset()
    with pytest.raises(InvalidValueError, match="illegal here; legal are"):
        strict.step(31)


# ---- macro steps and rewards


def test_a_macro_step_lasts_as_long_as_the_primitive():
    durations = {}
    for speed in (0.5, 1.0):
        env = make(motion={"speed": speed})
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
    env = make(max_episode_steps=2)
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


@pytest.mark.parametrize("style", sorted(STYLES))
def test_each_style_is_performed_and_the_same_everywhere(style):
    """Of those that draw samples, too."""
    starts = []
    for _ in range(2):
        library = standing_library(("arms up", "arms down"))
        given = {"library": library, "dynamics": "kinematic", "motion": {"style": style}}
        env = gymnasium.make("mplearn/PrimitiveHumanoid-v0", **given)
        _, info = env.reset(seed=0)
        observation, *_, info = env.step(int(np.flatnonzero(info["action_mask"])[-1]))
        assert info["primitive"] >= 0 and info["duration_s"] > 0.5
        starts.append(observation["posture"].tobytes())
    assert starts[0] == starts[1]
