"""What share of pushes at the chest a robot survives by taking steps, standing and in motion."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from mplearn.evaluation.table import Table
from mplearn.library import PrimitiveLibrary
from mplearn_envs.execution.bodies import Body
from mplearn_envs.execution.reflexes import Pushes
from mplearn_envs.execution.simulation import Simulation
from mplearn_envs.mechanics import Reference, reference_robot, rest_reference
from mplearn_envs.robot import Robot, humanoid
from mplearn_envs.skills.skills import Skills

from .model_error import disturb

PUSH_S = 0.1
DIRECTIONS = (
    "forward",
    "forward left",
    "left",
    "backward left",
    "backward",
    "backward right",
    "right",
    "forward right",
)
_HOLD_S = 1.0
_AFTER_S = 1.0


class Pushed(NamedTuple):
    """What came of one push.

    Attributes:
        direction: Which of `DIRECTIONS`.
        doing: What the robot did meanwhile: "standing", or a primitive's name.
        survived: Whether it still stands after it has come to rest and held for a second.
        n_steps: How many steps it took.
        took_s: How long it took until it stood as before [s].
    """

    direction: int
    doing: str
    survived: bool
    n_steps: int
    took_s: float


def pushed(
    library: PrimitiveLibrary,
    impulse_ns: float,
    n_each: int,
    seed: int = 0,
    *,
    standing: bool = False,
    error: float = 0.1,
    robot: Robot | None = None,
    chest: str = "chest",
) -> list[Pushed]:
    """Push a robot in eight directions, several times each.

    Args:
        library: Primitives; each push comes at a random moment of a random one that the robot can
            perform at half the human's speed.
        impulse_ns: Impulse of each push, over 0.1 s [N s].
        n_each: Pushes in each direction.
        seed: Of moments, primitives and model errors.
        standing: Whether it is pushed while it stands instead.
        error: Largest error of its belief in masses, gains and friction, as a share.
        robot: Who is pushed; None is the humanoid.
        chest: Body that is pushed, at its centre of mass.
    """
    robot = robot or humanoid()
    skills = Skills(library, robot)
    able = [id for id in library.ids if skills.feasibility(id).feasible]
    rng = np.random.default_rng(seed)
    out = []
    for _ in range(n_each):
        simulation = Simulation(robot, body=Body(steps=True))
        disturb(simulation.model, error, rng)
        body = simulation.model.body(chest).id
        for direction in range(len(DIRECTIONS)):
            simulation.reset()
            here = rest_reference(robot)
            id = None if standing else int(rng.choice(able))
            plan = skills.hold(here, _HOLD_S) if id is None else skills.plan(here, id)
            period_s = plan.duration_s / len(plan.commands)
            n_push = round(PUSH_S / period_s)
            start = int(rng.integers(max(len(plan.commands) - n_push, 1)))
            angle = 2.0 * np.pi * direction / len(DIRECTIONS)
            force = impulse_ns / PUSH_S * np.array([[np.cos(angle), np.sin(angle), 0.0]])
            push = Pushes(body, np.array([[start, start + n_push]]), force)
            report = simulation.perform(plan, pushes=push)
            end: Reference = report.end or plan.end
            survived = not report.fallen
            if survived:
                survived = not simulation.perform(skills.hold(end, _AFTER_S)).fallen
            name = "standing" if id is None else library[id].name
            took_s = report.duration_s - start * period_s
            out.append(Pushed(direction, name, survived, report.n_steps, took_s))
    return out


def survival_table(
    library: PrimitiveLibrary,
    impulses_ns: Sequence[float] = (24.0, 36.0, 48.0),
    n_each: int = 15,
    seed: int = 0,
    error: float = 0.1,
    robot: Robot | None = None,
    chest: str = "chest",
) -> Table:
    """Return which share of pushes is survived, by direction; arguments as of `pushed`."""
    robot = robot or humanoid()
    rows = []
    for impulse in impulses_ns:
        for standing in (True, False):
            found = pushed(
                library,
                impulse,
                n_each,
                seed,
                standing=standing,
                error=error,
                robot=robot,
                chest=chest,
            )
            shares = [
                f"{sum(p.survived for p in found if p.direction == d)}"
                for d in range(len(DIRECTIONS))
            ]
            alive = [p for p in found if p.survived]
            rows.append(
                (
                    f"{impulse:g}",
                    "standing" if standing else "in motion",
                    *shares,
                    f"{100.0 * len(alive) / len(found):.1f} %",
                    f"{np.mean([p.n_steps for p in alive]):.1f}" if alive else "-",
                    f"{np.median([p.took_s for p in alive]):.1f}" if alive else "-",
                )
            )
    mass = reference_robot(robot).tree.mass.sum()
    return Table(
        f"Pushes at the chest survived by steps, of {n_each} in each direction",
        ("impulse [N s]", "when", *DIRECTIONS, "survived", "steps", "back after [s]"),
        tuple(rows),
        f"Pushed for {PUSH_S} s; survived: it came back to its stance and stood for another "
        f"second. In motion: at a random moment of a random primitive. Masses, gains and friction "
        f"wrong by up to {100 * error:.0f} %. Back after: from the push to where the robot was to "
        f"be, median. The robot weighs {mass:.0f} kg.",
    )
