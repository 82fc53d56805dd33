"""Small valid files of every format, written here and not by what is tested."""

from __future__ import annotations

import gzip
import pickle
import struct
from collections.abc import Callable
from pathlib import Path

import numpy as np
from c3d_poses import write_c3d_poses

UI_PRMD_NAME = "m01_s01_e01_positions.txt"


def person(n_frames: int = 12, n_markers: int = 6, seed: int = 0) -> np.ndarray:
    """Markers (T, M, 3) [m] of something as large as a person that moves a little."""
    rng = np.random.default_rng(seed)
    rest = rng.uniform([-0.3, -0.4, 0.1], [0.3, 0.4, 1.8], (n_markers, 3))
    steps = rng.normal(0.0, 0.004, (n_frames, n_markers, 3))
    return rest + np.cumsum(steps, axis=0)


def write_ui_prmd(path: Path, points: np.ndarray | None = None) -> Path:
    points = person(n_markers=39) if points is None else points
    rows = (1000.0 * np.nan_to_num(points)).reshape(len(points), -1)
    path.write_text("".join(",".join(f"{x:.6f}" for x in row) + "\n" for row in rows))
    return path


def write_c3d(
    path: Path,
    points: np.ndarray | None = None,
    *,
    names: list[str] | None = None,
    rate_hz: float = 100.0,
    units: str = "mm",
    scale_to_file: float = 1000.0,
    extra: dict[tuple[str, str], list[str]] | None = None,
    analog: bool = False,
) -> Path:
    import ezc3d

    points = person() if points is None else points
    content = ezc3d.c3d()
    content["parameters"]["POINT"]["RATE"]["value"] = [rate_hz]
    content["parameters"]["POINT"]["LABELS"]["value"] = names or [
        f"M{i}" for i in range(points.shape[1])
    ]
    content["parameters"]["POINT"]["UNITS"]["value"] = [units]
    for (group, name), value in (extra or {}).items():
        content.add_parameter(group, name, value)
    data = np.ones((4, points.shape[1], len(points)))
    data[:3] = np.moveaxis(points * scale_to_file, 0, -1).swapaxes(0, 1)
    content["data"]["points"] = data
    if analog:
        content["parameters"]["ANALOG"]["RATE"]["value"] = [10.0 * rate_hz]
        content["parameters"]["ANALOG"]["LABELS"]["value"] = ["force"]
        content["data"]["analogs"] = np.ones((1, 1, 10 * len(points)))
    content.write(str(path))
    return path


def write_theia(path: Path) -> Path:
    """Poses of the trunk and the legs of somebody who stands and sways."""
    places = {"worldbody": (0.0, 0.0, 0.0), "pelvis": (0.0, 0.0, 950.0)}
    places |= {"torso": (0.0, 20.0, 1420.0), "head": (0.0, 30.0, 1560.0)}
    for side, sign in (("l", -1.0), ("r", 1.0)):
        for name, height in (("thigh", 900.0), ("shank", 480.0), ("foot", 80.0)):
            places[f"{side}_{name}"] = (90.0 * sign, 0.0, height)
        places[f"{side}_toes"] = (90.0 * sign, 150.0, 20.0)
    poses = np.tile(np.eye(4), (12, len(places), 1, 1))
    sway = 0.02 * np.sin(np.arange(12) / 5.0)[:, None, None]
    at = np.array(list(places.values()))
    poses[:, :, :3, 3] = at + sway * at[:, 2:]
    labels = [f"{name}_4X4" for name in places]
    return write_c3d_poses(path, poses, labels, rate_hz=100.0)


ASF = """# a skeleton
:version 1.10
:units
  mass 1.0
  length 0.45
  angle deg
:root
  order TX TY TZ RX RY RZ
  axis XYZ
  position 0 0 0
  orientation 0 0 0
:bonedata
  begin
    id 1
    name trunk
    direction 0 1 0
    length 9.0
    axis 0 0 0 XYZ
    dof rx ry rz
    limits (-30 40)
           (-30 30)
           (-30 30)
  end
  begin
    id 2
    name larm
    direction 0.8 -0.6 0
    length 10.0
    axis 10 20 -30 XYZ
    dof rz rx
  end
  begin
    id 3
    name thigh
    direction 0.34202 -0.939693 0
    length 7.95556
    axis 0 0 20 XYZ
    dof rx ry rz
  end
  begin
    id 4
    name shank
    direction 0 -1 0
    length 8
    axis -90 5 20 ZXY
    dof rx
  end
:hierarchy
  begin
    root trunk thigh
    trunk larm
    thigh shank
  end
"""
AMC_BONES = {"root": 6, "thigh": 3, "shank": 1, "trunk": 3, "larm": 2}


