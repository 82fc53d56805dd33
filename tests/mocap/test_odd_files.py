"""Files as people have them: what tools, locales and editors do to a file changes nothing in it.

Each row bends a plain file; what is read must be what is read from the plain one, and what was
decided must be said.
"""

from __future__ import annotations

import gzip
import re
import struct
from collections.abc import Callable
from pathlib import Path
from zipfile import ZipFile

import numpy as np
import pytest
from mocap_writers import (
    amc_values,
    bvh_values,
    smpl_poses,
    write_amc,
    write_asf,
    write_bvh,
    write_c3d,
    write_g1_csv,
    write_mvnx,
    write_smpl,
    write_trc,
)
from scipy.spatial.transform import Rotation

from mplearn.demonstrator import demonstrate
from mplearn.errors import InvalidValueError, RecordingError
from mplearn.mocap import Hints, open_recording, open_recordings
from mplearn.mocap.markers.columns import MEDIAPIPE_POSE, OPENPOSE_BODY_25
from mplearn.recording import Recording

pytestmark = pytest.mark.filterwarnings("ignore::mplearn.errors.RecordingWarning")
Change = Callable[[str], str]
HIDDEN, GONE = 3, slice(10, 20)  # a marker, and in which frames nobody sees it


@pytest.fixture(scope="module")
def standing() -> Recording:
    return demonstrate(["SQD", "SQR", "BAR"], 4, rate_hz=50.0).recording.sliced(0, 60)


@pytest.fixture(scope="module")
def points(standing: Recording) -> np.ndarray:
    points = standing.markers.copy()
    points[GONE, HIDDEN] = np.nan
    return points


def cells(frame: np.ndarray, form: str, missing: str) -> list[str]:
    return [missing if np.isnan(x) else format(1000.0 * x, form) for x in frame.ravel()]


def table(
    points: np.ndarray,
    names: tuple[str, ...],
    *,
    form: str = ".4f",
    missing: str = "",
    clock: Callable[[int], str] = lambda i: f"{i / 50:.3f}",
) -> str:
    """Columns NAME_x, ... in millimetres."""
    head = ",".join(["time", *(f"{name}_{axis}" for name in names for axis in "xyz")])
    rows = (",".join([clock(i), *cells(f, form, missing)]) for i, f in enumerate(points))
    return "\n".join([head, *rows]) + "\n"


def trc(points: np.ndarray, names: tuple[str, ...], *, form: str = ".4f", missing: str = "") -> str:
    head = [
        "PathFileType\t4\t(X/Y/Z)\ta.trc",
        "DataRate\tCameraRate\tNumFrames\tNumMarkers\tUnits\tOrigDataRate",
        f"50.00\t50.00\t{len(points)}\t{len(names)}\tmm\t50.00",
        "Frame#\tTime\t" + "\t\t\t".join(names) + "\t\t",
        "\t\t" + "\t".join(f"{axis}{i + 1}" for i in range(len(names)) for axis in "XYZ"),
        "",
    ]
    yup = points[..., [0, 2, 1]] * (1.0, 1.0, -1.0)  # x ahead, z to the right
    rows = (
        "\t".join([str(i + 1), f"{i / 50:.4f}", *cells(f, form, missing)])
        for i, f in enumerate(yup)
    )
    return "\n".join([*head, *rows]) + "\n"


def check(path: Path, points: np.ndarray, names: tuple[str, ...], says: str = "") -> None:
    recording = open_recording(path)
    assert recording.rate_hz == pytest.approx(50.0, rel=1e-4)
    assert recording.marker_names == names
    assert recording.markers == pytest.approx(points, abs=1e-5, nan_ok=True)
    assert recording.report is not None
    said = [*recording.report.notes, *recording.report.warnings]
    assert not says or any(says in text for text in said)


MISSING = [
    *("nan", "NaN", "-1.#IND", "1.#QNAN", "-nan", "nan(ind)", "-nan(ind)", "N/A", "*", ".", "-"),
    *("null", "?", "missing", "#VALUE!", "#DIV/0!", "-9999.0", "9999999", "0.0000", "-1"),
    *("inf", "-inf", "Infinity", "-999.999", "-32768", "3.4028235e+38", "-1e30"),
]


@pytest.mark.parametrize("missing", MISSING)
@pytest.mark.parametrize("kind", ["csv", "trc"])
def test_what_was_not_seen(
    tmp_path: Path, standing: Recording, points: np.ndarray, missing: str, kind: str
) -> None:
    path = tmp_path / f"a.{kind}"
    path.write_text(
        (trc if kind == "trc" else table)(points, standing.marker_names, missing=missing)
    )
    check(path, points, standing.marker_names)


def velocities(text: str) -> str:
    head, *frames = text.splitlines()
    name = head.split(",")[1][:-2]
    more = ",".join(f"{name}_v{axis}" for axis in "xyz")
    return "\n".join([f"{head},{more}", *(f"{line},1,2,3" for line in frames)]) + "\n"


def by_points(text: str, head: str) -> str:
    """A row for each point that was seen."""
    names, *frames = (line.split(",") for line in text.splitlines())
    lines = [head]
    for time, *values in frames:
        seen = [i for i in range(0, len(values), 3) if values[i]]
        lines += [",".join([time, names[1 + i][:-2], *values[i : i + 3]]) for i in seen]
    return "\n".join(lines) + "\n"


def quaternions(text: str) -> str:
    """How each point is turned, behind where it is."""
    head, *frames = (line.split(",") for line in text.splitlines())
    lines = [head[:1], *(frame[:1] for frame in frames)]
    for at in range(1, len(head), 3):
        name = head[at].rpartition("_")[0]
        lines[0] += [f"{name}_position.{axis}" for axis in "xyz"]
        lines[0] += [f"{name}_rotation.{axis}" for axis in "wxyz"]
        for line, frame in zip(lines[1:], frames, strict=True):
            line += [*frame[at : at + 3], "1", "0", "0", "0"]
    return "\n".join(map(",".join, lines)) + "\n"


