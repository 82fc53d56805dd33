"""How likely the robot falls in what it plans to do, in a body of a level: seen in simulation.

Kinematic dynamics have no contact, so a fall is a matter of chance there. Its hazard [1/s] is
exp(w . strain), a proportional hazard as of [Cox1972], of what strains the balance: feet in the
air, the zero-moment point near the edge of the soles, a fast COG, fast joints. Bodies of one level
differ: each falls more or less often than the level's do at the mean, by a factor that is drawn
with it (a frailty, [Vaupel1979]). Weights and spread of each level are fitted to simulated random
walks by `mplearn_envs.experiments.falls`.
"""

from __future__ import annotations

import json
import math
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache
from pathlib import Path

import numpy as np

from mplearn.recording import FloatArray
from mplearn_envs.planning.plan import Plan

from .bodies import BODIES, NOMINAL, Body

PATH = Path(__file__).parent / "falls.json"
STRAINS = ("always", "one foot", "near the edge", "COG speed [m/s]", "joint speed [rad/s]")
SAFE_M = 0.05  # from the edge of the soles
_LEAST = 1e-9  # of these factors


@dataclass(frozen=True)
class FallRisk:
    """The hazard of falling.

    Attributes:
        weights: Of each of `STRAINS`.
        spread: Variance of the factor by which bodies differ from that, whose mean is 1.
    """

    weights: tuple[float, ...]
    spread: float = 0.0

    def of_body(self, draw: int) -> FallRisk:
        """Return the hazard of one body.

        Args:
            draw: Which; the same number gives the same body.
        """
        if self.spread == 0.0:
            return self
        rng = np.random.default_rng([draw, 3])
        factor = max(float(rng.gamma(1.0 / self.spread, self.spread)), _LEAST)
        return FallRisk((self.weights[0] + math.log(factor), *self.weights[1:]))

    def probability(self, strain: FloatArray, duration_s: float) -> float:
        """Return how likely the robot falls meanwhile.

        Args:
            strain: See `strain_of`, shape (5,).
            duration_s: How long it lasts [s].
        """
        return -math.expm1(-duration_s * math.exp(min(float(strain @ self.weights), 50.0)))


def strain_of(plan: Plan) -> FloatArray:
    """Return means over a plan: 1, the share of time on one foot, how near the edge, speeds; (5,).

    How near: 0 where the zero-moment point is 5 cm or more from the edge of the soles, 1 on it.
    """
    margin = np.nan_to_num(plan.zmp_margin_m[1:], nan=0.0)
    cog = np.diff(plan.cog[:, :2], axis=0) / plan.knot_s
    joints = np.diff(plan.q[:, 7:], axis=0) / plan.knot_s
    return np.array(
        [
            1.0,
            float((plan.up[1:] >= 0).mean()),
            float((1.0 - np.clip(margin / SAFE_M, 0.0, 1.0)).mean()),
            float(np.linalg.norm(cog, axis=1).mean()),
            float(np.sqrt((joints**2).mean(axis=1)).mean()),
        ]
    )


def risk_of(body: Body) -> FallRisk | None:
    """Return the risk of a body of one of the levels; None where it never falls."""
    if body == NOMINAL:
        return None
    level = next(name for name, known in BODIES.items() if known == body)
    return fitted()[level]


@cache
def fitted() -> Mapping[str, FallRisk]:
    """Return the risk of the bodies of each level."""
    known = json.loads(PATH.read_text("utf-8"))
    return {
        level: FallRisk(tuple(weights), known["spread"][level])
        for level, weights in known["weights"].items()
    }