def write_asf(path: Path, text: str = ASF) -> Path:
    path.write_text(text)
    return path


def amc_values(n_frames: int = 12, seed: int = 0) -> np.ndarray:
    """Values (T, 15) in the order of AMC_BONES, degrees and the file's units of length."""
    rng = np.random.default_rng(seed)
    steps = rng.normal(0.0, 3.0, (n_frames, sum(AMC_BONES.values())))
    values = rng.uniform(-40, 40, steps.shape[1]) + np.cumsum(steps, axis=0)
    values[:, :3] = [1.0, 17.0, -2.0] + 0.01 * steps[:, :3]
    return values


def write_amc(
    path: Path, values: np.ndarray | None = None, bones: dict[str, int] | None = None
) -> Path:
    values = amc_values() if values is None else values
    lines = ["#!OML:ASF", ":FULLY-SPECIFIED", ":DEGREES"]
    for number, frame in enumerate(values, start=1):
        lines.append(str(number))
        at = 0
        for bone, count in (bones or AMC_BONES).items():
            lines.append(f"{bone} " + " ".join(repr(float(x)) for x in frame[at : at + count]))
            at += count
    path.write_text("\n".join(lines) + "\n")
    return path


BVH_HIERARCHY = """HIERARCHY
ROOT Hips
{
  OFFSET 0 0 0
  CHANNELS 6 Xposition Yposition Zposition Zrotation Xrotation Yrotation
  JOINT Spine
  {
    OFFSET 0 25 1
    CHANNELS 3 Xrotation Yrotation Zrotation
    JOINT Arm
    {
      OFFSET 18 30 -2
      CHANNELS 3 Yrotation Zrotation Xrotation
      End Site
      {
        OFFSET 55 0 0
      }
    }
    JOINT Head
    {
      OFFSET 0 40 0
      CHANNELS 6 Xposition Yposition Zposition Zrotation Yrotation Xrotation
      End Site
      {
        OFFSET 0 20 0
      }
    }
  }
  JOINT Leg
  {
    OFFSET 9 -2 0
    CHANNELS 1 Xrotation
    End Site
    {
      OFFSET 0 -85 3
    }
  }
}
"""
BVH_CHANNELS = 6 + 3 + 3 + 6 + 1


def bvh_values(n_frames: int = 12, seed: int = 0) -> np.ndarray:
    """Values (T, 19), degrees and centimetres."""
    rng = np.random.default_rng(seed)
    steps = rng.normal(0.0, 3.0, (n_frames, BVH_CHANNELS))
    values = rng.uniform(-40, 40, BVH_CHANNELS) + np.cumsum(steps, axis=0)
    values[:, :3] = [10.0, 95.0, -20.0] + 0.1 * steps[:, :3]
    values[:, 12:15] = [0.0, 41.0, 1.0] + 0.1 * steps[:, 12:15]
    return values


def write_bvh(path: Path, values: np.ndarray | None = None, hierarchy: str = BVH_HIERARCHY) -> Path:
    values = bvh_values() if values is None else values
    rows = "".join(" ".join(repr(float(x)) for x in row) + "\n" for row in values)
    path.write_text(f"{hierarchy}MOTION\nFrames: {len(values)}\nFrame Time: 0.01\n{rows}")
    return path


