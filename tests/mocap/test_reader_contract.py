"""What holds for every reader that is registered, now or later."""

from __future__ import annotations

import re
import shutil
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from mocap_writers import BINARY, WRITERS, write, zipped

from mplearn import plugins
from mplearn.errors import (
    InvalidValueError,
    MPLearnError,
    RecordingError,
    RecordingWarning,
)
from mplearn.mocap import (
    Hints,
    Reader,
    open_recording,
    open_recordings,
    readers,
    register_reader,
    registry,
    resample,
    take_names,
)
from mplearn.recording import Recording

FORMATS = sorted(WRITERS)
WITHOUT_ROWS = BINARY | {"MVNX"}
SKELETAL = {"AMC", "BVH", "G1 CSV", "G1 array", "MVNX", "SMPL"}
# in body lengths, of anything: no person in metres
FROM_THE_BODY = {"DeepLabCut", "SLEAP", "key points", "DeepLabCut HDF5", "SLEAP HDF5"}
RATES_HZ = {
    "AMC": 120.0,
    "G1 CSV": 30.0,
    **dict.fromkeys(FROM_THE_BODY, 30.0),
}  # which do not say theirs
TEXT_FORMATS = [format for format in FORMATS if format not in WITHOUT_ROWS]
SEPARATORS = {
    **dict.fromkeys(
        (
            *("CSV", "G1 CSV", "UI-PRMD", "Motive CSV", "Nexus CSV", "DeepLabCut", "SLEAP"),
            "key points",
        ),
        ",",
    ),
    **dict.fromkeys(("TRC", "Qualisys TSV", "OpenSim storage"), "\t"),
}


@pytest.fixture(scope="module")
def valid(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Path]:
    """One small valid file of each format, in a folder of its own."""
    return {format: write(tmp_path_factory.mktemp("valid"), format) for format in FORMATS}


def test_every_reader_has_a_writer_to_be_tested_with() -> None:
    assert sorted(reader.format for reader in readers()) == FORMATS


@pytest.mark.parametrize("format", FORMATS)
def test_a_file_is_read_by_the_reader_of_its_format(valid: dict[str, Path], format: str) -> None:
    report = open_recording(valid[format]).report
    assert report is not None
    assert report.format == format
    assert report.rate_hz == open_recording(valid[format]).rate_hz


class ShoutReader(Reader):
    """Reads one number a line; takes .shout, and of .csv the files that begin with a !."""

    format = "SHOUT"
    suffixes = (".shout", ".csv")

    def accepts(self, path: Path) -> bool:
        return path.suffix == ".shout" or path.read_bytes()[:1] == b"!"

    def read(self, path: Path, hints: Hints, *, positions: bool) -> Recording:
        rows = [[float(line)] for line in path.read_text().strip("!\n").split("\n")]
        return Recording(np.array(rows), hints.rate_hz or 25.0, ("loudness",))


@pytest.fixture
def shouting() -> Iterator[None]:
    before = list(registry._registered)
    register_reader(ShoutReader())
    yield
    registry._registered[:] = before


@pytest.mark.usefixtures("shouting")
def test_a_readers_own_format_joins_by_one_line(tmp_path: Path) -> None:
    (tmp_path / "a.shout").write_text("1\n2\n")
    (tmp_path / "b.csv").write_text("!3\n4\n5\n")
    write(tmp_path, "CSV")
    assert take_names(tmp_path) == ("a", "b", "take")
    assert [len(each) for each in open_recordings(tmp_path)] == [2, 3, 12]
    report = open_recording(tmp_path / "b.csv").report
    assert report is not None
    assert (report.format, report.rate_hz) == ("SHOUT", 25.0)
    n_readers = len(readers())
    register_reader(ShoutReader())
    assert len(readers()) == n_readers


@pytest.mark.usefixtures("shouting")
def test_a_reader_that_returns_no_recording_is_named(tmp_path: Path) -> None:
    class Careless(ShoutReader):
        suffixes = (".careless",)

        def accepts(self, path: Path) -> bool:
            return True

        def read(self, path: Path, hints: Hints, *, positions: bool) -> Recording:
            return np.zeros((2, 1))  # type: ignore[return-value]

    class Silent(ShoutReader):
        suffixes = (".silent",)

        def read_each(self, path: Path, hints: Hints, *, positions: bool) -> tuple[Recording, ...]:
            return ()

    register_reader(Silent())
    (tmp_path / "a.silent").write_text("1\n2\n")
    with pytest.raises(RecordingError, match=r"Silent\.read_each returned \(\), not a tuple of"):
        open_recordings(tmp_path / "a.silent")
    register_reader(Careless())
    (tmp_path / "a.careless").write_text("1\n2\n")
    with pytest.raises(RecordingError, match=r"Careless\.read returned a value of type ndarray"):
        open_recording(tmp_path / "a.careless")


