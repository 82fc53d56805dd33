"""AMC without its ASF: CMU's degrees of freedom, and dm_control's CMU humanoid [dm_control]."""

from __future__ import annotations

import itertools
import tempfile
import warnings
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np

from ...maths.rotations import quaternion_to_matrix
from ...recording import FloatArray, Recording, marker_channels
from ..files import bad_file, cmu_subject, stem
from ..findings import Findings
from ..placing.size import CMU_UNIT_M
from ..placing.space import checked_markers, file_axes, to_z_up
from ..reader import Hints
from .asf import ASFSkeleton, rotations_of
from .kinematics import Joint, joint_positions, skeleton_of, with_axes
from .skeletal import Column, SkeletalMotion, angle_channels

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


def _turning_joints() -> Iterator[Joint]:
    for bone, columns in itertools.groupby(enumerate(CMU_COLUMNS), lambda item: item[1].joint):
        indexed = list(columns)
        rotations = rotations_of(tuple(column for _, column in indexed), indexed[0][0])
        yield Joint(bone, -1, np.zeros(3), rotations)


CMU_SKELETON = ASFSkeleton(CMU_COLUMNS, tuple(_turning_joints()), CMU_UNIT_M, True)
"""What every skeleton of the database has in common: which joint turns how, but no bones."""

_DM_CONTROL_AXES = to_z_up("z", "-y")  # parse_amc turns y to z and leaves x: a person faces -y


def cmu_humanoid_recording(
    path: Path, motion: SkeletalMotion, hints: Hints, findings: Findings, *, positions: bool
) -> Recording:
    """Return a motion of the CMU database whose skeleton is not known.

    Args:
        path: The AMC file.
        motion: Values of `CMU_SKELETON`.
        hints: What the caller says.
        findings: What came to light so far.
        positions: Whether to return where dm_control's CMU humanoid has its joints as it performs
            the motion, instead of the angles.

    Raises:
        RecordingError: There are fewer than the 4 frames that ``parse_amc.convert`` needs.
    """
    unit_m, up = hints.unit_m or motion.space.unit_m, hints.up_axis or "y"
    findings.note("no ASF lies beside it: taken for one of the CMU database")
    skeleton = None
    if not positions:
        channels, frames = angle_channels(path, motion, file_axes(up, "y", "z"), unit_m)
    else:
        if len(motion.values) < 4:
            raise bad_file(
                path, f"{len(motion.values)} frames and no ASF", "at least 4 frames, or its ASF"
            )
        if np.isnan(motion.values).any():
            raise bad_file(path, "a value is nan and no ASF", "a number in each cell, or its ASF")
        qpos, model = _converted(motion.values)
        findings.note("the bones are those of dm_control's CMU humanoid, not the person's")
        joints = tuple(_joint(model, body) for body in range(1, model.nbody))
        joints = with_axes(joints) if hints.joint_axes else joints
        local = joint_positions(joints, qpos)  # (T, J, 3), the root at the origin
        points = (
            np.einsum("tij,tkj->tki", quaternion_to_matrix(qpos[:, 3:7]), local) + qpos[:, None, :3]
        ) @ _DM_CONTROL_AXES.T
        names = tuple(joint.name for joint in joints)
        checked_markers(path, points, names)
        channels, frames = marker_channels(names), points.reshape(len(points), -1)
        skeleton = skeleton_of(joints, qpos, _DM_CONTROL_AXES)
    return Recording(
        frames,
        motion.rate_hz,
        channels,
        stem(path),
        cmu_subject(stem(path)),
        skeleton=skeleton,
        report=findings.report(motion.rate_hz, unit_m, up),
    )


def _converted(values: FloatArray) -> tuple[FloatArray, Any]:
    """Return dm_control's positions of the humanoid's joints, shape (T, 63), and its model."""
    per_unit = [180.0 / np.pi if column.rotates else 1.0 for column in CMU_COLUMNS]
    lines = [
        f"{number}\nroot {' '.join(map(repr, frame))}\n"
        for number, frame in enumerate((values * per_unit).tolist(), start=1)
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