def write_trc(
    path: Path,
    points: np.ndarray | None = None,
    *,
    units: str = "mm",
    scale_to_file: float = 1000.0,
    rate_hz: float = 100.0,
) -> Path:
    """``points`` are in the file's axes: y up, x forward."""
    points = person()[..., [0, 2, 1]] if points is None else points
    n_frames, n_markers = points.shape[:2]
    names = [f"M{i}" for i in range(n_markers)]
    lines = [
        f"PathFileType\t4\t(X/Y/Z)\t{path.name}",
        "DataRate\tCameraRate\tNumFrames\tNumMarkers\tUnits\tOrigDataRate\tOrigDataStartFrame"
        "\tOrigNumFrames",
        f"{rate_hz:.2f}\t{rate_hz:.2f}\t{n_frames}\t{n_markers}\t{units}\t{rate_hz:.2f}\t1"
        f"\t{n_frames}",
        "Frame#\tTime\t" + "\t\t\t".join(names) + "\t\t",
        "\t\t" + "\t".join(f"{axis}{i + 1}" for i in range(n_markers) for axis in "XYZ"),
        "",
    ]
    for i, frame in enumerate(points * scale_to_file):
        cells = ["" if np.isnan(x) else f"{x:.5f}" for x in frame.ravel()]
        lines.append(f"{i + 1}\t{i / rate_hz:.5f}\t" + "\t".join(cells))
    path.write_text("\n".join(lines) + "\n")
    return path


def write_csv(
    path: Path,
    points: np.ndarray | None = None,
    *,
    rate_hz: float = 100.0,
    columns: dict[str, list[str]] | None = None,
) -> Path:
    points = person() if points is None else points
    names = [f"M{i}.{axis}" for i in range(points.shape[1]) for axis in "xyz"]
    lines = [",".join(["time", *names, *(columns or {})])]
    for i, frame in enumerate(points):
        cells = ["" if np.isnan(x) else repr(float(x)) for x in frame.ravel()]
        texts = [values[i] for values in (columns or {}).values()]
        lines.append(",".join([f"{i / rate_hz:.6f}", *cells, *texts]))
    path.write_text("\n".join(lines) + "\n")
    return path


def write_storage(
    path: Path, points: np.ndarray | None = None, *, vectors: bool = False, rate_hz: float = 100.0
) -> Path:
    points = y_up(person() if points is None else points)
    names = [f"M{i}" for i in range(points.shape[1])]
    columns = names if vectors else [f"{name}_{axis}" for name in names for axis in "XYZ"]
    lines = [f"DataType={'Vec3' if vectors else 'double'}", "version=3", "OpenSimVersion=4.4"]
    lines += ["endheader", "\t".join(["time", *columns])]
    for i, frame in enumerate(points):
        cells = [f"{x:.6f}" for x in frame.ravel()]
        cells = [",".join(cells[k : k + 3]) for k in range(0, len(cells), 3)] if vectors else cells
        lines.append("\t".join([f"{i / rate_hz:.5f}", *cells]))
    path.write_text("\n".join(lines) + "\n")
    return path


def y_up(points: np.ndarray) -> np.ndarray:
    """Return points with z up in the axes of tools with y up and x forward."""
    return np.stack([points[..., 0], points[..., 2], -points[..., 1]], axis=-1)


def cells_of(frame: np.ndarray, form: str = ".6f") -> list[str]:
    return ["" if np.isnan(x) else format(x, form) for x in frame.ravel()]


def write_motive(
    path: Path,
    points: np.ndarray | None = None,
    *,
    version: str = "1.23",
    rate_hz: float = 100.0,
    kinds: list[str] | None = None,
    names: list[str] | None = None,
    units: str = "Meters",
    scale_to_file: float = 1.0,
) -> Path:
    """``kinds``: "Marker", "Bone", "Rigid Body" or "Unlabeled" for each point."""
    points = person() if points is None else points
    kinds = kinds or ["Marker"] * points.shape[1]
    names = names or [f"Skeleton 001:M{i}" for i in range(points.shape[1])]
    columns: list[list[str]] = [
        ["", "", "", "", "", "Frame"],
        ["", "", "", "", "", "Time (Seconds)"],
    ]
    table = [[str(i), f"{i / rate_hz:.6f}"] for i in range(len(points))]
    for i, (kind, name) in enumerate(zip(kinds, names, strict=True)):
        parent = "Parent" if version >= "3" else ""
        kind_, name_ = ("Marker", f"Unlabeled {1000 + i}") if kind == "Unlabeled" else (kind, name)
        if kind in ("Bone", "Rigid Body"):
            columns += [[kind_, name_, f'"{i}"', parent, "Rotation", axis] for axis in "XYZW"]
            for row in table:
                row.extend(["0.0", "0.0", "0.0", "1.0"])
        columns += [[kind_, name_, f'"{i}"', parent, "Position", axis] for axis in "XYZ"]
        for row, frame in zip(table, y_up(points)[:, i] * scale_to_file, strict=True):
            row.extend(cells_of(frame))
        if kind == "Rigid Body":
            columns.append([kind_, name_, f'"{i}"', parent, "Error Per Marker", ""])
            for row in table:
                row.append("0.0001")
    head = [
        "Format Version,1.23,Take Name,walk,Capture Frame Rate,"
        f"{rate_hz:.6f},Export Frame Rate,{rate_hz:.6f},Total Exported Frames,{len(points)},"
        f"Rotation Type,Quaternion,Length Units,{units},Coordinate Space,Global",
        "",
    ]
    for row in range(6):
        if row == 3 and version < "3":
            continue
        head.append(",".join(column[row] for column in columns))
    path.write_text("\n".join([*head, *(",".join(row) for row in table)]) + "\n")
    return path