def in_brackets(text: str, form: str) -> str:
    """The three numbers of a point in one cell."""
    head, *frames = (line.split(",") for line in text.splitlines())
    lines = [",".join([head[0], *(name[:-2] for name in head[1::3])])]
    for time, *values in frames:
        triples = (values[i : i + 3] for i in range(0, len(values), 3))
        cells_ = ['"' + form.format(*v).replace('"', '""') + '"' if v[0] else "" for v in triples]
        lines.append(",".join([time, *cells_]))
    return "\n".join(lines) + "\n"


def two_rows(text: str, *, named: bool) -> str:
    """Names above axes, as pandas writes them, below them perhaps the name of the index."""
    head, frames = text.split("\n", 1)
    names = head.split(",")[1:]
    lines = [["marker" if named else "", *(n[:-2] for n in names)]]
    lines += [["axis" if named else "", *(n[-1:] for n in names)]]
    lines += [["time", *([""] * len(names))]] if named else []
    return "\n".join([*map(",".join, lines), frames])


def visual3d(text: str) -> str:
    """A file's name, names, kinds and folders above axes, as Visual3D exports them; no times."""
    head, *frames = text.splitlines()
    names = [name[:-2] for name in head.split(",")[1:]]
    above = [["walk.c3d"] * len(names), names, *([word] * len(names) for word in ("TARGET", "RAW"))]
    lines = ["\t".join(["", *row]) for row in above]
    lines.append("\t".join(["ITEM", *("XYZ"[k % 3] for k in range(len(names)))]))
    lines += ["\t".join([str(i + 1), *frame.split(",")[1:]]) for i, frame in enumerate(frames)]
    return "\n".join(["rate: 50", *lines]) + "\n"


def sides_last(text: str) -> str:
    """``WRA_l_x`` and ``WRA_r_x`` for ``LWRA_x`` and ``RWRA_x``."""
    head, frames = text.split("\n", 1)
    return re.sub(r"\b([LR])([A-Z]+)_", lambda m: f"{m[2]}_{m[1].lower()}_", head) + "\n" + frames


def after_noon(seconds: float) -> str:
    """A time of day so long after 12:59 PM."""
    hour, minute = (12, 59) if seconds < 60 else (1, 0)
    return f"{hour}:{minute:02d}:{seconds % 60:06.3f} PM"


def fortran(text: str) -> str:
    return re.sub(r"(\d)e([-+]\d)", r"\1D\2", text)


def grouped(text: str, between: str) -> str:
    """Decimal commas, and something else between thousands."""
    text = text.replace(",", ";").replace(".", ",")
    return re.sub(r"(\d)(\d{3},\d+)", rf"\1{between}\2", text)


TABLES: dict[str, Change] = {
    "exponents of Fortran": fortran,
    "comma between thousands": lambda s: re.sub(r"(\d)(\d{3}\.\d+)", r'"\1,\2"', s),
    "point between thousands": lambda s: grouped(s, "."),
    "blank between thousands": lambda s: grouped(s, "\u202f"),
    "minus of typographers": lambda s: s.replace(",-", ",\u2212"),
    "times twice": lambda s: re.sub(r"(?m)^([^,\n]+),", r"\1,\1,", s),
    "separator named for Excel": lambda s: "sep=;\n" + s.replace(",", ";"),
    "names again at the end": lambda s: s + s.split("\n")[0] + "\n",
    "names again in between": lambda s: s.replace("\n0.4", f"\n{s.splitlines()[0]}\n0.4", 1),
    "lines of nothing": lambda s: s.replace("\n", "\n\n"),
    "old Macintosh": lambda s: s.replace("\n", "\r"),
    "capital letters": str.upper,
    "blanks behind commas": lambda s: s.replace(",", ", "),
    "byte order mark": lambda s: "\ufeff" + s,
    "bars": lambda s: s.replace(",", "|"),
    "a title above": lambda s: "Walk of Anna; 2nd try\n\n" + s,
    "names and values above": lambda s: "Subject,Anna\nRate,50\nDate,2024-03-01\n\n" + s,
    "a column without a name": lambda s: s.replace("\n", ",7\n").replace(",7", ",", 1),
    "quoted names": lambda s: re.sub(r"(\w+)_x,\1_y,\1_z", r"'\1'_x,'\1'_y,'\1'_z", s),
    "bars in names": lambda s: re.sub(r"(\w+)_([xyz])\b", r"S1|\1|\2", s),
    "positions": lambda s: re.sub(r"_([xyz])\b", r"_pos_\1", s),
    "coordinates": lambda s: re.sub(r"_([xyz])\b", r".coord.\1", s),
    "axes in the middle": lambda s: re.sub(r"_([xyz])\b", r"_\1_coord", s),
    "axes in brackets": lambda s: re.sub(r"_([xyz])\b", r".pos[\1]", s),
    "heads of bones": lambda s: re.sub(r"_([xyz])\b", r".head_\1", s),
    "axes of translations": lambda s: re.sub(r"_([xyz])\b", r"_T\1", s),
    "velocities too": velocities,
    "quaternions too": quaternions,
    "in brackets": lambda s: in_brackets(s, "[{}, {}, {}]"),
    "in brackets of numpy": lambda s: in_brackets(s, "[{} {} {}]"),
    "tuples": lambda s: in_brackets(s, "({}, {}, {})"),
    "in curly brackets": lambda s: in_brackets(s, '{{"x": {}, "y": {}, "z": {}}}'),
    "two rows of names": lambda s: two_rows(s, named=True),
    "two rows of names, no name of the index": lambda s: two_rows(s, named=False),
    "Visual3D": visual3d,
    "times in Japanese": lambda s: s.replace("time", "\u6642\u9593", 1),
    "frames and times in Japanese": lambda s: "".join(
        (f"{i}," if i else "\u30d5\u30ec\u30fc\u30e0,") + line
        for i, line in enumerate(s.replace("time", "\u6642\u9593", 1).splitlines(keepends=True))
    ),
    "a remark below": lambda s: s + "\nEnd of file\n",
    "a text in front, and lines of nothing": lambda s: re.sub(
        r"(?m)^", "walk,", s.strip()
    ).replace("walk,", "trial,", 1).replace("\n", "\n\n") + "\n",
    "means below": lambda s: s + "\nMean,1,2,3\n",
    "bones": lambda s: by_points(s, "time,Bone,X,Y,Z"),
    "kinds of joints": lambda s: by_points(s, "time,jointType,x,y,z"),
    "names of segments": lambda s: by_points(s, "time,segment_name,posX,posY,posZ"),
    "long, axes named": lambda s: by_points(s, "time,marker,pos_x,pos_y,pos_z"),
    "long, with units": lambda s: by_points(s, "time,Marker Name,X (mm),Y (mm),Z (mm)"),
}  # fmt: skip


