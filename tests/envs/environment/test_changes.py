"""Version 1 with changes: what is legal grows, habits and people change; the seed decides."""

import copy
import json
import pickle
from itertools import pairwise

import gymnasium
import numpy as np
import pytest
from gymnasium.envs.registration import EnvSpec
from gymnasium.utils.env_checker import check_env

from mplearn.errors import InvalidValueError
from mplearn_envs.checks import check_action_mask
from mplearn_envs.varied.changes import CHANGES, Changes, make_changes
from mplearn_envs.varied.changing_person import ChangingPerson, People
from mplearn_envs.varied.people import library_of

ID = "mplearn/PrimitiveHumanoid-v1"


def make(changes="all", **options):
    options = {"dynamics": "kinematic", "task": "follow", "disable_env_checker": True} | options
    return gymnasium.make(ID, changes=changes, **options)


@pytest.fixture(scope="module")
def env():
    return make()


def performed(env, seed, n=25):
    """Return all that an episode shows to who takes the last legal action."""
    observation, info = env.reset(seed=seed)
    out = []
    for _ in range(n):
        slot = np.flatnonzero(info["action_mask"])[-1]
        observation, reward, *_, info = env.step(int(slot))
        seen = [observation[key].tobytes() for key in sorted(observation)]
        out.append((seen, reward, info["person"], info["library_version"], info["changed"]))
    return out


def test_an_episode_depends_on_its_seed_alone(env):
    first = performed(env, 3)
    assert performed(env, 4) != first
    assert performed(env, 3) == first
    assert performed(make(), 3) == first
    spec = EnvSpec.from_json(make(CHANGES["all"]).spec.to_json())
    assert performed(gymnasium.make(spec), 3) == first


@pytest.mark.parametrize("level", ["all", "people"])
def test_an_episode_goes_on_from_its_state_a_copy_or_a_pickle(level):
    env = make(level)
    env.reset(seed=5)
    for _ in range(12):
        slot = np.flatnonzero(env.unwrapped.action_masks())[-1]
        env.step(int(slot))
    state = env.unwrapped.state()
    others = [copy.deepcopy(env), pickle.loads(pickle.dumps(env)), make(level)]
    others[2].reset(seed=99)
    others[2].unwrapped.load_state(state)
    mine, theirs = env.unwrapped.repertoire, others[2].unwrapped.task._repertoire
    assert theirs.skills is mine.skills or level == "people"  # only what grows is copied
    assert copy.deepcopy(mine.library) is mine.library

    def onward(env):
        seen = []
        for _ in range(8):
            slot = np.flatnonzero(env.unwrapped.action_masks())[-1]
            observation, reward, *_, info = env.unwrapped.step(int(slot))
            seen.append((reward, info["person"], info["library_version"]))
            seen.append([observation[key].tobytes() for key in sorted(observation)])
        return seen

    expected = onward(env)
    assert all(onward(other) == expected for other in others)
    env.unwrapped.load_state(state)
    assert onward(env) == expected


def test_what_is_legal_is_what_was_shown():
    """Against the demonstrator's own script, motion by motion."""
    env = make(Changes(watched=15, people_s=25.0))
    task, ways = env.unwrapped.task, set()
    grown = 0
    for seed in range(4):
        _, info = env.reset(seed=seed)
        rep, changing = env.unwrapped.repertoire, env.unwrapped._changing
        first = int(np.flatnonzero(env.unwrapped._people.starts)[0])
        assert changing.walked(first, 15)[0] == first
        known = {(a, int(b)) for a in rep.ids for b in np.flatnonzero(rep.after(a).prior[1:]) + 1}
        time_s = 0.0
        while time_s < 50.0:
            before = set(known)
            slot = np.flatnonzero(info["action_mask"])[-1]
            *_, info = env.step(int(slot))
            time_s += info["duration_s"]
            for a, b in pairwise(task.recognised(time_s)):
                if changing.is_way(rep.slots[a], rep.slots[b]):
                    known.add((a, rep.slots[b]))
            now = {(a, int(b)) for a in rep.ids for b in np.flatnonzero(rep.after(a).prior[1:]) + 1}
            assert now == known
            assert info["changed"]["n_ways"] == len(known)
            assert info["changed"]["n_new_ways"] == len(known - before)
            grown += len(known - before)
            ways |= known
    assert grown > 10 and len(ways) > 60


def test_the_masks_agree_with_what_happens(env):
    check_action_mask(env, steps=40)
    check_env(env.unwrapped, skip_render_check=True)


def test_info_has_one_shape(env):
    def shape(value):
        if isinstance(value, dict):
            return {key: shape(each) for key, each in value.items()}
        return (value.dtype, value.shape) if isinstance(value, np.ndarray) else type(value)

    _, info = env.reset(seed=1)
    first = shape(info)
    for _ in range(10):
        *_, info = env.step(int(np.flatnonzero(info["action_mask"])[-1]))
        assert shape(info) == first


