"""What a training is: everything that its result depends on."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import asdict, dataclass, field
from math import inf
from pathlib import Path
from typing import Any, Literal, TypeAlias, get_args

from mplearn.errors import InvalidValueError, MPLearnError
from mplearn_agents.suited import PriorUse as PriorUse
from mplearn_envs.environment.options import ActionOptions

VERSION = 3  # of agents: changes with networks, what they see, and what tasks show
USUAL_SPEED = (1.0,)  # as the only one
Course: TypeAlias = list[list[float]]  # tracked coordinates from where a motion begins to its end
EnvVersion: TypeAlias = Literal["v0", "v1"]
AlgorithmName: TypeAlias = Literal["maskable-ppo", "ppo", "dqn"]


@dataclass(frozen=True)
class TrainingConfig:
    """A training of one agent; the same configuration gives the same agent.

    Training goes in rounds. At the start of each, all random sources are seeded anew from ``seed``
    and the number of steps made, and the environments are reset; at its end there is a checkpoint
    and an evaluation. So a training that was interrupted goes on at its last checkpoint as if
    nothing had happened, bit for bit (but for DQN, whose replay memory starts empty again).

    Attributes:
        env: Version of the environment: "v0", or "v1" with many primitives of several people.
        task: Name of the environment's task, or where one's own is: "module:Class" or
            "file.py:Class".
        algorithm: "maskable-ppo"; or "ppo" or "dqn", which know no masks, with illegal actions
            projected to legal ones (`ProjectIllegal`).
        steps: Macro steps to train for, rounded up to whole rounds.
        seed: Of everything.
        dynamics: "kinematic" is fast; "simulated" is with contact.
        library: File of the library; None is the built-in one.
        prior: What the transition prior is to the policy (not to DQN's, where it is a feature).
        round_steps: Macro steps a round, rounded up to whole rollouts.
        episodes: Episodes of an evaluation.
        learning_rate: Of the optimiser; None is the algorithm's own.
        network: Widths of the hidden layers, of actor and critic each.
        n_envs: Environments that it learns from at once; None is the algorithm's own. DQN has one.
        discount: What a reward in a second's time is worth, in (0, 1]; None is the environment's.
        speeds: Among which speeds it chooses with the primitive, see `ActionOptions.speeds`.
        environment: Further arguments of the environment.

    Example:
        >>> TrainingConfig(task="recite", steps=1000).algorithm
        'maskable-ppo'
    """

    env: EnvVersion = "v0"
    task: str = "goal"
    algorithm: AlgorithmName = "maskable-ppo"
    steps: int = 40_000
    seed: int = 0
    dynamics: str = "kinematic"
    library: str | None = None
    prior: PriorUse = "logits"
    round_steps: int = 5_000
    episodes: int = 50
    learning_rate: float | None = None
    network: tuple[int, ...] = (128, 128)
    n_envs: int | None = None
    discount: float | None = None
    speeds: tuple[float, ...] = USUAL_SPEED
    environment: dict[str, Any] = field(default_factory=dict)

    def __post_init__(self) -> None:
        for name, allowed in (
            ("env", EnvVersion),
            ("algorithm", AlgorithmName),
            ("prior", PriorUse),
        ):
            if getattr(self, name) not in get_args(allowed):
                raise InvalidValueError(
                    f"{name} must be one of {get_args(allowed)}, not {getattr(self, name)!r}"
                )
        if self.env == "v1" and self.library is not None:
            raise InvalidValueError("v1 has its own library: give none, or train on v0")
        for name in ("steps", "round_steps", "episodes"):
            if getattr(self, name) < 1:
                raise InvalidValueError(f"{name} must be at least 1, not {getattr(self, name)}")
        if self.seed < 0:
            raise InvalidValueError(f"seed must not be negative, but is {self.seed}")
        object.__setattr__(self, "network", tuple(self.network))  # JSON has lists
        object.__setattr__(self, "speeds", ActionOptions(speeds=tuple(self.speeds)).speeds)
        if not self.network or min(self.network) < 1:
            raise InvalidValueError(
                f"network must be widths of hidden layers from 1, not {self.network}"
            )
        if self.learning_rate is not None and not 0.0 < self.learning_rate < inf:
            raise InvalidValueError(f"learning_rate must be positive, not {self.learning_rate}")
        if self.discount is not None and not 0.0 < self.discount <= 1.0:
            raise InvalidValueError(f"discount must be in (0, 1], not {self.discount}")
        if self.n_envs is not None and self.n_envs < 1:
            raise InvalidValueError(f"n_envs must be at least 1, not {self.n_envs}")
        if self.algorithm == "dqn" and self.n_envs not in (None, 1):
            raise InvalidValueError(f"dqn learns from 1 environment at once, not {self.n_envs}")

    @property
    def options(self) -> dict[str, Any]:
        """Arguments of the environment that it learns from, beside its name."""
        out: dict[str, Any] = {"task": self.task, "dynamics": self.dynamics}
        given = {"library": self.library, "discount": self.discount}
        out |= {name: value for name, value in given.items() if value is not None}
        out |= self.environment
        if self.speeds != USUAL_SPEED:
            out["actions"] = {**out.get("actions", {}), "speeds": self.speeds}
        return out

    def save(self, path: Path, slots: Mapping[int, int], courses: Mapping[int, Course]) -> None:
        """Write this as JSON, with the slot and the course of each primitive that it knows."""
        values = {"version": VERSION, **asdict(self)}
        values["slots"] = {str(id): slot for id, slot in slots.items()}
        values["courses"] = {str(id): course for id, course in courses.items()}
        path.write_text(json.dumps(values, indent=2) + "\n", "utf-8")

    @classmethod
    def load(cls, path: Path) -> tuple[TrainingConfig, dict[int, int], dict[int, Course]]:
        """Return what `save` wrote.

        Raises:
            InvalidValueError: The file is missing, damaged, or of another version.
        """
        try:
            values = json.loads(path.read_text("utf-8"))
            version = values.pop("version", 1)
            if version != VERSION:
                raise InvalidValueError(
                    f"{path.parent} holds an agent of version {version}; here are agents of "
                    f"version {VERSION}, whose networks differ: train it again"
                )
            slots = {int(id): int(slot) for id, slot in values.pop("slots").items()}
            ends = values.pop("ends", {})  # of agents of before
            courses = {int(id): each for id, each in values.pop("courses", ends).items()}
            return cls(**values), slots, courses
        except (OSError, ValueError, KeyError, TypeError, AttributeError) as error:
            if isinstance(error, MPLearnError):
                raise
            raise InvalidValueError(
                f"{path.parent} holds no training: {path.name} is missing or damaged ({error})"
            ) from error
