"""Who does a task how well: all policies and trained agents, over several seeds, in one table."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import gymnasium
import numpy as np
from scipy import stats

import mplearn_envs  # noqa: F401  (registers the environment)
from mplearn.errors import InvalidValueError
from mplearn.evaluation import Table
from mplearn.recording import FloatArray

from .episodes import Episode, play
from .policies import NEEDS_TASK, POLICIES, Policy
from .rl import TrainedPolicy, TrainingConfig
from .rl.config import AlgorithmName, PriorUse, usual_prior
from .rl.train import train
from .rl.trained import CONFIG, POLICY

if TYPE_CHECKING:
    from rich.console import Console

COLUMNS = ("task", "dynamics", "policy", "return", "success", "falls", "time")
CONFIDENCE = 0.95
SLOW = ("search",)  # plays as few episodes as the simulated robot does


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
        steps: Macro steps of a training.
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
    steps: int = 40_000
    library: str | None = None

    def __post_init__(self) -> None:
        unknown = [name for name in self.policies if name not in POLICIES]
        if unknown:
            raise InvalidValueError(f"policies must be among {tuple(POLICIES)}, not {unknown}")
        if len(self.seeds) < 2:
            raise InvalidValueError(f"an interval needs at least 2 seeds, not {self.seeds}")


def compare(
    comparison: Comparison, agents: Path, console: Console | None = None
) -> Iterator[Table]:
    """Yield one table a task.

    Args:
        comparison: What to compare.
        agents: Folder of the trained agents; those that are there already are taken from there.
        console: Where the progress of trainings is shown; None is silent.
    """
    for task in comparison.tasks:
        priors = comparison.priors or (usual_prior(task),)
        trained = {
            f"{algorithm}, prior as {prior}": [
                _trained(comparison, task, algorithm, prior, seed, agents, console)
                for seed in comparison.seeds
            ]
            for algorithm in comparison.algorithms
            for prior in (("feature",) if algorithm == "dqn" else priors)
        }
        rows = []
        for dynamics in comparison.dynamics:
            env = gymnasium.make(
                "mplearn/PrimitiveHumanoid-v0",
                library=comparison.library,
                task=task,
                dynamics=dynamics,
                disable_env_checker=True,
            )
            for name, policies in _contestants(comparison, task, env, trained):
                slow = dynamics == "simulated" or name in SLOW
                n = comparison.simulated_episodes if slow else comparison.episodes
                results = [
                    play(env, policy, n, seed)
                    for policy, seed in zip(policies, comparison.seeds, strict=True)
                ]
                rows.append((task, dynamics, name, *_cells(results)))
            env.close()
        yield Table(
            f"Task {task!r}: {len(comparison.seeds)} seeds",
            COLUMNS,
            tuple(rows),
            f"Mean over seeds and its {100 * CONFIDENCE:.0f} % interval (Student's t), of "
            f"{comparison.episodes} kinematic or {comparison.simulated_episodes} simulated "
            f"episodes a seed (so few of {', '.join(SLOW)}, too). The return is discounted by "
            f"time. Agents are trained kinematically, one a seed, for {comparison.steps} macro "
            "steps.",
        )


def _contestants(
    comparison: Comparison,
    task: str,
    env: gymnasium.Env[Any, Any],
    trained: dict[str, list[TrainedPolicy]],
) -> Iterator[tuple[str, Sequence[Policy]]]:
    for name in comparison.policies:
        foresees = name == "search" and task == "follow"
        if task in NEEDS_TASK.get(name, (task,)) and not foresees:
            yield name, [POLICIES[name](env)] * len(comparison.seeds)
    yield from trained.items()


def _trained(
    comparison: Comparison,
    task: str,
    algorithm: AlgorithmName,
    prior: PriorUse,
    seed: int,
    agents: Path,
    console: Console | None,
) -> TrainedPolicy:
    config = TrainingConfig(
        task=task,
        algorithm=algorithm,
        prior=prior,
        steps=comparison.steps,
        seed=seed,
        library=comparison.library,
        round_steps=comparison.steps,
    )
    folder = agents / f"{task}-{algorithm}-{prior}-{seed}"
    if (folder / POLICY).exists() and TrainingConfig.load(folder / CONFIG)[0] == config:
        return TrainedPolicy.load(folder)
    return train(config, folder, console=console)


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
