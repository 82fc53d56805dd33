"""MuJoCo's steps in one compiled loop, which leaves Python to other threads meanwhile."""

from __future__ import annotations

import ctypes
from pathlib import Path
from typing import Any, NamedTuple

import llvmlite.binding
import mujoco
import numpy as np
from numba import types

from mplearn.errors import RobotError
from mplearn.maths.compiling import kernel
from mplearn.recording import FloatArray, IntArray
from mplearn_envs.control.ankle_feedback import AnkleFeedback, correct
from mplearn_envs.mechanics.views import Views

from .tracking_report import FALL_DROP_M, has_fallen


def _of_mujoco(name: str) -> Any:
    """Return a function of MuJoCo's library that takes model and data, for compiled code."""
    folder = Path(mujoco.__file__).parent
    found = [path for path in folder.iterdir() if path.stem.removeprefix("lib") == "mujoco"]
    found += sorted(folder.glob("libmujoco.*"))
    if not found:
        raise RobotError(f"MuJoCo's library is not in {folder}: install the package mujoco anew")
    function = getattr(ctypes.CDLL(str(found[0])), name)
    llvmlite.binding.add_symbol(name, ctypes.cast(function, ctypes.c_void_p).value)
    signature = types.void(types.intp, types.intp)
    return types.ExternalFunction(name, signature)


_mj_step = _of_mujoco("mj_step")
mj_step1 = _of_mujoco("mj_step1")  # poses and velocities of the state
mj_step2 = _of_mujoco("mj_step2")  # what follows from them and the commands
mj_subtree_velocity = _of_mujoco("mj_subtreeVel")
mj_inverse = _of_mujoco("mj_inverse")  # the forces that make an acceleration


class Simulated(NamedTuple):
    """A simulation, for compiled code.

    Attributes:
        model: Address of the model.
        data: Address of its state.
        views: Views of that.
    """

    model: int
    data: int
    views: Views

    @classmethod
    def of(cls, model: mujoco.MjModel, data: mujoco.MjData, feet: IntArray) -> Simulated:
        """Return a simulation of a robot with these bodies as feet."""
        return cls(model._address, data._address, Views.of(data, feet))


class Track(NamedTuple):
    """What a robot did at a plan's K + 1 reference postures; filled as it goes on.

    Attributes:
        q: Postures, shape (K + 1, 7 + n).
        v: Velocities, shape (K + 1, 6 + n).
    """

    q: FloatArray
    v: FloatArray

    @classmethod
    def begin(cls, data: mujoco.MjData, n_knots: int) -> Track:
        """Return a track that begins where the robot stands."""
        track = cls(
            np.empty((n_knots + 1, len(data.qpos))), np.empty((n_knots + 1, len(data.qvel)))
        )
        track.q[0], track.v[0] = data.qpos, data.qvel
        return track


@kernel
def send(
    robot: Simulated,
    commands: FloatArray,
    wanted: FloatArray,
    law: AnkleFeedback,
    track: Track,
    first: int,
    last: int,
) -> tuple[int, bool]:
    """Send the commands between two of a plan's K + 1 reference postures, or until a fall.

    Args:
        robot: The simulated robot.
        commands: All servo commands of the plan, shape (N, n) [rad].
        wanted: Reference postures, shape (K + 1, 7 + n).
        law: What corrects them; one without wanted values corrects nothing.
        track: Filled after the first.
        first: Where the robot is in the plan.
        last: Where to stop.

    Returns:
        Where it stopped, and whether because the robot had fallen there.
    """
    views = robot.views
    n_steps = commands.shape[0] // (wanted.shape[0] - 1)
    guided = law.wanted.shape[0] > 0
    for knot in range(first + 1, last + 1):
        for step in range((knot - 1) * n_steps, knot * n_steps):
            views.ctrl[:] = commands[step]
            if guided:  # by how the robot stands now: what is performed depends on its state alone
                mj_step1(robot.model, robot.data)
                mj_subtree_velocity(robot.model, robot.data)
                correct(law, step, views)
                mj_step2(robot.model, robot.data)
            else:
                _mj_step(robot.model, robot.data)
        track.q[knot], track.v[knot] = views.qpos, views.qvel
        if has_fallen(track.q[knot], wanted[knot], FALL_DROP_M):
            return knot, True
    return last, False