def test_a_text_that_no_reader_claims_is_refused_as_a_table(tmp_path: Path) -> None:
    (tmp_path / "notes.txt").write_text("hip_angle,knee_angle\n1,2\n3,4\n")
    with pytest.raises(RecordingError, match="no rate"):
        open_recording(tmp_path / "notes.txt")


@pytest.mark.parametrize("kind", TABLES)
def test_tables(tmp_path: Path, standing: Recording, points: np.ndarray, kind: str) -> None:
    form = ".7e" if "Fortran" in kind else ".4f"
    path = tmp_path / "a.csv"
    path.write_text(TABLES[kind](table(points, standing.marker_names, form=form)))
    names = standing.marker_names
    check(path, points, names, "repeats the names" if "again" in kind else "")


@pytest.mark.parametrize(
    "remark",
    [
        *("# fps: 50", "# rate = 50 Hz", "Sampling rate,50", "fps,50", "Frame Rate: 50.0"),
        *("# Sampling frequency: 50 Hz, subject: A", "// recorded at 50 Hz", "Abtastrate;50"),
        *("Frames per second,50", "Fréquence (Hz),50", "dt,0.02", "Sample period (ms),20 ms"),
    ],
)
def test_a_rate_above_the_table(
    tmp_path: Path, standing: Recording, points: np.ndarray, remark: str
) -> None:
    text = table(points, standing.marker_names, clock=str).replace("time", "frame", 1)
    path = tmp_path / "a.csv"
    path.write_text(f"{remark}\n{text}")
    check(path, points, standing.marker_names)


@pytest.mark.parametrize(
    ("name", "beside"),
    [
        ("walk_50hz.csv", ""),
        ("walk-50fps-3.csv", ""),
        ("cam2_1080p50fps.csv", ""),
        ("lowpass_10hz_walk_50hz.csv", ""),
        ("a.csv", '{"SamplingFrequency": 50, "TaskName": "walk"}'),
        ("a.csv", '{"frame_rate": 50.0}'),
    ],
)
def test_a_rate_beside_the_table(
    tmp_path: Path, standing: Recording, points: np.ndarray, name: str, beside: str
) -> None:
    path = tmp_path / name
    path.write_text(table(points, standing.marker_names, clock=str).replace("time", "frame", 1))
    for unreadable in (beside, "[50]", "{", "") if beside else ("",):
        if unreadable:
            path.with_suffix(".json").write_text(unreadable)
        if unreadable == beside:
            check(path, points, standing.marker_names, "50 Hz, as")
        else:
            with pytest.raises(RecordingError, match="no rate"):
                open_recording(path)


@pytest.mark.parametrize("name", ["butter10hz.csv", "from_100hz_to_50hz.csv", "take_60.csv"])
def test_a_name_that_says_no_rate(
    tmp_path: Path, standing: Recording, points: np.ndarray, name: str
) -> None:
    path = tmp_path / name
    path.write_text(table(points, standing.marker_names, clock=str).replace("time", "frame", 1))
    with pytest.raises(RecordingError, match="no rate"):
        open_recording(path)


@pytest.mark.parametrize("name", ["T_{}", "point {}", "P.{}"])
def test_numbered_markers_keep_their_names(
    tmp_path: Path, standing: Recording, points: np.ndarray, name: str
) -> None:
    names = tuple(name.format(k) for k in range(1, 1 + points.shape[1]))
    path = tmp_path / "a.csv"
    path.write_text(table(points, names))
    assert open_recording(path).marker_names == names


def test_a_medial_marker_beside_a_lateral_one_is_kept(
    tmp_path: Path, standing: Recording, points: np.ndarray
) -> None:
    names = (*standing.marker_names, f"{standing.marker_names[0]}_M")
    more = np.concatenate([points, points[:, :1] + 0.05], axis=1)
    path = tmp_path / "a.csv"
    path.write_text(table(more, names))
    check(path, more, names)


@pytest.mark.parametrize("remark", ["# fps: 50", "% by hand", "fps,50", "Sampling rate: 50 Hz"])
def test_remarks_above_a_narrow_table(tmp_path: Path, remark: str) -> None:
    rows = "".join(f"{i},{0.1 * i:.2f},{0.2 * i:.2f},0.3,0.4\n" for i in range(20))
    path = tmp_path / "a_50hz.csv"
    path.write_text(f"{remark}\nframe,hip,knee,ankle,toe\n{rows}")
    recording = open_recording(path)
    assert recording.channels == ("hip", "knee", "ankle", "toe")
    assert (len(recording), recording.rate_hz) == (20, 50.0)


@pytest.mark.parametrize("unit", ["in", "inches"])
def test_units_behind_the_axes(
    tmp_path: Path, standing: Recording, points: np.ndarray, unit: str
) -> None:
    path = tmp_path / "a.csv"
    text = table(points / 25.4, standing.marker_names, form=".6f")
    path.write_text(re.sub(r"_([xyz])\b", rf"_\1_{unit}", text))
    check(path, points, standing.marker_names)


def test_sides_behind_the_names(tmp_path: Path, standing: Recording, points: np.ndarray) -> None:
    """What ends in r is the right side, where there is a left one, and no rotation."""
    path = tmp_path / "a.csv"
    path.write_text(sides_last(table(points, standing.marker_names)))
    names = [re.sub(r"^([LR])([A-Z]+)$", r"\2_\1", name) for name in standing.marker_names]
    check(path, points, tuple(n[:-1] + n[-1].lower() if n[-2:-1] == "_" else n for n in names))


