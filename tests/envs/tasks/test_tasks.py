"""Tasks in general: what they show, how they end, what they refuse; and free motion."""

import gymnasium
import numpy as np
import pytest
from gymnasium import spaces
from standing_env import SLOT, legal
from standing_task import make

from mplearn.errors import InvalidValueError, MPLearnError, NoPathError
from mplearn_envs.tasks import FollowTask, FreeTask, GoalTask, ReciteTask, Task

ALL = (
    FreeTask(),
    FollowTask(),
    ReciteTask(),
    *(GoalTask(kind) for kind in ("hand", "posture", "primitive")),
)


@pytest.mark.parametrize(
    "task", ALL, ids=lambda task: type(task).__name__ + getattr(task, "kind", "")
)
def test_observations_stay_within_bounds_and_are_fresh(task):
    env = make(task, max_episode_steps=30)
    observation, info = env.reset(seed=1)
    rng = np.random.default_rng(0)
    for _ in range(60):
        assert env.observation_space.contains(observation)
        kept = observation["task"].copy()
        observation["task"][:] = 7.0
        assert not np.shares_memory(observation["task"], task.observe())
        np.testing.assert_array_equal(task.observe(), kept)
        action = rng.choice(legal(info)) if rng.random() < 0.9 else rng.integers(32)
        observation, _, terminated, truncated, info = env.step(action)
        if terminated or truncated:
            observation, info = env.reset()


@pytest.mark.parametrize(
    "task", ALL, ids=lambda task: type(task).__name__ + getattr(task, "kind", "")
)
def test_the_flat_option_is_gymnasiums_flattening(task):
    flat, whole = make(task, flat=True), make(task)
    wrapped = gymnasium.wrappers.FlattenObservation(whole)
    assert flat.observation_space == wrapped.observation_space
    ours, info = flat.reset(seed=2)
    theirs, _ = wrapped.reset(seed=2)
    for _ in range(4):
        np.testing.assert_array_equal(ours, theirs)
        assert ours.dtype == theirs.dtype
        action = np.int64(legal(info)[-1])
        ours, _, terminated, _, info = flat.step(action)
        theirs = wrapped.step(action)[0]
        if terminated:
            break


def test_a_task_may_show_nothing():
    class Calm(Task):
        def bonuses(self, choice):
            return {}

        def rates(self, performance):
            return {"calm": np.ones(len(performance.time_s))}

        def fall(self):
            return 0.0

    env = make(Calm())
    assert "task" not in env.observation_space.spaces
    assert "task" not in env.reset()[0]


def test_what_a_task_shows_is_of_the_kind_of_its_bounds_and_a_copy():
    class Bit(FreeTask):
        shown = np.ones(1)

        def space(self, repertoire):
            return spaces.Box(0, 1, (1,), np.int8)

        def observe(self):
            return self.shown

    env = make(Bit())
    shown = env.reset()[0]["task"]
    assert shown.dtype == np.int8 and env.observation_space["task"].contains(shown)
    shown[:] = 0
    assert Bit.shown == 1.0


def test_tasks_can_end_an_episode_and_pay_at_the_end():
    class Twice(Task):
        def space(self, repertoire):
            return spaces.Box(0.0, 9.0, (1,), np.float64)

        def reset(self, scene):
            self.n = scene.options.get("n", 0)

        def observe(self):
            return np.array([float(self.n)])

        def bonuses(self, choice):
            return {"prize": 1.0}

        def rates(self, performance):
            return {}

        def fall(self):
            return 0.0

        def arrive(self, scene):
            self.n += 1
            return {"prize": 10.0}

        @property
        def done(self):
            return self.n >= 2

        def report(self):
            return {"success": self.done}

    env = make(Twice(), discount=0.9)
    observation, info = env.reset()
    assert observation["task"] == [0.0] and info["is_success"] is False
    _, reward, terminated, truncated, info = env.step(SLOT["squat"])
    assert reward == pytest.approx(1.0 + 0.9 ** info["duration_s"] * 10.0)
    assert not terminated and not truncated
    _, _, terminated, _, info = env.step(SLOT["rise"])
    assert terminated and info["is_success"] and not info["fallen"]
    with pytest.raises(InvalidValueError, match="call reset"):
        env.step(0)
    assert env.reset(options={"n": 1})[0]["task"] == [1.0]


def test_free_shows_what_was_performed_lately():
    env = make(FreeTask(memory=2))
    env.reset()
    for name in ("squat", "rise", "bow down"):
        observation, *_, info = env.step(SLOT[name])
    expected = np.zeros(32)
    expected[[SLOT["rise"], SLOT["bow down"]]] = 0.5
    np.testing.assert_allclose(observation["task"], expected)
    terms = info["reward_terms"]
    assert 0.0 < terms["balanced"] <= terms["alive"] * 1.0001
    unsafe = FreeTask(safe_m=10.0)
    env = make(unsafe)
    env.reset()
    *_, info = env.step(SLOT["bow down"])
    assert 0.0 < info["reward_terms"]["balanced"] < 0.02 * info["reward_terms"]["alive"]


# ---- bad input


@pytest.mark.parametrize(
    ("task", "error", "message"),
    [
        (GoalTask("hand", target=("left", (1.0, 0.0, 2.0))), NoPathError, "misses by"),
        (GoalTask("hand", target=("up", (1.0, 0.0, 2.0))), InvalidValueError, "'left' or 'right'"),
        (GoalTask("hand", target=("left", (np.nan, 0, 0))), InvalidValueError, "'left' or 'right'"),
        (GoalTask("posture", target={"base_roll": 0.5}), NoPathError, "misses by"),
        (GoalTask("posture", target={"tail": 0.5}), InvalidValueError, "some of the channels"),
        (GoalTask("posture", target={"base_roll": np.inf}), InvalidValueError, "finite"),
        (GoalTask("primitive", target="fly"), MPLearnError, "no primitive 'fly'"),
        (GoalTask("primitive", target="rise", deadline_s=2.0), NoPathError, "at least"),
        (GoalTask("primitive", deadline_s=0.1), NoPathError, "can reach no goal"),
        (ReciteTask(request=("squat", "fly")), MPLearnError, "no primitive 'fly'"),
        (ReciteTask(request=("wave", "squat")), NoPathError, "'squat' cannot be performed"),
    ],
)
def test_a_goal_that_cannot_be_reached_is_told_at_reset(task, error, message):
    env = make(task)
    with pytest.raises(error, match=message):
        env.reset()
    with pytest.raises(InvalidValueError, match="call reset"):
        env.unwrapped.step(0)


@pytest.mark.parametrize(
    "bad",
    [
        lambda: GoalTask("foot"),
        lambda: GoalTask(deadline_s=0.0),
        lambda: GoalTask(tolerance_m=np.nan),
        lambda: ReciteTask(length=0),
        lambda: ReciteTask(request=()),
        lambda: ReciteTask(deadline_s=-1.0),
        lambda: FollowTask(pace=0.0),
        lambda: FollowTask(variation=np.nan),
        lambda: FollowTask(recognised_after=1.1),
        lambda: FollowTask(deadline_s=np.inf),
    ],
)
def test_bad_settings_of_tasks_are_refused(bad):
    with pytest.raises(InvalidValueError):
        bad()
