"""UI-PRMD, C3D, TRC and CSV: what was written is what is read."""

from __future__ import annotations

import re
import struct
from pathlib import Path

import numpy as np
import pytest
from mocap_writers import (
    person,
    write_c3d,
    write_csv,
    write_storage,
    write_trc,
    write_ui_prmd,
)

from mplearn.errors import InvalidValueError, RecordingError, RecordingWarning
from mplearn.mocap import (
    Hints,
    open_recording,
    open_recordings,
    open_takes,
    readers,
    registry,
    take_names,
)
from mplearn.mocap.markers.ui_prmd import PLUG_IN_GAIT_MARKERS
from mplearn.mocap.placing.space import to_z_up
from mplearn.recording import LabelledSegment


def spans(labels: tuple[LabelledSegment, ...]) -> list[tuple[int, int, str]]:
    return [(s.start, s.end, s.label) for s in labels]


# UI-PRMD -------------------------------------------------------------------------------------


def write_repetitions(folder: Path, names: list[str], length: int = 5) -> np.ndarray:
    points = person(length * len(names), 39)
    for i, name in enumerate(names):
        write_ui_prmd(folder / name, points[i * length : (i + 1) * length])
    return points


def test_repetitions_join_to_takes(tmp_path: Path) -> None:
    names = [f"m02_s03_e{i:02d}_positions.txt" for i in range(1, 11)]
    points = write_repetitions(tmp_path, names)
    (take,) = open_recordings(tmp_path)
    assert (take.name, take.person, take.rate_hz) == ("m02_s03", "s03", 100.0)
    assert take.marker_names == PLUG_IN_GAIT_MARKERS
    assert take.markers == pytest.approx(points, abs=1e-8)
    assert spans(take.labels) == [(5 * i, 5 * i + 5, "m02") for i in range(10)]
    assert {label.person for label in take.labels} == {"s03"}


def test_takes_of_a_folder_in_order_and_by_name(tmp_path: Path) -> None:
    for name in ("m02_s01", "m01_s02", "m01_s01"):
        write_repetitions(tmp_path, [f"{name}_e{i:02d}_positions_inc.txt" for i in (1, 2)])
    (tmp_path / "README.txt").write_text("not a recording")
    assert take_names(tmp_path) == ("m01_s01", "m01_s02", "m02_s01")
    assert [take.name for take in open_recordings(tmp_path)] == list(take_names(tmp_path))
    assert open_recording(tmp_path, take="m01_s02").person == "s02"
    with pytest.raises(RecordingError, match=r"3 takes.*m01_s01, m01_s02, m02_s01"):
        open_recording(tmp_path)
    with pytest.raises(RecordingError, match=r"no take 'm09_s01'.*m01_s01, m01_s02, m02_s01"):
        open_recording(tmp_path, take="m09_s01")


def test_a_missing_repetition_divides_the_take(tmp_path: Path) -> None:
    write_repetitions(tmp_path, [f"m01_s01_e{i:02d}_positions.txt" for i in (2, 3, 5, 6, 7)])
    assert take_names(tmp_path) == ("m01_s01_e02-e03", "m01_s01_e05-e07")
    assert len(open_recording(tmp_path, take="m01_s01_e05-e07")) == 15


def test_the_same_repetition_twice(tmp_path: Path) -> None:
    write_repetitions(tmp_path, ["m01_s01_e01_positions.txt", "m01_s01_e01_positions_inc.txt"])
    with pytest.raises(RecordingError, match="each repetition once"):
        open_recordings(tmp_path)


def test_zero_is_occluded(tmp_path: Path) -> None:
    points = person(6, 39)
    points[2, 4] = 0.0
    points[3, 5, 0] = 0.0  # one zero coordinate is a measurement
    recording = open_recording(write_ui_prmd(tmp_path / "m01_s01_e01_positions.txt", points))
    assert np.argwhere(np.isnan(recording.markers).any(axis=2)).tolist() == [[2, 4]]
    assert recording.name == "m01_s01_e01"
    assert spans(recording.labels) == [(0, 6, "m01")]