def test_a_column_says_the_rate(tmp_path: Path, standing: Recording, points: np.ndarray) -> None:
    text = table(points, standing.marker_names, clock=lambda i: "50")
    path = tmp_path / "a.csv"
    path.write_text(text.replace("time", "fps", 1))
    check(path, points, standing.marker_names)


@pytest.mark.parametrize("hidden", ["LANK", "CLAV"])
def test_a_marker_that_is_zero_throughout_was_never_seen(
    tmp_path: Path, standing: Recording, points: np.ndarray, hidden: str
) -> None:
    gone = points.copy()
    gone[:, standing.marker_names.index(hidden)] = np.nan
    path = tmp_path / "a.csv"
    path.write_text(table(gone, standing.marker_names, missing="0"))
    check(path, gone, standing.marker_names)


def test_a_point_from_which_all_is_counted_is_there(
    tmp_path: Path, standing: Recording, points: np.ndarray
) -> None:
    names = standing.marker_names
    root = points[:, [names.index("LASI")]]
    path = tmp_path / "a.csv"
    path.write_text(table(points - root, names))
    read = open_recording(path, hints=Hints(up_axis="z"))
    assert not np.isnan(read.markers[:, names.index("LASI")]).any()


def test_around_where_all_is_counted_from_a_marker_may_be_unseen_too(
    tmp_path: Path, standing: Recording, points: np.ndarray
) -> None:
    names = standing.marker_names
    middle = points - np.nanmean(points, axis=(0, 1))
    middle[:, names.index("LANK")] = np.nan
    path = tmp_path / "a.csv"
    path.write_text(table(middle, names, missing="-1"))
    read = open_recording(path, hints=Hints(up_axis="z"))
    assert "LANK" not in read.marker_names or np.isnan(read.markers[:, names.index("LANK")]).all()


def test_points_of_a_picture_with_a_depth_of_zero_are_told(
    tmp_path: Path, standing: Recording, points: np.ndarray
) -> None:
    flat = points * (0.0, 1.0, 1.0)
    path = tmp_path / "a.csv"
    path.write_text(table(flat, standing.marker_names))
    check(path, flat, standing.marker_names, "all points have the same x")


@pytest.mark.parametrize("form", ["_{}", "[{}]"])
def test_numbered_axes_are_not_taken_for_markers_silently(
    tmp_path: Path, standing: Recording, points: np.ndarray, form: str
) -> None:
    path = tmp_path / "a.csv"
    text = table(points, standing.marker_names)
    path.write_text(re.sub(r"_([xyz])\b", lambda m: form.format("xyz".index(m[1])), text))
    report = open_recording(path).report
    assert report is not None and any("end their names in _x" in x for x in report.warnings)


@pytest.mark.parametrize(
    ("clock", "name"),
    [
        (lambda i: f"00:00:{i / 50:06.3f}", "time"),
        (lambda i: f"2024-03-01T10:00:{i / 50:06.3f}", "timestamp"),
        (lambda i: f"{1.7e9 + i / 50:.3f}", "timestamp"),
        (lambda i: str(1_700_000_000_000 + 20 * i), "timestamp"),
        (lambda i: str(1_700_000_000_000_000_000 + 20_000_000 * i), "timestamp"),
        (lambda i: f"2024-03-01 10:00:{i / 50:09.6f}", "datetime"),
        (lambda i: f"{1.7e9 + i / 50:.3f}", "epoch"),
        (lambda i: f"{1.7e12 + 20.0 * i:.0f}", "unix_time_ms"),
        (lambda i: str(638_000_000_000_000_000 + 200_000 * i), "timestamp"),  # of .NET
        (lambda i: f"01.05.2024 10:00:{i / 50:06.3f}", "Zeit"),
        (lambda i: f"5/1/2024 {after_noon(59.4 + i / 50)}", "Time"),
        (
            lambda i: (
                f"{'30.4.2024 23:59' if i < 30 else '1.5.2024 00:00'}:{(59.4 + i / 50) % 60:06.3f}"
            ),
            "time",
        ),
    ],
)
def test_clocks(
    tmp_path: Path, standing: Recording, points: np.ndarray, clock: Callable[[int], str], name: str
) -> None:
    path = tmp_path / "a.csv"
    text = table(points, standing.marker_names, clock=clock).replace("time", name, 1)
    path.write_text(text)
    check(path, points, standing.marker_names)


def test_whole_seconds_and_nanoseconds(
    tmp_path: Path, standing: Recording, points: np.ndarray
) -> None:
    path = tmp_path / "a.csv"
    clock = lambda i: f"{1_700_000_000 + i // 50},{20_000_000 * (i % 50)}"  # noqa: E731
    text = table(points, standing.marker_names, clock=clock)
    path.write_text(text.replace("time", "secs,nsecs", 1))
    check(path, points, standing.marker_names)


@pytest.mark.parametrize("long", [True, False])
@pytest.mark.parametrize("who", ["person_id", "trackingId", "person"])
def test_people_in_rows_of_their_own_are_takes_of_their_own(
    tmp_path: Path, standing: Recording, points: np.ndarray, who: str, long: bool
) -> None:
    """Of two people the second comes later, and a metre further on."""
    names, kept = standing.marker_names, slice(GONE.stop, None)
    lines: list[str] = []
    for person, late, far in (("1", 0, 0.0), ("2", 5, 1.0)):
        text = table(points[kept] + far, names, clock=lambda i, late=late: str(i + late))
        text = by_points(text, "frame,joint,x,y,z") if long else text.replace("time", "frame", 1)
        (frame, rest), *rows = (line.split(",", 1) for line in text.splitlines())
        lines += [] if lines else [f"{frame},{who},{rest}"]
        lines += [f"{frame},{person},{rest}" for frame, rest in rows]
    text = "\n".join(lines) + "\n"
    path = tmp_path / "a_50hz.csv"
    path.write_text(text)
    first, second = open_recordings(path)
    assert (first.person, second.person) == ("1", "2")
    assert first.marker_names == tuple(f"1:{name}" for name in names)
    assert second.marker_names == tuple(f"2:{name}" for name in names)
    n_frames = len(points[kept])
    assert len(first) == len(second) == n_frames + 5
    assert first.markers[:n_frames] == pytest.approx(points[kept], abs=1e-5, nan_ok=True)
    assert second.markers[5:] == pytest.approx(points[kept] + 1.0, abs=1e-5, nan_ok=True)
    assert np.isnan(first.markers[n_frames:]).all() and np.isnan(second.markers[:5]).all()