def write_nexus(
    path: Path,
    points: np.ndarray | None = None,
    *,
    rate_hz: float = 100.0,
    names: list[str] | None = None,
    before: str = "",
    behind: str = "",
    separator: str = ",",
) -> Path:
    points = person() if points is None else points
    names = names or [f"Anna:M{i}" for i in range(points.shape[1])]
    lines = ["Trajectories", f"{rate_hz:g}"]
    lines.append(",," + ",".join(f"{name},," for name in names))
    lines.append("Frame,Sub Frame," + ",".join(["X,Y,Z"] * len(names)))
    lines.append(",," + ",".join(["mm,mm,mm"] * len(names)))
    lines += [f"{i + 1},0," + ",".join(cells_of(p * 1000.0)) for i, p in enumerate(points)]
    path.write_text((before + "\n".join(lines) + "\n" + behind).replace(",", separator))
    return path


def write_qualisys(
    path: Path,
    points: np.ndarray | None = None,
    *,
    rate_hz: float = 100.0,
    counted: bool = False,
    headed: bool = False,
) -> Path:
    points = person() if points is None else points
    names = [f"M{i}" for i in range(points.shape[1])]
    lines = [
        f"NO_OF_FRAMES\t{len(points)}",
        "NO_OF_CAMERAS\t8",
        f"NO_OF_MARKERS\t{len(names)}",
        f"FREQUENCY\t{rate_hz:g}",
        "NO_OF_ANALOG\t0",
        "DESCRIPTION\t--",
        "TIME_STAMP\t2024-01-01, 10:00:00.000\t1.0",
        "DATA_INCLUDED\t3D",
        "MARKER_NAMES\t" + "\t".join(names),
    ]
    if headed:
        axes = "\t".join(f"{name} {axis}" for name in names for axis in "XYZ")
        lines += ["TRAJECTORY_TYPES" + "\tMeasured" * len(names), f"Frame\tTime\t{axes}"]
    for i, frame in enumerate(points):
        first = [str(i + 1), f"{i / rate_hz:.5f}"] if counted or headed else []
        lines.append("\t".join([*first, *cells_of(1000.0 * np.nan_to_num(frame))]))
    path.write_text("\n".join(lines) + "\n")
    return path


def write_default_amc(path: Path) -> Path:
    write_asf(path.parent / f"{path.stem}.asf")
    return write_amc(path)


