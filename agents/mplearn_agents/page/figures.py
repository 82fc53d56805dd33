"""Figures on the page: which shapes a body is made of, and where they are in a posture."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from mplearn.body import feature_channels, human_body, posture_of, robot_body
from mplearn.errors import InvalidValueError
from mplearn.library import PrimitiveLibrary
from mplearn.maths.rotations import matrix_to_quaternion
from mplearn.recording import FloatArray

from .messages import Poses

if TYPE_CHECKING:
    import mujoco

    from mplearn.body import KinematicTree

CLIP_HZ = 30.0
_SEEN_GROUPS = 3  # geoms from this group on are for contact, not to be seen
_KINDS = {2: "sphere", 3: "capsule", 4: "ellipsoid", 5: "cylinder", 6: "box"}
#: Bodies of the human that the robot lacks, and which of its turn as they do.
_LIKE = {"abdomen": "pelvis", "clavicle_l": "chest", "clavicle_r": "chest"}


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


def human_poses(features: FloatArray, channels: Sequence[str]) -> Poses:
    """Return where the bodies of a human figure are that does what the robot's features say.

    Each segment is turned as the robot's is, whatever the joints in between; the soles are as high
    above the floor as the robot's, in proportion.

    Args:
        features: Shape (T, D).
        channels: Names of the D channels, among them the robot's.

    Returns:
        Shape (T, B, 7): position [m] and quaternion.
    """
    robot, human = robot_body().tree, human_body().tree
    order = [list(channels).index(name) for name in feature_channels()]
    postures = posture_of(features[:, order])
    larger = human.offset[0, 2] / robot.offset[0, 2]
    turns, soles_z = _turns_and_soles(robot, postures)
    turns = turns[:, [robot.body(_LIKE.get(name, name)) for name in human.body_names]]
    places = np.empty(turns.shape[:3])
    places[:, 0] = postures[:, :3] * larger
    for body, parent in enumerate(human.parent):
        if parent >= 0:
            places[:, body] = places[:, parent] + turns[:, parent] @ human.offset[body]
    soles = _soles(human)
    at, under = human.site_body[soles], human.site_offset[soles]
    lowest = (places[:, at] + np.einsum("tsij,sj->tsi", turns[:, at], under))[..., 2].min(axis=1)
    places[..., 2] += (larger * soles_z - lowest)[:, None]
    return np.concatenate((places, matrix_to_quaternion(turns)), axis=2, dtype=np.float32)


def motions_of(library: PrimitiveLibrary, id: int) -> list[Poses]:
    """Return the motion of a primitive as a human figure does it, then its demonstrations.

    Args:
        library: What is known.
        id: The primitive.

    Returns:
        Poses at `CLIP_HZ`, shape (T, B, 7) each.

    Raises:
        InvalidValueError: The library's channels are no body's.
        UnknownPrimitiveError: There is no such primitive.
    """
    primitive, rate_hz = library[id], library.rate_hz
    if not has_figure(library.channels):
        raise InvalidValueError("these channels are no body's: there is no figure to show")
    poses = []
    for motion in (library.generate([id]).frames, *primitive.exemplars):
        n = max(2, round(len(motion) / rate_hz * CLIP_HZ))
        at = np.linspace(0, len(motion) - 1, n).round().astype(np.int64)
        poses.append(human_poses(motion[at], library.channels))
    return poses


def _turns_and_soles(tree: KinematicTree, postures: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return the bodies' orientations, (T, B, 3, 3), and how high the lowest sole is, (T,) [m]."""
    soles = _soles(tree)
    at, under = tree.site_body[soles], tree.site_offset[soles]
    turns = np.empty((len(postures), len(tree.body_names), 3, 3))
    heights = np.empty(len(postures))
    for t, posture in enumerate(postures):
        places, turns[t] = tree.forward(posture)
        heights[t] = (places[at, 2] + np.einsum("sj,sj->s", turns[t, at, 2], under)).min()
    return turns, heights


def _soles(tree: KinematicTree) -> list[int]:
    return [i for i, name in enumerate(tree.site_names) if name.startswith("sole_")]