@pytest.mark.parametrize("layout", [MEDIAPIPE_POSE, OPENPOSE_BODY_25])
def test_points_of_several_people_may_be_numbered(tmp_path: Path, layout: tuple[str, ...]) -> None:
    points = np.random.default_rng(0).normal((0, 0, 1), 0.3, (12, 2, len(layout), 3))
    lines = ["frame,person_id,landmark_id,x,y,z"]
    for i, who, k in np.ndindex(points.shape[:3]):
        lines.append(",".join(map(str, (i, who, k, *points[i, who, k].tolist()))))
    path = tmp_path / "a_50hz.csv"
    path.write_text("\n".join(lines) + "\n")
    people = open_recordings(path, hints=Hints(unit_m=1.0, up_axis="z"))
    for who, each in enumerate(people):
        assert each.marker_names == tuple(f"{who}:{name}" for name in layout)
        assert each.markers == pytest.approx(points[:, who])
    assert len(people) == 2


def test_rows_of_nobody_are_left_out(
    tmp_path: Path, standing: Recording, points: np.ndarray
) -> None:
    """A tracker that writes frames in which nobody is tracked, before, between and after others."""
    names, shown = standing.marker_names, points[GONE.stop :]
    (head, *rows) = table(shown, names, clock=str).splitlines()
    lines = [head.replace("time", "frame,trackingId", 1)]
    nobody = "," * 3 * len(names)
    for i, row in enumerate(rows):
        (frame, rest) = row.split(",", 1)
        lines += [f"{frame},,{rest}" if i in (2, 9) else f"{frame},{1 + i % 2},{rest}"]
    lines += [f"{len(rows)},{nobody}"]
    path = tmp_path / "a_50hz.csv"
    path.write_text("\n".join(lines) + "\n")
    people = open_recordings(path)
    assert [each.person for each in people] == ["1", "2"]
    assert len(people[0]) == len(rows)
    assert people[0].report is not None
    assert "3 rows that name nobody left out" in people[0].report.notes


def test_who_would_be_where_in_a_table_of_no_markers_is_a_channel(tmp_path: Path) -> None:
    head = ",".join(["time", "track_id", "m_x", "m_y", "m_z", *(f"knee_{k}" for k in range(8))])
    rows = (",".join([f"{i / 50:.2f}", str(1 + i % 2), *["0.5"] * 11]) for i in range(20))
    path = tmp_path / "a.csv"
    path.write_text("\n".join([head, *rows]) + "\n")
    read = open_recording(path)
    assert read.channels[0] == "track_id"
    assert read.frames[:, 0].tolist() == [1.0, 2.0] * 10


def test_names_that_come_again_below_an_empty_line_end_nothing(
    tmp_path: Path, standing: Recording, points: np.ndarray
) -> None:
    head, *rows = table(points, standing.marker_names).splitlines()
    path = tmp_path / "a.csv"
    path.write_text("\n".join([head, *rows[:20], "", head, *rows[20:]]) + "\n")
    check(path, points, standing.marker_names, "repeats the names")


@pytest.mark.parametrize("damaged", ["[0.1, 0.2]", "[0.1, 0.2, 0.3", "[0.1, 0.2, 0.3, 0.4]"])
def test_a_cell_that_does_not_hold_three_numbers_is_named(
    tmp_path: Path, standing: Recording, points: np.ndarray, damaged: str
) -> None:
    lines = in_brackets(table(points, standing.marker_names), "[{}, {}, {}]").splitlines()
    lines[5] = re.sub(r'"\[[^"]*"', f'"{damaged}"', lines[5], count=1)
    path = tmp_path / "a.csv"
    path.write_text("\n".join(lines) + "\n")
    with pytest.raises(RecordingError, match=re.escape(damaged)):
        open_recording(path)


@pytest.mark.parametrize(
    "remark", ["Low-pass filter frequency: 6 Hz", "Analog rate,1000", "EMG sampling rate: 2000"]
)
def test_rates_of_something_else_are_not_the_frames(
    tmp_path: Path, standing: Recording, points: np.ndarray, remark: str
) -> None:
    path = tmp_path / "a_50hz.csv"
    text = table(points, standing.marker_names, clock=str).replace("time", "frame", 1)
    path.write_text(f"{remark}\n{text}")
    check(path, points, standing.marker_names)


def test_frames_in_steps_are_told(tmp_path: Path, standing: Recording, points: np.ndarray) -> None:
    path = tmp_path / "a.csv"
    text = table(points, standing.marker_names, clock=lambda i: str(2 * i))
    path.write_text("fps,50\n" + text.replace("time", "frame", 1))
    check(path, points, standing.marker_names, "numbered in steps of 2")


def test_times_that_stand_still_are_none(
    tmp_path: Path, standing: Recording, points: np.ndarray
) -> None:
    path = tmp_path / "a_50hz.csv"
    text = table(points, standing.marker_names, clock=lambda i: f"{i},0.0")
    path.write_text(text.replace("time", "frame,time", 1))
    check(path, points, standing.marker_names)


def test_several_rows_of_one_point_are_refused(
    tmp_path: Path, standing: Recording, points: np.ndarray
) -> None:
    text = by_points(table(points, standing.marker_names), "time,marker,x,y,z")
    path = tmp_path / "a.csv"
    path.write_text(text + text.split("\n", 1)[1])
    with pytest.raises(RecordingError, match="several rows of one point"):
        open_recording(path)


def test_a_table_that_was_cut_off(tmp_path: Path, standing: Recording, points: np.ndarray) -> None:
    path = tmp_path / "a.csv"
    path.write_text(table(points, standing.marker_names)[:-100])
    check(path, points[:-1], standing.marker_names, "cut off")
    path.write_text(table(points, standing.marker_names).replace(",", "", 200))
    with pytest.raises(RecordingError):
        open_recording(path)


