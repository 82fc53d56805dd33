"""What a robot performs of libraries learned from people, in any order."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

import numpy as np

from mplearn.evaluation.table import Table
from mplearn.library import PrimitiveLibrary
from mplearn_envs.robot import Robot, humanoid
from mplearn_envs.skills.skills import Skills

from .walks import Walk, go


def learned_table(
    libraries: Iterable[tuple[str, PrimitiveLibrary]],
    seeds: Sequence[int],
    n_primitives: int = 60,
    speed: float = 0.5,
    error: float = 0.1,
    robot: Robot | None = None,
) -> Table:
    """Return what is feasible of each library, why the rest is not, and walks in any order.

    Any primitive follows any other, which asks more of the robot than what was demonstrated: out of
    a squat it must raise a leg.

    Args:
        libraries: What was learned, by name.
        seeds: One walk each; masses, gains and friction are drawn anew for each.
        n_primitives: Primitives in a row.
        speed: As a share of the human's.
        error: Largest model error, as a share.
        robot: Who performs; None is the humanoid.
    """
    robot = robot or humanoid()
    rows = []
    for name, library in libraries:
        skills = Skills(library, robot, speed)
        verdicts = {id: skills.feasibility(id) for id in library.ids}
        able = [id for id, verdict in verdicts.items() if verdict.feasible]
        walks = [Walk(speed, lifting=True) for _ in seeds]
        for walk, seed in zip(walks, seeds, strict=True):
            if able:
                rng = np.random.default_rng(seed)
                go(walk, skills, able, n_primitives, error, rng, any_order=True)
        steps = [step for walk in walks for step in walk.steps]
        lifting = sum(skills[id].lifts for id in able)
        refused = (
            f"{library[id].name}: {verdict.problems[0]}"
            for id, verdict in verdicts.items()
            if not verdict.feasible
        )
        rows.append(
            (
                name,
                f"{len(able)} of {len(library)}",
                str(lifting),
                f"{len(walks)} x {max(len(walk.steps) for walk in walks)}",
                str(sum(bool(walk.fell) for walk in walks)),
                f"{100 * max((step[1] for step in steps), default=np.nan):.2f}",
                "; ".join(refused) or "-",
                f"{sum(walk.detours for walk in walks)} of {len(steps)}",
            )
        )
    return Table(
        f"What robot {robot.name!r} performs of what it learned from people",
        (
            *("learned from", "feasible", "lift a foot", "walks", "falls", "COG off [cm]"),
            *("refused", "stood up before"),
        ),
        tuple(rows),
        f"At {speed:g} of the human's speed; masses, gains and friction wrong by up to "
        f"{100 * error:.0f} %; any primitive follows any other; "
        "where it cannot begin at once the robot stands up before. "
        "Feet stand as far apart as they were shown, or as a step reaches.",
    )