# C3D -----------------------------------------------------------------------------------------


def test_c3d_round_trip(tmp_path: Path) -> None:
    points = person(30, 7)
    points[4:9, 2] = np.nan
    names = [f"Anna:P{i}" for i in range(7)]
    path = write_c3d(tmp_path / "walk.c3d", points, names=names, rate_hz=120.0, analog=True)
    recording = open_recording(path)
    assert recording.rate_hz == 120.0
    assert recording.marker_names == tuple(f"P{i}" for i in range(7))
    assert np.array_equal(np.isnan(recording.markers), np.isnan(points))
    assert recording.markers == pytest.approx(points, abs=1e-6, nan_ok=True)  # stored as float32


def other_machines(data: bytes, n_points: int, processor: int, scale: float | None) -> bytes:
    """Rewrite a small C3D file of a PC with reals, as a DEC or an SGI, or with integers."""
    order = ">" if processor == 86 else "<"

    def real(value: float) -> bytes:
        if processor != 85:
            return struct.pack(order + "f", value)
        low, high = struct.unpack("<2H", struct.pack("<f", 4.0 * value))
        return struct.pack("<2H", high, low)

    out = bytearray(data)
    for at in range(2, 24, 2):
        if at not in (12, 14, 20, 22):
            struct.pack_into(order + "H", out, at, *struct.unpack_from("<H", data, at))
    for at in (12, 20):
        out[at : at + 4] = real(*struct.unpack_from("<f", data, at))
    if scale is not None:
        out[12:16] = real(scale)
    at = 516
    out[515] = processor
    while data[at]:
        link = at + 2 + abs(struct.unpack_from("b", data, at)[0])
        (step,) = struct.unpack_from("<h", data, link)
        struct.pack_into(order + "h", out, link, step)
        if data[at + 1] < 128:
            kind, n_dimensions = struct.unpack_from("bB", data, link + 2)
            begin = link + 4 + n_dimensions
            for i in range(int(np.prod([*data[link + 4 : begin]]))):
                if kind == 2:
                    value = struct.unpack_from("<h", data, begin + 2 * i)
                    struct.pack_into(order + "h", out, begin + 2 * i, *value)
                elif kind == 4:
                    (number,) = struct.unpack_from("<f", data, begin + 4 * i)
                    if scale is not None and data[at + 2 : link] == b"SCALE":
                        number = scale
                    out[begin + 4 * i : begin + 4 * i + 4] = real(number)
        at = link + step
    start = 512 * (struct.unpack_from("<H", data, 16)[0] - 1)
    count = 4 * n_points * (1 + struct.unpack_from("<2H", data, 6)[1] - data[6])
    reals = struct.unpack_from(f"<{count}f", data, start)
    if scale is None:
        return bytes(out[:start]) + b"".join(map(real, reals))
    whole = [v if i % 4 == 3 else v / scale for i, v in enumerate(reals)]
    return bytes(out[:start]) + b"".join(struct.pack(order + "h", round(v)) for v in whole)


@pytest.mark.parametrize("scale", [None, 0.1])
@pytest.mark.parametrize("processor", [84, 85, 86])
def test_c3d_of_every_machine(tmp_path: Path, processor: int, scale: float | None) -> None:
    points = person(20, 5)
    path = write_c3d(tmp_path / "a.c3d", points, rate_hz=120.0)
    path.write_bytes(other_machines(path.read_bytes(), 5, processor, scale))
    recording = open_recording(path)
    assert recording.rate_hz == 120.0
    assert recording.markers == pytest.approx(points, abs=1e-6 if scale is None else 6e-5)
    if processor == 84:
        import ezc3d

        theirs = np.moveaxis(ezc3d.c3d(str(path))["data"]["points"][:3], 0, -1).swapaxes(0, 1)
        assert recording.markers == pytest.approx(theirs / 1000.0, abs=1e-9)


