"""Who does a task how well: all policies and trained agents, over several seeds, in one table."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterator, Mapping, Sequence
from concurrent.futures import ProcessPoolExecutor
from contextlib import contextmanager
from dataclasses import dataclass, replace
from functools import partial
from multiprocessing import get_context
from pathlib import Path

import numpy as np
from scipy import stats

from mplearn.errors import InvalidValueError
from mplearn.evaluation import Table
from mplearn.recording import FloatArray

from .contest import Contest, Game
from .episodes import Episode
from .policies import NEEDS_TASK, POLICIES
from .rl import TrainingConfig
from .rl.config import AlgorithmName, PriorUse, usual_prior, usual_steps

COLUMNS = ("task", "dynamics", "policy", "return", "success", "falls", "time")
CONFIDENCE = 0.95
SLOW = ("search",)  # plays as few episodes as the simulated robot does
ROUND_STEPS = 20_000  # of a training: so much is lost at most when it is interrupted
PROBES = 10  # episodes after each round, for the log


@dataclass(frozen=True)
class Comparison:
    """What is compared.

    Attributes:
        tasks: Names of tasks.
        dynamics: "kinematic", "simulated" or both. Agents are trained kinematically.
        policies: Names of policies; those that do not suit a task are left out there, as is
            "search" in "follow", where it foresees the demonstrator.
        algorithms: What agents are trained with.
        priors: What the transition prior is to them; "dqn" knows "feature" only. None: what
            suits the task, see `usual_prior`.
        seeds: Of the episodes, and of the trainings: one agent a seed.
        episodes: Episodes a seed, kinematic.
        simulated_episodes: Episodes a seed, simulated; and of policies that think long.
        steps: Macro steps of a training; None: what suits the task, see `usual_steps`.
        library: File of the library; None is the built-in one.
    """

    tasks: tuple[str, ...] = ("goal", "follow", "recite", "free")
    dynamics: tuple[str, ...] = ("kinematic",)
    policies: tuple[str, ...] = tuple(POLICIES)
    algorithms: tuple[AlgorithmName, ...] = ("maskable-ppo",)
    priors: tuple[PriorUse, ...] | None = None
    seeds: tuple[int, ...] = (100, 101, 102, 103, 104)
    episodes: int = 50
    simulated_episodes: int = 4
    steps: int | None = None
    library: str | None = None

    def __post_init__(self) -> None:
        unknown = [name for name in self.policies if name not in POLICIES]
        if unknown:
            raise InvalidValueError(f"policies must be among {tuple(POLICIES)}, not {unknown}")
        if len(self.seeds) < 2:
            raise InvalidValueError(f"an interval needs at least 2 seeds, not {self.seeds}")

    @property
    def n_contests(self) -> int:
        """How many contests there are in all."""
        return sum(len(self.contests(task)) for task in self.tasks) * len(self.seeds)

    def contests(self, task: str) -> dict[str, list[Contest]]:
        """Return the contests of a task: of each contestant, one a seed."""
        trainings = self._trainings(task)
        policies = [
            name
            for name in self.policies
            if task in NEEDS_TASK.get(name, (task,)) and (name, task) != ("search", "follow")
        ]
        out = {}
        for name in [*policies, *trainings]:
            games = tuple(Game(dynamics, self._n(name, dynamics)) for dynamics in self.dynamics)
            training = trainings.get(name)
            out[name] = [
                Contest(
                    task, name, seed, games, self.library, training and replace(training, seed=seed)
                )
                for seed in self.seeds
            ]
        return out

    def steps_of(self, task: str) -> int:
        """Return the macro steps of a training."""
        return usual_steps(task) if self.steps is None else self.steps

    def _n(self, name: str, dynamics: str) -> int:
        slow = dynamics == "simulated" or name in SLOW
        return self.simulated_episodes if slow else self.episodes

    def _trainings(self, task: str) -> dict[str, TrainingConfig]:
        """Return how each agent is trained for a task, by its name; but for the seed."""
        steps = self.steps_of(task)
        uses: list[tuple[AlgorithmName, PriorUse]] = [
            (algorithm, "feature" if algorithm == "dqn" else prior)
            for algorithm in self.algorithms
            for prior in self.priors or (usual_prior(task),)
        ]
        return {
            f"{algorithm}, prior as {use}": TrainingConfig(
                task=task,
                algorithm=algorithm,
                prior=use,
                steps=steps,
                library=self.library,
                round_steps=min(steps, ROUND_STEPS),
                episodes=PROBES,
            )
            for algorithm, use in uses
        }


def compare(
    comparison: Comparison,
    folder: Path,
    jobs: int | None = 1,
    done: Callable[[Contest], object] = lambda _: None,
) -> Iterator[Table]:
    """Yield one table a task.

    Args:
        comparison: What to compare.
        folder: Where trained agents and episodes are kept; those that are there already are taken
            from there, so that a comparison that was interrupted goes on.
        jobs: Number of processes; None is the number of processors.
        done: Told of each contest that is over.
    """
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
            yield _table(comparison, task, played)


@contextmanager
def _mapping(jobs: int) -> Iterator[Callable[..., Iterator[list[list[Episode]]]]]:
    """Yield `map`, over that many processes."""
    if jobs == 1:
        yield map
        return
    with ProcessPoolExecutor(jobs, get_context("spawn"), _work_alone) as pool:
        yield pool.map


def _work_alone() -> None:
    """Use one thread; called in each process before torch is there."""
    os.environ["OMP_NUM_THREADS"] = "1"


def _table(
    comparison: Comparison, task: str, played: Mapping[str, Sequence[Sequence[Sequence[Episode]]]]
) -> Table:
    """Return a task's table; ``played``: the episodes of each contestant, seed and game."""
    rows = [
        (task, dynamics, name, *_cells([games[k] for games in of_seeds]))
        for k, dynamics in enumerate(comparison.dynamics)
        for name, of_seeds in played.items()
    ]
    return Table(
        f"Task {task!r}: {len(comparison.seeds)} seeds",
        COLUMNS,
        tuple(rows),
        f"Mean over seeds and its {100 * CONFIDENCE:.0f} % interval (Student's t), of "
        f"{comparison.episodes} kinematic or {comparison.simulated_episodes} simulated episodes a "
        f"seed (so few of {', '.join(SLOW)}, too). The return is discounted by time. Agents are "
        f"trained kinematically, one a seed, for {comparison.steps_of(task)} macro steps.",
    )


def _cells(results: Sequence[Sequence[Episode]]) -> tuple[str, ...]:
    """Return the means over episodes of each seed, summed up over seeds."""

    def means(value: Callable[[Episode], float]) -> FloatArray:
        return np.array([np.mean([value(episode) for episode in seed]) for seed in results])

    return (
        with_interval(means(lambda e: e.return_)),
        with_interval(100 * means(lambda e: e.success), " %", 1),
        with_interval(100 * means(lambda e: e.fallen), " %", 1),
        with_interval(means(lambda e: e.duration_s), " s", 1),
    )


def with_interval(values: FloatArray, unit: str = "", digits: int = 2) -> str:
    """Return the mean of independent values and the half width of its interval; a dash for NaN."""
    if np.isnan(values).any():
        return "-"
    error = float(stats.sem(values)) * float(stats.t.ppf((1 + CONFIDENCE) / 2, len(values) - 1))
    return f"{values.mean():.{digits}f} ± {error:.{digits}f}{unit}"
