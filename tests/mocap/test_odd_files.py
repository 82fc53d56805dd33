"""Files as people have them: what tools, locales and editors do to a file changes nothing in it.

Each row bends a plain file; what is read must be what is read from the plain one, and what was
decided must be said.
"""

from __future__ import annotations

import gzip
import re
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from mocap_writers import amc_values, bvh_values, write_amc, write_asf, write_bvh, write_mvnx

from mplearn.demonstrator import demonstrate
from mplearn.errors import InvalidValueError, RecordingError
from mplearn.mocap import Hints, open_recording
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
    *("null", "?", "missing", "#VALUE!", "#DIV/0!", "-9999.0", "9999999", "0.0000"),
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


def fortran(text: str) -> str:
    return re.sub(r"(\d)e([-+]\d)", r"\1D\2", text)


TABLES: dict[str, Change] = {
    "exponents of Fortran": fortran,
    "comma between thousands": lambda s: re.sub(r"(\d)(\d{3}\.\d+)", r'"\1,\2"', s),
    "separator named for Excel": lambda s: "sep=;\n" + s.replace(",", ";"),
    "names again at the end": lambda s: s + s.split("\n")[0] + "\n",
    "names again in between": lambda s: s.replace("\n0.4", f"\n{s.splitlines()[0]}\n0.4", 1),
    "lines of nothing": lambda s: s.replace("\n", "\n\n"),
    "old Macintosh": lambda s: s.replace("\n", "\r"),
    "capital letters": str.upper,
    "blanks behind commas": lambda s: s.replace(",", ", "),
    "byte order mark": lambda s: "\ufeff" + s,
}  # fmt: skip


@pytest.mark.parametrize("kind", TABLES)
def test_tables(tmp_path: Path, standing: Recording, points: np.ndarray, kind: str) -> None:
    form = ".7e" if "Fortran" in kind else ".4f"
    path = tmp_path / "a.csv"
    path.write_text(TABLES[kind](table(points, standing.marker_names, form=form)))
    names = standing.marker_names
    check(path, points, names, "repeats the names" if "again" in kind else "")


@pytest.mark.parametrize(
    "remark", ["# fps: 50", "# rate = 50 Hz", "Sampling rate,50", "fps,50", "Frame Rate: 50.0"]
)
def test_a_rate_above_the_table(
    tmp_path: Path, standing: Recording, points: np.ndarray, remark: str
) -> None:
    text = table(points, standing.marker_names, clock=str).replace("time", "frame", 1)
    path = tmp_path / "a.csv"
    path.write_text(f"{remark}\n{text}")
    check(path, points, standing.marker_names)


@pytest.mark.parametrize(
    ("clock", "name"),
    [
        (lambda i: f"00:00:{i / 50:06.3f}", "time"),
        (lambda i: f"2024-03-01T10:00:{i / 50:06.3f}", "timestamp"),
        (lambda i: f"{1.7e9 + i / 50:.3f}", "timestamp"),
        (lambda i: str(1_700_000_000_000 + 20 * i), "timestamp"),
        (lambda i: str(1_700_000_000_000_000_000 + 20_000_000 * i), "timestamp"),
    ],
)
def test_clocks(
    tmp_path: Path, standing: Recording, points: np.ndarray, clock: Callable[[int], str], name: str
) -> None:
    path = tmp_path / "a.csv"
    text = table(points, standing.marker_names, clock=clock).replace("time", name, 1)
    path.write_text(text)
    check(path, points, standing.marker_names)


def test_a_table_that_was_cut_off(tmp_path: Path, standing: Recording, points: np.ndarray) -> None:
    path = tmp_path / "a.csv"
    path.write_text(table(points, standing.marker_names)[:-100])
    check(path, points[:-1], standing.marker_names, "cut off")
    path.write_text(table(points, standing.marker_names).replace(",", "", 200))
    with pytest.raises(RecordingError):
        open_recording(path)


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
}  # fmt: skip


@pytest.mark.parametrize("kind", TRC)
def test_trc(tmp_path: Path, standing: Recording, points: np.ndarray, kind: str) -> None:
    form = ".7e" if "Fortran" in kind else ".4f"
    path = tmp_path / "a.trc"
    path.write_text(TRC[kind](trc(points, standing.marker_names, form=form)))
    check(path, points, standing.marker_names, "taken as mm" if kind == "wrong unit" else "")


@pytest.mark.parametrize("encoding", ["utf-8-sig", "utf-16", "latin-1"])
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
    "semicolons": (lambda s: rows(s, lambda line: line.replace(" ", "; ")), ""),
    "commas between channels": (lambda s: s.replace("Xrotation ", "Xrotation, "), ""),
    "short names of channels": (lambda s: re.sub("(pos|rot)(ition|ation)", r"\1", s), ""),
    "radians": (radians, "as radians"),
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


@pytest.mark.parametrize("cut", [5, 300, 1200])
def test_an_mvnx_file_that_was_cut_off(tmp_path: Path, cut: int) -> None:
    path = write_mvnx(tmp_path / "a.mvnx")
    plain = open_recording(path, positions=True)
    path.write_text(path.read_text()[:-cut])
    found = open_recording(path, positions=True)
    assert len(plain) - 1 <= len(found) <= len(plain)
    assert found.frames == pytest.approx(plain.frames[: len(found)], abs=1e-8)
    assert found.report is not None and any("cut off" in x for x in found.report.warnings)
