"""The person of `rigs`, written as AMC with its ASF, as MVNX, as poses of SMPL and of
Theia, and as coordinates of OpenSim.

All hang in a T pose, x forward, y left, z up; what they do is what the BVH rigs do.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from c3d_poses import write_c3d_poses
from rigs import Rig, _nodes, _zero_pose
from scipy.spatial.transform import Rotation

from mplearn.body.models.body import Body

UNIT_M = 0.0254 / 0.45  # of the CMU database


@dataclass(frozen=True)
class Limbs:
    """A tree of joints, J, over T frames.

    Attributes:
        names, parents: Of the joints, parents first.
        ends: Whether a joint is the end of a chain.
        rest: Where the joints are in the T pose, shape (J, 3) [m].
        places: Where they are, shape (T, J, 3) [m].
        turns: Rotation of each since the T pose, shape (T, J, 3, 3).
    """

    names: list[str]
    parents: list[int]
    ends: list[bool]
    rest: np.ndarray
    places: np.ndarray
    turns: np.ndarray

    def children(self, joint: int) -> list[int]:
        return [child for child, parent in enumerate(self.parents) if parent == joint]

    def local(self, joint: int) -> np.ndarray:
        """Rotation of a joint against its parent, shape (T, 3, 3)."""
        if self.parents[joint] < 0:
            return self.turns[:, joint]
        return self.turns[:, self.parents[joint]].transpose(0, 2, 1) @ self.turns[:, joint]


def limbs_of(body: Body, postures: np.ndarray, rig: Rig | None = None) -> Limbs:
    rig = rig or Rig()
    nodes = _nodes(body, postures, rig)
    rest = _nodes(body, _zero_pose(body, "T")[None], rig)
    names = [node.name if not node.is_end else f"{nodes[node.parent].name}_end" for node in nodes]
    return Limbs(
        names,
        [node.parent for node in nodes],
        [node.is_end for node in nodes],
        np.array([node.pos[0] for node in rest]),
        np.stack([node.pos for node in nodes], axis=1),
        np.stack([n.mat @ r.mat[0].T for n, r in zip(nodes, rest, strict=True)], axis=1),
    )


def write_amc_of(path: Path, limbs: Limbs, seed: int = 0) -> Path:
    """Write an AMC and the ASF beside it: y up, degrees, each bone with axes of its own.

    A bone turns at its near end. Where several hang on one joint, the joint's bone has no length
    and bones that do not turn lead from it to the next ones, as CMU's ``lhipjoint``.
    """
    rng = np.random.default_rng(seed)
    to_file = np.array([[0.0, 1.0, 0.0], [0.0, 0.0, 1.0], [1.0, 0.0, 0.0]])
    bones: list[str] = []
    hierarchy: dict[str, list[str]] = {}
    columns: list[tuple[str, np.ndarray]] = []

    def bone(name: str, parent: str, vector: np.ndarray, turn: np.ndarray | None) -> None:
        vector = to_file @ vector / UNIT_M
        length = float(np.linalg.norm(vector))
        axis = rng.uniform(-60, 60, 3)
        axes = Rotation.from_euler("xyz", axis, degrees=True)
        direction = vector / length if length else np.array([1.0, 0.0, 0.0])
        words = [" ".join(f"{x:.9f}" for x in v) for v in (direction, axis)]
        dof = "" if turn is None else "    dof rx ry rz\n"
        bones.append(
            f"  begin\n    id {len(bones) + 1}\n    name {name}\n    direction {words[0]}\n"
            f"    length {length:.9f}\n    axis {words[1]} XYZ\n{dof}  end\n"
        )
        hierarchy.setdefault(parent, []).append(name)
        if turn is not None:
            own = axes.inv() * Rotation.from_matrix(to_file @ turn @ to_file.T) * axes
            columns.append((name, own.as_euler("xyz", degrees=True)))

    def hang(joint: int, parent: str) -> None:
        """Hang a joint's bone on the one that ends where it is, and all below on that."""
        name = limbs.names[joint]
        below = limbs.children(joint)
        along = limbs.rest[below[0]] - limbs.rest[joint] if len(below) == 1 else np.zeros(3)
        bone(name, parent, along, limbs.local(joint))
        for child in below:
            lead(joint, child, name, alone=len(below) == 1)

    def lead(joint: int, child: int, name: str, *, alone: bool) -> None:
        if not alone:
            bone(
                f"{name}_to_{limbs.names[child]}",
                name,
                limbs.rest[child] - limbs.rest[joint],
                None,
            )
        if not limbs.ends[child]:
            hang(child, name if alone else f"{name}_to_{limbs.names[child]}")

    root = Rotation.from_matrix(to_file @ limbs.turns[:, 0] @ to_file.T)
    places = limbs.places[:, 0] @ to_file.T / UNIT_M
    columns.append(("root", np.concatenate([places, root.as_euler("xyz", degrees=True)], axis=1)))
    for child in limbs.children(0):
        lead(0, child, "root", alone=False)
    lines = "".join(f"    {name} {' '.join(children)}\n" for name, children in hierarchy.items())
    path.with_suffix(".asf").write_text(
        ":version 1.10\n:name rig\n:units\n  mass 1.0\n  length 0.45\n  angle deg\n:root\n"
        "  order TX TY TZ RX RY RZ\n  axis XYZ\n  position 0 0 0\n  orientation 0 0 0\n"
        f":bonedata\n{''.join(bones)}:hierarchy\n  begin\n{lines}  end\n"
    )
    frames = [":FULLY-SPECIFIED\n:DEGREES\n"]
    for t in range(len(places)):
        rows = (f"{name} {' '.join(f'{x:.6f}' for x in values[t])}\n" for name, values in columns)
        frames.append(f"{t + 1}\n{''.join(rows)}")
    path.write_text("".join(frames))
    return path


