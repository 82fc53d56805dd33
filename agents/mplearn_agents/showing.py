"""A robot shows primitives one after another, whatever the graph says, and may be pushed."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from mplearn.errors import InvalidValueError, RobotError
from mplearn.library import PrimitiveLibrary
from mplearn.recording import FloatArray
from mplearn_envs.execution.bodies import Body
from mplearn_envs.execution.reflexes import NO_PUSHES, Pushes
from mplearn_envs.execution.simulation import Simulation
from mplearn_envs.execution.tracking_report import TrackingReport
from mplearn_envs.experiments.survival import DIRECTIONS, PUSH_S
from mplearn_envs.mechanics import rest_reference
from mplearn_envs.planning.plan import Plan
from mplearn_envs.robot import Robot
from mplearn_envs.skills.skills import Skills

from .walk import HOLD, WalkResult, WalkStep

STAND = "hold"  # to stand still, instead of a primitive
_STAND_S = 1.0
_RATE_HZ = 25.0


@dataclass(frozen=True)
class Push:
    """A push at the chest.

    Attributes:
        impulse_ns: Over 0.1 s [N s].
        direction: Where to, one of `mplearn_envs.experiments.survival.DIRECTIONS`, as the robot
            looks at the start.

    Raises:
        InvalidValueError: The impulse is not positive and finite, or there is no such direction.
    """

    impulse_ns: float
    direction: str = DIRECTIONS[0]

    def __post_init__(self) -> None:
        if not 0.0 < self.impulse_ns < np.inf:
            raise InvalidValueError(f"impulse_ns must be positive, not {self.impulse_ns!r}")
        if self.direction not in DIRECTIONS:
            raise InvalidValueError(
                f"direction must be one of {DIRECTIONS}, not {self.direction!r}"
            )


def show(
    library: PrimitiveLibrary,
    robot: Robot,
    wanted: Sequence[str | int],
    *,
    speed: float = 0.5,
    push: Push | None = None,
) -> WalkResult:
    """Let the robot perform primitives in simulation, and come to rest; its postures are recorded.

    It begins as the environment does, standing upright with arms hanging, and goes from one to the
    next as it plans there: into another stance by steps, where that is another one. The rest of a
    show after a fall is left out.

    Args:
        library: The primitives.
        robot: Who performs.
        wanted: Names or ids of primitives; `STAND` is to stand still for a second.
        speed: Share of the human's speed.
        push: Comes amid each of them; the robot takes steps where it would fall otherwise.

    Raises:
        UnknownPrimitiveError: There is no such primitive.
        RobotError: The robot cannot perform one of them, with the reason.
    """
    skills = Skills(library, robot, speed)
    ids = [None if key == STAND else library[key].id for key in wanted]
    for id in ids:
        verdict = None if id is None else skills.feasibility(id)
        if id is not None and verdict is not None and not verdict.feasible:
            reasons = "; ".join(map(str, verdict.problems))
            raise RobotError(f"{robot.name!r} cannot perform {library[id].name!r}: {reasons}")
    simulation = Simulation(robot, body=Body(steps=push is not None))
    simulation.reset()
    here = rest_reference(robot)
    steps: list[WalkStep] = []
    postures: list[FloatArray] = []
    step_of: list[int] = []

    def keep() -> None:
        postures.append(simulation.data.qpos.copy())
        step_of.append(len(steps))

    for id in [*ids, None]:
        plan = skills.hold(here, _STAND_S) if id is None else skills.plan(here, id)
        period_s = plan.duration_s / len(plan.commands)
        last = len(steps) == len(ids)
        pushes = NO_PUSHES if push is None or last else _amid(push, plan, simulation, robot)
        every = round(1.0 / (_RATE_HZ * period_s))
        report = simulation.perform(plan, keep, every, pushes)
        steps.append(_step(id, STAND if id is None else library[id].name, report))
        here = report.end or plan.end
        if report.fallen:
            break
    return WalkResult(tuple(steps), np.array(postures), np.array(step_of, dtype=np.int64), _RATE_HZ)


def _amid(push: Push, plan: Plan, simulation: Simulation, robot: Robot) -> Pushes:
    period_s = plan.duration_s / len(plan.commands)
    first, n = len(plan.commands) // 2, round(PUSH_S / period_s)
    angle = 2.0 * np.pi * DIRECTIONS.index(push.direction) / len(DIRECTIONS)
    force = push.impulse_ns / PUSH_S * np.array([[np.cos(angle), np.sin(angle), 0.0]])
    bodies = dict(robot.segments)
    body = simulation.model.body(bodies.get("chest", bodies["pelvis"])).id
    return Pushes(body, np.array([[first, first + n]]), force)


def _step(id: int | None, name: str, report: TrackingReport) -> WalkStep:
    stepped = f", {report.n_steps} steps" if report.n_steps else ""
    return WalkStep(
        action=HOLD,
        primitive=id,
        name=name + stepped,
        duration_s=report.duration_s,
        reward=0.0,
        illegal=False,
        fallen=report.fallen,
        tracking_rmse_rad=float(np.sqrt(np.mean(report.tracking_error_rad**2))),
        cog_deviation_m=float(report.cog_deviation_m.max()),
        zmp_margin_m=float(report.zmp_margin_m.min()),
    )
