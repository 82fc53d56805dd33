"""Export what a robot performs in a format of one's own: here, a table with a header.

python examples/own_format.py
"""

import tempfile
from pathlib import Path

import numpy as np

from mplearn_envs.export import (
    Format,
    Reading,
    RobotModel,
    check,
    export,
    format_of,
    perform,
    register_format,
)
from mplearn_envs.robot import humanoid


class Table(Format):
    """Tab-separated columns with their names, 100 Hz."""

    name = "table"
    about = "a table with a header: m, quaternion wxyz, rad"
    suffix = ".tsv"
    rate_hz = 100.0

    def write(self, path, motions, model):
        (motion,) = motions
        names = ("x", "y", "z", "qw", "qx", "qy", "qz", *motion.joint_names)
        rows = np.hstack((motion.root_pos, motion.root_quat, motion.joint_pos))
        np.savetxt(path, rows, fmt="%.9g", delimiter="\t", header="\t".join(names), comments="")

    def read(self, path, model):  # for `mplearn export --check`
        rows = np.loadtxt(path, delimiter="\t", skiprows=1)
        return (Reading(self.rate_hz, rows[:, :3], rows[:, 3:7], rows[:, 7:]),)


register_format(Table())  # now `--to table` is known, too

motion = perform(None, humanoid(), ("bow down", "bow up")).motions[0]
model = RobotModel.of(humanoid())
with tempfile.TemporaryDirectory() as folder:
    (path,) = export([motion], model, format_of("table"), Path(folder) / "bow.tsv")
    verdict = check(path, model)[0]
print(f"{len(motion)} frames, off by {verdict.misfit.position_m:.1e} m")
assert verdict.in_order