@pytest.mark.parametrize("processor", [85, 86])
def test_c3d_whose_last_parameter_has_its_offset_in_another_order(
    tmp_path: Path, processor: int
) -> None:
    points = person(20, 5)
    path = write_c3d(tmp_path / "a.c3d", points)
    data = bytearray(other_machines(path.read_bytes(), 5, processor, None))
    order = ">" if processor == 86 else "<"
    at = last = 516
    while data[at]:
        link = at + 2 + abs(struct.unpack_from("b", data, at)[0])
        last, at = link, link + struct.unpack_from(order + "h", data, link)[0]
    data[last : last + 2] = data[last : last + 2][::-1]
    path.write_bytes(data)
    assert open_recording(path).markers == pytest.approx(points, abs=1e-6)


def test_c3d_cut_off(tmp_path: Path) -> None:
    path = write_c3d(tmp_path / "a.c3d", person(300, 20))
    path.write_bytes(path.read_bytes()[:-2000])
    with pytest.warns(RecordingWarning, match=r"300 frames, 294 are there"):
        recording = open_recording(path)
    assert recording.markers == pytest.approx(person(300, 20)[:294], abs=1e-6)
    path.write_bytes(path.read_bytes()[: -294 * 20 * 16])
    with pytest.raises(RecordingError, match=r"300 frames.*bytes"):
        open_recording(path)


@pytest.mark.parametrize(("units", "scale"), [("m", 1.0), ("cm", 100.0), ("mm", 1000.0)])
def test_c3d_units(tmp_path: Path, units: str, scale: float) -> None:
    points = person()
    path = write_c3d(tmp_path / "a.c3d", points, units=units, scale_to_file=scale)
    assert open_recording(path).markers == pytest.approx(points, abs=1e-6)


def test_c3d_axes_are_the_files(tmp_path: Path) -> None:
    points = person()
    in_file = np.stack([points[..., 0], points[..., 2], -points[..., 1]], axis=-1)  # y up
    screen = {("POINT", "X_SCREEN"): ["+X"], ("POINT", "Y_SCREEN"): ["+Y"]}
    path = write_c3d(tmp_path / "a.c3d", in_file, extra=screen)
    assert open_recording(path).markers == pytest.approx(points, abs=1e-6)
    screen["POINT", "X_SCREEN"] = ["-Y"]
    with pytest.raises(RecordingError, match="SCREEN"):
        open_recording(write_c3d(tmp_path / "b.c3d", in_file, extra=screen))


def test_c3d_negative_residual_is_occluded(tmp_path: Path) -> None:
    path = write_c3d(tmp_path / "a.c3d", person(6, 5))
    data = bytearray(path.read_bytes())
    start = 512 * (int.from_bytes(data[16:18], "little") - 1)
    place = start + (3 * 5 + 2) * 16 + 12  # residual of marker 2 in frame 3
    data[place : place + 4] = np.float32(-1.0).tobytes()
    path.write_bytes(data)
    missing = np.isnan(open_recording(path).markers)
    assert np.argwhere(missing.any(axis=2)).tolist() == [[3, 2]]


@pytest.mark.filterwarnings("ignore::mplearn.errors.RecordingWarning")  # four points: which is up?
def test_c3d_leaves_model_outputs_and_unnamed_trajectories_out(tmp_path: Path) -> None:
    names = ["LASI", "LHipAngles", "*7", "RASI", "LTOE", "RTOE"]
    path = write_c3d(
        tmp_path / "a.c3d", person(), names=names, extra={("POINT", "ANGLES"): ["LHipAngles"]}
    )
    assert open_recording(path).marker_names == ("LASI", "RASI", "LTOE", "RTOE")


@pytest.mark.filterwarnings("ignore::mplearn.errors.RecordingWarning")  # no person: which is up?
def test_c3d_of_two_people_keeps_their_prefixes(tmp_path: Path) -> None:
    names = [f"{who}:{name}" for who in ("Anna", "Ben") for name in ("LASI", "RASI", "CLAV")]
    path = write_c3d(tmp_path / "a.c3d", person(), names=names)
    assert open_recording(path).marker_names == tuple(names)


