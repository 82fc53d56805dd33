"""How hard a push at the chest the robot survives."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from mplearn.evaluation.table import Table
from mplearn.maths.easing import minimum_jerk
from mplearn.recording import FloatArray
from mplearn_envs.execution.simulation import Feedback, Simulation
from mplearn_envs.mechanics import reference_robot, rest_reference
from mplearn_envs.planning import Motion, Plan, Planner
from mplearn_envs.robot import Robot, humanoid

PUSH_S = 0.1
RECOVERY_S = 2.5
DIRECTIONS = {
    "forward": (1.0, 0.0),
    "backward": (-1.0, 0.0),
    "left": (0.0, 1.0),
    "right": (0.0, -1.0),
    "forward left": (0.7071, 0.7071),
}
_SQUAT_M = 0.15
_LARGEST_NS = 80.0


def push_table(
    robot: Robot | None = None,
    chest: str = "chest",
    feedback: Sequence[Feedback] = ("never", "always"),
    resolution_ns: float = 0.5,
) -> Table:
    """Find the largest impulse at the chest after which the robot stands, by bisection.

    Args:
        robot: Who is pushed; None is the humanoid.
        chest: Name of the body that is pushed, at its centre of mass.
        feedback: How the ankles correct the balance, see `Simulation`.
        resolution_ns: How finely it is searched for [N s].
    """
    robot = robot or humanoid()
    planner = Planner(robot)
    rest = rest_reference(robot)
    down = np.stack((rest.target, rest.target))
    down[1, 0] -= _SQUAT_M
    x = minimum_jerk(np.linspace(0.0, 1.0, 101)[:, None])
    squat = planner.plan(rest, Motion(down[0] * (1 - x) + down[1] * x, 100.0), 0.5)
    stand = planner.hold(rest, 1.0)
    cases: list[tuple[str, Plan, int]] = [
        ("standing", stand, len(stand.q) - 1),
        ("amid a squat", squat, (len(squat.q) - 1) // 2),
    ]
    rows = []
    for name, plan, knot in cases:
        for kind in feedback:
            cells = []
            for direction in DIRECTIONS.values():
                trial = _Trial(robot, chest, planner, plan, knot, kind)
                cells.append(f"{trial.largest(np.array(direction), resolution_ns):.1f}")
            rows.append((name, kind, *cells))
    return Table(
        "Largest impulse at the chest that is survived [N s]",
        ("when", "ankle feedback", *DIRECTIONS),
        tuple(rows),
        f"Pushed for {PUSH_S} s, both feet down; still upright {RECOVERY_S} s later. "
        f"The robot weighs {reference_robot(robot).tree.mass.sum():.0f} kg.",
    )


class _Trial:
    """One situation, ready to be pushed in any way."""

    def __init__(
        self, robot: Robot, chest: str, planner: Planner, plan: Plan, knot: int, feedback: Feedback
    ) -> None:
        self.simulation = Simulation(robot, feedback)
        self.simulation.reset()
        self.body = self.simulation.model.body(chest).id
        self.simulation.perform(plan.part(0, knot))
        self.state = self.simulation.state()
        hold = planner.hold(plan.end, RECOVERY_S + PUSH_S)
        pushed = max(1, round(PUSH_S / plan.knot_s))
        last = len(plan.q) - 1
        if knot + pushed < last:
            self.plans = [plan.part(knot, knot + pushed), plan.part(knot + pushed, last), hold]
        else:
            self.plans = [hold.part(0, pushed), hold.part(pushed, len(hold.q) - 1)]

    def largest(self, direction: FloatArray, resolution_ns: float) -> float:
        """Return the largest impulse survived [N s], up to 80."""
        low, high = 0.0, _LARGEST_NS
        while high - low > resolution_ns:
            middle = 0.5 * (low + high)
            low, high = (middle, high) if self.survives(middle * direction) else (low, middle)
        return low

    def survives(self, impulse: FloatArray) -> bool:
        """Whether the robot still stands after an impulse, shape (2,) [N s]."""
        simulation = self.simulation
        simulation.load_state(self.state)
        for i, plan in enumerate(self.plans):
            simulation.data.xfrc_applied[self.body, :2] = impulse / PUSH_S if i == 0 else 0.0
            if simulation.perform(plan).fallen:
                simulation.data.xfrc_applied[:] = 0.0
                return False
        return True
