"""Small valid files of every format, written here and not by what is tested."""

from __future__ import annotations

import gzip
from collections.abc import Callable
from pathlib import Path

import numpy as np

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


def write_default_amc(path: Path) -> Path:
    write_asf(path.parent / f"{path.stem}.asf")
    return write_amc(path)


Writer = Callable[[Path], Path]
WRITERS: dict[str, tuple[str, Writer]] = {
    "UI-PRMD": (UI_PRMD_NAME, write_ui_prmd),
    "C3D": ("take.c3d", write_c3d),
    "AMC": ("take.amc", write_default_amc),
    "BVH": ("take.bvh", write_bvh),
    "TRC": ("take.trc", write_trc),
    "CSV": ("take.csv", write_csv),
}
"""For each reader, by its format: a file name, and what writes a small valid file there."""


def write(folder: Path, format: str) -> Path:
    """Write a small valid file of a format."""
    name, writer = WRITERS[format]
    return writer(folder / name)


def zipped(path: Path) -> Path:
    target = path.with_name(path.name + ".gz")
    target.write_bytes(gzip.compress(path.read_bytes()))
    return target
