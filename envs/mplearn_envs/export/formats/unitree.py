"""CSV of Unitree's retargeted motions: LAFAN1 for the G1, and what scripts after it read.

No header; a row a frame: x, y, z [m], a quaternion x, y, z, w, the joints in the model's order
[rad]. Nothing in the file says the rate: those who read it take 30 Hz.
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from mplearn.errors import RecordingError

from ..format import Format, Reading
from ..motion import RobotMotion
from ..robot_model import RobotModel


class UnitreeCSV(Format):
    """See the module's docstring."""

    name = "unitree"
    about = (
        "CSV without a header: m, quaternion xyzw, rad, 30 Hz (Unitree's LAFAN1, mjlab's script)"
    )
    suffix = ".csv"
    rate_hz = 30.0

    def write(self, path: Path, motions: Sequence[RobotMotion], model: RobotModel) -> None:
        """Write one motion."""
        (motion,) = motions
        table = np.hstack((motion.root_pos, motion.root_quat[:, [1, 2, 3, 0]], motion.joint_pos))
        np.savetxt(path, table, fmt="%.9g", delimiter=",")

    def read(self, path: Path, model: RobotModel) -> tuple[Reading, ...]:
        """Return the motion of a file."""
        width = 7 + len(model.joint_names)
        try:
            lines = path.read_text(encoding="utf-8").split("\n")
            if not any(map(str.strip, lines)):
                raise ValueError("it is empty")
            table = np.loadtxt(lines, delimiter=",", ndmin=2)
        except ValueError as error:
            raise RecordingError(
                f"{path}: not rows of numbers without a header: {error}"
            ) from error
        if table.shape[1] != width:
            raise RecordingError(
                f"{path}: rows of {table.shape[1]} numbers; robot {model.name!r} has {width}: "
                f"x, y, z, a quaternion, {len(model.joint_names)} joints"
            )
        quat = table[:, [6, 3, 4, 5]]
        return (Reading(self.rate_hz, table[:, :3], quat, table[:, 7:]).require(path, model),)
