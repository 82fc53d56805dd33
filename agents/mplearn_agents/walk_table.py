"""How well the robot performs random walks on what was learned."""

from __future__ import annotations

from collections.abc import Sequence

import gymnasium
import numpy as np

import mplearn_envs  # noqa: F401  (registers the environment)
from mplearn.evaluation import Table
from mplearn.library import PrimitiveLibrary

from .policies import RandomWalk
from .walk import WalkResult, walk

STEPS = 20
COLUMNS = (
    "learned from",
    "seed",
    "feasible",
    "performed",
    "different",
    "falls",
    "robot's time",
    "tracking RMSE, worst",
    "COG deviation, largest",
    "ZMP margin, least",
)


def walk_table(
    libraries: Sequence[tuple[str, PrimitiveLibrary]], seeds: Sequence[int], steps: int = STEPS
) -> Table:
    """Let the robot walk at half speed, once a library and seed, and return what it was like.

    Args:
        libraries: What was learned, as features of the robot, by name.
        seeds: Seeds of the walks.
        steps: Primitives a walk.
    """
    rows: list[tuple[str, ...]] = []
    for name, library in libraries:
        env = gymnasium.make(
            "mplearn/PrimitiveHumanoid-v0", library=library, disable_env_checker=True
        )
        repertoire = env.unwrapped.repertoire  # type: ignore[attr-defined]
        feasible = sum(repertoire.skills.feasibility(id).feasible for id in library.ids)
        known = f"{feasible} of {len(library)}"
        rows += [
            _row((name, str(seed), known), walk(env, RandomWalk(), steps, seed)) for seed in seeds
        ]
        env.close()
    return Table(
        f"Random walks of {steps} primitives, performed by the robot",
        COLUMNS,
        tuple(rows),
        "By the transition prior, at half the human's speed, in simulation. Primitives that exceed "
        "what the robot can do are masked.",
    )


def _row(head: tuple[str, ...], result: WalkResult) -> tuple[str, ...]:
    moved = [step for step in result.steps if step.primitive is not None]
    return (
        *head,
        str(len(result.primitives)),
        str(len(set(result.primitives))),
        str(result.falls),
        f"{result.duration_s:.0f} s",
        f"{np.degrees(max(step.tracking_rmse_rad for step in moved)):.2f} deg",
        f"{100 * max(step.cog_deviation_m for step in moved):.2f} cm",
        f"{100 * min(step.zmp_margin_m for step in moved):.1f} cm",
    )
