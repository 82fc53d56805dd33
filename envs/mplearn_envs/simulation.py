"""The robot in MuJoCo: it performs plans, and tells how it stands."""

from __future__ import annotations

from collections.abc import Callable
from functools import cached_property
from typing import Any, NamedTuple

import mujoco
import numpy as np

from mplearn.body.tree import quaternion_matrix
from mplearn.recording import BoolArray, FloatArray

from .control.planner import Plan
from .control.reference import rest_reference, sole_corners
from .control.support import convex_hull, support_margin, zero_moment_point
from .robot import Robot

SETTLE_S = 1.0
FALL_TILT_RAD = 0.6
FALL_DROP_M = 0.2
_STATE = mujoco.mjtState.mjSTATE_INTEGRATION


class Performance(NamedTuple):
    """What happened while a plan was performed, at its S reference postures (fewer after a fall).

    Attributes:
        time_s: Time since the start, shape (S,) [s].
        tracking_error_rad: Root mean square over the joints of actual minus wanted angle, (S,)
            [rad].
        cog_deviation_m: Distance of the COG's projection from the middle of the soles, (S,) [m].
        zmp_margin_m: Distance of the zero-moment point from the edge of the soles, (S,) [m].
        fallen: Whether the robot fell; the last sample is when.
        duration_s: How long it took [s].
    """

    time_s: FloatArray
    tracking_error_rad: FloatArray
    cog_deviation_m: FloatArray
    zmp_margin_m: FloatArray
    fallen: bool
    duration_s: float