MVNX_JOINTS = (
    # child, parent, where the joint is in the parent [m]: x forward, y left, z up in a T pose
    ("L5", "Pelvis", (0.0, 0.0, 0.10)),
    ("L3", "L5", (0.0, 0.0, 0.11)),
    ("T12", "L3", (0.0, 0.0, 0.10)),
    ("T8", "T12", (0.0, 0.0, 0.10)),
    ("Neck", "T8", (0.0, 0.0, 0.14)),
    ("Head", "Neck", (0.0, 0.0, 0.09)),
    ("RightShoulder", "T8", (0.0, -0.03, 0.09)),
    ("RightUpperArm", "RightShoulder", (0.0, -0.14, 0.0)),
    ("RightForeArm", "RightUpperArm", (0.0, -0.28, 0.0)),
    ("RightHand", "RightForeArm", (0.0, -0.24, 0.0)),
    ("LeftShoulder", "T8", (0.0, 0.03, 0.09)),
    ("LeftUpperArm", "LeftShoulder", (0.0, 0.14, 0.0)),
    ("LeftForeArm", "LeftUpperArm", (0.0, 0.28, 0.0)),
    ("LeftHand", "LeftForeArm", (0.0, 0.24, 0.0)),
    ("RightUpperLeg", "Pelvis", (0.0, -0.08, 0.0)),
    ("RightLowerLeg", "RightUpperLeg", (0.0, 0.0, -0.42)),
    ("RightFoot", "RightLowerLeg", (0.0, 0.0, -0.40)),
    ("RightToe", "RightFoot", (0.14, 0.0, -0.07)),
    ("LeftUpperLeg", "Pelvis", (0.0, 0.08, 0.0)),
    ("LeftLowerLeg", "LeftUpperLeg", (0.0, 0.0, -0.42)),
    ("LeftFoot", "LeftLowerLeg", (0.0, 0.0, -0.40)),
    ("LeftToe", "LeftFoot", (0.14, 0.0, -0.07)),
)
MVNX_SEGMENTS = ("Pelvis", *(child for child, _, _ in MVNX_JOINTS))
MVNX_ENDS = {"Head": (0.0, 0.0, 0.18), "RightHand": (0.0, -0.18, 0.0), "LeftHand": (0.0, 0.18, 0.0),
             "RightToe": (0.06, 0.0, -0.02), "LeftToe": (0.06, 0.0, -0.02)}  # fmt: skip


def mvnx_motion(n_frames: int = 12, seed: int = 0) -> tuple[np.ndarray, np.ndarray]:
    """Origins (T, 23, 3) [m] and orientations (T, 23, 4), w x y z, of a person who moves."""
    from scipy.spatial.transform import Rotation

    rng = np.random.default_rng(seed)
    local = {}
    for name in MVNX_SEGMENTS:
        turns = 0.2 * rng.normal(size=3) + np.cumsum(0.02 * rng.normal(size=(n_frames, 3)), axis=0)
        local[name] = Rotation.from_rotvec(turns)
    steps = 0.003 * rng.normal(size=(n_frames, 3))
    places = {"Pelvis": np.array([0.3, -0.2, 0.93]) + np.cumsum(steps, axis=0)}
    world = {"Pelvis": local["Pelvis"]}
    for child, parent, offset in MVNX_JOINTS:
        places[child] = places[parent] + world[parent].apply(offset)
        world[child] = world[parent] * local[child]
    quaternions = [world[name].as_quat(scalar_first=True) for name in MVNX_SEGMENTS]
    return np.stack([places[n] for n in MVNX_SEGMENTS], 1), np.stack(quaternions, 1)


def write_mvnx(
    path: Path,
    motion: tuple[np.ndarray, np.ndarray] | None = None,
    *,
    holds: tuple[str, ...] = ("orientation", "position", "jointAngle"),
    version: str = "4",
    head: str = '<?xml version="1.0" encoding="UTF-8"?>',
    subject: str = 'label="Anna" frameRate="100" segmentCount="23"',
) -> Path:
    positions, orientations = mvnx_motion() if motion is None else motion
    points: dict[str, list[tuple[str, tuple[float, ...]]]] = {name: [] for name in MVNX_SEGMENTS}
    joints = []
    for child, parent, offset in MVNX_JOINTS:
        points[parent].append((f"j{child}", offset))
        points[child].append((f"j{child}", (0.0, 0.0, 0.0)))
        joints.append(
            f'<joint label="j{child}"><connector1>{parent}/j{child}</connector1>'
            f"<connector2>{child}/j{child}</connector2></joint>"
        )
    for name, place in MVNX_ENDS.items():
        points[name].append((f"pEnd{name}", place))

    def text(values: np.ndarray) -> str:
        return " ".join(f"{x:.9f}" for x in np.ravel(values))

    segments = "".join(
        f'<segment label="{name}" id="{i}"><points>'
        + "".join(
            f'<point label="{label}"><pos_b>{text(place)}</pos_b></point>'
            for label, place in points[name]
        )
        + "</points></segment>\n"
        for i, name in enumerate(MVNX_SEGMENTS, 1)
    )
    rest = np.zeros((len(MVNX_SEGMENTS), 4))
    rest[:, 0] = 1.0
    frames = [
        f'<frame time="0" index="" tc="" ms="0" type="{kind}"><orientation>{text(rest)}'
        f"</orientation><position>{text(np.zeros((23, 3)))}</position></frame>\n"
        for kind in ("identity", "tpose", "tpose-isb")
    ]
    for i, (place, turn) in enumerate(zip(positions, orientations, strict=True)):
        angles = np.full((len(MVNX_JOINTS), 3), 10.0 + i)
        found = {"orientation": turn, "position": place, "jointAngle": angles}
        inside = "".join(f"<{name}>{text(found[name])}</{name}>" for name in holds)
        frames.append(
            f'<frame time="{10 * i}" index="{i}" type="normal">{inside}'
            f"<velocity>{text(place)}</velocity></frame>\n"
        )
    path.write_text(
        f'{head}\n<mvnx xmlns="http://www.xsens.com/mvn/mvnx" version="{version}">\n'
        f"<subject {subject}>\n<segments>{segments}</segments>\n<joints>{''.join(joints)}"
        f"</joints>\n<frames>\n{''.join(frames)}</frames>\n</subject>\n</mvnx>\n"
    )
    return path