def write_mvnx_of(path: Path, limbs: Limbs, rate_hz: float) -> Path:
    """Write MVNX: world's positions and orientations of the segments, points on them."""
    segments = [joint for joint, end in enumerate(limbs.ends) if not end]

    def text(values: np.ndarray) -> str:
        return " ".join(f"{x:.6f}" for x in np.ravel(values))

    points: dict[int, list[str]] = {joint: [] for joint in segments}
    joints = []
    for joint, parent in enumerate(limbs.parents):
        if parent < 0:
            continue
        name, above = limbs.names[joint], limbs.names[parent]
        place = text(limbs.rest[joint] - limbs.rest[parent])
        points[parent].append(f'<point label="p{name}"><pos_b>{place}</pos_b></point>')
        if not limbs.ends[joint]:
            joints.append(
                f'<joint label="j{name}"><connector1>{above}/p{name}</connector1>'
                f"<connector2>{name}/p{name}</connector2></joint>"
            )
    listed = "".join(
        f'<segment label="{limbs.names[joint]}" id="{i}"><points>{"".join(points[joint])}</points>'
        "</segment>"
        for i, joint in enumerate(segments, 1)
    )
    turns = limbs.turns[:, segments]
    quaternions = Rotation.from_matrix(turns.reshape(-1, 3, 3)).as_quat(scalar_first=True)
    quaternions = quaternions.reshape(len(turns), -1)
    frames = "".join(
        f'<frame time="{1000 * t / rate_hz:.0f}" index="{t}" type="normal"><orientation>'
        f"{text(quaternions[t])}</orientation><position>{text(limbs.places[t, segments])}"
        "</position></frame>\n"
        for t in range(len(turns))
    )
    path.write_text(
        f'<mvnx version="4"><subject label="rig" frameRate="{rate_hz:g}"><segments>{listed}'
        f"</segments><joints>{''.join(joints)}</joints><frames>{frames}</frames></subject></mvnx>"
    )
    return path


SMPL_PARTS = (
    *("Hips", "LeftUpLeg", "RightUpLeg", "Spine", "LeftLeg", "RightLeg", "Spine", "LeftFoot"),
    *("RightFoot", "Spine1", "LeftToe", "RightToe", "Neck", "LeftShoulder", "RightShoulder"),
    *("Neck", "LeftArm", "RightArm", "LeftForeArm", "RightForeArm", "LeftHand", "RightHand"),
)
"""What of a plain rig each of SMPL's 22 joints turns with."""
SMPL_PARENTS = (-1, 0, 0, 0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 9, 9, 12, 13, 14, 16, 17, 18, 19)


def write_smpl_of(path: Path, limbs: Limbs, rate_hz: float) -> Path:
    """Write the poses of a plain rig as AMASS has them; lengths of bones are not in the file."""
    to_ours = np.array([[0.0, 0.0, 1.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]])
    world = [limbs.turns[:, limbs.names.index(part)] for part in SMPL_PARTS]
    poses = np.zeros((len(limbs.turns), 52, 3))
    for joint, parent in enumerate(SMPL_PARENTS):
        if parent < 0:
            turn = world[joint] @ to_ours
        else:
            turn = to_ours.T @ world[parent].transpose(0, 2, 1) @ world[joint] @ to_ours
        poses[:, joint] = Rotation.from_matrix(turn).as_rotvec()
    np.savez(
        path,
        poses=poses.reshape(len(poses), -1),
        trans=limbs.places[:, 0],
        mocap_framerate=rate_hz,
    )
    return path


