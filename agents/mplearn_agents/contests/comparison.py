"""What is compared: which contestants play which tasks, how often, and how agents are trained."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import get_args

from mplearn.errors import InvalidValueError
from mplearn_agents.contests.contest import Contest, EnvName, Game
from mplearn_agents.policies import POLICIES
from mplearn_agents.rl import TrainingConfig
from mplearn_agents.rl.config import USUAL_SPEED, AlgorithmName, PriorUse
from mplearn_agents.suited import SUITED, plays, suited
from mplearn_envs.execution.bodies import BodyName
from mplearn_envs.execution.modes import Dynamics
from mplearn_envs.tasks import TASKS
from mplearn_envs.varied.changes import CHANGES
from mplearn_envs.varied.people import SPLITS

DYNAMICS = get_args(Dynamics)
SLOW = ("search",)  # plays as few episodes as the simulated robot does
ROUND_STEPS = 20_000  # of a training: so much is lost at most when it is interrupted
PROBES = 10  # episodes after each round, for the log


@dataclass(frozen=True)
class Comparison:
    """What is compared.

    Attributes:
        tasks: Names of tasks; those that the environment has not are left out.
        dynamics: "kinematic", "simulated" or both. Agents are trained kinematically.
        policies: Names of policies; those that do not suit a task are left out there, see `Suited`.
        algorithms: What agents are trained with.
        priors: What the transition prior is to them; "dqn" knows "feature" only. None: what
            suits the task, see `Suited`.
        seeds: Of the episodes, and of the trainings: one agent a seed.
        episodes: Episodes a seed, kinematic.
        simulated_episodes: Episodes a seed, simulated; and of policies that think long.
        steps: Macro steps of a training; None: what suits the task, see `Suited`.
        library: File of the library; None is the built-in one.
        env: Version of the environment; "online": a learner watches meanwhile. There no agents are
            trained: they would need the same primitives in the same slots, and a day of watching.
        people: Of v1: with whom it is played, one game each. Agents are trained with "train".
        speeds: Among which speeds everyone chooses with the primitive, the usual one first.
        changes: Of v1's task ``follow``: levels of what changes meanwhile, one game each; see
            `mplearn_envs.varied.changes`. Agents are trained without.
        bodies: Levels of what the body is like, simulated; see `mplearn_envs.execution.bodies`.
    """

    tasks: tuple[str, ...] = tuple(SUITED)
    dynamics: tuple[str, ...] = ("kinematic",)
    policies: tuple[str, ...] = tuple(POLICIES)
    algorithms: tuple[AlgorithmName, ...] = ("maskable-ppo",)
    priors: tuple[PriorUse, ...] | None = None
    seeds: tuple[int, ...] = (100, 101, 102, 103, 104)
    episodes: int = 50
    simulated_episodes: int = 4
    steps: int | None = None
    library: str | None = None
    env: EnvName = "v0"
    people: tuple[str, ...] = ("train", "test")
    bodies: tuple[str, ...] = ("nominal",)
    changes: tuple[str, ...] = ("none",)
    speeds: tuple[float, ...] = USUAL_SPEED

    def __post_init__(self) -> None:
        for what, allowed in (
            ("tasks", TASKS),
            ("policies", POLICIES),
            ("dynamics", DYNAMICS),
            ("people", SPLITS),
            ("bodies", get_args(BodyName)),
            ("changes", CHANGES),
        ):
            unknown = [name for name in getattr(self, what) if name not in allowed]
            if unknown:
                raise InvalidValueError(f"{what} must be among {tuple(allowed)}, not {unknown}")
        if self.changes != ("none",) and self.env != "v1":
            raise InvalidValueError("changes are those of people of v1: compare with env='v1'")
        if self.changes != ("none",) and "follow" not in self.tasks:
            raise InvalidValueError("changes are those of the task 'follow': let it be a task")
        if self.library is not None and self.env != "v0":
            raise InvalidValueError(f"{self.env} has its own library: give none, or compare on v0")
        if self.env == "online":  # there the demonstrator to follow would be another one
            object.__setattr__(self, "tasks", tuple(t for t in self.tasks if t != "follow"))
            if not self.tasks:
                raise InvalidValueError("online has every task but 'follow': name another")
        if len(self.seeds) < 2:
            raise InvalidValueError(f"an interval needs at least 2 seeds, not {self.seeds}")

    def games(self, task: str, name: str = "") -> tuple[Game, ...]:
        """Return what is played of a task.

        Args:
            task: The task.
            name: By whom; who thinks long plays fewer episodes.
        """
        return tuple(
            Game(dynamics, self._n(name, dynamics), body, people, changes)
            for dynamics in self.dynamics
            for body in (self.bodies if dynamics == "simulated" else ("nominal",))
            for people in (self.people if self.env == "v1" else (None,))
            for changes in (self.changes if task == "follow" else ("none",))
        )

    @property
    def n_contests(self) -> int:
        """How many contests there are in all."""
        return sum(len(self.contests(task)) for task in self.tasks) * len(self.seeds)

    def contests(self, task: str) -> dict[str, list[Contest]]:
        """Return the contests of a task: of each contestant, one a seed."""
        trainings = self._trainings(task)
        policies = [name for name in self.policies if plays(name, task, self.env)]
        out = {}
        for name in [*policies, *trainings]:
            games = self.games(task, name)
            training = trainings.get(name)
            out[name] = [
                Contest(
                    task,
                    name,
                    seed,
                    games,
                    self.library,
                    training and replace(training, seed=seed),
                    self.env,
                    self.speeds,
                )
                for seed in self.seeds
            ]
        return out

    def steps_of(self, task: str) -> int:
        """Return the macro steps of a training."""
        return suited(task).steps if self.steps is None else self.steps

    def _n(self, name: str, dynamics: str) -> int:
        slow = dynamics == "simulated" or name in SLOW
        return self.simulated_episodes if slow else self.episodes

    def _trainings(self, task: str) -> dict[str, TrainingConfig]:
        """Return how each agent is trained for a task, by its name; but for the seed."""
        if self.env == "online":
            return {}
        steps = self.steps_of(task)
        uses: list[tuple[AlgorithmName, PriorUse]] = [
            (algorithm, "feature" if algorithm == "dqn" else prior)
            for algorithm in self.algorithms
            for prior in self.priors or (suited(task).prior,)
        ]
        return {
            f"{algorithm}, prior as {use}": TrainingConfig(
                task=task,
                algorithm=algorithm,
                prior=use,
                steps=steps,
                env=self.env,
                library=self.library,
                round_steps=min(steps, ROUND_STEPS),
                episodes=PROBES,
                speeds=self.speeds,
            )
            for algorithm, use in uses
        }