@pytest.mark.usefixtures("shouting")
def test_an_installed_package_brings_readers_of_its_own(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    class Point:
        name = "quiet"
        brings: object = None

        def load(self) -> object:
            return self.brings

    class QuietReader(ShoutReader):
        format = "QUIET"
        suffixes = (".quiet",)

    point = Point()
    point.brings = QuietReader
    monkeypatch.setattr(plugins, "entry_points", lambda group: [point])
    registry._load_entry_points.cache_clear()
    (tmp_path / "a.quiet").write_text("1\n2\n")
    report = open_recording(tmp_path / "a.quiet").report
    assert report is not None
    assert report.format == "QUIET"
    point.brings = None  # a package that is broken is named
    registry._load_entry_points.cache_clear()
    with pytest.raises(RecordingError, match="'quiet' of an installed package"):
        open_recording(tmp_path / "a.quiet")
    monkeypatch.undo()
    registry._load_entry_points.cache_clear()


@pytest.mark.parametrize("wrong", [(), ("abc",), (".ABC",), (".gz",)])
def test_a_reader_without_a_suffix_is_refused(wrong: tuple[str, ...]) -> None:
    class Wrong(ShoutReader):
        suffixes = wrong

    with pytest.raises(InvalidValueError, match="suffixes"):
        register_reader(Wrong())
    with pytest.raises(InvalidValueError, match="instance of Reader"):
        register_reader(Wrong)  # type: ignore[arg-type]


@pytest.mark.parametrize("format", FORMATS)
@pytest.mark.parametrize("positions", [False, True])
def test_reads_metres_and_seconds(valid: dict[str, Path], format: str, positions: bool) -> None:
    recording = open_recording(valid[format], positions=positions)
    assert len(recording) == 12
    assert recording.rate_hz == pytest.approx(RATES_HZ.get(format, 100.0))
    assert len(set(recording.channels)) == len(recording.channels)
    assert valid[format].name.startswith(recording.name)
    if recording.is_markers:
        heights = recording.markers[..., 2]
        assert 0.5 < np.nanmax(heights) - np.nanmin(heights) < 2.5  # z is up, and in metres
    assert recording.is_markers or format in SKELETAL | FROM_THE_BODY
    assert recording.is_markers or not positions or format in FROM_THE_BODY


@pytest.mark.parametrize("format", FORMATS)
def test_gzipped_is_the_same(valid: dict[str, Path], format: str, tmp_path: Path) -> None:
    for file in valid[format].parent.iterdir():
        shutil.copy(file, tmp_path)
    plain = open_recording(tmp_path / valid[format].name)
    packed = zipped(tmp_path / valid[format].name)
    assert np.array_equal(open_recording(packed).frames, plain.frames, equal_nan=True)
    assert open_recording(packed).name == plain.name


@pytest.mark.parametrize("format", FORMATS)
def test_upper_case_suffix(valid: dict[str, Path], format: str, tmp_path: Path) -> None:
    for file in valid[format].parent.iterdir():
        shutil.copy(file, tmp_path)
    path = tmp_path / valid[format].name
    loud = path.rename(path.with_suffix(path.suffix.upper()))
    assert len(open_recording(loud)) == 12


@pytest.mark.parametrize("format", FORMATS)
def test_a_folder_of_one_take_opens_like_its_file(valid: dict[str, Path], format: str) -> None:
    folder = valid[format].parent
    (only,) = open_recordings(folder)
    assert np.array_equal(only.frames, open_recording(folder).frames, equal_nan=True)
    assert np.array_equal(only.frames, open_recording(valid[format]).frames, equal_nan=True)


@pytest.mark.parametrize("format", FORMATS)
def test_reading_twice_is_bit_identical(valid: dict[str, Path], format: str) -> None:
    first, second = (open_recording(valid[format], positions=True) for _ in range(2))
    assert first.frames.tobytes() == second.frames.tobytes()


@pytest.mark.parametrize("format", FORMATS)
def test_rate_option_resamples(valid: dict[str, Path], format: str) -> None:
    recording = open_recording(valid[format])
    at_50 = open_recording(valid[format], rate_hz=50.0)
    assert at_50.rate_hz == 50.0
    assert np.array_equal(at_50.frames, resample(recording, 50.0).frames, equal_nan=True)
    with pytest.raises(InvalidValueError, match="rate_hz"):
        open_recording(valid[format], rate_hz=-1.0)


@pytest.mark.parametrize("format", FORMATS)
def test_hinted_rate_wins(valid: dict[str, Path], format: str) -> None:
    assert open_recording(valid[format], hints=Hints(rate_hz=77.0)).rate_hz == 77.0


@pytest.mark.parametrize("format", FORMATS)
def test_missing_file(format: str, tmp_path: Path) -> None:
    name = f"nowhere{Path(WRITERS[format][0]).suffix}"
    with pytest.raises(RecordingError, match=re.escape(name) + ".*expected"):
        open_recording(tmp_path / name)


@pytest.mark.parametrize("format", FORMATS)
@pytest.mark.parametrize("content", [b"", b" \n\n", b"\x00\xff\x13" * 700, b"P" * 2000, b"1\n"])
def test_empty_or_rubbish(format: str, content: bytes, tmp_path: Path) -> None:
    path = tmp_path / WRITERS[format][0]
    path.write_bytes(content)
    for file in (path, zipped(path)):
        with pytest.raises(RecordingError, match=f"{path.name}.*expected"):
            open_recording(file)


@pytest.mark.parametrize("format", FORMATS)
def test_truncated_gzip(valid: dict[str, Path], format: str, tmp_path: Path) -> None:
    packed = zipped(Path(shutil.copy(valid[format], tmp_path)))
    packed.write_bytes(packed.read_bytes()[:-20])
    with pytest.raises(RecordingError, match=f"{packed.name}.*gzip"):
        open_recording(packed)


@pytest.mark.parametrize("format", TEXT_FORMATS)
def test_wrong_column_count(valid: dict[str, Path], format: str, tmp_path: Path) -> None:
    lines = valid[format].read_text().rstrip().split("\n")
    separator = SEPARATORS.get(format, " ")
    for broken in (lines[-1] + f"{separator}1.5", lines[-1].rsplit(separator, 1)[0]):
        path = _beside(valid[format], tmp_path, "\n".join([*lines[:-1], broken]) + "\n")
        if format == "BVH" and len(broken) < len(lines[-1]):  # a file that was cut off
            with pytest.warns(RecordingWarning, match="cut off"):
                assert len(open_recording(path)) == 11
            continue
        with pytest.raises(RecordingError, match=f"{path.name}.*expected"):
            open_recording(path)


@pytest.mark.parametrize("format", TEXT_FORMATS)
@pytest.mark.parametrize("cell", ["x", "1_0", "1e999"])
def test_non_numeric_cell(valid: dict[str, Path], format: str, cell: str, tmp_path: Path) -> None:
    text = valid[format].read_text().rstrip()
    last = re.search(r"[-\d.e]+$", text)
    assert last is not None
    path = _beside(valid[format], tmp_path, text[: last.start()] + cell + "\n")
    with pytest.raises(RecordingError, match=f"{path.name}.*line.*expected a.* number"):
        open_recording(path)


@pytest.mark.filterwarnings("ignore:.*1 cells are not numbers")
@pytest.mark.parametrize("format", TEXT_FORMATS)
@pytest.mark.parametrize("cell", ["inf", "-Infinity"])
def test_what_is_infinite_is_missing_where_anything_may_be(
    valid: dict[str, Path], format: str, cell: str, tmp_path: Path
) -> None:
    text = valid[format].read_text().rstrip()
    last = re.search(r"[-\d.e]+$", text)
    assert last is not None
    outcomes: list[object] = []
    for missing in ("nan", cell):
        path = _beside(valid[format], tmp_path, text[: last.start()] + missing + "\n")
        try:
            recording = open_recording(path)
        except RecordingError as error:
            outcomes.append("number" in str(error))
        else:
            outcomes.append((recording.channels, recording.frames.tobytes()))
    assert outcomes[0] == outcomes[1]


@pytest.mark.parametrize("format", sorted(set(FORMATS) - FROM_THE_BODY))
def test_huge_values_are_a_question_of_units(
    valid: dict[str, Path], format: str, tmp_path: Path
) -> None:
    for file in valid[format].parent.iterdir():
        shutil.copy(file, tmp_path)
    path = tmp_path / valid[format].name
    for wrong in (1.0e3, 1.0e-5):  # millimetres as kilometres, or as almost nothing
        with pytest.raises(RecordingError, match=f"{path.stem}.*expected.*unit_m"):
            open_recording(path, hints=Hints(unit_m=wrong), positions=True)


@pytest.mark.filterwarnings("ignore::mplearn.errors.RecordingWarning")
@pytest.mark.parametrize("format", FORMATS)
@settings(
    max_examples=80, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture]
)
@given(data=st.data())
def test_damage_never_surprises(
    valid: dict[str, Path], format: str, tmp_path: Path, data: st.DataObject
) -> None:
    content = bytearray(valid[format].read_bytes())
    if data.draw(st.booleans(), "truncate"):
        del content[data.draw(st.integers(0, len(content) - 1), "length") :]
    for _ in range(data.draw(st.integers(0, 4), "changes")):
        if content:
            place = data.draw(st.integers(0, len(content) - 1), "place")
            content[place] = data.draw(st.integers(0, 255), "byte")
    path = _beside(valid[format], tmp_path, bytes(content))
    for positions in (False, True):
        try:
            recording = open_recording(path, positions=positions)
        except MPLearnError as error:
            assert path.name in str(error)
        else:
            assert not np.isinf(recording.frames).any()


def _beside(original: Path, folder: Path, content: str | bytes) -> Path:
    """Write other content under a valid file's name, with what lies beside it."""
    for file in original.parent.iterdir():
        shutil.copy(file, folder)
    path = folder / original.name
    path.write_bytes(content.encode() if isinstance(content, str) else content)
    return path