THEIA_PARTS = {
    "worldbody": "",
    "head": "Neck",
    "torso": "Spine1",
    **{
        f"{letter}_{segment}": f"{side}{part}"
        for letter, side in (("l", "Left"), ("r", "Right"))
        for segment, part in (
            *(("uarm", "Arm"), ("larm", "ForeArm"), ("hand", "Hand"), ("thigh", "UpLeg")),
            *(("shank", "Leg"), ("foot", "Foot"), ("toes", "Toe")),
        )
    },
    "pelvis": "Hips",
    "pelvis_shifted": "Hips",
}
"""What of a plain rig each of Theia's segments turns with."""


def theia_poses(limbs: Limbs) -> np.ndarray:
    """How Theia's segments lie in its world (x right, y ahead, z up), shape (T, S, 4, 4) [mm]."""
    to_file = np.array([[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])
    poses = np.tile(np.eye(4), (len(limbs.turns), len(THEIA_PARTS), 1, 1))
    for k, (segment, part) in enumerate(THEIA_PARTS.items()):
        if not part:
            continue
        joint = limbs.names.index(part)
        place = limbs.places[:, joint]
        if segment == "torso":  # it begins between the shoulders
            sides = [limbs.names.index(f"{side}Arm") for side in ("Left", "Right")]
            place = limbs.places[:, sides].mean(axis=1)
        poses[:, k, :3, :3] = to_file @ limbs.turns[:, joint] @ to_file.T
        poses[:, k, :3, 3] = 1000.0 * place @ to_file.T
    return poses


def write_theia_of(path: Path, limbs: Limbs, rate_hz: float) -> Path:
    """Write the poses of a plain rig's segments as Theia has them in C3D files."""
    labels = [f"{segment}_4X4" for segment in THEIA_PARTS]
    return write_c3d_poses(path, theia_poses(limbs), labels, rate_hz=rate_hz)


def opensim_coordinates(limbs: Limbs) -> dict[str, np.ndarray]:
    """Coordinates of Rajagopal's model [rad, m]: it turns about z, x, y, from arms that hang."""
    to_file = np.array([[1.0, 0.0, 0.0], [0.0, 0.0, 1.0], [0.0, -1.0, 0.0]])
    found = {}

    def add(names: str, turns: np.ndarray, side: float = 1.0) -> None:
        angles = Rotation.from_matrix(to_file @ turns @ to_file.T).as_euler("ZXY")
        for name, angle in zip(names.split(), angles.T * [[1.0], [side], [side]], strict=False):
            found[name] = -angle if name.startswith("knee") else angle

    def against(part: str, other: str) -> np.ndarray:
        one, below = (limbs.turns[:, limbs.names.index(name)] for name in (other, part))
        return one.transpose(0, 2, 1) @ below

    add("pelvis_tilt pelvis_list pelvis_rotation", limbs.turns[:, 0])
    add("lumbar_extension lumbar_bending lumbar_rotation", against("Spine1", "Hips"))
    hips = [limbs.names.index(f"{side}UpLeg") for side in ("Left", "Right")]
    origin = limbs.places[:, hips].mean(axis=1) + limbs.turns[:, 0] @ [0.07, 0.0, 0.066]
    for axis, values in zip("xyz", (origin @ to_file.T).T, strict=True):
        found[f"pelvis_t{axis}"] = values
    for side, letter, sign in (("Left", "l", -1.0), ("Right", "r", 1.0)):
        hang = Rotation.from_euler("x", 90.0 * sign, degrees=True).as_matrix()
        legs = [f"{side}{part}" for part in ("UpLeg", "Leg", "Foot")]
        add(f"hip_flexion_{letter} hip_adduction_{letter} hip_rotation_{letter}",
            against(legs[0], "Hips"), sign)  # fmt: skip
        add(f"knee_angle_{letter}", against(legs[1], legs[0]))
        add(f"ankle_angle_{letter}", against(legs[2], legs[1]))
        arm = against(f"{side}Arm", "Spine1") @ hang.T
        add(f"arm_flex_{letter} arm_add_{letter} arm_rot_{letter}", arm, sign)
        add(f"elbow_flex_{letter}", hang @ against(f"{side}ForeArm", f"{side}Arm") @ hang.T)
    return found


def write_mot_of(path: Path, limbs: Limbs, rate_hz: float) -> Path:
    """Write a plain rig as coordinates of OpenSim's models, in degrees."""
    found = opensim_coordinates(limbs)
    lines = ["Coordinates", "version=1", f"nRows={len(limbs.turns)}", f"nColumns={len(found) + 1}"]
    lines += ["inDegrees=yes", "", "Units are S.I. units (second, meters, Newtons, ...)", ""]
    lines += ["endheader", "\t".join(["time", *found])]
    table = [x if name[-3:-1] == "_t" else np.degrees(x) for name, x in found.items()]
    lines += [
        "\t".join([f"{t / rate_hz:.5f}", *(f"{x:.7f}" for x in row)])
        for t, row in enumerate(np.transpose(table))
    ]
    path.write_text("\n".join(lines) + "\n")
    return path
