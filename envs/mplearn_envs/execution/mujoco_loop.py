"""MuJoCo's steps in one compiled loop, which leaves Python to other threads meanwhile."""

from __future__ import annotations

import ctypes
from pathlib import Path
from typing import Any, NamedTuple

import llvmlite.binding
import mujoco
from numba import njit, types

from mplearn.errors import RobotError
from mplearn.recording import FloatArray, IntArray
from mplearn_envs.control.ankle_feedback import AnkleFeedback, correct

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


class Views(NamedTuple):
    """What the loop sees of a simulation: MuJoCo's own memory; names are those of ``MjData``."""

    ctrl: FloatArray
    qpos: FloatArray
    qvel: FloatArray
    subtree_com: FloatArray
    subtree_linvel: FloatArray
    xpos: FloatArray
    xmat: FloatArray
    xaxis: FloatArray
    xfrc_applied: FloatArray

    @classmethod
    def of(cls, data: mujoco.MjData) -> Views:
        """Return views of a simulation's state."""
        return cls(*(getattr(data, name) for name in cls._fields))


@njit(cache=True, nogil=True)
def send(
    model: int,
    data: int,
    views: Views,
    feet: IntArray,
    commands: FloatArray,
    law: AnkleFeedback,
    wanted: FloatArray,
    first: int,
    last: int,
    q: FloatArray,
    v: FloatArray,
) -> tuple[int, bool]:
    """Send the commands between two of a plan's K + 1 reference postures, or until a fall.

    Args:
        model: Address of the model.
        data: Address of its state.
        views: Views of that.
        feet: Bodies of the feet, shape (2,).
        commands: All servo commands of the plan, shape (N, n) [rad].
        law: What corrects them; one without wanted values corrects nothing.
        wanted: Reference postures, shape (K + 1, 7 + n).
        first: Where the robot is in the plan.
        last: Where to stop.
        q: Filled with the postures at the reference postures after the first, (K + 1, 7 + n).
        v: Filled with the velocities there, (K + 1, 6 + n).

    Returns:
        Where it stopped, and whether because the robot had fallen there.
    """
    n_steps = commands.shape[0] // (wanted.shape[0] - 1)
    guided = law.wanted.shape[0] > 0
    for knot in range(first + 1, last + 1):
        for step in range((knot - 1) * n_steps, knot * n_steps):
            views.ctrl[:] = commands[step]
            if guided:  # by how the robot stands now: what is performed depends on its state alone
                mj_step1(model, data)
                mj_subtree_velocity(model, data)
                correct(
                    law,
                    step,
                    views.ctrl,
                    views.subtree_com[1],
                    views.subtree_linvel[1],
                    views.xpos[feet[0]],
                    views.xpos[feet[1]],
                    views.xmat[feet[0]],
                    views.xmat[feet[1]],
                    views.xaxis,
                )
                mj_step2(model, data)
            else:
                _mj_step(model, data)
        q[knot], v[knot] = views.qpos, views.qvel
        if has_fallen(q[knot], wanted[knot], FALL_DROP_M):
            return knot, True
    return last, False