def test_c3d_without_points(tmp_path: Path) -> None:
    path = write_c3d(tmp_path / "a.c3d")
    data = bytearray(path.read_bytes())
    data[2:4] = b"\0\0"  # the header's number of points
    path.write_bytes(data)
    with pytest.raises(RecordingError, match=r"a\.c3d: .*no points"):
        open_recording(path)


def test_c3d_same_name_twice(tmp_path: Path) -> None:
    path = write_c3d(tmp_path / "a.c3d", person(), names=["A", "B", "A", "C", "D", "E"])
    with pytest.warns(RecordingWarning, match=r"same name more than once: A; the first"):
        recording = open_recording(path)
    assert recording.marker_names == ("A", "B", "C", "D", "E")
    assert recording.markers[:, 0] == pytest.approx(person()[:, 0], abs=1e-6)
    assert recording.report is not None
    assert recording.report.left_out == ("A",)


# TRC -----------------------------------------------------------------------------------------


def test_trc_is_y_up_and_x_forward(tmp_path: Path) -> None:
    points = person(20, 5)
    points[3:6, 1] = np.nan
    in_file = np.stack([points[..., 0], points[..., 2], -points[..., 1]], axis=-1)
    recording = open_recording(write_trc(tmp_path / "a.trc", in_file, rate_hz=60.0))
    assert recording.rate_hz == 60.0
    assert recording.marker_names == ("M0", "M1", "M2", "M3", "M4")
    assert recording.markers == pytest.approx(points, abs=1e-7, nan_ok=True)


@pytest.mark.filterwarnings("ignore::mplearn.errors.RecordingWarning")  # three points
def test_trc_in_metres_and_a_dropped_frame(tmp_path: Path) -> None:
    points = person(10, 3)
    path = write_trc(tmp_path / "a.trc", points, units="m", scale_to_file=1.0)
    lines = path.read_text().split("\n")
    del lines[10]
    path.write_text("\n".join(lines).replace("\t10\t3\tm", "\t9\t3\tm"))
    recording = open_recording(path)
    assert len(recording) == 10
    assert np.flatnonzero(np.isnan(recording.frames).all(axis=1)).tolist() == [4]


@pytest.mark.parametrize(
    ("old", "new", "found"),
    [
        ("PathFileType", "FileType", "starts with"),
        ("Frame#", "Frames", "line 4"),
        ("\tmm\t", "\tparsec\t", "parsec"),
        ("0.05000", "0.04000", "time goes back"),
        ("0.05000", "0.04600", None),
        ("100.00\t100.00", "often\t100.00", "DataRate"),
    ],
)
def test_broken_trc(tmp_path: Path, old: str, new: str, found: str | None) -> None:
    path = write_trc(tmp_path / "a.trc")
    assert old in path.read_text()
    path.write_text(path.read_text().replace(old, new, 1))
    if found is None:  # times that jitter by less than half a frame are rounded, not wrong
        assert len(open_recording(path)) == 12
        return
    with pytest.raises(RecordingError, match=rf"a\.trc.*{found}"):
        open_recording(path)


@pytest.mark.parametrize(
    ("old", "new", "n_markers", "said"),
    [
        ("\t6\tmm", "\t7\tmm", 6, "NumMarkers is 7, but 6 names"),
        ("\t12\t6", "\t11\t6", 6, "NumFrames is 11, but 12 frames"),
        ("M5", "M4", 5, "more than once: M4"),
        ("100.00\t100.00", "none\t100.00", 6, "DataRate is none, the times say 100 Hz"),
        ("100.00\t100.00", "250.00\t250.00", 6, "DataRate is 250.00, the times say 100 Hz"),
    ],
)
def test_trc_whose_header_contradicts_it(
    tmp_path: Path, old: str, new: str, n_markers: int, said: str
) -> None:
    path = write_trc(tmp_path / "a.trc")
    whole = open_recording(path)
    path.write_text(path.read_text().replace(old, new, 1))
    with pytest.warns(RecordingWarning, match=said):
        recording = open_recording(path)
    assert recording.rate_hz == pytest.approx(100.0)
    assert np.array_equal(recording.frames, whole.frames[:, : 3 * n_markers])


