"""Robots that are not quite as the planner believes."""

from __future__ import annotations

import mujoco
import numpy as np


def disturb(model: mujoco.MjModel, share: float, rng: np.random.Generator) -> None:
    """Change masses, servo gains and friction, each by up to a share of itself, in place.

    Args:
        model: The simulated robot.
        share: Largest error, 0.1 for 10 %.
        rng: Source of randomness.
    """

    def factors(n: int) -> np.ndarray[tuple[int], np.dtype[np.float64]]:
        return rng.uniform(1.0 - share, 1.0 + share, n)

    heavier = factors(model.nbody)
    model.body_mass *= heavier
    model.body_inertia *= heavier[:, None]
    gain = factors(model.nu)
    model.actuator_gainprm[:, 0] *= gain
    model.actuator_biasprm[:, 1] *= gain
    model.actuator_biasprm[:, 2] *= factors(model.nu)
    model.geom_friction *= factors(1)
    mujoco.mj_setConst(model, mujoco.MjData(model))
