"""Move freely: stay upright, do what is likely, and do not repeat yourself."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from mplearn.recording import FloatArray
from mplearn_envs.simulation import Performance

from .base import Choice, Task


@dataclass
class FreeTask(Task):
    """Free motion.

    ======== =================================================== ============ ==================
    term     formula                                             paid         extremes
    ======== =================================================== ============ ==================
    alive    ``alive``                                           per second   0 .. ``alive``
    likely   ``likely`` * P(choice | what was performed before)  per choice   0 .. ``likely``
    varied   ``varied`` * (1 - share of this primitive among     per choice   0 .. ``varied``
             the last ``memory`` ones)
    fall     - ``fallen``                                        at a fall    - ``fallen`` .. 0
    ======== =================================================== ============ ==================

    Holding and illegal actions earn no ``likely`` and no ``varied``.

    Attributes:
        alive: Reward of a second upright.
        likely: Reward of a certain choice.
        varied: Reward of a primitive that was not performed lately.
        fallen: Price of a fall.
        memory: Number of primitives in which repetitions count.
    """

    alive: float = 0.1
    likely: float = 0.5
    varied: float = 0.5
    fallen: float = 10.0
    memory: int = 10

    def bonuses(self, choice: Choice) -> dict[str, float]:
        """Return the terms ``likely`` and ``varied``."""
        if choice.primitive is None or not choice.legal:
            return {"likely": 0.0, "varied": 0.0}
        lately = choice.history[-self.memory :]
        share = lately.count(choice.primitive) / max(len(lately), 1)
        return {"likely": self.likely * choice.probability, "varied": self.varied * (1.0 - share)}

    def rates(self, performance: Performance) -> dict[str, FloatArray]:
        """Return the term ``alive``."""
        return {"alive": np.full(len(performance.time_s), self.alive)}

    def fall(self) -> float:
        """Return the price of a fall."""
        return -self.fallen