def test_a_row_that_was_cut_off_between_cells_does_not_count(
    tmp_path: Path, standing: Recording, points: np.ndarray
) -> None:
    for kind, text in (("csv", table), ("trc", trc)):
        path = tmp_path / f"a.{kind}"
        whole = text(points, standing.marker_names)
        separator = "\t" if kind == "trc" else ","
        path.write_text(separator.join(whole.rstrip("\n").split(separator)[:-6])[:-2])
        check(path, points[:-1], standing.marker_names, "cut off")


@pytest.mark.parametrize("rate_hz", [30.0, 60.0, 75.0])
def test_times_with_two_decimals_do_not_jitter(
    tmp_path: Path, standing: Recording, points: np.ndarray, rate_hz: float
) -> None:
    path = tmp_path / "a.csv"
    names = standing.marker_names
    path.write_text(table(points, names, clock=lambda i: f"{i / rate_hz:.2f}"))
    recording = open_recording(path)
    assert recording.rate_hz == pytest.approx(rate_hz, rel=2e-3)
    assert recording.markers == pytest.approx(points, abs=1e-5, nan_ok=True)


def test_between_blanks_a_missing_cell_is_not_guessed(
    tmp_path: Path, standing: Recording, points: np.ndarray
) -> None:
    for kind, text in (("csv", table), ("trc", trc)):
        path = tmp_path / f"a.{kind}"
        path.write_text(re.sub("[,\t]+", "  ", text(points, standing.marker_names)))
        with pytest.raises(RecordingError, match="columns"):
            open_recording(path)


TRC: dict[str, Change] = {
    "exponents of Fortran": fortran,
    "lines of nothing above": lambda s: "\n\n" + s,
    "lines of nothing below": lambda s: s + "\n \n\t\t\n",
    "a rate with its unit": lambda s: s.replace("50.00\t", "50 Hz\t", 1),
    "a rate with a comma": lambda s: s.replace("50.00\t", "50,00\t", 1),
    "no axes": lambda s: re.sub(r"(?m)^\t\tX1\t.*\n\n", "", s),
    "unit in capitals": lambda s: s.replace("\tmm\t", "\t MM \t"),
    "unit in words": lambda s: s.replace("\tmm\t", "\tmillimetres\t"),
    "no unit": lambda s: s.replace("\tmm\t", "\t\t"),
    "wrong unit": lambda s: s.replace("\tmm\t", "\tm\t"),
    "header in small letters": lambda s: re.sub("PathFileType|DataRate", lambda m: m[0].lower(), s),
    "old Macintosh": lambda s: s.replace("\n", "\r"),
    "byte order mark": lambda s: "\ufeff" + s,
    "no first number": lambda s: re.sub(r"(?m)^1(?=\t0\.)", "", s),
    "no first line": lambda s: s.split("\n", 1)[1],
    "names in quotes": lambda s: re.sub(r"(?<=\t)([A-Z]\w+)(?=[\t\n])", r'"\1"', s),
    "numbers of frames as times": lambda s: re.sub(r"(?m)^(\d+)\t[\d.]+\t(?=-?\d)", r"\1\t\1\t", s),
    "times that repeat": lambda s: re.sub(r"(?m)^(\d+\t\d+\.\d)\d+", r"\1", s),
}  # fmt: skip


@pytest.mark.parametrize("kind", TRC)
def test_trc(tmp_path: Path, standing: Recording, points: np.ndarray, kind: str) -> None:
    form = ".7e" if "Fortran" in kind else ".4f"
    path = tmp_path / "a.trc"
    path.write_text(TRC[kind](trc(points, standing.marker_names, form=form)))
    check(path, points, standing.marker_names, "taken as mm" if kind == "wrong unit" else "")


@pytest.mark.parametrize(
    "encoding", ["utf-8-sig", "utf-16", "utf-16-le", "utf-16-be", "utf-32", "latin-1"]
)
@pytest.mark.parametrize("packed", [False, True])
def test_encodings(
    tmp_path: Path, standing: Recording, points: np.ndarray, encoding: str, packed: bool
) -> None:
    text = trc(points, standing.marker_names).replace("a.trc", "C:\\Jörg\\a.trc").encode(encoding)
    path = tmp_path / ("a.trc.gz" if packed else "a.trc")
    path.write_bytes(gzip.compress(text) if packed else text)
    check(path, points, standing.marker_names)


def rows(text: str, change: Change) -> str:
    head, time, frames = text.partition("Frame Time: 0.01\n")
    return head + time + "".join(change(line) + "\n" for line in frames.splitlines())


def counted(text: str, step: float) -> str:
    n = iter(range(1000))
    return rows(text, lambda line: f"{step * next(n):g} {line}")


def short(match: re.Match[str]) -> str:
    """Xposition -> TX, Zrotation -> RZ."""
    return ("T" if match[2] == "p" else "R") + match[1]


def radians(text: str) -> str:
    """The angles of `write_bvh` as radians: all but positions of the root and of Head."""
    positions = {0, 1, 2, 12, 13, 14}

    def change(line: str) -> str:
        values = [float(cell) for cell in line.split()]
        return " ".join(str(x if i in positions else np.deg2rad(x)) for i, x in enumerate(values))

    return rows(text, change)


