"""Version 1: its library, its people, its long ways, and the scale of its returns."""

import copy
import pickle
from collections import Counter
from itertools import pairwise

import gymnasium
import numpy as np
import pytest
from gymnasium.envs.registration import EnvSpec

import mplearn_envs  # noqa: F401  (registers the environment)
from mplearn.errors import InvalidValueError
from mplearn_envs.checks import check_action_mask
from mplearn_envs.skills.repertoire import Repertoire
from mplearn_envs.skills.soonest import performed, soonest
from mplearn_envs.varied import build
from mplearn_envs.varied.people import (
    FACTS,
    PATH,
    SPLITS,
    foreknowledge,
    library_of,
    starts,
    varied_library,
)

ID = "mplearn/PrimitiveHumanoid-v1"


def make(**options):
    return gymnasium.make(ID, **({"dynamics": "kinematic"} | options))


@pytest.fixture(scope="module")
def env():
    return make()


def walked(env, n=6, seed=3):
    rng, seen = np.random.default_rng(seed), []
    for _ in range(n):
        legal = np.flatnonzero(env.unwrapped.action_masks())
        observation, reward, *_, info = env.step(int(rng.choice(legal[1:])))
        seen.append((observation["posture"].tobytes(), reward, info["primitive"], info["person"]))
    return seen


