"""The tasks: what they show, what they pay, and that they can be solved by planning."""

from itertools import pairwise

import gymnasium
import numpy as np
import pytest
from gymnasium import spaces
from standing_library import MOTIONS, standing_library

import mplearn_envs  # noqa: F401  (registers the environment)
from mplearn.errors import InvalidValueError, MPLearnError, NoPathError
from mplearn_envs.reach import soonest_arrivals
from mplearn_envs.tasks import FollowTask, FreeTask, GoalTask, ReciteTask, Task

ID = "mplearn/PrimitiveHumanoid-v0"
SLOT = {motion[0]: slot for slot, motion in enumerate(MOTIONS, start=1)}
KINDS = ("hand", "posture", "primitive")
ALL = (
    FreeTask(),
    FollowTask(),
    ReciteTask(),
    *(GoalTask(kind) for kind in KINDS),
)


def make(task, **options):
    options = {"dynamics": "kinematic"} | options
    return gymnasium.make(ID, library=standing_library(), task=task, **options)


def legal(info):
    return np.flatnonzero(info["action_mask"]).tolist()


def shortest_way(env, info, slots):
    """Return the actions that lead to one of the slots with the fewest primitives (brute force)."""
    repertoire = env.unwrapped.repertoire
    ways = [[slot] for slot in legal(info) if slot]
    while ways:
        way = ways.pop(0)
        if way[-1] in slots:
            return way
        after = repertoire.after(repertoire.primitive(way[-1]))
        ways += [[*way, slot] for slot in np.flatnonzero(after.mask).tolist() if slot]
        assert len(way) < 8
    raise AssertionError("no way")


# ---- all of them


@pytest.mark.parametrize(
    "task", ALL, ids=lambda task: type(task).__name__ + getattr(task, "kind", "")
)
def test_observations_stay_within_bounds_and_are_fresh(task):
    env = make(task, max_steps=30)
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


# ---- free


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


# ---- goal


@pytest.mark.parametrize("kind", KINDS)
def test_goals_are_drawn_by_seed_not_yet_reached_and_reached_in_the_least_time(kind):
    env = make(GoalTask(kind))
    goals = set()
    for seed in range(12):
        observation, info = env.reset(seed=seed)
        again, _ = env.reset(seed=seed)
        np.testing.assert_array_equal(observation["task"], again["task"])
        goals.add(observation["task"].tobytes())
        assert not info["is_success"]
        time_s, value, terminated = 0.0, 0.0, False
        for action in shortest_way(env, info, info["task"]["slots"]):
            assert not terminated
            _, reward, terminated, _, info = env.step(action)
            value += 0.95**time_s * reward
            time_s += info["duration_s"]
        assert terminated and info["is_success"]
        assert time_s == pytest.approx(info["task"]["least_time_s"], abs=1e-9)
        hurry = -0.1 * (1 - 0.95**time_s) / -np.log(0.95)
        assert value == pytest.approx(hurry + 0.95**time_s, rel=0.02)
    assert len(goals) > 3


def test_soonest_arrivals_are_those_of_all_ways():
    env = make("free")
    env.reset()
    repertoire = env.unwrapped.repertoire
    found = soonest_arrivals(repertoire, repertoire.entries(env.unwrapped.performer.reference))
    best = {}
    rng = np.random.default_rng(0)
    for _ in range(60):
        _, info = env.reset(seed=0)
        time_s = 0.0
        for _ in range(5):
            options = [slot for slot in legal(info) if slot]
            if not options:
                break
            *_, info = env.step(rng.choice(options))
            time_s += info["duration_s"]
            best[info["primitive"]] = min(best.get(info["primitive"], np.inf), time_s)
    assert set(best) == set(found)
    for id, time_s in best.items():
        assert found[id].time_s == pytest.approx(time_s, abs=0.05)


def test_a_hand_reaches_its_point():
    env = make(GoalTask("hand", far_m=0.15, tolerance_m=0.05))
    observation, info = env.reset(seed=3)
    start = observation["task"]
    for action in shortest_way(env, info, info["task"]["slots"]):
        observation, *_ = env.step(action)
    end = observation["task"]
    np.testing.assert_array_equal(start[:5], end[:5])
    assert np.linalg.norm(start[5:8]) > 0.15 and np.linalg.norm(end[5:8]) <= 0.05
    env.unwrapped.performer.show()
    hand = env.unwrapped.data.body(("hand_l", "hand_r")[int(start[1])]).xpos
    assert hand[2] == pytest.approx(end[4] - end[7], abs=1e-5)
    assert start[8] == 1.0 and 0.0 < end[8] < 1.0


def test_a_goal_ends_at_its_deadline():
    env = make(GoalTask("primitive", target="rise", deadline_s=6.0))
    env.reset()
    terminated, n = False, 0
    while not terminated:
        _, _, terminated, _, info = env.step(0)
        n += 1
    assert n == 12 and not info["is_success"] and not info["fallen"]


def test_given_goals():
    bow = {"base_pitch": 0.8}
    env = make(GoalTask("posture", target=bow))
    observation, info = env.reset()
    assert info["task"]["slots"] == (SLOT["bow down"],)
    apart = observation["task"][33:66]
    assert apart[2] == pytest.approx(0.8, abs=0.01) and np.count_nonzero(apart) == 1
    assert env.step(SLOT["bow down"])[4]["is_success"]
    env = make(GoalTask("primitive"))
    assert env.reset(options={"target": "rise"})[1]["task"]["slots"] == (SLOT["rise"],)
    assert env.reset(options={"target": 4})[1]["task"]["slots"] == (SLOT["arms down"],)


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


# ---- recite