class Simulation:
    """One robot on a floor.

    Args:
        robot: The robot.

    Attributes:
        model: The compiled model.
        data: Its state.
    """

    def __init__(self, robot: Robot) -> None:
        self.robot = robot
        self.model = mujoco.MjModel.from_xml_string(robot.xml)
        self.data = mujoco.MjData(self.model)
        self._corners = sole_corners(robot)
        self._feet = [self.model.body(name).id for name in robot.feet]

    @cached_property
    def _settled(self) -> FloatArray:
        """State of a robot that has stood still for a second; every reset starts from it."""
        data = mujoco.MjData(self.model)
        rest = rest_reference(self.robot).q
        data.qpos[:] = rest
        data.ctrl[:] = rest[7:]
        for _ in range(round(SETTLE_S / self.model.opt.timestep)):
            mujoco.mj_step(self.model, data)
        data.time = 0.0
        return self._state_of(data)

    def reset(self) -> None:
        """Put the robot to its standing posture, at rest."""
        self.load_state(self._settled)

    def state(self) -> FloatArray:
        """Return all that the future depends on (``mjSTATE_INTEGRATION``)."""
        return self._state_of(self.data)

    def load_state(self, state: FloatArray) -> None:
        """Go on from what `state` returned, bit for bit."""
        mujoco.mj_setState(self.model, self.data, state, _STATE)
        self._update_positions()

    def perform(
        self, plan: Plan, on_frame: Callable[[], None] | None = None, frame_steps: int = 10
    ) -> Performance:
        """Send a plan's commands to the servos and simulate.

        Args:
            plan: What to perform.
            on_frame: Called every ``frame_steps`` steps, to take pictures.
            frame_steps: See there.
        """
        model, data = self.model, self.data
        step, control, force = mujoco.mj_step, data.ctrl, data.qfrc_constraint[:6]
        n_knots = len(plan.q) - 1
        n_steps = len(plan.commands) // n_knots
        q, cog = np.empty((n_knots, model.nq)), np.empty((n_knots, 3))
        ground = np.zeros((n_knots, 6))  # sums over a knot's steps: single ones flutter
        next_frame, fallen, done = frame_steps, False, n_knots
        for knot in range(n_knots):
            reaction = ground[knot]
            for command in plan.commands[knot * n_steps : (knot + 1) * n_steps]:
                control[:] = command
                step(model, data)
                reaction += force
            q[knot], cog[knot] = data.qpos, data.subtree_com[1]
            if on_frame is not None and (knot + 1) * n_steps >= next_frame:
                next_frame += frame_steps
                self._update_positions()
                on_frame()
            if knot % 5 == 4 and self._has_fallen(plan.q[knot + 1]):
                fallen, done = True, knot + 1
                break
        fallen = fallen or self._has_fallen(plan.q[-1])
        self._update_positions()
        return self._performance(plan, q[:done], cog[:done], ground[:done] / n_steps, fallen)

    def _performance(
        self, plan: Plan, q: FloatArray, cog: FloatArray, ground: FloatArray, fallen: bool
    ) -> Performance:
        turn = np.array([quaternion_matrix(x) for x in q[:, 3:7]])
        moment = np.einsum("kij,kj->ki", turn, ground[:, 3:])  # free joints turn in their own frame
        zmp = zero_moment_point(ground[:, :3], moment, q[:, :3])
        soles = self.soles()[..., :2].reshape(-1, 2)
        time = np.arange(1.0, len(q) + 1.0) * plan.knot_s
        error = q[:, 7:] - plan.q[1 : len(q) + 1, 7:]
        return Performance(
            time,
            np.sqrt(np.mean(error**2, axis=1)),
            np.linalg.norm(cog[:, :2] - soles.mean(axis=0), axis=1),
            np.nan_to_num(support_margin(convex_hull(soles), zmp), nan=-1.0),
            fallen,
            float(time[-1]),
        )

    def soles(self) -> FloatArray:
        """Return the lower corners of both soles, shape (2, 4, 3) [m]."""
        turn = self.data.xmat[self._feet].reshape(2, 3, 3)
        return np.asarray(
            np.einsum("sij,scj->sci", turn, self._corners) + self.data.xpos[self._feet][:, None]
        )

    def posture(self) -> FloatArray:
        """Return base height [m], roll, pitch and the joint angles [rad], shape (3 + n,)."""
        w, x, y, z = self.data.qpos[3:7]
        roll = np.arcsin(np.clip(2 * (y * z + w * x), -1.0, 1.0))
        pitch = np.arctan2(2 * (w * y - x * z), 1 - 2 * (x * x + y * y))
        return np.concatenate(([self.data.qpos[2], roll, pitch], self.data.qpos[7:]))

    def velocity(self) -> FloatArray:
        """Return velocities, shape (6 + n,).

        Linear [m/s], x along the heading; angular [rad/s], base's frame; joints' [rad/s].
        """
        out = self.data.qvel.copy()
        out[:2] = self._heading() @ out[:2]
        return np.asarray(out)

    def balance(self) -> tuple[FloatArray, float]:
        """Return how the COG stands over the feet.

        Returns:
            The COG from the middle of the soles, x along the heading, shape (3,) [m]; and the
            distance of its projection from the edge of the support polygon [m], negative outside.
            Those corners of the soles support that are less than 1.5 cm above the floor; -1 if
            fewer than three do.
        """
        corners = self.soles().reshape(8, 3)
        cog = self.data.subtree_com[1].copy()
        down: BoolArray = corners[:, 2] < 0.015
        margin = -1.0
        if np.count_nonzero(down) >= 3:
            margin = float(support_margin(convex_hull(corners[down, :2]), cog[:2]))
        cog[:2] = self._heading() @ (cog[:2] - corners[:, :2].sum(axis=0) / 8.0)
        return cog, margin

    def _heading(self) -> FloatArray:
        """Return the (2, 2) matrix that turns vectors of the floor into the base's heading."""
        w, x, y, z = self.data.qpos[3:7]
        yaw = np.arctan2(2 * (w * z - x * y), 1 - 2 * (x * x + z * z))
        c, s = np.cos(yaw), np.sin(yaw)
        return np.array([[c, s], [-s, c]])

    def _has_fallen(self, wanted: FloatArray) -> bool:
        """Whether the base is far from upright or from its height, or not finite."""
        upright = _up(self.data.qpos) @ _up(wanted) > np.cos(FALL_TILT_RAD)
        return not (upright and self.data.qpos[2] > wanted[2] - FALL_DROP_M)

    def _update_positions(self) -> None:
        """Bring poses up to the state, which a step leaves one step behind."""
        mujoco.mj_kinematics(self.model, self.data)
        mujoco.mj_comPos(self.model, self.data)
        mujoco.mj_camlight(self.model, self.data)

    def _state_of(self, data: mujoco.MjData) -> FloatArray:
        out = np.empty(mujoco.mj_stateSize(self.model, _STATE))
        mujoco.mj_getState(self.model, data, out, _STATE)
        return out

    def __getstate__(self) -> dict[str, Any]:
        return {"robot": self.robot, "state": self.state()}

    def __setstate__(self, state: dict[str, Any]) -> None:
        Simulation.__init__(self, state["robot"])
        self.load_state(state["state"])


def _up(q: FloatArray) -> FloatArray:
    """Return the vertical in the base's frame, shape (3,)."""
    w, x, y, z = q[3:7]
    return np.array([2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)])