# what it does to the file, and what is to be said
BVH: dict[str, tuple[Change, str]] = {
    "remark above": (lambda s: "# made by hand\n" + s, "before HIERARCHY"),
    "XML above": (lambda s: "<!-- from X -->\n\n" + s, "before HIERARCHY"),
    "a zero more in each line": (lambda s: rows(s, lambda line: line + " 0.000"), "no channel"),
    "numbered lines": (lambda s: counted(s, 1), "number of its frame"),
    "lines with times": (lambda s: counted(s, 0.01), "number of its frame"),
    "frames a second": (lambda s: s.replace("Time: 0.01", "Time: 100"), "as frames a second"),
    "milliseconds": (lambda s: s.replace("Time: 0.01", "Time: 10"), "as milliseconds"),
    "milliseconds named": (lambda s: s.replace("Time: 0.01", "Time: 10 ms"), ""),
    "seconds named": (lambda s: s.replace("Time: 0.01", "Time: 0.01s"), ""),
    "Fortran": (lambda s: s.replace("Time: 0.01", "Time: 1.0D-02"), ""),
    "channels in short": (lambda s: re.sub("([XYZ])([pr])[a-z]+ion", short, s), ""),
    "remarks": (lambda s: s.replace("JOINT", "# below\n  // it\n JOINT"), ""),
    "semicolons": (lambda s: rows(s, lambda line: line.replace(" ", "; ")), ""),
    "commas between channels": (lambda s: s.replace("Xrotation ", "Xrotation, "), ""),
    "short names of channels": (lambda s: re.sub("(pos|rot)(ition|ation)", r"\1", s), ""),
    "radians": (radians, "as radians"),
    "ends without channels": (
        lambda s: re.sub(r"(End Site\s*\{[^}]*)", r"\1 CHANNELS 0 ", s), ""),
}  # fmt: skip


@pytest.mark.parametrize("kind", BVH)
def test_bvh(tmp_path: Path, kind: str) -> None:
    change, says = BVH[kind]
    values = bvh_values()
    values[:, 9] += np.linspace(0.0, 80.0, len(values))  # of an arm
    path = write_bvh(tmp_path / "a.bvh", values)
    plain = open_recording(path, positions=True)
    path.write_text(change(path.read_text()))
    found = open_recording(path, positions=True)
    assert found.rate_hz == 100.0
    assert found.channels == plain.channels
    assert found.frames == pytest.approx(plain.frames, abs=1e-6)
    assert found.report is not None
    said = [*found.report.notes, *found.report.warnings]
    assert not says or any(says in text for text in said)


def test_what_the_angles_are_in_can_be_said(tmp_path: Path) -> None:
    values = bvh_values()
    values[:, 3:12] = 0.0
    values[:, 15:] = 0.0
    values[:, 9] += np.linspace(0.0, 3.0, len(values))  # degrees, of somebody who hardly moves
    path = write_bvh(tmp_path / "a.bvh", values)
    said = {unit: Hints(angle_unit=unit) for unit in ("degrees", "radians")}
    angles = {unit: open_recording(path, hints=hints).frames for unit, hints in said.items()}
    moved = np.ptp(angles["degrees"], axis=0).max()
    assert moved == pytest.approx(np.radians(3.0), rel=1e-4)
    assert np.ptp(angles["radians"], axis=0).max() == pytest.approx(3.0, rel=1e-4)
    with pytest.raises(InvalidValueError, match="angle_unit must be one of degrees, radians"):
        Hints(angle_unit="gon")


def test_an_amc_in_radians_that_does_not_say_so(tmp_path: Path) -> None:
    values = amc_values()
    values[:, 6] += np.linspace(0.0, 80.0, len(values))
    path = write_amc(tmp_path / "a.amc", values)
    write_asf(tmp_path / "a.asf")
    plain = open_recording(path)

    def turned(line: str) -> str:
        bone, *values = line.split()
        first = 3 if bone == "root" else 0
        turn = [1.0] * first + [np.pi / 180.0] * len(values)
        return " ".join([bone, *(str(float(x) * t) for x, t in zip(values, turn, strict=False))])

    lines = path.read_text().replace(":DEGREES\n", "").splitlines()
    path.write_text("\n".join(turned(x) if " " in x else x for x in lines) + "\n")
    found = open_recording(path)
    assert found.frames == pytest.approx(plain.frames, abs=1e-9)
    assert found.report is not None and any("radians" in x for x in found.report.warnings)


def test_an_mvnx_file_with_decimal_commas(tmp_path: Path) -> None:
    path = write_mvnx(tmp_path / "a.mvnx")
    plain = open_recording(path, positions=True)
    path.write_text(re.sub(r"(-?\d)\.(\d{9})", r"\1,\2", path.read_text()))
    found = open_recording(path, positions=True)
    assert found.rate_hz == plain.rate_hz
    assert found.frames == pytest.approx(plain.frames, abs=1e-12)


@pytest.mark.parametrize("form", ["matrices", "matrices in a row", "w first", "w last"])
def test_poses_of_smpl_in_other_forms(tmp_path: Path, form: str) -> None:
    vectors = 0.3 * smpl_poses(n_joints=24).reshape(12, 24, 3)
    plain = open_recording(write_smpl(tmp_path / "a.npz", poses=vectors), positions=True)
    turns = Rotation.from_rotvec(vectors.reshape(-1, 3))
    poses = turns.as_matrix().reshape(12, 24, 3, 3)
    if "w" in form.split():
        poses = turns.as_quat(scalar_first=form == "w first").reshape(12, 24, 4)
    elif "row" in form:
        poses = poses.reshape(12, -1)
    found = open_recording(write_smpl(tmp_path / "b.npz", poses=poses), positions=True)
    assert found.frames == pytest.approx(plain.frames, abs=1e-6)
    assert found.report is not None
    said = "; ".join([*found.report.notes, *found.report.warnings])
    assert ("matrices" if "matrices" in form else "quaternions") in said


@pytest.mark.parametrize("form", ["matrices", "quaternions"])
def test_a_joint_of_smpl_that_was_not_seen(tmp_path: Path, form: str) -> None:
    vectors = 0.3 * smpl_poses(n_joints=24).reshape(12, 24, 3)
    turns = Rotation.from_rotvec(vectors.reshape(-1, 3))
    poses = turns.as_matrix() if form == "matrices" else turns.as_quat(scalar_first=True)
    poses = poses.reshape(12, 24, *poses.shape[1:])
    vectors[3, 5] = poses[3, 5] = np.nan
    plain = open_recording(write_smpl(tmp_path / "a.npz", poses=vectors), positions=True)
    found = open_recording(write_smpl(tmp_path / "b.npz", poses=poses), positions=True)
    assert np.isnan(found.frames).any()
    assert found.frames == pytest.approx(plain.frames, abs=1e-6, nan_ok=True)


