"""JSON, a line each: first what the robot is, then a line a frame."""

from __future__ import annotations

import json
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from mplearn.errors import RecordingError

from ..format import Format, Reading, in_order
from ..motion import RobotMotion
from ..robot_model import RobotModel


class NDJSON(Format):
    """See the module's docstring."""

    name = "ndjson"
    about = "JSON lines: a header with names, units and rate, then a line a frame (m, wxyz, rad)"
    suffix = ".ndjson"

    def write(self, path: Path, motions: Sequence[RobotMotion], model: RobotModel) -> None:
        """Write one motion."""
        (motion,) = motions
        header = {
            "type": "robot_motion",
            "name": motion.name,
            "robot": model.name,
            "rate_hz": motion.rate_hz,
            "units": {"root_pos": "m", "root_quat": "wxyz", "joint_pos": "rad", "t": "s"},
            "joints": list(motion.joint_names),
            "spans": [span._asdict() for span in motion.spans],
        }
        parts = (motion.times_s, motion.root_pos, motion.root_quat, motion.joint_pos)
        with path.open("w", encoding="utf-8") as file:
            file.write(json.dumps(header) + "\n")
            for t, pos, quat, joints in zip(
                *(part.round(9).tolist() for part in parts), strict=True
            ):
                frame = {"t": t, "root_pos": pos, "root_quat": quat, "joint_pos": joints}
                file.write(json.dumps(frame, separators=(",", ":")) + "\n")

    def read(self, path: Path, model: RobotModel) -> tuple[Reading, ...]:
        """Return the motion of a file; joints go by their names."""
        try:
            lines = [json.loads(line) for line in path.read_text("utf-8").splitlines() if line]
            header, frames = lines[0], lines[1:]
            order = in_order(path, "joint", header["joints"], model.joint_names)
            parts = [
                np.array([frame[key] for frame in frames], dtype=np.float64)
                for key in ("root_pos", "root_quat", "joint_pos", "t")
            ]
            rate_hz = float(header["rate_hz"])
        except (ValueError, KeyError, IndexError, TypeError) as error:
            raise RecordingError(f"{path}: no motion in JSON lines: {error!r}") from error
        pos, quat, joints, times = parts
        if joints.ndim == 2 and joints.shape[1] == len(header["joints"]):
            joints = joints[:, order]
        return (Reading(rate_hz, pos, quat, joints, times_s=times).require(path, model),)