def test_requests_ask_for_ways_round():
    env = make(ReciteTask(length=3))
    repertoire = env.unwrapped.repertoire
    for seed in range(10):
        observation, info = env.reset(seed=seed)
        request = list(info["task"]["slots"])
        blocks = observation["task"][:-1].reshape(3, 32)
        assert blocks.argmax(axis=1).tolist() == request and blocks.sum() == 3
        assert request[0] not in legal(info)  # the shortcut is illegal
        for before, after in pairwise(request):
            assert not repertoire.after(repertoire.primitive(before)).mask[after]
        earned, terminated = 0.0, False
        for slot in request:
            for action in shortest_way(env, info, (slot,)):
                observation, _, terminated, _, info = env.step(action)
                earned += info["reward_terms"]["said"] / info["discount"]
        assert terminated and info["is_success"] and info["task"]["slots"] == ()
        assert earned == pytest.approx(3.0)
        assert info["reward_terms"]["complete"] == pytest.approx(info["discount"])
        assert not observation["task"][:-1].any()


def test_a_shortcut_says_nothing():
    env = make(ReciteTask(request=("rise", "arms down")))
    env.reset()
    *_, info = env.step(SLOT["rise"])
    assert info["illegal"] and info["reward_terms"]["said"] == 0.0
    assert info["task"]["slots"] == (SLOT["rise"], SLOT["arms down"])


# ---- follow


def schedule(task):
    return list(zip(task._ids, task._ends_s, strict=True))


def test_the_demonstrator_depends_on_the_seed_alone():
    task = FollowTask(deadline_s=20.0)
    env = make(task)
    seen = []
    for actions in ((0,) * 50, (SLOT["squat"], SLOT["rise"]) * 20):
        env.reset(seed=5)
        for action in actions:
            if env.step(action)[2]:
                break
        seen.append(schedule(task))
    common = min(len(s) for s in seen)
    assert common > 5 and seen[0][:common] == seen[1][:common]
    env.reset(seed=6)
    assert schedule(task) != seen[0][: len(schedule(task))]


def test_agreement_is_paid_while_both_do_the_same():
    """Against the integral over the true intervals."""
    task = FollowTask(agree=2.0)
    env = make(task, discount=0.9)
    repertoire = env.unwrapped.repertoire
    for seed in range(5):
        env.reset(seed=seed)
        time_s = 0.0
        for name in ("squat", "rise", "arms up", "arms down", "bow down"):
            *_, info = env.step(SLOT[name])
            assert not info["illegal"]
            end_s = time_s + info["duration_s"]
            expected, start_s = 0.0, 0.0
            for id, until_s in schedule(task):
                low, high = max(start_s, time_s), min(until_s, end_s)
                if repertoire.slots[id] == SLOT[name] and low < high:
                    rate = -np.log(0.9)
                    powers = 0.9 ** (low - time_s) - 0.9 ** (high - time_s)
                    expected += 2.0 * powers / rate
                start_s = until_s
            assert info["reward_terms"]["agree"] == pytest.approx(expected, abs=0.05)
            time_s = end_s


@pytest.mark.parametrize("share", [0.0, 0.3, 1.0])
def test_a_motion_is_shown_after_a_share_of_it_and_predicts(share):
    task = FollowTask(recognised_after=share)
    env = make(task)
    repertoire = env.unwrapped.repertoire
    observation, _ = env.reset(seed=4)
    assert not observation["task"][:32].any()
    time_s = 0.0
    for _ in range(40):
        observation, *_, info = env.step(0)
        time_s += info["duration_s"]
        shown = observation["task"]
        began_s, known = 0.0, []
        for id, end_s in schedule(task):
            if began_s + share * (end_s - began_s) <= time_s:
                known.append((id, began_s))
            began_s = end_s
        assert np.flatnonzero(shown[:32]).tolist() == [repertoire.slots[id] for id, _ in known[-1:]]
        after, later = shown[32:64], shown[64:96]
        assert after.sum() == pytest.approx(1.0) and later.sum() == pytest.approx(1.0)
        following = schedule(task)[len(known) :]
        assert not following or after[repertoire.slots[following[0][0]]] > 0.0
        if known:
            id, began_s = known[-1]
            usual_s = repertoire.duration_s(id) / task.pace
            assert shown[96] == pytest.approx(min((time_s - began_s) / usual_s, 3.0))
            if repertoire.after(id).mask.sum() == 2 and following:
                assert after.argmax() == repertoire.slots[following[0][0]]


def test_the_demonstrator_takes_his_time():
    for pace in (0.5, 1.0):
        task = FollowTask(pace=pace, variation=0.0, deadline_s=30.0)
        env = make(task)
        env.reset(seed=2)
        while not env.step(0)[2]:
            pass
        began_s = 0.0
        for id, end_s in schedule(task):
            usual_s = env.unwrapped.repertoire.duration_s(id)
            assert end_s - began_s == pytest.approx(usual_s / pace)
            began_s = end_s


def test_who_knows_the_demonstrator_agrees_more_than_who_does_not():
    task = FollowTask(deadline_s=40.0)
    env = make(task)
    means = {}
    for knows in (True, False):
        agreement = []
        for seed in range(6):
            _, info = env.reset(seed=seed)
            rng, over = np.random.default_rng(seed), False
            while not over:
                options = [slot for slot in legal(info) if slot] or [0]
                wanted = info["task"]["demonstrator"]
                action = wanted if wanted in options else 0
                *_, over, _, info = env.step(action if knows else rng.choice(options))
            agreement.append(info["task"]["agreement"])
        means[knows] = np.mean(agreement)
    assert means[True] > 2 * means[False]
