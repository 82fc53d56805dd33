"""How well the robot performs random walks on what was learned."""

from __future__ import annotations

from collections.abc import Sequence

import gymnasium
import numpy as np

import mplearn_envs  # noqa: F401  (registers the environment)
from mplearn.evaluation import Table
from mplearn.library import PrimitiveLibrary

from .policies import POLICIES
from .walk import WalkResult, walk

STEPS = 20
COLUMNS = (
    "walk",
    "primitives",
    "of these different",
    "falls",
    "robot's time",
    "tracking RMSE, worst",
    "COG deviation, largest",
    "ZMP margin, least",
)


def walk_table(library: PrimitiveLibrary, seeds: Sequence[int], steps: int = STEPS) -> Table:
    """Let the robot walk at half speed, once a seed, and return what it was like.

    Args:
        library: What was learned, as features of the robot.
        seeds: Seeds of the walks.
        steps: Primitives a walk.
    """
    env = gymnasium.make(
        "mplearn/PrimitiveHumanoid-v0", library=library, disable_env_checker=True, max_steps=steps
    )
    repertoire = env.unwrapped.repertoire  # type: ignore[attr-defined]
    refused = sum(not repertoire.feasibility(id).feasible for id in library.ids)
    rows = [_row(seed, walk(env, POLICIES["random"](), steps, seed)) for seed in seeds]
    env.close()
    return Table(
        f"Random walks of the robot on {len(library)} primitives",
        COLUMNS,
        tuple(rows),
        f"By the transition prior, at half the human's speed, in simulation. {refused} of the "
        "primitives are masked, because they lift a foot or exceed the robot's limits.",
    )


def _row(seed: int, result: WalkResult) -> tuple[str, ...]:
    moved = [step for step in result.steps if step.primitive is not None]
    return (
        f"seed {seed}",
        str(len(result.primitives)),
        str(len(set(result.primitives))),
        str(result.falls),
        f"{result.duration_s:.0f} s",
        f"{np.degrees(max(step.tracking_rmse_rad for step in moved)):.2f} deg",
        f"{100 * max(step.cog_deviation_m for step in moved):.2f} cm",
        f"{100 * min(step.zmp_margin_m for step in moved):.1f} cm",
    )