@pytest.mark.parametrize(
    "poses",
    [
        np.zeros((0, 24, 4)),
        np.zeros((12, 24, 4)),
        np.zeros((12, 24, 3, 3)),
        np.tile(-np.eye(3), (12, 24, 1, 1)),
        np.tile(-np.eye(3).ravel(), (12, 24)),
    ],
)
def test_poses_of_smpl_that_are_no_rotations(tmp_path: Path, poses: np.ndarray) -> None:
    with pytest.raises(RecordingError, match="poses"):
        open_recording(write_smpl(tmp_path / "a.npz", poses=poses))


def test_six_numbers_a_joint_are_refused(tmp_path: Path) -> None:
    with pytest.raises(RecordingError, match=r"shape \(12, 24, 6\)"):
        open_recording(write_smpl(tmp_path / "a.npz", poses=np.ones((12, 24, 6))))


def test_a_table_of_the_g1_with_decimal_commas_and_its_rate_in_the_name(tmp_path: Path) -> None:
    plain = open_recording(write_g1_csv(tmp_path / "a.csv"))
    path = write_g1_csv(tmp_path / "dance_60fps.csv")
    path.write_text(path.read_text().replace(",", ";").replace(".", ","))
    found = open_recording(path)
    assert (plain.rate_hz, found.rate_hz) == (30.0, 60.0)
    assert found.frames == pytest.approx(plain.frames, abs=1e-12)


@pytest.mark.parametrize("unit", ["", "N/A", "unknown", "mm/deg", "[mm]"])
def test_units_of_c3d_that_say_little(
    tmp_path: Path, standing: Recording, points: np.ndarray, unit: str
) -> None:
    names = list(standing.marker_names)
    path = write_c3d(tmp_path / "a.c3d", points, names=names, rate_hz=50.0, units=unit)
    check(path, points, standing.marker_names)


def test_a_c3d_without_a_rate_names_the_option(
    tmp_path: Path, standing: Recording, points: np.ndarray
) -> None:
    names = list(standing.marker_names)
    for name in ("a.c3d", "walk_50Hz.c3d"):
        path = write_c3d(tmp_path / name, points, names=names, rate_hz=50.0)
        data = bytearray(path.read_bytes())
        for at in [m.start() for m in re.finditer(re.escape(struct.pack("<f", 50.0)), data)]:
            data[at : at + 4] = bytes(4)
        path.write_bytes(data)
        if name == "a.c3d":
            with pytest.raises(RecordingError, match=r"RATE.*rate_hz="):
                open_recording(path)
            assert open_recording(path, hints=Hints(rate_hz=50.0)).rate_hz == 50.0
        else:
            check(path, points, standing.marker_names, "50 Hz, as the file's name says")


def test_frames_that_16_bits_cannot_count_are_counted(tmp_path: Path) -> None:
    points = np.random.default_rng(0).normal(1.0, 0.3, (65_600, 4, 3))
    path = write_c3d(tmp_path / "a.c3d", points, names=list("abcd"), rate_hz=100.0)
    data = bytearray(path.read_bytes())
    assert struct.unpack_from("<2H", data, 6) == (1, 65_535)
    at = data.index(b"FRAMES", 512)  # what says more is taken away
    data[at : at + 6] = b"FLAMES"
    path.write_bytes(data)
    assert len(open_recording(path, hints=Hints(unit_m=0.001, up_axis="z"))) == len(points)


@pytest.mark.parametrize("cut", [5, 300, 1200])
def test_an_mvnx_file_that_was_cut_off(tmp_path: Path, cut: int) -> None:
    path = write_mvnx(tmp_path / "a.mvnx")
    plain = open_recording(path, positions=True)
    path.write_text(path.read_text()[:-cut])
    found = open_recording(path, positions=True)
    assert len(plain) - 1 <= len(found) <= len(plain)
    assert found.frames == pytest.approx(plain.frames[: len(found)], abs=1e-8)
    assert found.report is not None and any("cut off" in x for x in found.report.warnings)


@pytest.mark.parametrize("suffix", ["bvh", "trc", "csv", "tsv", "c3d", "npz", "mvnx", "xdf"])
@pytest.mark.parametrize(
    ("content", "says"),
    [
        (b"version https://git-lfs.github.com/spec/v1\noid sha256:0\nsize 9\n", "Git LFS"),
        (b"\n<!DOCTYPE html>\n<html><body>404</body></html>\n", "page of the web"),
    ],
)
def test_what_was_saved_instead_of_a_recording_is_called_so(
    tmp_path: Path, suffix: str, content: bytes, says: str
) -> None:
    path = tmp_path / f"a.{suffix}"
    path.write_bytes(content)
    with pytest.raises(RecordingError, match=says):
        open_recording(path, hints=Hints(rate_hz=50.0))


def test_a_zip_archive_is_called_so(tmp_path: Path) -> None:
    with ZipFile(tmp_path / "a.bvh", "w") as archive:
        archive.writestr("a.bvh", "HIERARCHY")
        archive.writestr("b.bvh", "HIERARCHY")
    with pytest.raises(RecordingError, match="zip archive"):
        open_recording(tmp_path / "a.bvh")


@pytest.mark.parametrize("behind", ["\x1a", "\0" * 512])
@pytest.mark.parametrize("write", [write_bvh, write_trc, write_g1_csv])
def test_what_lies_behind_a_text_is_none(
    tmp_path: Path, write: Callable[[Path], Path], behind: str
) -> None:
    path = write(tmp_path / f"a.{write.__name__[-3:]}")
    plain = open_recording(path)
    path.write_text(path.read_text() + behind)
    assert np.array_equal(open_recording(path).frames, plain.frames)


@pytest.mark.parametrize("begun", ["-", "1.2 -", ".", "1e-"])
def test_a_bvh_file_may_end_within_a_number(tmp_path: Path, begun: str) -> None:
    path = write_bvh(tmp_path / "a.bvh")
    plain = open_recording(path)
    path.write_text(path.read_text() + begun)
    assert np.array_equal(open_recording(path).frames, plain.frames)
