"""Figures on the page: which shapes a body is made of, and where they are in a posture."""

from __future__ import annotations

from collections.abc import Sequence
from functools import cache
from typing import TYPE_CHECKING, Any

import numpy as np

from mplearn.body import feature_channels, human_body, posture_of, robot_body
from mplearn.maths.rotations import matrix_to_quaternion
from mplearn.recording import FloatArray

from .messages import Poses

if TYPE_CHECKING:
    import mujoco

    from mplearn.body import KinematicTree

SMALLEST_M = 0.012  # shapes with a smaller radius (fingers' details) are not worth their drawing
_SEEN_GROUPS = 3  # geoms from this group on are for contact, not to be seen
_KINDS = {2: "sphere", 3: "capsule", 4: "ellipsoid", 5: "cylinder", 6: "box"}
#: The robot's joints whose names differ from the human's.
_HUMAN_NAMES = {"waist_yaw": "lumbar_yaw", "wrist_yaw_l": "forearm_yaw_l"} | {
    "wrist_yaw_r": "forearm_yaw_r"
}


def shapes_of(model: mujoco.MjModel) -> list[dict[str, Any]]:
    """Return the visible shapes of a model's bodies, as plain values.

    Each has ``body`` (0 is the first body below the world), ``kind``, ``size`` [m], ``pos`` [m] and
    ``quat`` in the body's frame, and the name of its ``material``.
    """
    shapes = []
    for i in range(model.ngeom):
        body, kind = int(model.geom_bodyid[i]) - 1, _KINDS.get(int(model.geom_type[i]))
        if body < 0 or kind is None or model.geom_group[i] >= _SEEN_GROUPS:
            continue
        material = int(model.geom_matid[i])
        shapes.append(
            {
                "body": body,
                "kind": kind,
                "size": [round(float(x), 5) for x in model.geom_size[i]],
                "pos": [round(float(x), 5) for x in model.geom_pos[i]],
                "quat": [round(float(x), 6) for x in model.geom_quat[i]],
                "material": model.material(material).name if material >= 0 else "",
            }
        )
    return shapes


def poses_of(tree: KinematicTree, postures: FloatArray) -> Poses:
    """Return where the bodies are, shape (T, B, 7): position [m] and quaternion.

    Args:
        tree: The kinematics.
        postures: Shape (T, 7 + n).
    """
    poses = np.empty((len(postures), len(tree.body_names), 7), np.float32)
    for t, posture in enumerate(postures):
        places, turns = tree.forward(posture)
        poses[t, :, :3] = places
        poses[t, :, 3:] = matrix_to_quaternion(turns)
    return poses


def has_figure(channels: Sequence[str]) -> bool:
    """Whether motions of these channels are a robot's, and so can be shown by a figure."""
    return set(feature_channels()) <= set(channels)


def human_postures(features: FloatArray, channels: Sequence[str]) -> FloatArray:
    """Return postures of the human body that do what the robot's features say, (T, 7 + n).

    Joints of the same meaning take the same angles; the soles are as high above the floor as the
    robot's, in proportion.

    Args:
        features: Shape (T, D).
        channels: Names of the D channels, among them the robot's.
    """
    robot, human = robot_body(), human_body()
    order = [list(channels).index(name) for name in feature_channels(robot)]
    features = features[:, order]
    of_robot = posture_of(features)
    q = np.tile(human.rest, (len(features), 1))
    larger = human.rest[2] / robot.rest[2]
    q[:, 2], q[:, 3:7] = features[:, 0] * larger, of_robot[:, 3:7]
    for theirs, mine in _joints():
        q[:, mine] = of_robot[:, theirs]
    for t in range(len(q)):
        lowest = _lowest_sole(robot.tree, of_robot[t]) * larger
        q[t, 2] += lowest - _lowest_sole(human.tree, q[t])
    return q


@cache
def _joints() -> tuple[tuple[int, int], ...]:
    """Return the joints that both bodies have: place in the robot's posture, and the human's."""
    robot, human = robot_body(), human_body()
    pairs = []
    for k, name in enumerate(robot.joint_names):
        mine = _HUMAN_NAMES.get(name, name)
        if mine in human.joint_names:
            pairs.append((7 + k, 7 + human.joint_names.index(mine)))
    return tuple(pairs)


def _lowest_sole(tree: KinematicTree, posture: FloatArray) -> float:
    soles = [i for i, name in enumerate(tree.site_names) if name.startswith("sole_")]
    return float(tree.site_positions(posture)[soles, 2].min())
