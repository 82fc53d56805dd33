"""The dictionary that GMR saves, as an npz without pickles.

``fps``, ``root_pos`` (T, 3) [m], ``root_rot`` (T, 4) x, y, z, w, ``dof_pos`` (T, n) [rad],
``local_body_pos`` (T, B, 3): the bodies seen from a base at the origin that is not turned, and
``link_body_list``, their names. 30 Hz.
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from mplearn.recording import FloatArray

from ..format import Format, Reading
from ..motion import RobotMotion
from ..robot_model import RobotModel
from .npz import arrays, keys, rate

_NEEDED = ("fps", "root_pos", "root_rot", "dof_pos")


class GMRNPZ(Format):
    """See the module's docstring."""

    name = "gmr"
    about = "npz with the keys of GMR: root_pos, root_rot xyzw, dof_pos, 30 Hz, no pickle"
    suffix = ".npz"
    rate_hz = 30.0

    def write(self, path: Path, motions: Sequence[RobotMotion], model: RobotModel) -> None:
        """Write one motion."""
        (motion,) = motions
        with path.open("wb") as file:  # to a name in capitals numpy appends its own
            np.savez(
                file,
                fps=np.array(motion.rate_hz),
                root_pos=motion.root_pos,
                root_rot=motion.root_quat[:, [1, 2, 3, 0]],
                dof_pos=motion.joint_pos,
                local_body_pos=seen_from_the_base(model, motion.joint_pos).astype(np.float32),
                link_body_list=np.array(model.body_names),
                joint_names=np.array(model.joint_names),
            )

    def read(self, path: Path, model: RobotModel) -> tuple[Reading, ...]:
        """Return the motion of a file."""
        found = arrays(path, _NEEDED)
        return (
            Reading(
                rate(path, found["fps"]),
                found["root_pos"],
                found["root_rot"][..., [3, 0, 1, 2]],
                found["dof_pos"],
                found.get("local_body_pos"),
                local=True,
            ).require(path, model),
        )

    def accepts(self, path: Path) -> bool:
        """Whether it is an npz with GMR's names."""
        return super().accepts(path) and {"root_rot", "dof_pos"} <= keys(path)


def seen_from_the_base(model: RobotModel, joint_pos: FloatArray) -> FloatArray:
    """Return where bodies are seen from the base, shape (T, B, 3) [m]."""
    still = np.tile([1.0, 0.0, 0.0, 0.0], (len(joint_pos), 1))
    return model.forward(np.zeros((len(joint_pos), 3)), still, joint_pos).pos
