"""AMC without its ASF: CMU's degrees of freedom, and dm_control's CMU humanoid [dm_control]."""

from __future__ import annotations

import tempfile
import warnings
from pathlib import Path
from typing import Any

import numpy as np

from ..maths.rotations import quaternion_to_matrix
from ..recording import FloatArray, Recording, marker_channels
from .files import bad_file, cmu_subject, stem
from .kinematics import Joint, joint_positions, skeleton_of, with_axes
from .skeletal import Column
from .space import checked_markers, to_z_up

CMU_UNIT_M = 0.0254 / 0.45
"""Length of the unit of length of CMU's files [m]."""

_CMU_DOFS = (
    "root: tx ty tz rx ry rz, lowerback: rx ry rz, upperback: rx ry rz, thorax: rx ry rz, "
    "lowerneck: rx ry rz, upperneck: rx ry rz, head: rx ry rz, "
    "rclavicle: ry rz, rhumerus: rx ry rz, rradius: rx, rwrist: ry, rhand: rx rz, rfingers: rx, "
    "rthumb: rx rz, lclavicle: ry rz, lhumerus: rx ry rz, lradius: rx, lwrist: ry, lhand: rx rz, "
    "lfingers: rx, lthumb: rx rz, rfemur: rx ry rz, rtibia: rx, rfoot: rx rz, rtoes: rx, "
    "lfemur: rx ry rz, ltibia: rx, lfoot: rx rz, ltoes: rx"
)

CMU_COLUMNS = tuple(
    Column(bone, "xyz".index(dof[1]), dof[0] == "r", bone == "root")
    for bone, dofs in (entry.split(": ") for entry in _CMU_DOFS.split(", "))
    for dof in dofs.split()
)
"""What the 62 numbers of a frame mean for every skeleton of the CMU database."""

_DM_CONTROL_AXES = to_z_up("z", "-y")  # parse_amc turns y to z and leaves x: a person faces -y


def cmu_humanoid_positions(
    path: Path, angles: FloatArray, rate_hz: float, unit_m: float, *, axes: bool = False
) -> Recording:
    """Return the joint positions of dm_control's CMU humanoid as it performs a motion.

    Args:
        path: The AMC file.
        angles: Its values in the order of `CMU_COLUMNS`, shape (T, 62) [m] [rad].
        rate_hz: Frames per second [1/s].
        unit_m: Unit that the translations were converted with [m].
        axes: Whether to show how joints are turned; see `Hints`.

    Raises:
        RecordingError: There are fewer than the 4 frames that ``parse_amc.convert`` needs.
    """
    if len(angles) < 4:
        raise bad_file(path, f"{len(angles)} frames and no ASF", "at least 4 frames, or its ASF")
    qpos, model = _converted(angles, unit_m)
    joints = tuple(_joint(model, body) for body in range(1, model.nbody))
    joints = with_axes(joints) if axes else joints
    local = joint_positions(joints, qpos)  # (T, J, 3), the root at the origin
    turned = np.einsum("tij,tkj->tki", quaternion_to_matrix(qpos[:, 3:7]), local)
    points = turned + qpos[:, None, :3]
    points = points @ _DM_CONTROL_AXES.T
    names = tuple(joint.name for joint in joints)
    checked_markers(path, points, names)
    channels = marker_channels(names)
    frames = points.reshape(len(points), -1)
    skeleton = skeleton_of(joints, qpos, _DM_CONTROL_AXES)
    return Recording(
        frames, rate_hz, channels, stem(path), cmu_subject(stem(path)), skeleton=skeleton
    )


def _converted(angles: FloatArray, unit_m: float) -> tuple[FloatArray, Any]:
    """Return dm_control's positions of the humanoid's joints, shape (T, 63), and its model."""
    per_unit = [180.0 / np.pi if c.rotates else 1.0 / unit_m for c in CMU_COLUMNS]
    lines = [
        f"{number}\nroot {' '.join(map(repr, frame))}\n"
        for number, frame in enumerate((angles * per_unit).tolist(), start=1)
    ]
    # dm_control warns where there is no screen, and parse_amc leaves its file to the collector
    with tempfile.TemporaryDirectory() as folder, warnings.catch_warnings():
        warnings.simplefilter("ignore")
        from dm_control import mujoco
        from dm_control.suite import humanoid_CMU
        from dm_control.suite.utils import parse_amc

        plain = Path(folder) / "frames.amc"
        plain.write_text("".join(lines))
        physics = mujoco.Physics.from_xml_string(*humanoid_CMU.get_model_and_assets())
        converted = parse_amc.convert(str(plain), physics, parse_amc.MOCAP_DT)
    return converted.qpos.T, physics.model


def _joint(model: Any, body: int) -> Joint:
    name = model.id2name(body, "body")
    if body == 1:
        return Joint(name, -1, np.zeros(3))
    first = int(model.body_jntadr[body])
    hinges = range(first, first + int(model.body_jntnum[body]))
    return Joint(
        name,
        int(model.body_parentid[body]) - 1,
        np.array(model.body_pos[body]),
        tuple((np.array(model.jnt_axis[i]), int(model.jnt_qposadr[i])) for i in hinges),
        before=quaternion_to_matrix(model.body_quat[body]),
    )
