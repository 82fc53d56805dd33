"""Followers who plan in many futures: their plans against brute force, and who does better."""

import gymnasium
import numpy as np
import pytest

import mplearn_envs  # noqa: F401  (registers the environment)
from mplearn.errors import InvalidValueError
from mplearn_agents.episodes import play
from mplearn_agents.policies import Foresight, Mirror, hindsight, oracle
from mplearn_agents.policies.futures import Futures, Shown, Steps, worth
from mplearn_agents.policies.hindsight import Hindsight, Outlook
from mplearn_agents.policies.outlooks import experienced_follower
from mplearn_envs.tasks import FollowTask

ID = "mplearn/PrimitiveHumanoid-v1"
N, PLACES = 9, 4


def make(changes="all", **options):
    given = {"dynamics": "kinematic", "task": "follow", "changes": changes} | options
    return gymnasium.make(ID, disable_env_checker=True, **given)


def world(seed, n_futures=5):
    """Return a small graph, what can be done on it, futures, and what becomes legal in them."""
    rng = np.random.default_rng(seed)
    ticks = np.where(
        rng.random((PLACES, PLACES)) < 0.5, rng.integers(1, 4, (PLACES, PLACES)), np.nan
    )
    ticks[:, 0] = np.nan
    doing = np.repeat(rng.integers(1, PLACES, (n_futures, 3)), 3, axis=1)
    order, known = doing[:, 3::3], np.tile([4, 7], (n_futures, 1))
    before = np.where(np.isnan(ticks[doing[:, :6:3], order]), doing[:, :6:3], -1)
    shown = Shown.of(order, known, before, np.full_like(order, 2))
    weights = 0.9 ** np.arange(N)
    steps = Steps.of(ticks, 1)
    return steps, doing, shown, weights


def moves(steps, shown, k, place, t):
    """Return what can be done in a place of a future: slot, where it ends, when."""
    own = [(slot, to, min(t + took, N)) for slot, to, took in steps.at(place)]
    new = (m for m in range(2) if shown.before[k, m] == place and shown.ticks[k, m] <= t)
    return own + [(shown.after[k, m],) * 2 + (min(t + shown.took[k, m], N),) for m in new]


def paid(doing, weights, slot, t, end):
    return sum(weights[i] for i in range(t, end) if doing[i] == slot)


@pytest.mark.parametrize("seed", range(8))
def test_values_are_those_of_the_best_of_all_plans(seed):
    steps, doing, shown, weights = world(seed)
    futures = Futures.of(doing, steps, shown, weights, np.zeros(PLACES, np.int64))

    def best(k, place, t):
        if t >= N:
            return 0.0
        return max(
            paid(doing[k], weights, slot, t, end) + best(k, to, end)
            for slot, to, end in moves(steps, shown, k, place, t)
        )

    for k in range(len(doing)):
        for place in range(PLACES):
            for t in (0, 2, 5):
                assert futures.values[k, t, place] == pytest.approx(best(k, place, t))


@pytest.mark.parametrize("seed", range(8))
@pytest.mark.parametrize("decisions", [0, 1, 3])
def test_who_has_not_seen_yet_decides_the_same_in_all_futures(seed, decisions):
    steps, doing, shown, weights = world(seed)
    futures = Futures.of(doing, steps, shown, weights, np.zeros(PLACES, np.int64))

    def expected(of, place, t, left):
        if t >= N:
            return 0.0
        if left == 0 or len(of) == 1:
            return np.mean([futures.values[k, t, place] for k in of])
        stories = {}
        for k in of:
            seen = tuple(shown.after[k, shown.ticks[k] <= t].tolist())
            stories.setdefault(seen, []).append(k)
        total = 0.0
        for alike in stories.values():
            total += len(alike) * max(
                np.mean([paid(doing[k], weights, slot, t, end) for k in alike])
                + expected(alike, to, end, left - 1)
                for slot, to, end in moves(steps, shown, alike[0], place, t)
            )
        return total / len(of)

    every = np.arange(len(doing))
    for place in range(PLACES):
        found = worth(every, place, 1, decisions, steps, futures, shown)
        assert found == pytest.approx(expected(every.tolist(), place, 1, decisions))


