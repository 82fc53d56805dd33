"""Who does a task how well: all policies and trained agents, over several seeds, in one table."""

from __future__ import annotations

import os
import signal
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from concurrent.futures import ProcessPoolExecutor
from contextlib import contextmanager
from functools import partial
from multiprocessing import active_children, get_context
from pathlib import Path
from typing import Any

import numpy as np
from scipy import stats

from mplearn.errors import InvalidValueError
from mplearn.evaluation import Table
from mplearn.recording import FloatArray
from mplearn.spawning import deaf_to_interrupts
from mplearn_agents.contests.comparison import SLOW, Comparison
from mplearn_agents.contests.contest import Contest
from mplearn_agents.episodes import Episode

COLUMNS = ("task", "dynamics", "policy", "return", "share of the best", "success", "falls", "time")
CONFIDENCE = 0.95
ORACLE = "oracle"
REGRET = (
    " The regret is what the return misses, in the same episodes, of that of the oracle, who knows "
    "the graph."
)
AGENTS = " Agents are trained kinematically, one a seed, for {} macro steps."
ONLINE = (
    " That best is of what was known when the episode began; with what is learned later more may "
    "be possible, which the oracle foresees."
)


def compare(
    comparison: Comparison,
    folder: Path,
    jobs: int | None = 1,
    done: Callable[[Contest], object] = lambda _: None,
) -> Iterator[tuple[Table, Table]]:
    """Yield two tables a task: who does it how well, and how long each takes to think and act.

    Args:
        comparison: What to compare.
        folder: Where trained agents and episodes are kept; those that are there already are taken
            from there, so that a comparison that was interrupted goes on.
        jobs: Number of processes; None is the number of processors.
        done: Told of each contest that is over.

    Raises:
        InvalidValueError: ``jobs`` is less than 1.
    """
    if jobs is not None and jobs < 1:
        raise InvalidValueError(f"there is at least 1 job, not {jobs}")
    contests = {task: comparison.contests(task) for task in comparison.tasks}
    in_order = [each for of in contests.values() for entrants in of.values() for each in entrants]
    with _mapping(jobs or os.cpu_count() or 1) as mapped:
        results = mapped(partial(Contest.play, folder=folder), in_order)
        for task, entrants in contests.items():
            played: dict[str, list[list[list[Episode]]]] = {}
            for name, of_seeds in entrants.items():
                for contest in of_seeds:
                    played.setdefault(name, []).append(next(results))
                    done(contest)
            yield _table(comparison, task, played), _wall_table(task, played)


@contextmanager
def _mapping(jobs: int) -> Iterator[Callable[..., Iterator[list[list[Episode]]]]]:
    """Yield `map`, over that many processes."""
    if jobs == 1:
        yield map
        return
    others = set(active_children())
    with ProcessPoolExecutor(jobs, get_context("spawn"), _begin_work) as pool:

        def mapped(do: Callable[..., Any], each: Iterable[Any]) -> Iterator[Any]:
            with deaf_to_interrupts():  # processes are started as they are needed
                done = [pool.submit(do, one) for one in each]
            return (future.result() for future in done)  # none is cancelled, as by pool.map

        try:
            yield mapped
        except BaseException:  # interrupted, too: what is not kept yet is given up
            for worker in set(active_children()) - others:
                worker.terminate()
            raise


def _begin_work() -> None:
    """Use one thread (torch is not there yet), and leave interrupts to the parent."""
    os.environ["OMP_NUM_THREADS"] = "1"
    signal.signal(signal.SIGINT, signal.SIG_IGN)


def _table(
    comparison: Comparison, task: str, played: Mapping[str, Sequence[Sequence[Sequence[Episode]]]]
) -> Table:
    """Return a task's table; ``played``: the episodes of each contestant, seed and game."""
    games, regrets = comparison.games(task), ORACLE in played
    rows = [
        (
            *(task, game.name, name, *_cells([games[k] for games in of_seeds])),
            *([_regret(of_seeds, played[ORACLE], k)] if regrets else []),
        )
        for k, game in enumerate(games)
        for name, of_seeds in played.items()
    ]
    return Table(
        f"Task {task!r} in {comparison.env}: {len(comparison.seeds)} seeds",
        (*COLUMNS, "regret") if regrets else COLUMNS,
        tuple(rows),
        f"Mean over seeds and its {100 * CONFIDENCE:.0f} % interval (Student's t), of "
        f"{comparison.episodes} kinematic or {comparison.simulated_episodes} simulated episodes a "
        f"seed (so few of {', '.join(SLOW)}, too). The return is discounted by time; of the best "
        f"return that is possible, holding is 0 % and all of it 100 %."
        + (ONLINE if comparison.env == "online" else AGENTS.format(comparison.steps_of(task)))
        + (REGRET if regrets else ""),
    )


def _cells(results: Sequence[Sequence[Episode]]) -> tuple[str, ...]:
    """Return the means over episodes of each seed, summed up over seeds."""

    def means(value: Callable[[Episode], float]) -> FloatArray:
        return np.array([np.mean([value(episode) for episode in seed]) for seed in results])

    return (
        with_interval(means(lambda e: e.return_)),
        with_interval(100 * means(lambda e: e.share), " %", 1),
        with_interval(100 * means(lambda e: e.success), " %", 1),
        with_interval(100 * means(lambda e: e.fallen), " %", 1),
        with_interval(means(lambda e: e.duration_s), " s", 1),
    )


def _regret(
    results: Sequence[Sequence[Sequence[Episode]]],
    oracle: Sequence[Sequence[Sequence[Episode]]],
    game: int,
) -> str:
    """Return what returns miss of the oracle's; both by seed, game and episode."""
    missed = [
        np.mean(
            [best.return_ - own.return_ for own, best in zip(of[game], known[game], strict=True)]
        )
        for of, known in zip(results, oracle, strict=True)
    ]
    return with_interval(np.array(missed))


def _wall_table(task: str, played: Mapping[str, Sequence[Sequence[Sequence[Episode]]]]) -> Table:
    """Return how long a macro step of each contestant took, its thinking included."""
    rows = []
    for name, of_seeds in played.items():
        episodes = [episode for seed in of_seeds for game in seed for episode in game]
        wall_s, steps = sum(e.wall_s for e in episodes), sum(e.steps for e in episodes)
        rows.append((task, name, f"{1e3 * wall_s / steps:.1f} ms", f"{wall_s:.0f} s"))
    return Table(
        f"Task {task!r}: time on the wall",
        ("task", "policy", "a macro step", "in all"),
        tuple(rows),
    )


def with_interval(values: FloatArray, unit: str = "", digits: int = 2) -> str:
    """Return the mean of independent values and the half width of its interval; a dash for NaN."""
    if np.isnan(values).any():
        return "-"
    error = float(stats.sem(values)) * float(stats.t.ppf((1 + CONFIDENCE) / 2, len(values) - 1))
    return f"{values.mean():.{digits}f} ± {error:.{digits}f}{unit}"
