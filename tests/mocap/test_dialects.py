"""Dialects of marker files: however they are spelled, what was written is what is read."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from mocap_writers import (
    cells_of,
    person,
    write_c3d,
    write_csv,
    write_motive,
    write_nexus,
    write_qualisys,
    write_trc,
    y_up,
)

from mplearn.demonstrator import demonstrate
from mplearn.errors import RecordingError, RecordingWarning
from mplearn.mocap import Hints, open_recording
from mplearn.mocap.markers.columns import MEDIAPIPE_POSE, meaning_of
from mplearn.recording import Recording

pytestmark = pytest.mark.filterwarnings("ignore::mplearn.errors.RecordingWarning")


@pytest.fixture(scope="module")
def standing() -> Recording:
    return demonstrate(["SQD", "SQR", "BAR"], 4, rate_hz=50.0).recording.sliced(0, 60)


def said(recording: Recording) -> str:
    assert recording.report is not None
    return "\n".join([*recording.report.notes, *recording.report.warnings])


# tables --------------------------------------------------------------------------------------


@st.composite
def spelling(draw: st.DrawFn) -> dict[str, object]:
    separator = draw(st.sampled_from([",", ";", "\t"]))
    return {
        "name": draw(
            st.sampled_from(
                ["{m}, {A}", "pos_{a}_{m}", "Pos{A}_{m}",
                 "{m}.{a}", "{m}_{A}", "{m} {a}", "{m}:{A}", "{m}-{a}", "{m}{A}", "{m}_pos_{a}",
                 "{m} ({A})", "{a}_{m}", "Anna:{m}.{a}"]
            )
        ),
        "unit": draw(st.sampled_from([("", 1.0), ("", 1e-3), (" (mm)", 1e-3), (" [cm]", 0.01)])),
        "time": draw(
            st.sampled_from(
                [("time", 1.0), ("Time (s)", 1.0), ("timestamp_ms", 1e-3), ("Time [ms]", 1e-3),
                 ("t", 1.0), ("Timestamp", 1e-3), ("time_us", 1e-6), ("TIME", 1.0),
                 ("timestamp_usec", 1e-6), ("time_nanos", 1e-9)]
            )
        ),
        "frame": draw(st.sampled_from(["", "frame", "Frame#", "Frame Number", "index", "Sample"])),
        "separator": separator,
        "comma": separator != "," and draw(st.booleans()),
        "missing": draw(st.sampled_from(["", "NaN", "NA", "null", "n/a"])),
        "trailing": draw(st.integers(0, 3)),
        "quoted": draw(st.booleans()),
        "remark": draw(st.sampled_from(["", "# made by hand\n# in 2024\n"])),
        "rate_hz": draw(st.sampled_from([25.0, 30.0, 100.0, 240.0])),
    }  # fmt: skip


@settings(
    max_examples=60, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture]
)
@given(how=spelling())
def test_tables_in_any_spelling(
    standing: Recording, tmp_path: Path, how: dict[str, object]
) -> None:
    points = standing.markers.copy()
    points[7, 3] = np.nan
    unit, unit_m = how["unit"]  # type: ignore[misc]
    time, time_s = how["time"]  # type: ignore[misc]
    separator, trailing = str(how["separator"]), str(how["separator"]) * int(how["trailing"])  # type: ignore[call-overload]
    header = [str(how["frame"])] * bool(how["frame"]) + [time]
    for name in standing.marker_names:
        header += [str(how["name"]).format(m=name, a=axis, A=axis.upper()) + unit for axis in "xyz"]
    if how["quoted"]:
        header = [f'"{name}"' for name in header]
    header = [f'"{n}"' if "," in n and '"' not in n else n for n in header]
    lines = [str(how["remark"]) + separator.join(header) + trailing]
    for i, frame in enumerate(points / unit_m):
        cells = [str(i + 5)] * bool(how["frame"]) + [f"{i / how['rate_hz'] / time_s:.4f}"]  # type: ignore[operator]
        cells += [str(how["missing"]) if np.isnan(x) else f"{x:.4f}" for x in frame.ravel()]
        if how["comma"]:
            cells = [cell.replace(".", ",") for cell in cells]
        lines.append(separator.join(cells) + trailing)
    path = tmp_path / ("a.tsv" if separator == "\t" else "a.csv")
    path.write_text("\n".join(lines) + "\n")
    recording = open_recording(path)
    assert recording.rate_hz == pytest.approx(how["rate_hz"], rel=1e-3)
    assert recording.marker_names == standing.marker_names
    assert recording.markers == pytest.approx(points, abs=1e-4, nan_ok=True)


def test_names_above_axes_and_units(standing: Recording, tmp_path: Path) -> None:
    names, path = standing.marker_names, tmp_path / "a.csv"
    rows = ["," + ",".join(f"{x:.2f}" for x in f.ravel() * 1000) for f in standing.markers]
    rows = [f"{i / 50:.3f}{row}" for i, row in enumerate(rows)]
    axes = ",".join(["time", *(["X", "Y", "Z"] * len(names))])
    for names_row in (
        "," + ",".join(f"{name},," for name in names),
        "," + ",".join(f"{name},{name},{name}" for name in names),
    ):
        for units in ("", "s," + ",".join(["mm"] * 3 * len(names)) + "\n"):
            path.write_text(f"{names_row}\n{axes}\n{units}" + "\n".join(rows) + "\n")
            recording = open_recording(path)
            assert recording.marker_names == names
            assert recording.rate_hz == pytest.approx(50.0)
            assert recording.markers == pytest.approx(standing.markers, abs=1e-4, nan_ok=True)


@pytest.mark.parametrize(("kind", "seed"), [("uniform", 0), *(("normal", k) for k in range(4))])
def test_a_jittering_clock_is_evened(tmp_path: Path, kind: str, seed: int) -> None:
    rng = np.random.default_rng(seed)
    jitter = rng.uniform(-0.012, 0.012, 200) if kind == "uniform" else rng.normal(0, 0.005, 200)
    times = np.arange(200) / 30.0 + jitter
    lines = ["time,knee,hip"]
    lines += [f"{t:.6f},{np.sin(3 * t):.8f},{0.1 * t:.8f}" for t in times]
    path = tmp_path / "a.csv"
    path.write_text("\n".join(lines) + "\n")
    recording = open_recording(path)
    assert recording.rate_hz == pytest.approx(30.0, rel=5e-3)
    even = times[0] + np.arange(len(recording)) / recording.rate_hz
    assert recording.frames[:, 1] == pytest.approx(0.1 * even, abs=1e-6)
    assert recording.frames[:, 0] == pytest.approx(np.sin(3 * even), abs=0.004)
    assert "jitter" in said(recording)


def test_a_jittering_clock_with_dropped_frames_leaves_a_gap(tmp_path: Path) -> None:
    times = np.arange(200) / 30.0 + np.random.default_rng(1).uniform(-0.006, 0.006, 200)
    lines = ["time,knee", *(f"{t:.6f},{0.1 * t:.8f}" for t in times)]
    del lines[61:67]
    path = tmp_path / "a.csv"
    path.write_text("\n".join(lines) + "\n")
    recording = open_recording(path)
    assert len(recording) in (199, 200, 201)
    missing = np.flatnonzero(np.isnan(recording.frames[:, 0]))
    assert 4 <= len(missing) <= 7
    assert set(missing) <= set(range(57, 69))
    even = times[0] + np.arange(len(recording)) / recording.rate_hz
    seen = ~np.isnan(recording.frames[:, 0])
    assert recording.frames[seen, 0] == pytest.approx(0.1 * even[seen], abs=0.1 * 0.02)


def test_degrees_and_millimetres_where_names_say_so(tmp_path: Path) -> None:
    path = tmp_path / "a.csv"
    path.write_text("time,knee (deg),hip_deg,height (mm),toe\n0,90,180,1500,0.5\n0.02,45,0,1,1\n")
    recording = open_recording(path)
    assert recording.channels == ("knee", "hip", "height", "toe")
    assert recording.frames[0] == pytest.approx([np.pi / 2, np.pi, 1.5, 0.5])
    path.write_text("time,knee,hip\n0,90,-120\n0.02,45,0\n")
    assert "(deg)" in said(open_recording(path))


def test_only_a_number_of_frames_needs_a_rate(tmp_path: Path) -> None:
    path = tmp_path / "a.csv"
    rows = "".join(f"{i},{i * 0.01}\n" for i in (10, 12, 14, 18, 20))
    path.write_text("Frame,knee\n" + rows)
    with pytest.raises(RecordingError, match=r"no rate.*rate_hz"):
        open_recording(path)
    recording = open_recording(path, hints=Hints(rate_hz=60.0))
    assert recording.channels == ("knee",)
    assert np.flatnonzero(np.isnan(recording.frames[:, 0])).tolist() == [3]


@pytest.mark.parametrize("numbered", ["x{i},y{i},z{i},visibility{i}", "{i}_x,{i}_y,{i}_z,{i}_v"])
def test_mediapipe_by_number(tmp_path: Path, numbered: str) -> None:
    points = landmarks()
    path = tmp_path / "a.csv"
    header = ",".join(numbered.format(i=i) for i in range(33))
    rows = [",".join(f"{x:.5f},{y:.5f},{z:.5f},0.9" for x, y, z in frame) for frame in points]
    lines = [f"frame,timestamp,{header}", *(f"{i},{i * 33},{row}" for i, row in enumerate(rows))]
    path.write_text("\n".join(lines) + "\n")
    check_landmarks(open_recording(path), points)


def test_landmarks_a_row_each(tmp_path: Path) -> None:
    points = landmarks()
    for name, names in (("landmark", MEDIAPIPE_POSE), ("landmark_id", range(33))):
        rows = [
            f"{i},{i * 0.033:.3f},{each},{x:.5f},{y:.5f},{z:.5f},0.99"
            for i, frame in enumerate(points)
            for each, (x, y, z) in zip(names, frame, strict=True)
        ]
        path = tmp_path / "a.csv"
        path.write_text(f"frame,time,{name},x,y,z,visibility\n" + "\n".join(rows) + "\n")
        check_landmarks(open_recording(path), points)


def landmarks() -> np.ndarray:
    """World landmarks as MediaPipe gives them: metres from the hips, y down, z away."""
    joints = {
        "nose": 1.6, "eye": 1.63, "ear": 1.62, "mouth": 1.55, "shoulder": 1.4, "elbow": 1.1,
        "wrist": 0.85, "pinky": 0.78, "index": 0.77, "thumb": 0.8, "hip": 0.95, "knee": 0.5,
        "ankle": 0.09, "heel": 0.03, "foot_index": 0.02,
    }  # fmt: skip
    rng = np.random.default_rng(1)
    body = np.zeros((33, 3))
    for i, name in enumerate(MEDIAPIPE_POSE):
        part = max((p for p in joints if p in name), key=len)
        side = 1 if "left" in name else -1 if "right" in name else 0
        wide = {"shoulder": 0.2, "elbow": 0.25, "wrist": 0.28}.get(part, 0.1)
        body[i] = (side * wide, -(joints[part] - 0.95), -0.1 if part == "foot_index" else 0.0)
    return body + np.cumsum(rng.normal(0, 0.002, (40, 33, 3)), axis=0)


def check_landmarks(recording: Recording, points: np.ndarray) -> None:
    assert recording.marker_names == MEDIAPIPE_POSE
    assert recording.rate_hz == pytest.approx(1 / 0.033, rel=1e-3)
    assert recording.report is not None
    assert recording.report.up == "-y"
    assert recording.markers[..., 2] == pytest.approx(-points[..., 1], abs=1e-4)
    left, right = (recording.marker_names.index(f"{side}_hip") for side in ("left", "right"))
    toe = recording.marker_names.index("left_foot_index")
    across = recording.markers[0, left] - recording.markers[0, right]
    ahead = (
        recording.markers[0, toe] - recording.markers[0, recording.marker_names.index("left_heel")]
    )
    assert np.cross(ahead, across)[2] > 0  # left is left: nobody is mirrored


def test_freemocap_by_trajectory(tmp_path: Path, standing: Recording) -> None:
    names = [f"body_{name}" for name in standing.marker_names]
    header = ["timestamp", "timestamp_by_camera", *(f"{n}_{a}" for n in names for a in "xyz")]
    lines = [",".join(header)]
    for i, frame in enumerate(standing.markers * 1000.0):
        cells = ["" if np.isnan(x) else f"{x:.3f}" for x in frame.ravel()]
        lines.append(",".join([f"{1e9 * (5 + i / 30):.0f}", "\"{'cam': 1, 'b': 2}\"", *cells]))
    path = tmp_path / "a.csv"
    path.write_text("\n".join(lines) + "\n")
    recording = open_recording(path)
    assert recording.marker_names == tuple(names)
    assert recording.rate_hz == pytest.approx(30.0, rel=1e-4)
    assert recording.markers == pytest.approx(standing.markers, abs=1e-5, nan_ok=True)
    assert recording.report is not None
    assert recording.report.left_out == ("timestamp_by_camera",)


@pytest.mark.parametrize("form", ["pose_{i}_{a}", "kpt{i}.{a}", "landmark[{i}].{a}"])
def test_mediapipe_by_number_under_any_name(tmp_path: Path, form: str) -> None:
    names = [form.format(i=i, a=a) for i in range(len(MEDIAPIPE_POSE)) for a in "xyz"]
    assert tuple(meaning_of(names).markers) == MEDIAPIPE_POSE


@pytest.mark.parametrize(
    "form",
    [
        "markers.{m}.{a}",
        "{m}Pos{A}",
        "{m}T{A}",
        "{m}_world_{a}",
        "Anna_{m}_{a}",
        "('{m}', '{a}')",
        "{m}->{a}",
    ],
)
def test_words_that_all_names_share_fall_away(form: str, standing: Recording) -> None:
    names = standing.marker_names
    header = [form.format(m=m, a=a, A=a.upper()) for m in names for a in "xyz"]
    assert tuple(meaning_of(header).markers) == names


def test_words_that_tell_a_side_or_a_part_stay() -> None:
    for word in ("left", "L", "hand", "Head"):
        header = [f"{word}_{k:02d}m_{a}" for k in range(20) for a in "xyz"]
        assert all(name.startswith(f"{word}_") for name in meaning_of(header).markers)
    parts = [
        "shoulder",
        "upper_arm",
        "elbow",
        "forearm",
        "wrist",
        "hand",
        "hip",
        "thigh",
        "knee",
        "shank",
        "ankle",
        "toe",
    ]
    for side in ("left", "L"):  # of one side of a body
        header = [f"{side}_{part}_{a}" for part in parts for a in "xyz"]
        assert all(name.startswith(f"{side}_") for name in meaning_of(header).markers)


def test_orientations_beside_places_leave_them_markers(tmp_path: Path, standing: Recording) -> None:
    points = standing.markers
    columns = ("x", "y", "z", "qx", "qy", "qz", "qw")
    lines = [",".join(["time", *(f"{m}_{c}" for m in standing.marker_names for c in columns)])]
    for i, frame in enumerate(points):
        cells = [c for p in frame for c in (*cells_of(p), "0", "0", "0", "1")]
        lines.append(",".join([f"{i / 50}", *cells]))
    (tmp_path / "a.csv").write_text("\n".join(lines) + "\n")
    recording = open_recording(tmp_path / "a.csv")
    assert recording.marker_names == standing.marker_names
    np.testing.assert_allclose(recording.markers, points, atol=1e-6)
    assert "LFHD_qx" in recording.report.left_out


def test_pictures_are_not_taken_for_space(tmp_path: Path) -> None:
    points = landmarks()
    points = (points - points.min()) / (points.max() - points.min())
    header = ",".join(f"{n}_{a}" for n in MEDIAPIPE_POSE for a in "xyz")
    rows = [",".join(f"{x:.5f}" for x in frame.ravel()) for frame in points]
    path = tmp_path / "a.csv"
    path.write_text(f"{header}\n" + "\n".join(rows) + "\n")
    with pytest.warns(RecordingWarning, match="picture"):
        open_recording(path, hints=Hints(rate_hz=30.0))


def test_what_names_of_columns_mean() -> None:
    found = meaning_of(
        ["Frame", "Time (s)", "LeftShoulder_x", "LeftShoulder_y", "LeftShoulder_z", "Hips_rx",
         "Hips_ry", "Hips_rz", "Gyro_x", "Gyro_y", "Gyro_z", "LFHD.visibility", "q_w"]
    )  # fmt: skip
    assert found.frames == (0,)
    assert found.times == (1,)
    assert found.markers == {"LeftShoulder": (2, 3, 4)}
    assert found.confidences == (11,)


# exports of motion capture tools -------------------------------------------------------------


@pytest.mark.parametrize("version", ["1.23", "3.0"])
@pytest.mark.parametrize(
    ("units", "scale"),
    [("Meters", 1.0), ("Millimeters", 1000.0), ("Millimètres", 1000.0), ("Zentimeter", 100.0)],
)
def test_motive(tmp_path: Path, version: str, units: str, scale: float) -> None:
    points = person(20, 8)
    points[3:6, 1] = np.nan
    kinds = ["Rigid Body", "Marker", "Unlabeled", "Marker", "Bone", "Marker", "Marker", "Marker"]
    names = ["Wand", *(f"Anna:M{i}" for i in range(1, 7)), "Wand:Marker1"]
    path = write_motive(
        tmp_path / "a.csv", points, version=version, kinds=kinds, names=names, units=units,
        scale_to_file=scale, rate_hz=120.0,
    )  # fmt: skip
    recording = open_recording(path)
    assert recording.rate_hz == 120.0
    assert recording.marker_names == ("M1", "M3", "M5", "M6")
    assert recording.markers == pytest.approx(points[:, [1, 3, 5, 6]], abs=1e-6, nan_ok=True)
    assert recording.report is not None
    assert recording.report.format == "Motive CSV"
    assert {"Wand", "Anna:M4"} <= set(recording.report.left_out)


def test_motive_without_its_first_line(tmp_path: Path, standing: Recording) -> None:
    path = write_motive(tmp_path / "a.csv", standing.markers, names=list(standing.marker_names))
    path.write_text(path.read_text().split("\n", 2)[2])
    recording = open_recording(path)
    assert recording.marker_names == standing.marker_names
    np.testing.assert_allclose(recording.markers, standing.markers, atol=1e-5)


def test_motive_of_bones_alone_and_with_time_codes(tmp_path: Path) -> None:
    points = person(20, 6)
    path = write_motive(tmp_path / "a.csv", points, kinds=["Bone"] * 6)
    recording = open_recording(path)
    assert recording.markers == pytest.approx(points, abs=1e-6)
    assert "positions of bones" in said(recording)
    lines = write_motive(path, points).read_text().split("\n")
    for i, line in enumerate(lines):
        cells = line.split(",")
        if i >= 2 and len(cells) > 2:
            marks = {2: "", 3: "", 4: "", 5: "", 6: "TimeCode"}
            cells[2:2] = [marks.get(i, "15:26:46:12.02")]
            lines[i] = ",".join(cells)
    path.write_text("\n".join(lines))
    assert open_recording(path).markers == pytest.approx(points, abs=1e-6)


def test_nexus_with_other_blocks(tmp_path: Path) -> None:
    points = person(20, 5)
    points[2, 3] = np.nan
    before = "Devices\n1000\n,,Plate,,\nFrame,Sub Frame,Fx,Fy,Fz\n,,N,N,N\n1,0,1,2,3\n\n"
    behind = (
        "\nModel Outputs\n100\n,,Anna:LAnkle,,\nFrame,Sub Frame,X,Y,Z\n,,deg,deg,deg\n1,0,1,2,3\n"
    )
    for separator in (",", "\t", ";"):
        suffix = ".txt" if separator == "\t" else ".csv"
        path = write_nexus(
            tmp_path / f"a{suffix}", points, before=before, behind=behind, separator=separator,
            rate_hz=200.0,
        )  # fmt: skip
        recording = open_recording(path)
        assert recording.rate_hz == 200.0
        assert recording.marker_names == tuple(f"M{i}" for i in range(5))
        assert recording.markers == pytest.approx(points, abs=1e-6, nan_ok=True)
        assert recording.report is not None
        assert set(recording.report.left_out) == {"block 'devices'", "block 'model outputs'"}


@pytest.mark.parametrize("kind", [{}, {"counted": True}, {"headed": True}])
def test_qualisys(tmp_path: Path, kind: dict[str, bool]) -> None:
    points = person(20, 5)
    points[4:7, 2] = np.nan  # written as zeros
    recording = open_recording(write_qualisys(tmp_path / "a.tsv", points, rate_hz=300.0, **kind))
    assert recording.rate_hz == 300.0
    assert recording.marker_names == tuple(f"M{i}" for i in range(5))
    assert recording.markers == pytest.approx(points, abs=1e-6, nan_ok=True)


def test_qualisys_of_other_data(tmp_path: Path) -> None:
    path = write_qualisys(tmp_path / "a.tsv")
    path.write_text(path.read_text().replace("DATA_INCLUDED\t3D", "DATA_INCLUDED\t6D"))
    with pytest.raises(RecordingError, match="DATA_INCLUDED is '6D'"):
        open_recording(path)


# TRC -----------------------------------------------------------------------------------------


def in_milliseconds(row: str) -> str:
    cells = row.split("\t")
    return "\t".join([cells[0], f"{1000 * float(cells[1]):.1f}", *cells[2:]]) if row else row


def test_trc_spelled_otherwise(tmp_path: Path, standing: Recording) -> None:
    points = standing.markers[:, :8]
    path = write_trc(tmp_path / "a.trc", y_up(points), rate_hz=60.0, units="mm")
    text = path.read_text()
    lines = text.split("\n")
    names = [f"M{i}" for i in range(8)]
    rest = "\n".join(lines[6:])
    spelled = {
        "no blank line": "\n".join([*lines[:5], rest]),
        "names one after the other": "\n".join(
            [*lines[:3], "Frame#\tTime\t" + "\t".join(names), *lines[4:]]
        ),
        "a name a column": "\n".join(
            [
                *lines[:3],
                "Frame#\tTime\t" + "\t".join(f"{n}_{a}" for n in names for a in "xyz"),
                rest,
            ]
        ),
        "line ends": text.replace("\n", "\r\n"),
        "subject": text.replace("\tM", "\tAnna:M"),
        "no unit": text.replace("\tmm\t", "\t\t"),
        "frame from zero": text.replace("Frame#", "Frame"),
        "frame with a blank": text.replace("Frame#", "Frame #"),
        "capitals": text.replace("PathFileType", "PATHFILETYPE").replace("DataRate", "DATARATE"),
        "decimal commas": "\n".join(
            [*lines[:2], lines[2].replace(".", ","), *lines[3:6], rest.replace(".", ",")]
        ),
        "milliseconds": "\n".join([*lines[:6], *map(in_milliseconds, lines[6:])]),
        "a name three times": "\n".join(
            [*lines[:3], "Frame#\tTime\t" + "\t".join(n for n in names for _ in "xyz"), rest]
        ),
    }
    for what, content in spelled.items():
        path.write_bytes(content.encode())
        recording = open_recording(path)
        assert recording.marker_names == tuple(names), what
        assert recording.rate_hz == pytest.approx(60.0), what
        assert recording.markers == pytest.approx(points, abs=1e-6, nan_ok=True), what


def test_trc_with_trailing_cells_cut_and_unnamed_columns(tmp_path: Path) -> None:
    points = person(20, 6)
    points[3:6, 4:] = np.nan
    path = write_trc(tmp_path / "a.trc", y_up(points))
    lines = [
        line.rstrip("\t") if i > 5 else line for i, line in enumerate(path.read_text().split("\n"))
    ]
    path.write_text("\n".join(lines))
    recording = open_recording(path)
    assert recording.markers == pytest.approx(points, abs=1e-6, nan_ok=True)
    assert "3 of 20 rows end early" in said(recording)
    whole = write_trc(path, y_up(points)).read_text().split("\n")
    path.write_text("\n".join(f"{x}\t1\t2\t3" if i > 5 and x else x for i, x in enumerate(whole)))
    recording = open_recording(path)
    assert recording.markers == pytest.approx(points, abs=1e-6, nan_ok=True)
    assert "more columns than names" in said(recording)


# C3D -----------------------------------------------------------------------------------------


@pytest.mark.parametrize("flipped", ["-Z", "+Z"])
@pytest.mark.parametrize("forward", ["-X", "+X", "+Y", "-Y"])
def test_c3d_with_screen_axes_of_opposite_sign(
    tmp_path: Path, standing: Recording, flipped: str, forward: str
) -> None:
    screen = {("POINT", "X_SCREEN"): [forward], ("POINT", "Y_SCREEN"): [flipped]}
    names = list(standing.marker_names)
    path = write_c3d(tmp_path / "a.c3d", standing.markers, names=names, extra=screen)
    recording = open_recording(path)
    heights = standing.markers[..., 2]
    assert recording.markers[..., 2] == pytest.approx(heights, abs=1e-5, nan_ok=True)
    if flipped == "-Z":
        assert "the file says -z" in said(recording)
        assert recording.markers == pytest.approx(standing.markers, abs=1e-5, nan_ok=True)


@pytest.mark.parametrize("first", [1, 65_530, 70_001, 2_000_000])
def test_c3d_with_high_frame_numbers(tmp_path: Path, first: int) -> None:
    points = person(80, 5)
    last = first + 79
    words = {("TRIAL", "ACTUAL_START_FIELD"): first, ("TRIAL", "ACTUAL_END_FIELD"): last}
    extra = {key: [float(n % 65536), float(n // 65536)] for key, n in words.items()}
    path = write_c3d(tmp_path / "a.c3d", points, extra=extra)  # type: ignore[arg-type]
    data = bytearray(path.read_bytes())
    for at, number in ((6, first), (8, last)):
        data[at : at + 2] = min(number, 65535).to_bytes(2, "little")
    path.write_bytes(data)
    recording = open_recording(path)
    assert len(recording) == 80
    assert recording.markers == pytest.approx(points, abs=1e-6)


def test_c3d_of_more_than_255_points(tmp_path: Path) -> None:
    points = person(6, 300)
    names = [f"P{i:03d}" for i in range(300)]
    path = write_c3d(
        tmp_path / "a.c3d", points, names=names[:255], extra={("POINT", "LABELS2"): names[255:]}
    )
    recording = open_recording(path)
    assert recording.marker_names == tuple(names)
    assert recording.markers == pytest.approx(points, abs=1e-6)


@pytest.mark.parametrize(
    ("labels", "expected"),
    [
        (["A", "B", "", "D", "E", "F"], "ABDEF"),
        (["Anna:A", "Anna:B", "Anna:C", "D", "E", "F"], "ABCDEF"),
        (["A", "B", "C", "Unlabeled 7", "*12", "uname*3"], "ABC"),
        (["A", "B", "C", "unlabeled_7", "Unidentified8", "Unknown_9"], "ABC"),
        (["A", "B", "B", "B", "E", "F"], "ABEF"),
    ],
)
def test_c3d_labels(tmp_path: Path, labels: list[str], expected: str) -> None:
    points = person(10, 6)
    recording = open_recording(write_c3d(tmp_path / "a.c3d", points, names=labels))
    assert recording.marker_names == tuple(expected)
    plain = [label.split(":")[-1] for label in labels]
    for name in expected:
        at = recording.marker_names.index(name)
        assert recording.markers[:, at] == pytest.approx(points[:, plain.index(name)], abs=1e-6)


@pytest.mark.parametrize(
    ("text", "scale"),
    [
        *(("Millimeters", 1e3), ("mill", 1e3), ("mete", 1.0), ("centimeters", 100.0), ("", 1e3)),
        *(("inch", 1 / 0.0254), ("um", 1e6), ("micr", 1e6)),
    ],
)
def test_c3d_units_in_words(tmp_path: Path, standing: Recording, text: str, scale: float) -> None:
    names = list(standing.marker_names)
    path = write_c3d(
        tmp_path / "a.c3d", standing.markers, names=names, units=text, scale_to_file=scale
    )
    recording = open_recording(path)
    assert recording.markers == pytest.approx(standing.markers, abs=1e-5, nan_ok=True)


def test_c3d_whose_unit_is_wrong(tmp_path: Path, standing: Recording) -> None:
    names = list(standing.marker_names)
    path = write_c3d(
        tmp_path / "a.c3d", standing.markers, names=names, units="mm", scale_to_file=1.0
    )
    with pytest.warns(RecordingWarning, match="taken as m, by the size of the person"):
        recording = open_recording(path)
    assert recording.markers == pytest.approx(standing.markers, abs=1e-5, nan_ok=True)


def test_c3d_leaves_the_axes_of_bones_out(tmp_path: Path) -> None:
    points = person(20, 9)
    from scipy.spatial.transform import Rotation

    turns = Rotation.random(20, random_state=0).as_matrix()
    for i, axis in enumerate(np.eye(3)):
        points[:, 6 + i] = points[:, 5] + 0.1 * turns @ axis
    names = ["M0", "M1", "M2", "M3", "M4", "PELO", "PELA", "PELL", "PELP"]
    recording = open_recording(write_c3d(tmp_path / "a.c3d", points, names=names))
    assert recording.marker_names == ("M0", "M1", "M2", "M3", "M4")
    assert recording.report is not None
    assert set(recording.report.left_out) == {"PELO", "PELA", "PELL", "PELP"}
    points[:, 8] = person(20, 1, seed=9)[:, 0]  # a marker of that name is a marker
    assert len(open_recording(write_c3d(tmp_path / "b.c3d", points, names=names)).marker_names) == 9


def test_csv_of_another_kind_is_said_to_be_flat(tmp_path: Path) -> None:
    path = write_csv(tmp_path / "a.csv", person(12, 4))
    text = path.read_text().replace(".z", ".w")
    path.write_text(text)
    assert not open_recording(path).is_markers


@pytest.mark.parametrize("between", [",", "  "])
@pytest.mark.filterwarnings("ignore::mplearn.errors.RecordingWarning")  # whose body it is
def test_trc_without_tabs(tmp_path: Path, between: str) -> None:
    path = write_trc(tmp_path / "a.trc")
    plain = open_recording(path)
    path.write_text(re.sub("\t+" if between.isspace() else "\t", between, path.read_text()))
    found = open_recording(path)
    assert found.channels == plain.channels and found.rate_hz == plain.rate_hz
    assert np.allclose(found.frames, plain.frames, equal_nan=True)


@pytest.mark.filterwarnings("ignore::mplearn.errors.RecordingWarning")
def test_motive_whose_only_free_markers_are_not_identified(tmp_path: Path) -> None:
    path = write_motive(tmp_path / "a.csv")
    plain = open_recording(path)
    lines = path.read_text().splitlines()
    kinds = next(i for i, line in enumerate(lines) if "Marker" in line)
    bones = [re.sub(r"\bMarker\b", "Bone Marker", lines[kinds]) + ",Marker" * 3]
    rows = [lines[kinds + 1] + ",Unlabeled 1001" * 3]
    for line in lines[kinds + 2 :]:
        last = line == lines[-1] or line[:1].isdigit()
        first = line.split(",")[0]
        axes = ",X,Y,Z" if first == "Frame" else ",Position" * 3 if "Position" in line else ",1,1,1"
        rows.append(line + (",0.1,0.2,0.3" if last and first.isdigit() else axes))
    path.write_text("\n".join([*lines[:kinds], *bones, *rows]) + "\n")
    found = open_recording(path)
    assert found.channels == plain.channels
    assert np.allclose(found.frames, plain.frames, equal_nan=True)


@pytest.mark.parametrize("apart", [False, True])
@pytest.mark.parametrize("reference", ["GLOBAL", "LOCAL"])
def test_a_skeleton_of_qualisys(
    tmp_path: Path, standing: Recording, reference: str, apart: bool
) -> None:
    names, points = standing.marker_names, 1000.0 * standing.markers
    axes = ("X", "Y", "Z", "QX", "QY", "QZ", "QW")
    named = [[m, *axes] if apart else [f"{m} {axis}" for axis in axes] for m in names]
    columns = "\t".join(cell for each in named for cell in each)
    lines = [f"NO_OF_FRAMES\t{len(points)}", "FREQUENCY\t50", f"REFERENCE\t{reference}"]
    lines.append(f"Frame\tTime\t{columns}")
    for i, frame in enumerate(points):
        own = [""] if apart else []  # below the name
        cells = "\t".join("\t".join([*own, *cells_of(p), "0", "0", "0", "1"]) for p in frame)
        lines.append(f"{i + 1}\t{i / 50:.5f}\t{cells}")
    path = tmp_path / "a.tsv"
    path.write_text("\n".join(lines) + "\n")
    if reference == "LOCAL":
        with pytest.raises(RecordingError, match="REFERENCE is LOCAL"):
            open_recording(path)
        return
    recording = open_recording(path)
    assert recording.marker_names == names
    np.testing.assert_allclose(recording.markers, standing.markers, atol=1e-5)


def test_bodies_of_qualisys_are_named_as_what_they_are(tmp_path: Path) -> None:
    path = tmp_path / "a.tsv"
    path.write_text(
        "NO_OF_FRAMES\t1\nFREQUENCY\t50\nDATA_INCLUDED\t6D\nBODY_NAMES\tWand\n1\t2\t3\n"
    )
    with pytest.raises(RecordingError, match="DATA_INCLUDED is '6D'; expected '3D'"):
        open_recording(path)


def test_c3d_whose_points_are_all_said_to_be_unmeasured(
    tmp_path: Path, standing: Recording
) -> None:
    path = write_c3d(tmp_path / "a.c3d", standing.markers, names=list(standing.marker_names))
    plain = open_recording(path)
    data = bytearray(path.read_bytes())
    begin = 512 * (int.from_bytes(data[16:18], "little") - 1)
    n_points = len(standing.marker_names)
    floats = np.frombuffer(bytes(data[begin : begin + 16 * n_points * len(plain)]), "<f4").copy()
    floats[3::4] = -1.0
    data[begin : begin + floats.nbytes] = floats.tobytes()
    path.write_bytes(bytes(data))
    recording = open_recording(path)
    np.testing.assert_array_equal(recording.frames, plain.frames)
    assert "no point is said to be measured" in said(recording)