# CSV -----------------------------------------------------------------------------------------


def test_csv_with_times_labels_segments_and_a_person(tmp_path: Path) -> None:
    points = person(10, 2)
    points[4, 1] = np.nan
    columns = {
        "label": ["", "squat", "squat", "squat", "squat", "", "bow", "bow", "kick", "kick"],
        "segment": list("0112203344"),
        "person": ["anna"] * 10,
    }
    recording = open_recording(write_csv(tmp_path / "a.csv", points, rate_hz=50, columns=columns))
    assert recording.rate_hz == pytest.approx(50.0)
    assert recording.markers == pytest.approx(points, abs=0, nan_ok=True)
    assert recording.person == "anna"
    assert spans(recording.labels) == [
        (1, 3, "squat"),
        (3, 5, "squat"),
        (6, 8, "bow"),
        (8, 10, "kick"),
    ]


@pytest.mark.parametrize("separator", [";", "\t", ","])
def test_points_are_between_thousands_of_whole_numbers_too(tmp_path: Path, separator: str) -> None:
    rows = [("time", "load"), *((f"0,{k:02}", "999,5") for k in range(50)), ("0,50", "1.013")]
    path = tmp_path / "a.csv"
    for last, whole in (("1.013,5", 1013.0), ("999,5", 1.013)):  # nothing else tells
        cells = [[f'"{cell}"' for cell in row] for row in (*rows, ("0,51", last))]
        path.write_text("\n".join(separator.join(row) for row in cells) + "\n")
        assert open_recording(path).frames[[0, 50], 0].tolist() == [999.5, whole]


def test_csv_of_angles_with_semicolons_and_quotes(tmp_path: Path) -> None:
    path = tmp_path / "a.csv"
    path.write_text('knee; hip ;"label"\n0.5;1;"down; slowly"\n;2;up\n')
    recording = open_recording(path, hints=Hints(rate_hz=30.0))
    assert recording.channels == ("knee", "hip")
    assert recording.frames == pytest.approx(np.array([[0.5, 1], [np.nan, 2]]), nan_ok=True)
    assert spans(recording.labels) == [(0, 1, "down; slowly"), (1, 2, "up")]
    with pytest.raises(RecordingError, match=r"no rate.*rate_hz"):
        open_recording(path)


@pytest.mark.parametrize("rate_hz", [20.0, 59.94, 120.0, 250.0])
def test_csv_times_may_be_rounded_to_milliseconds(tmp_path: Path, rate_hz: float) -> None:
    path = tmp_path / "a.csv"
    rows = "".join(f"{i / rate_hz:.3f},{i}\n" for i in range(500) if i not in (100, 101))
    path.write_text("time,x\n" + rows)
    recording = open_recording(path)
    assert recording.rate_hz == pytest.approx(rate_hz, rel=1e-3)
    assert len(recording) == 500
    assert np.flatnonzero(np.isnan(recording.frames[:, 0])).tolist() == [100, 101]


@pytest.mark.parametrize(
    ("text", "found"),
    [
        ("1,2,3\n4,5,6\n", "first row holds numbers"),
        ("a,a\n1,2\n", "columns named"),
        ("a,,b\n1,2,3\n", "columns named"),
        ("time,label\n0,x\n", "0 channels"),
        ("time,a\n", "0 rows"),
        ("time,t,a\n0,0,1\n", "several columns of times"),
        ("time,a\n0,1\n0,2\n", "goes back"),
        ("time,a\n0,1\n1,2\n1.5,2\n2.5,3\n3.5,3\n4.5,3\n5.5,3\n", "off an even rate|goes back"),
        ("time,a\n0,1\n1,2\n2,2\n3,2\n1e9,2\n", "no frames"),
        ("time,a\n0,1\n,2\n", "time is missing"),
        ("time,a,person\n0,1,anna\n1,2,ben\n", "several persons"),
        ('time,a\n0,"1\n', "not a table|number"),
        ("time,a\n0,1\n1\n", "1 columns"),
    ],
)
def test_broken_csv(tmp_path: Path, text: str, found: str) -> None:
    path = tmp_path / "a.csv"
    path.write_text(text)
    with pytest.raises(RecordingError, match=rf"a\.csv.*({found}).*expected"):
        open_recording(path)


