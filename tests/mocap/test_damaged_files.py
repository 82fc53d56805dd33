"""Whatever a file holds: a recording or an error of ours, soon, in little memory."""

from __future__ import annotations

import gzip
import os
import re
import tracemalloc
from pathlib import Path

import numpy as np
import pytest
from mocap_writers import BINARY, WRITERS, write
from mutations import NUMBER, mutated

from mplearn.errors import MPLearnError, RecordingError
from mplearn.mocap import Hints, open_recording

FORMATS = sorted(WRITERS)
pytestmark = pytest.mark.filterwarnings("ignore::mplearn.errors.RecordingWarning")


@pytest.fixture(scope="module")
def valid(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Path]:
    return {format: write(tmp_path_factory.mktemp("valid"), format) for format in FORMATS}


@pytest.mark.parametrize("format", FORMATS)
def test_mutated_files(valid: dict[str, Path], format: str) -> None:
    rng = np.random.default_rng(FORMATS.index(format))
    path = valid[format]
    whole = path.read_bytes()
    others = [file.read_bytes() for file in valid.values()]
    refused = 0
    tracemalloc.start()
    for i in range(200):
        path.write_bytes(mutated(rng, whole, others[i % len(others)]))
        try:
            recording = open_recording(path, positions=bool(i % 2))
        except MPLearnError as error:
            assert "expected" in str(error) or "must" in str(error)
            refused += 1
        else:
            assert not np.isinf(recording.frames).any()
            assert recording.report is not None
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    path.write_bytes(whole)
    assert 0 < refused < 200
    assert peak < 300e6


@pytest.mark.parametrize("format", sorted({*FORMATS} - BINARY))
def test_a_number_of_5000_digits(valid: dict[str, Path], format: str) -> None:
    path = valid[format]
    whole = path.read_bytes()
    places = list(NUMBER.finditer(whole))
    for match in [*places[:12], places[len(places) // 2], places[-1]]:
        path.write_bytes(whole[: match.start()] + b"7" * 5000 + whole[match.end() :])
        for positions in (False, True):
            try:
                open_recording(path, positions=positions)
            except MPLearnError as error:
                assert len(str(error)) < 2000
    path.write_bytes(whole)


def test_pipes_devices_and_names_that_cannot_be(valid: dict[str, Path], tmp_path: Path) -> None:
    pipe = tmp_path / "a.csv"
    os.mkfifo(pipe)
    amc = valid["AMC"]
    for path in (pipe, Path(os.devnull), Path("/dev/zero"), tmp_path / ("x" * 5000 + ".csv")):
        with pytest.raises(RecordingError, match="no such file"):
            open_recording(path)
        with pytest.raises(RecordingError, match="no such file"):
            open_recording(amc, hints=Hints(skeleton=path))
    with pytest.raises(RecordingError, match="no such file"):
        open_recording(tmp_path / "a\0b.csv")
    with pytest.raises(RecordingError, match="nothing readable"):
        open_recording(tmp_path)  # which holds the pipe only
    longest = tmp_path / ("y" * 251 + ".amc")  # what lies beside it cannot be named
    longest.write_bytes(amc.read_bytes())
    with pytest.raises(RecordingError, match=re.escape("larm")):
        open_recording(longest)


@pytest.mark.parametrize(
    ("name", "content"),
    [
        ("a.csv.gz", b"time,a,b\n" + b",,\n" * 2_000_000),
        ("a.csv", b"time,a,b\n" + b",,\n" * 4_000_000),
        ("a.csv", b"time,a\n" + b"\n" * 12_000_000),
        ("a.trc", b"PathFileType\t4\nA\n1\nFrame#\tTime\tA\n\n" + b"\t\t\n" * 4_000_000),
        ("a.bvh.gz", b"0 " * 4_000_000),
        ("a.c3d.gz", b"\0" * 8_000_000),
    ],
)
def test_files_of_almost_nothing(tmp_path: Path, name: str, content: bytes) -> None:
    path = tmp_path / name
    path.write_bytes(gzip.compress(content, 1) if name.endswith("gz") else content)
    tracemalloc.start()
    with pytest.raises(RecordingError):
        open_recording(path)
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert peak < 100e6


TEXTS = sorted({*WRITERS} - BINARY - {"MVNX"})


@pytest.mark.parametrize("format", TEXTS)
def test_the_row_in_which_a_text_ends_is_left_out_and_said(
    valid: dict[str, Path], format: str
) -> None:
    """A row that lacks numbers, and one whose last number lacks digits and is another one."""
    path = valid[format]
    whole = path.read_bytes()
    plain = open_recording(path)
    last = whole.rstrip().rpartition(b"\n")[2]
    number = min(len(last) - last.rfind(separator) for separator in b" ,\t" if separator in last)
    try:
        for cut in (3, number - 2, number + 2, len(last) // 2, len(last) - 3):
            path.write_bytes(whole.rstrip()[:-cut])
            found = open_recording(path)
            assert len(found) == len(plain) - 1, cut
            assert found.frames == pytest.approx(plain.frames[:-1], nan_ok=True), cut
            assert found.report is not None and found.report.warnings
        path.write_bytes(whole.rstrip())  # a whole file may end without a line break
        assert np.array_equal(open_recording(path).frames, plain.frames, equal_nan=True)
    finally:
        path.write_bytes(whole)


@pytest.mark.parametrize("form", ["{:.18e}", "{:.1f}", "{:.6f}"])
def test_the_last_of_numbers_of_any_form(tmp_path: Path, form: str) -> None:
    values = np.random.default_rng(0).uniform(10.0, 90.0, (9, 4))
    text = "a,b,c,d\n" + "\n".join(",".join(map(form.format, row)) for row in values)
    for cut in range(len(form.format(10.0))):
        (tmp_path / "a.csv").write_text(text[: len(text) - cut])
        found = open_recording(tmp_path / "a.csv", hints=Hints(rate_hz=50.0))
        read = np.array([[float(form.format(x)) for x in row] for row in values])
        assert found.frames == pytest.approx(read[: len(found)], abs=1e-4)


def test_a_last_zero_that_was_not_written_is_no_cut(tmp_path: Path) -> None:
    rows = [f"{k / 100},{0.5 + k / 100}" for k in range(1, 11)]
    (tmp_path / "a.csv").write_text("\n".join(["time,b", *rows[:-1], "0.1,0.6"]))
    assert len(open_recording(tmp_path / "a.csv")) == 10
