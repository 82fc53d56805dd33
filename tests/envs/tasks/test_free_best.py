"""The best of free motion: against brute force on graphs, and on the environment itself."""

import gymnasium
import networkx as nx
import numpy as np
import pytest

import mplearn_envs  # noqa: F401  (registers the environment)
from mplearn.errors import InvalidValueError
from mplearn_envs.tasks import FreeTask, wandering
from mplearn_envs.tasks.long_run import Actions, best_rate, best_values


@pytest.mark.parametrize("seed", range(40))
def test_rate_and_values_are_those_of_brute_force(seed):
    rng = np.random.default_rng(seed)
    n = int(rng.integers(2, 8))
    edges = {(s, (s + 1) % n) for s in range(n)}  # all is reached from everywhere
    edges |= {(int(s), int(t)) for s, t in rng.integers(0, n, (n, 2))}
    state, to = np.array(rng.permutation(sorted(edges))).T
    reward, time_s = rng.normal(size=len(to)), rng.uniform(0.2, 3.0, len(to))
    actions = Actions.of(state, to, reward, time_s)
    graph = nx.DiGraph()
    for s, t, earned, lasts in zip(state.tolist(), to.tolist(), reward, time_s, strict=True):
        graph.add_edge(s, t, earned=earned, lasts=lasts)
    rates = []
    for cycle in nx.simple_cycles(graph):
        ways = [graph[s][t] for s, t in zip(cycle, cycle[1:] + cycle[:1], strict=True)]
        rates.append(sum(w["earned"] for w in ways) / sum(w["lasts"] for w in ways))
    assert best_rate(actions) == pytest.approx(max(rates), abs=1e-9)
    values = best_values(actions, 0.7)
    worth = reward + 0.7**time_s * values[to]
    assert values == pytest.approx([worth[state == s].max() for s in range(n)], abs=1e-7)


def test_every_state_needs_an_action_that_takes_time():
    one = np.array([0]), np.array([1]), np.ones(1), np.ones(1)
    with pytest.raises(InvalidValueError, match="every state needs an action"):
        Actions.of(*one)
    with pytest.raises(InvalidValueError, match="takes time"):
        Actions.of(np.array([0]), np.array([0]), np.ones(1), np.zeros(1))


def made(discount, **task):
    free = FreeTask(ceiling=True, **task)
    env = gymnasium.make("mplearn/PrimitiveHumanoid-v0", dynamics="kinematic", task=free,
                         discount=discount, disable_env_checker=True)  # fmt: skip
    return env.unwrapped


def most(env, state, info, steps):
    """Return the greatest return of so many steps, by trying all of them."""
    best = 0.0
    for action in np.flatnonzero(info["action_mask"]).tolist() if steps else ():
        env.load_state(state)
        _, reward, _, _, after = env.step(action)
        rest = most(env, env.state(), after, steps - 1)
        best = max(best, reward + after["discount"] * rest)
    return best


@pytest.mark.parametrize("memory", [3, 10])
def test_the_best_return_is_that_of_all_that_can_be_done(memory):
    """Where the future counts for little, so that a few steps decide."""
    env = made(0.1, memory=memory)
    _, info = env.reset(seed=3)
    found = most(env, env.state(), info, 4)
    assert info["task"]["best_return"] == pytest.approx(found, rel=2e-3)
    assert info["task"]["idle_return"] == pytest.approx(held(env), rel=1e-3)


def held(env):
    env.reset(seed=3)
    total, discount = 0.0, 1.0
    for _ in range(20):
        _, reward, _, _, info = env.step(0)
        total, discount = total + discount * reward, discount * info["discount"]
    return total


def test_what_is_forgotten_bounds_the_best_from_above(monkeypatch):
    exact = made(0.95).reset(seed=1)[1]["task"]
    monkeypatch.setattr(wandering, "MOST_STATES", 200)
    env = made(0.95)
    env.repertoire.memory.clear()
    bound = env.reset(seed=1)[1]["task"]
    env.repertoire.memory.clear()
    assert exact["best_return"] < bound["best_return"] < 1.3 * exact["best_return"]
    assert exact["best_rate"] < bound["best_rate"] < 1.3 * exact["best_rate"]


def test_where_it_cannot_be_known_it_is_not_said():
    _, info = made(1.0).reset(seed=1)
    assert all(np.isnan(value) for value in info["task"].values())
    plain = gymnasium.make("mplearn/PrimitiveHumanoid-v0", dynamics="kinematic", task="free")
    assert plain.reset(seed=1)[1]["task"] == {}
