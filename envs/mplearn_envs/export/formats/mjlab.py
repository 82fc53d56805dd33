"""The npz from which mjlab and BeyondMimic (whole_body_tracking) train trackers.

``fps`` (one number in an array), ``joint_pos``, ``joint_vel`` (T, n), ``body_pos_w`` (T, B, 3),
``body_quat_w`` (T, B, 4) w, x, y, z, ``body_lin_vel_w``, ``body_ang_vel_w`` (T, B, 3): link frames
of all bodies but the world, in MuJoCo's order (depth first), velocities of the links' origins in
the world's frame; 50 Hz, single precision. ``joint_names`` and ``body_names`` are ours, and what
loaders do not know they leave alone.

Their loader checks nothing. In Isaac Lab bodies and joints come breadth first: a file of that order
trains to nothing in MuJoCo.
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from ..format import Format, Reading
from ..motion import RobotMotion
from ..robot_model import RobotModel
from .npz import arrays, keys, rate

_ARRAYS = (
    "joint_pos",
    "joint_vel",
    "body_pos_w",
    "body_quat_w",
    "body_lin_vel_w",
    "body_ang_vel_w",
)


class MjlabNPZ(Format):
    """See the module's docstring."""

    name = "mjlab"
    about = "npz for mjlab and BeyondMimic: 50 Hz, joints and bodies in MuJoCo's order, wxyz"
    suffix = ".npz"

    def write(self, path: Path, motions: Sequence[RobotMotion], model: RobotModel) -> None:
        """Write one motion."""
        (motion,) = motions
        posture = (motion.root_pos, motion.root_quat, motion.joint_pos)
        bodies = model.forward(*posture)
        velocities = model.velocities(*posture, motion.rate_hz)
        values = (
            motion.joint_pos,
            velocities.joint,
            *bodies,
            velocities.linear,
            velocities.angular,
        )
        content: dict[str, Any] = {
            name: value.astype(np.float32) for name, value in zip(_ARRAYS, values, strict=True)
        }
        content["fps"] = np.array([motion.rate_hz])
        content["joint_names"] = np.array(model.joint_names)
        content["body_names"] = np.array(model.body_names)
        with path.open("wb") as file:  # to a name in capitals numpy appends its own
            np.savez(file, **content)

    def read(self, path: Path, model: RobotModel) -> tuple[Reading, ...]:
        """Return the motion of a file."""
        found = arrays(path, ("fps", *_ARRAYS))
        joint_pos, joint_vel, pos, quat, linear, angular = (found[name] for name in _ARRAYS)
        return (
            Reading(
                rate(path, found["fps"]),
                pos[:, 0] if pos.ndim == 3 else pos,
                quat[:, 0] if quat.ndim == 3 else quat,
                joint_pos,
                pos,
                quat,
                joint_vel,
                linear,
                angular,
            ).require(path, model),
        )

    def accepts(self, path: Path) -> bool:
        """Whether it is an npz with bodies in the world."""
        return super().accepts(path) and "body_pos_w" in keys(path)
