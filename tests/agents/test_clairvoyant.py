"""The oracle of an online environment: its plans against brute force, its board."""

from functools import cache
from types import SimpleNamespace

import gymnasium
import numpy as np
import pytest
from standing_library import recording

import mplearn_envs  # noqa: F401  (registers the environments)
from mplearn.errors import InvalidValueError
from mplearn_agents.cli import main
from mplearn_agents.contests import contest
from mplearn_agents.contests.comparison import Comparison
from mplearn_agents.episodes import play
from mplearn_agents.policies import POLICIES, Clairvoyant, oracle
from mplearn_agents.policies.timeline import START, TICK_S, Timeline
from mplearn_envs.tasks import FreeTask, GoalTask, ReciteTask

ID = "mplearn/OnlinePrimitiveHumanoid-v0"


def make(task="goal", **options):
    shown = recording(4, ring=False)
    given = {"demonstrator": shown, "dynamics": "kinematic", "warm_up_s": 25.0}
    return gymnasium.make(ID, task=task, disable_env_checker=True, **(given | options))


def begun(task):
    env = make(task)
    env.reset(seed=1)
    return Timeline(env.unwrapped)


def ticks(way):
    return max(1, round(way.time_s / TICK_S))


@pytest.mark.parametrize("task", ["goal", "recite"])
def test_values_are_those_of_the_best_of_all_plans(task):
    timeline = begun(task)
    end_s, n = 9.0, 90
    wanted = {way.to[0] for way in timeline.ways(START, 0.0) if way.id is not None}
    rng = np.random.default_rng(0)
    then = rng.random((n + 1, 500))

    @cache
    def best(place, k):
        if k >= n:
            return 0.0
        worths = []
        for way in timeline.ways(place, k * TICK_S):
            end = min(k + ticks(way), n)
            reached = way.id in wanted
            later = 2.0 + then[end, timeline.number(way.to)] if reached else best(way.to, end)
            worths.append(way.paid + timeline.clock.discount**way.time_s * later)
        return max(worths)

    timeline.ways(START, end_s)  # all places have numbers
    values = timeline.values(end_s, wanted, 2.0, then)
    places = {to for k in (0, 40) for way in timeline.ways(START, k * 0.1) for to in [way.to]}
    for place in [START, *places]:
        for k in (0, 13, 55, 89, 90):
            assert values[k, timeline.number(place)] == pytest.approx(best(place, k))
    assert values[0, 0] > values[89, 0]


def test_ways_become_known_and_are_waited_for():
    """A goal to which no way is known at first is worth something only if one will be known."""
    env = make(FreeTask(), warm_up_s=6.0)
    env.reset(seed=1)
    timeline = Timeline(env.unwrapped)
    first = {way.id for way in timeline.ways(START, 0.0)}
    later = {place[0] for place in timeline._at(30.0).ways} - first - {None}
    assert later
    values = timeline.values(30.0, later, 1.0)
    assert values[0, 0] > timeline.values(30.0, (), 0.0)[0, 0]


@pytest.mark.parametrize("task", [GoalTask(), ReciteTask(length=2, deadline_s=20.0), FreeTask()])
def test_nobody_does_better(task):
    """But for what a grid of a tenth of a second, and a horizon, leave out."""
    env = make(task, max_episode_steps=7)
    known = play(env, oracle(env), 1, 3)
    for name in ("random", "greedy" if isinstance(task, FreeTask) else "quick-path"):
        own = play(env, POLICIES[name](env), 1, 3)
        assert all(a.return_ >= b.return_ - 0.05 for a, b in zip(known, own, strict=True)), name
    assert not any(episode.illegal or episode.fallen for episode in known)


def test_other_environments_and_tasks_are_refused():
    env = gymnasium.make("mplearn/PrimitiveHumanoid-v0", dynamics="kinematic")
    with pytest.raises(InvalidValueError, match="'mplearn/OnlinePrimitiveHumanoid-v0'"):
        Clairvoyant(env)
    with pytest.raises(InvalidValueError, match="needs the task 'follow'"):
        oracle(env)

    class Own(FreeTask.__base__):
        def bonuses(self, choice):
            return {}

        def rates(self, report):
            return {}

    with pytest.raises(InvalidValueError, match="plans for the tasks"):
        oracle(make(Own()))


def test_a_board_of_the_online_environment_has_regret_and_no_agents(tmp_path, monkeypatch):
    def quick(name, **options):
        return make(
            warm_up_s=35.0, **{k: v for k, v in options.items() if k != "disable_env_checker"}
        )

    monkeypatch.setattr(contest, "gymnasium", SimpleNamespace(make=quick))
    asked = [
        "--tasks",
        "follow",
        "goal",
        "--policies",
        "random",
        "quick-path",
        "search",
        "oracle",
    ]
    board = ["compare", "--env", "online", "--out", str(tmp_path), "--jobs", "1", "--seeds", "2"]
    assert main([*board, *asked, "--dynamics", "kinematic", "--episodes", "1"]) == 0
    written = (tmp_path / "compare.md").read_text()
    rows = [line for line in written.splitlines() if line.startswith("| goal")]
    cells = {row.strip("| ").split(" | ")[2]: row.strip("| ").split(" | ") for row in rows}
    assert list(cells) == ["random", "quick-path", "oracle"] and "| follow" not in written
    regret = {name: float(row[-1].split()[0]) for name, row in cells.items()}
    returns = {name: float(row[3].split()[0]) for name, row in cells.items()}
    assert regret["oracle"] == 0.0 and regret["random"] > 0.1
    assert regret["random"] == pytest.approx(returns["oracle"] - returns["random"], abs=0.011)
    assert "what is learned later" in written and "trained" not in written


def test_wrong_boards_of_the_online_environment_are_refused():
    with pytest.raises(InvalidValueError, match="every task but 'follow'"):
        Comparison(tasks=("follow",), env="online")
    with pytest.raises(InvalidValueError, match="has its own library"):
        Comparison(library="some.mplearn", env="online")
