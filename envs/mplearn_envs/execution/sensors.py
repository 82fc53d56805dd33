"""How a robot stands, measured on its simulated state in one go."""

from __future__ import annotations

from typing import NamedTuple

import mujoco
import numpy as np

from mplearn.maths.compiling import njit
from mplearn.maths.plane import turn_in_plane
from mplearn.maths.yaw_roll_pitch import roll_pitch_of, yaw_of
from mplearn.recording import FloatArray, IntArray
from mplearn_envs.mechanics.support import convex_hull, support_margin
from mplearn_envs.robot.feet import TOUCHES_M, sole_corners

from .simulation import Simulation


class Measured(NamedTuple):
    """How the robot stands; vectors of the floor are turned into the base's heading.

    Attributes:
        posture: Base height [m], roll, pitch and the joint angles [rad], shape (3 + n,).
        velocity: Linear [m/s], x along the heading; angular [rad/s], base's frame; the joints'
            [rad/s]; shape (6 + n,).
        cog: COG from the middle of the soles, x along the heading, shape (3,) [m].
        support_margin: Distance of the COG's projection from the edge of the support polygon,
            negative outside, -1 where fewer than three corners of the soles are down; (1,) [m].
        bodies: Origin of every body from the middle of the soles on the floor, x along the heading,
            shape (B, 3) [m]; body 0 is the world.

    Example:
        >>> from mplearn_envs.execution.simulation import Simulation
        >>> from mplearn_envs.robot import humanoid
        >>> simulation = Simulation(humanoid())
        >>> simulation.reset()
        >>> measured = Sensors(simulation).read()
        >>> measured.posture.shape, measured.velocity.shape, measured.cog.shape
        ((33,), (36,), (3,))
    """

    posture: FloatArray
    velocity: FloatArray
    cog: FloatArray
    support_margin: FloatArray
    bodies: FloatArray


class Sensors:
    """Measures a simulation.

    Args:
        simulation: The robot; its poses must be up to date.

    Example:
        >>> from mplearn_envs.execution.simulation import Simulation
        >>> from mplearn_envs.robot import humanoid
        >>> simulation = Simulation(humanoid())
        >>> simulation.reset()
        >>> measured = Sensors(simulation).read()
        >>> bool(0.7 < measured.posture[0] < 1.0), bool(measured.support_margin[0] > 0)
        (True, True)
    """

    def __init__(self, simulation: Simulation) -> None:
        self.simulation = simulation
        robot = simulation.robot
        self._feet = np.array([simulation.model.body(name).id for name in robot.feet])
        self._corners = sole_corners(simulation.model)

    def at(self, q: FloatArray, velocity: FloatArray | None = None) -> Measured:
        """Put the robot into a posture and measure it there.

        Args:
            q: Posture, shape (7 + n,).
            velocity: Its velocity, shape (6 + n,); None is none.
        """
        model, data = self.simulation.model, self.simulation.data
        data.qpos[:] = q
        data.qvel[:] = 0.0 if velocity is None else velocity
        mujoco.mj_kinematics(model, data)
        mujoco.mj_comPos(model, data)
        mujoco.mj_comVel(model, data)
        mujoco.mj_camlight(model, data)
        return self.read()

    def read(self) -> Measured:
        """Return how the robot stands, in fresh arrays."""
        data = self.simulation.data
        posture, velocity, cog, bodies, down = _read(
            data.qpos,
            data.qvel,
            data.subtree_com[1],
            data.xpos,
            data.xmat,
            self._feet,
            self._corners,
        )
        margin = np.array([-1.0])
        if len(down) >= 3:
            margin[0] = support_margin(convex_hull(down), cog[:2])
        return Measured(posture, velocity, cog, margin, bodies)


@njit(cache=True)
def _read(
    qpos: FloatArray,
    qvel: FloatArray,
    com: FloatArray,
    xpos: FloatArray,
    xmat: FloatArray,
    feet: IntArray,
    corners: FloatArray,
) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray, FloatArray]:
    """Return posture, velocity, COG, bodies, and the soles' corners that are down, (S, 2) [m]."""
    yaw = yaw_of(qpos[3:7])
    soles = np.empty((8, 3))
    for side in range(2):
        for k in range(4):
            for i in range(3):
                soles[4 * side + k, i] = xpos[feet[side], i]
                for j in range(3):
                    soles[4 * side + k, i] += xmat[feet[side], 3 * i + j] * corners[side, k, j]
    middle_x, middle_y = soles[:, 0].mean(), soles[:, 1].mean()

    posture = np.empty(qpos.shape[0] - 4)
    posture[0] = qpos[2]
    posture[1], posture[2] = roll_pitch_of(qpos[3:7])
    posture[3:] = qpos[7:]
    velocity = qvel.copy()
    velocity[0], velocity[1] = turn_in_plane(qvel[0], qvel[1], -yaw)
    cog = com.copy()
    cog[0], cog[1] = turn_in_plane(com[0] - middle_x, com[1] - middle_y, -yaw)
    bodies = np.empty_like(xpos)
    for b in range(xpos.shape[0]):
        x, y = turn_in_plane(xpos[b, 0] - middle_x, xpos[b, 1] - middle_y, -yaw)
        bodies[b, 0], bodies[b, 1], bodies[b, 2] = x, y, xpos[b, 2]
    down = np.empty((8, 2))
    n = 0
    for k in range(8):
        if soles[k, 2] < TOUCHES_M:
            x, y = turn_in_plane(soles[k, 0] - middle_x, soles[k, 1] - middle_y, -yaw)
            down[n, 0], down[n, 1] = x, y
            n += 1
    return posture, velocity, cog, bodies, down[:n].copy()
