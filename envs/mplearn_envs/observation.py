"""What the agent sees: the observation space and how it is filled."""

from __future__ import annotations

from typing import Any, TypeAlias

import numpy as np
from gymnasium import spaces

from mplearn.recording import FloatArray

from .repertoire import Choices
from .simulation import Simulation

Observation: TypeAlias = dict[str, Any]


def observation_limits(n_joints: int) -> dict[str, FloatArray]:
    """Return the largest magnitude of each measurement, as in `PrimitiveHumanoidEnv`'s table."""
    angles = np.full(n_joints, 2 * np.pi)
    return {
        "posture": np.concatenate(([10.0, np.pi / 2, np.pi], angles)),
        "velocity": np.full(6 + n_joints, 100.0),
        "cog": np.full(3, 10.0),
        "support_margin": np.full(1, 10.0),
    }


def observation_space(limits: dict[str, FloatArray], capacity: int) -> spaces.Dict:
    """Return the space of what `observe` returns."""
    measured = {key: spaces.Box(-high, high, dtype=np.float64) for key, high in limits.items()}
    return spaces.Dict(
        {
            **measured,
            "current_primitive": spaces.Discrete(capacity),
            "action_mask": spaces.MultiBinary(capacity),
            "transition_prior": spaces.Box(0.0, 1.0, (capacity,), np.float64),
        }
    )


def observe(
    limits: dict[str, FloatArray], simulation: Simulation, slot: int, choices: Choices
) -> Observation:
    """Return an observation, every array of it fresh.

    Args:
        limits: Where measurements are cut off.
        simulation: The robot.
        slot: Slot that was performed last.
        choices: What may be done next.
    """
    cog, margin = simulation.balance()
    measured = {
        "posture": simulation.posture(),
        "velocity": simulation.velocity(),
        "cog": cog,
        "support_margin": np.array([margin]),
    }
    return {
        **{key: np.clip(value, -limits[key], limits[key]) for key, value in measured.items()},
        "current_primitive": np.int64(slot),
        "action_mask": choices.mask.copy(),
        "transition_prior": choices.prior.copy(),
    }