def smpl_poses(n_frames: int = 12, n_joints: int = 52, seed: int = 0) -> np.ndarray:
    """Rotation vectors (T, 3 J) of a person who stands, z up, and moves a little."""
    rng = np.random.default_rng(seed)
    steps = 0.02 * rng.normal(size=(n_frames, n_joints, 3))
    vectors = 0.25 * rng.normal(size=(n_joints, 3)) + np.cumsum(steps, axis=0)
    vectors[:, 0] = [np.pi / 2, 0.0, 0.0]  # the model's y is the world's z
    return vectors.reshape(n_frames, -1)


def write_smpl(path: Path, **arrays: object) -> Path:
    content: dict[str, object] = {
        "poses": smpl_poses(),
        "trans": np.tile([0.4, -0.1, 0.95], (12, 1)),
        "mocap_framerate": np.array(100.0),
        "betas": np.zeros(16),
        "gender": np.array("neutral"),
    }
    content |= arrays
    np.savez(path, **{name: value for name, value in content.items() if value is not None})
    return path


def standing_coco(n_frames: int = 12) -> np.ndarray:
    """The 17 key points of COCO of somebody who stands and sways, shape (T, 17, 3) [m]."""
    side = [(0, 0.2, 1.45), (0, 0.25, 1.15), (0, 0.25, 0.9), (0, 0.1, 0.95), (0, 0.1, 0.5)]
    pairs = [(0.08, 0.03, 1.65), (0.0, 0.07, 1.62), *side, (0, 0.1, 0.08)]
    points = [(0.1, 0, 1.6), *(((x, sign * y, z)) for x, y, z in pairs for sign in (1, -1))]
    sway = 0.02 * np.sin(np.arange(n_frames) / 5.0)[:, None, None]
    return np.array(points) + sway * np.array(points)[:, 2:]


def write_joint_array(path: Path, points: np.ndarray | None = None) -> Path:
    np.save(path, standing_coco() if points is None else points)
    return path


def g1_values(n_frames: int = 12, seed: int = 0) -> np.ndarray:
    """The root's x y z [m] and quaternion x y z w, and 29 joints [rad], shape (T, 36)."""
    from scipy.spatial.transform import Rotation

    rng = np.random.default_rng(seed)
    joints = 0.2 * rng.normal(size=29) + np.cumsum(0.02 * rng.normal(size=(n_frames, 29)), axis=0)
    turns = np.cumsum(0.02 * rng.normal(size=(n_frames, 3)), axis=0)
    root = np.tile([0.5, -0.3, 0.78], (n_frames, 1)) + 0.01 * turns
    return np.concatenate([root, Rotation.from_rotvec(turns).as_quat(), joints], axis=1)