def test_who_knows_more_follows_better():
    env = make("people", people="test")
    returns = {}
    for make_policy in (lambda _: Mirror(), hindsight, oracle):
        policy = make_policy(env)
        episodes = play(env, policy, 3, 11)
        assert not any(episode.illegal for episode in episodes)
        returns[type(getattr(policy, "outlook", policy)).__name__] = [e.return_ for e in episodes]
    mean = {name: np.mean(values) for name, values in returns.items()}
    assert mean["KnowsTheGraph"] > mean["Mirror"] + 1.0
    assert mean["KnowsTheGraph"] > mean["KnowsWhatItMay"] - 0.5


def test_what_is_shown_is_waited_for_where_nothing_else_leads_to_it():
    """Where what the demonstrator shows becomes legal, holding is better than going elsewhere."""
    env = make("growing")
    policy = oracle(env)
    (episode,) = play(env, policy, 1, 11)
    assert policy.outlook.grows and episode.return_ > 15.0 and not episode.illegal


def test_who_knows_a_single_motion_performs_it_and_learns_the_others():
    env = make({"watched": 1}, task=FollowTask(deadline_s=20.0))
    (episode,) = play(env, hindsight(env), 1, 3)
    assert episode.return_ > 0.5 and not episode.illegal


def test_the_same_seed_plans_the_same_and_experience_is_enough_to_follow():
    env = make("people")
    policy = experienced_follower(env, 600)
    first = play(env, policy, 2, 5)
    assert play(env, policy, 2, 5) == first
    assert play(env, experienced_follower(env, 600), 2, 5) == first
    assert min(episode.return_ for episode in first) > 4.0 and not first[0].illegal


def test_how_long_motions_take_is_found_out_whatever_later_rewards_are_worth():
    usual = [experienced_follower(make("people", discount=d), 60).outlook for d in (0.98, 1.0)]
    np.testing.assert_array_equal(usual[0].usual_s, usual[1].usual_s)
    assert 1.0 < np.median(usual[1].usual_s) < 10.0
    with pytest.raises(InvalidValueError, match="explore for at least 1 step"):
        experienced_follower(make("people"), 0)


def test_a_certain_demonstrator_is_followed_to_the_end():
    """One who goes round three motions, each exactly as long as the robot takes."""

    class Round(Outlook):
        usual_s = np.array([0.0, 2.0, 2.0, 2.0])

        def likely(self, slot, time_s):
            return np.eye(4)[slot % 3 + 1]

        def lasts_s(self):
            out = np.full((4, 4), np.nan)
            for slot in (1, 2, 3):
                out[slot, [1, 2, 3]] = 2.0
            return out

    task = FollowTask(pace=1.0, variation=0.0)
    policy = Hindsight(Round(), task, 0.98, 0.5, Foresight(futures=3), seed=0)
    policy.reset(0)
    shown = np.zeros(14)
    shown[1], shown[-2], shown[-1] = 1.0, 1.0, 0.9  # the first is at its end
    mask = np.array([1, 1, 1, 1])
    info = {"action_mask": mask, "transition_prior": np.array([0.0, 1.0, 0.0, 0.0])}
    observation = {"task": shown, "current_primitive": 1}
    assert policy.act(observation, info) == 2
    info["action_mask"] = np.array([1, 0, 0, 0])
    assert policy.act(observation, info) == 0


@pytest.mark.parametrize("policy", [lambda _: Mirror(), hindsight])
def test_where_one_chooses_the_speed_the_usual_one_is_taken(policy):
    env = make("none", actions={"speeds": (1.0, 0.7)}, task=FollowTask(deadline_s=8.0))
    usual = make("none", task=FollowTask(deadline_s=8.0))
    episodes = [play(each, policy(each), 1, 3) for each in (env, usual)]
    assert episodes[0] == episodes[1] and not episodes[0][0].illegal


def test_other_tasks_and_wrong_foresight_are_refused():
    env = make("none", task="goal")
    with pytest.raises(InvalidValueError, match="needs the task 'follow'"):
        oracle(env)
    env.reset(seed=0)
    follow = make("none")
    follow.reset(seed=0)
    policy = hindsight(follow)
    observation, info = env.reset(seed=0)
    with pytest.raises(InvalidValueError, match="which shows"):
        policy.act(observation, info)
    with pytest.raises(InvalidValueError, match="at least 1 future"):
        Foresight(futures=0)
    with pytest.raises(InvalidValueError, match="tick_s must be positive"):
        Foresight(tick_s=0.0)
