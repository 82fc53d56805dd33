"""Move freely: stay upright and balanced, do what is likely, and do not repeat yourself."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np
from gymnasium import spaces

from mplearn.recording import FloatArray
from mplearn_envs.execution.tracking_report import TrackingReport
from mplearn_envs.skills.repertoire import Repertoire

from .base import Choice, Scene, Task
from .wandering import wandering


@dataclass
class FreeTask(Task):
    """Free motion.

    ========= ================================================== ============ ==================
    term      formula                                            paid         extremes
    ========= ================================================== ============ ==================
    alive     ``alive``                                          per second   0 .. ``alive``
    balanced  ``balanced`` * min(max(m / ``safe_m``, 0), 1),     per second   0 .. ``balanced``
              m: distance of the ZMP from the edge of the soles
    likely    ``likely`` * P(choice | what was performed before) per choice   0 .. ``likely``
    varied    ``varied`` * (1 - share of this primitive among    per choice   0 .. ``varied``
              the last ``memory`` ones)
    fall      - ``fallen``                                       at a fall    - ``fallen`` .. 0
    ========= ================================================== ============ ==================

    Holding and illegal actions earn no ``likely`` and no ``varied``. The task's observation is the
    share of each slot among the last ``memory`` primitives, shape (capacity,), in [0, 1].

    Attributes:
        alive: Reward of a second upright.
        balanced: Reward of a second in safe balance.
        likely: Reward of a certain choice.
        varied: Reward of a primitive that was not performed lately.
        fallen: Price of a fall.
        safe_m: Margin of the zero-moment point that is safe [m].
        memory: Number of primitives in which repetitions count.
        ceiling: Whether ``report`` has ``best_return``, ``idle_return`` and ``best_rate`` (the
            greatest reward per second in the long run): the best that is possible where plans are
            taken at their word, see `mplearn_envs.tasks.wandering`. It takes some seconds, once for
            each library.

    Example:
        >>> import gymnasium as gym
        >>> import mplearn_envs
        >>> name, task = "mplearn/PrimitiveHumanoid-v0", FreeTask(likely=1.0)
        >>> env = gym.make(name, task=task, dynamics="kinematic")
        >>> observation, info = env.reset(seed=1)
        >>> sorted(info["reward_terms"])
        ['alive', 'balanced', 'fall', 'illegal', 'likely', 'novel', 'varied']
    """

    alive: float = 0.05
    balanced: float = 0.05
    likely: float = 0.5
    varied: float = 0.5
    fallen: float = 10.0
    safe_m: float = 0.05
    memory: int = 10
    ceiling: bool = False
    terms: ClassVar[tuple[str, ...]] = ("likely", "varied", "alive", "balanced")
    reset_options: ClassVar[tuple[str, ...] | None] = ()

    def space(self, repertoire: Repertoire) -> spaces.Box:
        """Return the bounds of the shares."""
        return spaces.Box(0.0, 1.0, (repertoire.capacity,), np.float64)

    def reset(self, scene: Scene) -> None:
        """Nothing was performed yet."""
        self.arrive(scene)
        self._best = wandering(self, self.memory, scene) if self.ceiling else None

    def observe(self) -> FloatArray:
        """Return the share of each slot among the last primitives."""
        return self._shares.copy()

    def bonuses(self, choice: Choice) -> dict[str, float]:
        """Return the terms ``likely`` and ``varied``."""
        if choice.primitive is None or not choice.legal:
            return {"likely": 0.0, "varied": 0.0}
        lately = choice.history[-self.memory :]
        share = lately.count(choice.primitive) / max(len(lately), 1)
        return {"likely": self.likely * choice.probability, "varied": self.varied * (1.0 - share)}

    def rates(self, report: TrackingReport) -> dict[str, FloatArray]:
        """Return the terms ``alive`` and ``balanced``."""
        safe = np.minimum(np.maximum(report.zmp_margin_m / self.safe_m, 0.0), 1.0)
        return {
            "alive": np.full(len(report.time_s), self.alive),
            "balanced": self.balanced * safe,
        }

    def arrive(self, scene: Scene) -> dict[str, float]:
        """Count what was performed lately."""
        self._shares = np.zeros(scene.repertoire.capacity)
        lately = scene.history[-self.memory :]
        for id in lately:
            slot = scene.repertoire.slots.get(id)
            if slot is not None:
                self._shares[slot] += 1.0
        self._shares /= max(len(lately), 1)
        return {}

    def report(self) -> dict[str, Any]:
        """Return the best that is possible, where that is asked for."""
        if self._best is None:
            return {}
        return {**self._best.scale.report(), "best_rate": self._best.rate}