def write_g1_csv(
    path: Path, values: np.ndarray | None = None, header: list[str] | None = None
) -> Path:
    rows = [header] if header else []
    rows += [[f"{x:.9f}" for x in row] for row in (g1_values() if values is None else values)]
    path.write_text("".join(",".join(row) + "\n" for row in rows))
    return path


def write_g1_array(path: Path, values: np.ndarray | None = None) -> Path:
    np.save(path, g1_values() if values is None else values)
    return path


def xdf_chunk(tag: int, content: bytes) -> bytes:
    length = len(content) + 2
    width = 1 if length < 256 else 4
    return bytes([width]) + length.to_bytes(width, "little") + struct.pack("<H", tag) + content


def write_xdf(
    path: Path,
    points: np.ndarray | None = None,
    *,
    rate_hz: float = 100.0,
    times: np.ndarray | None = None,
    typed: bool = True,
    units: str = "meters",
    names: tuple[str, ...] | None = None,
    stream: str = "cameras",
    extra: bytes = b"",
) -> Path:
    """``typed``: channels by marker and type, as the layer's conventions have it, or by label."""
    points = person() if points is None else points
    times = 100.0 + np.arange(len(points)) / rate_hz if times is None else times
    channels = ""
    for i in range(points.shape[1]):
        name = f"M{i}" if names is None else names[i]
        for axis in "XYZ":
            channels += f"<channel><label>{name}_{axis}</label>"
            if typed:
                channels += f"<marker>{name}</marker><type>Position{axis}</type>"
            channels += f"<unit>{units}</unit></channel>"
    header = (
        f"<?xml version='1.0'?><info><name>{stream}</name><type>MoCap</type>"
        f"<channel_count>{3 * points.shape[1]}</channel_count>"
        f"<nominal_srate>{rate_hz}</nominal_srate><channel_format>float32</channel_format>"
        f"<desc><channels>{channels}</channels></desc></info>"
    )
    marks = (
        "<?xml version='1.0'?><info><name>marks</name><type>Markers</type><channel_count>1"
        "</channel_count><nominal_srate>0</nominal_srate><channel_format>string</channel_format>"
        "</info>"
    )
    number, other = struct.pack("<I", 7), struct.pack("<I", 3)
    data = b"XDF:" + xdf_chunk(1, b"<?xml version='1.0'?><info><version>1.0</version></info>")
    data += xdf_chunk(2, number + header.encode()) + xdf_chunk(2, other + marks.encode())
    data += xdf_chunk(3, other + b"\x01\x01\x08" + struct.pack("<d", times[0]) + b"\x01\x03go!")
    for first in range(0, len(points), 7):
        rows = b""
        for i in range(first, min(first + 7, len(points))):
            stamped = i == first or abs(times[i] - times[i - 1] - 1 / rate_hz) > 1e-6
            rows += b"\x08" + struct.pack("<d", times[i]) if stamped else b"\0"
            rows += points[i].astype("<f4").tobytes()
        count = min(7, len(points) - first)
        data += xdf_chunk(3, number + b"\x01" + bytes([count]) + rows)
    data += xdf_chunk(4, number + struct.pack("<2d", times[-1], -1e-3)) + extra
    data += xdf_chunk(6, number + b"<?xml version='1.0'?><info><sample_count/></info>")
    path.write_bytes(data)
    return path


def write_deeplabcut(path: Path) -> Path:
    values = keypoint_values()
    heads = [
        ["scorer", *["net"] * 12],
        ["bodyparts", *[name for name in KEYPOINTS for _ in range(3)]],
        ["coords", *["x", "y", "likelihood"] * 4],
    ]
    rows = heads + [[str(k), *(f"{x:.6f}" for x in row)] for k, row in enumerate(values)]
    path.write_text("".join(",".join(row) + "\n" for row in rows))
    return path


def write_sleap(path: Path) -> Path:
    parts = [f"{name}.{what}" for name in KEYPOINTS for what in ("x", "y", "score")]
    rows = [["track", "frame_idx", "instance.score", *parts]]
    rows += [
        ["mouse", str(k), "0.9", *(f"{x:.6f}" for x in row)]
        for k, row in enumerate(keypoint_values())
    ]
    path.write_text("".join(",".join(row) + "\n" for row in rows))
    return path