def people_of_two():
    ways = {who: np.zeros((4, 4)) for who in (0, 1)}
    ways[0][1, [2, 3]] = 0.5
    ways[0][2, 1] = ways[0][3, 1] = 1.0
    ways[1][1, 2] = ways[1][2, 3] = ways[1][3, 1] = 1.0
    return People(ways, np.array([0.0, 1.0, 0.0, 0.0]))


def test_people_and_habits_change_as_is_stated():
    changing = ChangingPerson(people_of_two(), 0, Changes(habits_s=(10.0,), people_s=(20.0,)), 7)
    late, early = changing.prior(2, 25.0), changing.prior(1, 0.0)  # in whatever order
    assert [changing.person_at(t) for t in (0.0, 19.9, 20.0, 1e6)] == [0, 0, 1, 1]
    np.testing.assert_array_equal(early, [0.0, 0.0, 0.5, 0.5])
    np.testing.assert_array_equal(late, [0.0, 0.0, 0.0, 1.0])
    changed = changing.prior(1, 12.0)
    assert changed.sum() == pytest.approx(1.0) and changed[2] != 0.5 and not changed[:2].any()
    np.testing.assert_array_equal(changing.prior(0, 0.0), people_of_two().starts)


def test_times_between_changes_are_exponential_and_new_habits_dirichlet():
    """By their means and variances."""
    changing = ChangingPerson(people_of_two(), 0, Changes(habits_s=5.0, evenness=2.0), 1)
    moments = np.arange(0.0, 20_000.0, 0.05)
    habits = np.array([changing._habits.before(t) for t in moments[::-1]])[::-1]
    times_s = np.diff(moments[1:][np.diff(habits) > 0])
    assert times_s.mean() == pytest.approx(5.0, rel=0.06)
    assert times_s.std() == pytest.approx(5.0, rel=0.1)
    drawn = np.array(
        [changing.prior(1, t)[2] for t in moments[np.flatnonzero(np.diff(habits)) + 1]]
    )
    assert drawn.mean() == pytest.approx(0.5, abs=0.02)
    assert drawn.var() == pytest.approx(1 / 12, rel=0.06)  # Beta(1, 1)


def test_steady_people_are_as_they_were():
    env = make("none")
    _, info = env.reset(seed=2)
    assert "changed" not in info and env.unwrapped.repertoire.library == library_of(info["person"])


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ("some", "changes must be one of"),
        ({"level": "much"}, "level must be one of"),
        ({"level": ["all"]}, "level must be one of"),
        ({"habit_s": 3.0}, "changes have the values"),
        ({"habits_s": 0.0}, "habits_s must be a mean time"),
        ({"people_s": (5.0, 3.0)}, "people_s must be a mean time"),
        ({"people_s": (np.nan, 3.0)}, "people_s must be a mean time"),
        ({"people_s": ("soon", 3.0)}, "people_s must be a mean time"),
        ({"habits_s": True}, "habits_s must be a mean time"),
        ({"watched": 0}, "watched must be an integer"),
        ({"watched": 2.5}, "watched must be an integer"),
        ({"evenness": -1.0}, "evenness must lie in"),
    ],
)
def test_what_is_wrong_is_said(changes, message):
    with pytest.raises(InvalidValueError, match=message):
        make(changes)


def test_changes_are_for_who_follows_and_states_for_the_like():
    with pytest.raises(InvalidValueError, match="choose the task 'follow'"):
        make("people", task="goal")
    envs = [make("growing"), make("people"), make("none"), make("none", task="goal")]
    for env in envs:
        env.reset(seed=0)
    for here in envs[:3]:
        for other in envs[:2]:
            if other is not here:
                with pytest.raises(InvalidValueError, match="other changes"):
                    here.unwrapped.load_state(other.unwrapped.state())
    for other in envs[2:]:
        with pytest.raises(InvalidValueError, match="other changes"):
            envs[1].unwrapped.load_state(other.unwrapped.state())


def test_changes_survive_json():
    given = {"level": "growing", "people_s": [20, 40]}
    env = make(given)
    plain = json.loads(env.spec.to_json())["kwargs"]["changes"]
    assert make_changes(given) == make(plain).unwrapped.changes == Changes(60, None, (20.0, 40.0))
    assert json.dumps(Changes(watched=np.int64(7)).watched) == "7"


def test_at_a_dead_end_each_episode_foresees_its_own_beginning():
    env = make("none", people=(1,))
    firsts = set()
    for seed in range(4):
        _, info = env.reset(seed=seed)
        task, repertoire = env.unwrapped.task, env.unwrapped.repertoire
        dead = next(id for id in repertoire.feasible_ids if repertoire.after(id).dead_end)
        np.testing.assert_array_equal(task._next_after((dead,)), info["transition_prior"])
        firsts.add(int(np.argmax(info["transition_prior"])))
    assert len(firsts) > 1
