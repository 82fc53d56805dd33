"""What is done while an agent trains: showing how far it is, and trying it out."""

from __future__ import annotations

import csv
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import gymnasium
import numpy as np
from rich.console import Console
from stable_baselines3.common.callbacks import BaseCallback

from mplearn_agents.episodes import Episode, play
from mplearn_agents.policies import Policy
from mplearn_agents.terminal.progress import open_progress

from .config import TrainingConfig

EVALUATION_SEED = 1_000_003


class ShowProgress(BaseCallback):
    """Shows a bar with the steps, their speed, and the success of the latest episodes.

    Args:
        config: What is trained.
        console: Where to show it; None shows nothing.
    """

    def __init__(self, config: TrainingConfig, console: Console | None) -> None:
        super().__init__()
        self.config = config
        self._bar = open_progress(
            console,
            "{task.completed:.0f} of {task.total:.0f} steps",
            "[cyan]{task.fields[speed]:.0f} steps/s",
            "[green]{task.fields[success]}",
        )

    @contextmanager
    def shown(self) -> Iterator[None]:
        """Show the bar meanwhile."""
        name = f"{self.config.algorithm} on {self.config.task}"
        with self._bar:
            self._task = self._bar.add_task(name, total=self.config.steps, speed=0, success="")
            yield

    def _on_training_start(self) -> None:
        self._began, self._first = time.perf_counter(), self.num_timesteps

    def _on_step(self) -> bool:
        return True

    def _on_rollout_end(self) -> None:
        recent = self.model.ep_success_buffer
        success = f"success {100 * np.mean(recent):.0f} %" if recent else ""
        speed = (self.num_timesteps - self._first) / (time.perf_counter() - self._began)
        self._bar.update(self._task, completed=self.num_timesteps, speed=speed, success=success)


class Evaluation(BaseCallback):
    """Plays episodes with the policy, always the same ones, at the end of each round.

    Args:
        policy: The policy that is trained; it is given masks.
        env: An environment of its own.
        config: What is trained.
        file: CSV file to which the means are appended.
    """

    def __init__(
        self, policy: Policy, env: gymnasium.Env[Any, Any], config: TrainingConfig, file: Path
    ) -> None:
        super().__init__()
        self.policy, self.env, self.config, self.file = policy, env, config, file

    def _on_step(self) -> bool:
        return True

    def _on_training_end(self) -> None:
        episodes = play(self.env, self.policy, self.config.episodes, EVALUATION_SEED)
        row = {"steps": self.num_timesteps, **means(episodes)}
        for name, value in row.items():
            self.logger.record(f"evaluation/{name}", value)
        self.logger.dump(self.num_timesteps)
        is_new = not self.file.exists()
        with self.file.open("a", newline="", encoding="utf-8") as file:
            writer = csv.DictWriter(file, list(row))
            if is_new:
                writer.writeheader()
            writer.writerow(row)


def means(episodes: list[Episode]) -> dict[str, float]:
    """Return the means over episodes: of success, return, falls, time [s] and illegal actions."""
    columns = zip(
        *((e.success, e.return_, e.fallen, e.duration_s, e.illegal) for e in episodes), strict=True
    )
    names = ("success", "return", "falls", "time_s", "illegal")
    return {name: float(np.mean(column)) for name, column in zip(names, columns, strict=True)}
