"""Motions to export, and files with one thing wrong."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np

from mplearn.recording import IntArray
from mplearn_envs.export import RobotModel, RobotMotion, export, format_of
from mplearn_envs.export.checking.faults import Mirror, breadth_first, joints_breadth_first
from mplearn_envs.export.format import Reading
from mplearn_envs.export.sidecar import sidecar_path

Corrupt = Callable[[RobotMotion, RobotModel], RobotMotion]


def degrees(motion: RobotMotion, model: RobotModel) -> RobotMotion:
    return replace(motion, joint_pos=np.degrees(motion.joint_pos))


def centimetres(motion: RobotMotion, model: RobotModel) -> RobotMotion:
    return replace(motion, root_pos=100.0 * motion.root_pos)


def other_quaternions(motion: RobotMotion, model: RobotModel) -> RobotMotion:
    return replace(motion, root_quat=np.roll(motion.root_quat, 1, axis=1))


def mirrored(motion: RobotMotion, model: RobotModel) -> RobotMotion:
    seen = Mirror(model).all(
        Reading(motion.rate_hz, motion.root_pos, motion.root_quat, motion.joint_pos)
    )
    return replace(
        motion, root_pos=seen.root_pos, root_quat=seen.root_quat, joint_pos=seen.joint_pos
    )


def breadth_first_joints(motion: RobotMotion, model: RobotModel) -> RobotMotion:
    return replace(motion, joint_pos=motion.joint_pos[:, joints_breadth_first(model)])


def swapped_joints(motion: RobotMotion, model: RobotModel) -> RobotMotion:
    moved = np.ptp(motion.joint_pos, axis=0)
    first, second = np.argsort(moved)[-2:]
    joints = motion.joint_pos.copy()
    joints[:, [first, second]] = joints[:, [second, first]]
    return replace(motion, joint_pos=joints)


def backward_joint(motion: RobotMotion, model: RobotModel) -> RobotMotion:
    sign = np.ones(len(model.joint_names))
    sign[np.ptp(motion.joint_pos, axis=0).argmax()] = -1.0
    return replace(motion, joint_pos=sign * motion.joint_pos)


def liveliest(motion: RobotMotion) -> int:
    return int(np.ptp(motion.joint_pos, axis=0).argmax())


def one_joint_in_degrees(motion: RobotMotion, model: RobotModel) -> RobotMotion:
    factor = np.ones(len(model.joint_names))
    factor[liveliest(motion)] = np.degrees(1.0)
    return replace(motion, joint_pos=factor * motion.joint_pos)


def other_zero(motion: RobotMotion, model: RobotModel) -> RobotMotion:
    off = np.zeros(len(model.joint_names))
    off[liveliest(motion)] = 0.3
    return replace(motion, joint_pos=motion.joint_pos + off)


def exchanged(motion: RobotMotion, model: RobotModel) -> RobotMotion:
    return replace(motion, root_pos=motion.root_pos[:, [1, 0, 2]])


def inches(motion: RobotMotion, model: RobotModel) -> RobotMotion:
    return replace(motion, root_pos=motion.root_pos / 0.0254)


def turned(motion: RobotMotion, model: RobotModel) -> RobotMotion:
    from scipy.spatial.transform import Rotation

    turn = Rotation.from_euler("z", 75, degrees=True)
    quat = turn * Rotation.from_quat(motion.root_quat, scalar_first=True)
    return replace(
        motion,
        root_pos=turn.apply(motion.root_pos),
        root_quat=quat.as_quat(scalar_first=True),
    )


def other_rate(motion: RobotMotion, model: RobotModel) -> RobotMotion:
    return replace(motion.resampled(2.0 * motion.rate_hz), rate_hz=motion.rate_hz)


def too_high(motion: RobotMotion, model: RobotModel) -> RobotMotion:
    return replace(motion, root_pos=motion.root_pos + np.array([0.0, 0.0, 0.12]))


def y_up(motion: RobotMotion, model: RobotModel) -> RobotMotion:
    from scipy.spatial.transform import Rotation

    turn = Rotation.from_euler("x", -90, degrees=True)
    quat = turn * Rotation.from_quat(motion.root_quat, scalar_first=True)
    return replace(
        motion,
        root_pos=turn.apply(motion.root_pos),
        root_quat=quat.as_quat(scalar_first=True),
    )


def kept(motion: RobotMotion, frames: slice | IntArray) -> RobotMotion:
    return replace(
        motion,
        root_pos=motion.root_pos[frames],
        root_quat=motion.root_quat[frames],
        joint_pos=motion.joint_pos[frames],
    )


def end_cut_off(motion: RobotMotion, model: RobotModel) -> RobotMotion:
    return kept(motion, slice(None, len(motion) * 2 // 3))


def begun_late(motion: RobotMotion, model: RobotModel) -> RobotMotion:
    return kept(motion, slice(len(motion) // 4, None))


#: Faults of the motion itself, which any format can hold: what is done, and what must be found.
OF_MOTIONS: dict[str, tuple[Corrupt, str]] = {
    "degrees": (degrees, "degrees"),
    "centimetres": (centimetres, "unit"),
    "quaternion order": (other_quaternions, "quaternion order"),
    "mirrored": (mirrored, "mirrored"),
    "joints breadth first": (breadth_first_joints, "joints permuted"),
    "two joints swapped": (swapped_joints, "joints permuted"),
    "rate": (other_rate, "rate"),
    "too high": (too_high, "place"),
    "y up": (y_up, "axes"),
    "one joint backward": (backward_joint, "mirrored"),
    "inches": (inches, "unit"),
    "turned": (turned, "axes"),
    "one joint in degrees": (one_joint_in_degrees, "degrees"),
    "zero of one joint": (other_zero, "zero"),
    "x and y exchanged": (exchanged, "axes"),
    "end cut off": (end_cut_off, "frames"),
    "begun late": (begun_late, "frames"),
}


def written(
    path: Path, motion: RobotMotion, model: RobotModel, name: str, corrupt: Corrupt | None = None
) -> Path:
    """Write a motion, and over it one that is wrong; what was meant stays beside it."""
    format = format_of(name)
    path = path / f"motion{format.suffix}"
    export([motion], model, format, path)
    if corrupt is not None:
        format.write(path, [corrupt(motion.resampled(format.rate_hz), model)], model)
    return path


def alone(path: Path) -> Path:
    """Take away what stands beside a file."""
    sidecar_path(path).unlink()
    return path


def change_arrays(path: Path, change: Callable[[dict[str, np.ndarray]], None]) -> None:
    """Change the arrays of an npz file."""
    with np.load(path) as file:
        arrays = dict(file)
    change(arrays)
    np.savez(path, **arrays)


BODY_ARRAYS = ("body_pos_w", "body_quat_w", "body_lin_vel_w", "body_ang_vel_w")


def of_arrays(model: RobotModel) -> dict[str, tuple[Callable[[dict[str, np.ndarray]], None], str]]:
    """Faults of mjlab's arrays: what is done, and what must be found, by the file alone."""
    n = len(model.body_names)
    shuffled = np.random.default_rng(3).permutation(n)

    def order(arrays: dict[str, np.ndarray], places: np.ndarray) -> None:
        for key in BODY_ARRAYS:
            arrays[key] = arrays[key][:, places]

    def breadth(arrays: dict[str, np.ndarray]) -> None:
        order(arrays, breadth_first(model))
        for key in ("joint_pos", "joint_vel"):
            arrays[key] = arrays[key][:, joints_breadth_first(model)]

    def scale(key: str, factor: float) -> Callable[[dict[str, np.ndarray]], None]:
        def change(arrays: dict[str, np.ndarray]) -> None:
            arrays[key] = arrays[key] * factor

        return change

    def quaternions(arrays: dict[str, np.ndarray]) -> None:
        arrays["body_quat_w"] = np.roll(arrays["body_quat_w"], -1, axis=-1)

    def both_degrees(arrays: dict[str, np.ndarray]) -> None:
        for key in ("joint_pos", "joint_vel"):
            arrays[key] = np.degrees(arrays[key])

    def swap(arrays: dict[str, np.ndarray]) -> None:
        for key in ("joint_pos", "joint_vel"):
            first, second = np.argsort(np.ptp(arrays["joint_pos"], axis=0))[-2:]
            arrays[key][:, [first, second]] = arrays[key][:, [second, first]]

    def own_frames(arrays: dict[str, np.ndarray]) -> None:
        from mplearn.maths.rotations import quaternion_to_matrix

        turn = quaternion_to_matrix(arrays["body_quat_w"].astype(float))
        for key in ("body_lin_vel_w", "body_ang_vel_w"):
            arrays[key] = np.einsum("tbji,tbj->tbi", turn, arrays[key])

    def of_masses(arrays: dict[str, np.ndarray]) -> None:
        from mplearn.maths.rotations import quaternion_to_matrix

        turn = quaternion_to_matrix(arrays["body_quat_w"].astype(float))
        arm = turn @ model.model.body_ipos[model.bodies][:, :, None]
        arrays["body_lin_vel_w"] += np.cross(arrays["body_ang_vel_w"], arm[..., 0])

    def left_for_right(arrays: dict[str, np.ndarray]) -> None:
        mirror = Mirror(model)
        for key in ("joint_pos", "joint_vel"):
            arrays[key] = arrays[key][:, mirror.joint] * mirror.sign

    return {
        "all breadth first": (breadth, "bodies permuted"),
        "bodies breadth first": (lambda a: order(a, breadth_first(model)), "bodies permuted"),
        "bodies shuffled": (lambda a: order(a, shuffled), "bodies permuted"),
        "bodies backwards": (lambda a: order(a, np.arange(n)[::-1]), "bodies permuted"),
        "quaternions xyzw": (quaternions, "quaternion order"),
        "degrees": (both_degrees, "degrees"),
        "angles alone in degrees": (scale("joint_pos", 180.0 / np.pi), "degrees"),
        "bodies in centimetres": (scale("body_pos_w", 100.0), "unit"),
        "bodies in millimetres": (scale("body_pos_w", 1000.0), "unit"),
        "two joints swapped": (swap, "joints permuted"),
        "fps": (scale("fps", 0.6), "rate"),
        "velocities a frame": (
            lambda a: [scale(k, 0.02)(a) for k in ("joint_vel", *BODY_ARRAYS[2:])] and None,
            "velocities",
        ),
        "velocities in degrees": (scale("joint_vel", 180.0 / np.pi), "velocities"),
        "velocities in own frames": (own_frames, "velocities"),
        "velocities of masses": (of_masses, "velocities"),
        "joints mirrored": (left_for_right, "mirrored"),
    }