def write_key_points(path: Path) -> Path:
    parts = [f"{name}_{what}" for name in KEYPOINTS for what in ("x", "y", "likelihood")]
    rows = [["frame", *parts]]
    rows += [[str(k), *(f"{x:.6f}" for x in row)] for k, row in enumerate(keypoint_values())]
    path.write_text("".join(",".join(row) + "\n" for row in rows))
    return path


def write_deeplabcut_hdf5(path: Path) -> Path:
    """Write rows as pandas does by PyTables; see the test of a file that it has written itself."""
    import h5py

    values = keypoint_values()
    coords = ("x", "y", "likelihood")
    heads = [("net", name, coord) for name in KEYPOINTS for coord in coords]
    rows = np.zeros(len(values), [("index", "<i8"), ("values_block_0", "<f8", (values.shape[1],))])
    rows["index"], rows["values_block_0"] = np.arange(len(values)), values
    with h5py.File(path, "w") as file:
        frame = file.create_group("df_with_missing")
        frame.attrs["pandas_type"] = np.bytes_(b"frame_table")
        frame["table"] = rows
        frame["table"].attrs["values_block_0_kind"] = np.bytes_(pickle.dumps(heads, 0))
    return path


def write_sleap_hdf5(path: Path) -> Path:
    import h5py

    values = keypoint_values().reshape(12, len(KEYPOINTS), 3)
    with h5py.File(path, "w") as file:
        file["tracks"] = values[..., :2].transpose(2, 1, 0)[None]
        file["point_scores"] = values[..., 2].T[None]
        file["node_names"] = np.array(KEYPOINTS, "S")
        file["track_names"] = np.array(["mouse"], "S")
    return path


KEYPOINTS = ("snout", "left_ear", "right_ear", "tail_base")


def keypoint_values() -> np.ndarray:
    """Return 12 frames of a mouse in a picture: x, y and likelihood of four points."""
    t = np.arange(12)[:, None]
    x = 100.0 + 2.0 * t + np.array([[30.0, 20.0, 20.0, -30.0]])
    y = 200.0 + np.array([[0.0, -8.0, 8.0, 0.0]]) + np.sin(t)
    return np.stack([x, y, np.full_like(x, 0.95)], axis=2).reshape(12, -1)


Writer = Callable[[Path], Path]
WRITERS: dict[str, tuple[str, Writer]] = {
    "UI-PRMD": (UI_PRMD_NAME, write_ui_prmd),
    "C3D": ("take.c3d", write_c3d),
    "Theia": ("take.c3d", write_theia),
    "AMC": ("take.amc", write_default_amc),
    "BVH": ("take.bvh", write_bvh),
    "TRC": ("take.trc", write_trc),
    "CSV": ("take.csv", write_csv),
    "OpenSim storage": ("take.sto", write_storage),
    "G1 CSV": ("take.csv", write_g1_csv),
    "MVNX": ("take.mvnx", write_mvnx),
    "SMPL": ("take.npz", write_smpl),
    "G1 array": ("take_100hz.npy", write_g1_array),
    "joint array": ("take_100hz.npy", write_joint_array),
    "Motive CSV": ("take.csv", write_motive),
    "Nexus CSV": ("take.csv", write_nexus),
    "Qualisys TSV": ("take.tsv", write_qualisys),
    "XDF": ("take.xdf", write_xdf),
    "DeepLabCut": ("take.csv", write_deeplabcut),
    "SLEAP": ("take.csv", write_sleap),
    "key points": ("take.csv", write_key_points),
    "DeepLabCut HDF5": ("take.h5", write_deeplabcut_hdf5),
    "SLEAP HDF5": ("take.h5", write_sleap_hdf5),
}
"""For each reader, by its format: a file name, and what writes a small valid file there."""

BINARY = frozenset(
    (
        *("C3D", "Theia", "SMPL", "XDF", "joint array", "G1 array"),
        *("DeepLabCut HDF5", "SLEAP HDF5"),
    )
)
"""Those that are no text."""


def write(folder: Path, format: str) -> Path:
    """Write a small valid file of a format."""
    name, writer = WRITERS[format]
    return writer(folder / name)


def zipped(path: Path) -> Path:
    target = path.with_name(path.name + ".gz")
    target.write_bytes(gzip.compress(path.read_bytes()))
    return target