def test_there_are_many_primitives_and_the_ways_among_them_are_long():
    library = varied_library()
    assert len(library) == 140 and (PATH.stat().st_size + FACTS.stat().st_size) < 1_500_000
    for person in SPLITS["all"]:
        graph = library_of(person).graph
        known = sorted({id for way in build_ways(person) for id in way[:2]})
        assert len(known) >= 115  # and from each to each there is a way
        steps = np.array(
            [
                len(graph.path(a, b, by="steps")) - 1
                for a in known[:: len(known) // 3]
                for b in known
                if a != b
            ]
        )
        assert np.mean((steps >= 5) & (steps <= 15)) > 0.6


def test_what_is_told_beforehand_is_what_the_commands_find():
    """For a sample of the primitives and the ways; up to what processors differ in."""
    library = varied_library()
    repertoire = Repertoire(library, foreknowledge_robot())
    known, skills = foreknowledge(), repertoire.skills
    for id in library.ids[::40]:
        assert skills.feasibility(id).feasible
        assert skills.feasibility(id).speed == pytest.approx(known.verdicts[id].speed, rel=0.02)
        assert skills.duration_s(id) == pytest.approx(known.durations_s[id], abs=0.1)
    for before, after in list(known.transitions_s)[:: len(known.transitions_s) // 6]:
        found = skills.transition_s(before, after)
        assert found == pytest.approx(known.transitions_s[before, after], abs=0.1)
    edges = {way[:2] for person in SPLITS["all"] for way in build_ways(person)}
    assert edges == {(a, b) for a, b in known.transitions_s if a is not None}


def test_the_library_is_learned_from_what_is_seen():
    """The command's own parts, on a short demonstration: nobody tells the learner what is what."""
    learner = build.taught((0,), n_motions=30)
    again = build.taught((0,), n_motions=30)
    version = learner.snapshot().version
    assert again.snapshot().version == version
    seen = build.recognised(learner, 0, n_motions=30)
    assert seen == build.recognised(again, 0, n_motions=30)
    assert learner.snapshot().version == version
    known = set(learner.snapshot().ids)
    assert known and set(seen.called) <= known and {id for way in seen.ways for id in way} <= known
    truth = {segment.label for segment in build.shown_by(0, 30).truth}
    assert {name for names in seen.called.values() for name in names} <= truth
    assert sum(seen.ways.values()) < sum(names.total() for names in seen.called.values())


def test_only_ways_that_lead_back_are_kept():
    ring = {(1, 2): 5, (2, 3): 2, (3, 1): 4, (3, 3): 9}
    aside = {(3, 4): 7, (5, 1): 2, (6, 7): 3, (7, 6): 3, (2, 1): 1}
    person = build.Seen(Counter(ring | aside))
    assert build.round_of(person, range(1, 8)) == [(1, 2), (2, 3), (3, 1)]
    assert build.round_of(person, (1, 2, 6, 7)) == [(6, 7), (7, 6)]


def foreknowledge_robot():
    from mplearn_envs.robot import humanoid

    return humanoid()


def test_people_of_a_split_come_and_their_ways_differ(env):
    people = {env.reset(seed=seed)[1]["person"] for seed in range(40)}
    with pytest.raises(InvalidValueError, match=r"\('person', 'target'\) here, not \['people'\]"):
        env.reset(options={"people": 7})
    assert people == set(SPLITS["train"])
    test = make(people="test")
    assert {test.reset(seed=seed)[1]["person"] for seed in range(20)} == set(SPLITS["test"])
    edges = [
        {(a, b) for a, b, _ in build_ways(person)}
        for person in (SPLITS["train"][0], *SPLITS["test"])
    ]
    for one, other in pairwise(edges):
        assert 0.1 < len(one - other) / len(one) < 0.35  # as they were seen
    _, info = env.reset(options={"person": 4})
    assert info["person"] == 4
    with pytest.raises(InvalidValueError, match="person must be one of"):
        env.reset(options={"person": 7})
    with pytest.raises(InvalidValueError, match="people must be one of"):
        make(people="nobody")


def build_ways(person):
    graph = library_of(person).graph
    return [
        (a, graph.ids[j], 1) for a in graph.ids for j in np.flatnonzero(graph.prior(a)).tolist()
    ]


def test_an_episode_starts_at_one_primitive_and_its_goal_is_far(env):
    firsts = set()
    for seed in range(12):
        _, info = env.reset(seed=seed)
        repertoire = env.unwrapped.repertoire
        first = performed(repertoire, env.unwrapped._begun().choices)
        assert len(first) == 1 and first[0] in starts()
        firsts.add(first[0])
        goal = repertoire.primitive(int(info["task"]["slots"][0]))
        way = soonest(repertoire, None, env.unwrapped._begun().choices)[goal]
        assert 5 <= way.n_steps <= 15
        assert way.time_s == pytest.approx(info["task"]["least_time_s"])
        assert info["task"]["best_return"] > info["task"]["idle_return"]
    assert len(firsts) > 5


@pytest.mark.parametrize("task", ["goal", "recite"])
def test_the_quickest_way_earns_what_is_said_to_be_the_best(task):
    """And no other policy more."""
    from mplearn_agents.episodes import play
    from mplearn_agents.policies import POLICIES

    env = make(task=task, people="test")
    episodes = {
        name: play(env, POLICIES[name](env), 6, seed=1) for name in ("quick-path", "likely-path")
    }
    for episode in episodes["quick-path"]:
        assert episode.success == 1.0
        assert episode.share == pytest.approx(1.0, abs=5e-3)
    assert all(episode.share < 1.0 + 5e-3 for episode in episodes["likely-path"])


def test_holding_earns_nothing_on_the_scale():
    env = make(task="goal")
    _, info = env.reset(seed=2)
    total, discount, over = 0.0, 1.0, False
    while not over:
        _, reward, over, truncated, now = env.step(0)
        total += discount * float(reward)
        discount *= now["discount"]
        assert not truncated
    assert total == pytest.approx(info["task"]["idle_return"], rel=1e-9)


def test_masks_copies_states_and_specs(env):
    check_action_mask(make(), steps=12)
    env.reset(seed=5)
    walked(env, 2)
    state = env.unwrapped.state()
    twin, pickled = copy.deepcopy(env), pickle.loads(pickle.dumps(env))
    seen = walked(env)
    assert walked(twin) == seen and walked(pickled) == seen
    other = make()
    other.reset(seed=77)
    other.unwrapped.load_state(state)
    assert walked(other) == seen
    again = gymnasium.make(EnvSpec.from_json(make(people=(6,), task="recite").spec.to_json()))
    assert again.unwrapped.people == (6,) and again.unwrapped.task.deadline_s == 180.0


def test_it_is_simulated_too_and_in_threads():
    vector = gymnasium.make_vec(ID, num_envs=2, people="all")
    _, infos = vector.reset(seed=1)
    for _ in range(2):
        actions = [int(np.flatnonzero(mask)[-1]) for mask in infos["action_mask"]]
        _, rewards, over, _, infos = vector.step(np.array(actions))
        assert not over.any() and np.isfinite(rewards).all()
    vector.close()