# folders, suffixes, hints --------------------------------------------------------------------


def test_unknown_suffix_and_unreadable_folders(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    without = [each for each in readers() if ".h5" not in each.suffixes]
    monkeypatch.setattr(registry, "_registered", without)  # as without h5py
    other = tmp_path / "take.mp4"
    other.write_bytes(b"film")
    with pytest.raises(RecordingError, match=r"unknown suffix '\.mp4'.*\.c3d"):
        open_recording(other)
    for name in ("mouse.h5", "mouse.slp"):  # which DeepLabCut and SLEAP write as tables, too
        (tmp_path / name).write_bytes(b"\x89HDF\r\n\x1a\n" + bytes(64) + b"df_with_missing")
        with pytest.raises(RecordingError, match=r"unknown suffix.*its CSV instead: of DeepLabCut"):
            open_recording(tmp_path / name)
        with pytest.raises(RecordingError, match=rf"{name}.*its CSV instead: of DeepLabCut"):
            open_recordings(tmp_path)
        table = write_csv(tmp_path / "walk.csv")
        assert list(open_takes(tmp_path).unreadable) == [name]
        table.rename(tmp_path / "mouse.analysis.csv")  # as it is exported
        assert not open_takes(tmp_path).unreadable
        (tmp_path / "journal.jsonl").write_text("{}\n")  # as shards have, and anybody
        assert not open_takes(tmp_path).unreadable
        (tmp_path / "journal.jsonl").unlink()
        (tmp_path / "mouse.analysis.csv").unlink()
        (tmp_path / name).unlink()
    with pytest.raises(RecordingError, match=rf"{re.escape(str(tmp_path))}.*nothing readable"):
        open_recordings(tmp_path)
    (tmp_path / "weather.h5").write_bytes(b"\x89HDF\r\n\x1a\n" + bytes(64) + b"temperatures")
    with pytest.raises(RecordingError, match="nothing readable"):  # that is nobody's motion
        open_takes(tmp_path)
    table = write_csv(tmp_path / "walk.csv")
    assert open_takes(tmp_path, strict=True).passed_over == ("weather.h5",)
    table.unlink()
    (tmp_path / "weather.h5").unlink()
    for folder in ("anna", "notes"):
        (tmp_path / folder).mkdir()
    write_csv(tmp_path / "anna" / "walk.csv")
    with pytest.raises(RecordingError, match=r"in folders of it, anna, is found by find_takes"):
        open_recordings(tmp_path)
    with pytest.raises(RecordingError, match="no such file or folder"):
        open_recordings(tmp_path / "none")
    with pytest.raises(RecordingError, match="first row holds numbers"):
        open_recording(write_ui_prmd(tmp_path / "squat.txt"))
    with pytest.raises(RecordingError, match="no take 'other'"):
        open_recording(write_csv(tmp_path / "a.csv"), take="other")


def test_two_formats_of_one_take(tmp_path: Path) -> None:
    write_csv(tmp_path / "a.csv")
    write_c3d(tmp_path / "a.c3d")
    write_trc(tmp_path / "b.trc")
    assert take_names(tmp_path) == ("a.c3d", "a.csv", "b")
    assert open_recording(tmp_path, take="a.csv").name == "a"
    (tmp_path / "a.csv.gz").write_bytes(b"")
    with pytest.raises(RecordingError, match="each take once"):
        take_names(tmp_path)


@pytest.mark.parametrize("wrong", [{"rate_hz": 0.0}, {"unit_m": -1.0}, {"up_axis": "w"}])
def test_wrong_hints(wrong: dict[str, object]) -> None:
    with pytest.raises(InvalidValueError, match=next(iter(wrong))):
        Hints(**wrong)  # type: ignore[arg-type]


@pytest.mark.parametrize("up", ["x", "y", "z", "-x", "-y", "-z", "+Z"])
@pytest.mark.parametrize("forward", ["x", "-y", "Z"])
def test_axes_turn_without_mirroring(up: str, forward: str) -> None:
    if up.strip("+-").lower() == forward.strip("+-").lower():
        with pytest.raises(InvalidValueError, match="different axes"):
            to_z_up(up, forward)
        return
    turn = to_z_up(up, forward)
    assert np.linalg.det(turn) == pytest.approx(1.0)
    assert turn @ turn.T == pytest.approx(np.eye(3))


@pytest.mark.parametrize("vectors", [False, True])
def test_markers_in_tables_of_opensim(tmp_path: Path, vectors: bool) -> None:
    points = person(20, 8)
    take = open_recording(write_storage(tmp_path / "a.sto", points, vectors=vectors))
    assert take.marker_names == tuple(f"M{i}" for i in range(8))
    assert take.markers == pytest.approx(points, abs=1e-6)


def test_coordinates_of_opensim_are_radians_and_metres(tmp_path: Path) -> None:
    path = tmp_path / "ik.mot"
    path.write_text(
        "Coordinates\nversion=1\nnRows=2\nnColumns=3\ninDegrees=yes\n\nUnits are S.I. units\n\n"
        "endheader\n    time\tpelvis_tilt\tpelvis_ty\n"
        "  0.00\t  90.0\t  0.95\n  0.01\t 180.0\t 1.0\n"
    )
    take = open_recording(path)
    assert take.channels == ("pelvis_tilt", "pelvis_ty")
    assert take.rate_hz == pytest.approx(100.0)
    assert take.frames == pytest.approx(np.array([[np.pi / 2, 0.95], [np.pi, 1.0]]))
    path.write_text(path.read_text().replace("endheader", ""))
    with pytest.raises(RecordingError, match="endheader"):
        open_recording(path)


@pytest.mark.parametrize(
    "name", ["pelvis_tx", "knee_ty_r", "/jointset/ground_pelvis/pelvis_tz/value", "femur_r_X"]
)
def test_lengths_among_angles_of_opensim_stay_metres(tmp_path: Path, name: str) -> None:
    path = tmp_path / "ik.mot"
    path.write_text(f"ik\ninDegrees=yes\nendheader\ntime\ta\t{name}\n0\t180\t1\n0.01\t90\t2\n")
    take = open_recording(path)
    assert take.frames == pytest.approx(np.array([[np.pi, 1.0], [np.pi / 2, 2.0]]))


@pytest.mark.parametrize(
    "names",
    [
        "pelvis_tilt pelvis_list pelvis_rotation pelvis_tx pelvis_ty pelvis_tz hip_flexion_r",
        "pelvis_Ox pelvis_Oy pelvis_Oz pelvis_X pelvis_Y pelvis_Z femur_r_Ox",
    ],
)
def test_places_among_angles_of_opensim_are_no_markers(tmp_path: Path, names: str) -> None:
    path = tmp_path / "ik.mot"
    rows = (f"{i / 100}\t90\t90\t90\t1\t2\t3\t90" for i in range(3))
    head = "ik\ninDegrees=yes\nendheader\n" + "\t".join(["time", *names.split()])
    path.write_text("\n".join([head, *rows]) + "\n")
    take = open_recording(path)
    right = np.pi / 2
    assert take.channels == tuple(names.split())
    assert take.frames[0] == pytest.approx([right, right, right, 1.0, 2.0, 3.0, right])


def test_a_table_of_quaternions_of_opensim_is_named(tmp_path: Path) -> None:
    path = tmp_path / "imu.sto"
    path.write_text("DataType=Quaternion\nendheader\ntime\tpelvis\n0\t1,0,0,0\n0.01\t1,0,0,0\n")
    with pytest.raises(RecordingError, match="quaternion"):
        open_recording(path)
