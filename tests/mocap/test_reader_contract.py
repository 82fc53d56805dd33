"""What holds for every reader that is registered, now or later."""

from __future__ import annotations

import re
import shutil
from pathlib import Path

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from mocap_writers import UI_PRMD_NAME, WRITERS, write, zipped

from mplearn.errors import InvalidValueError, MPLearnError, RecordingError
from mplearn.mocap import READERS, Hints, Reader, open_recording, open_recordings, resample

SUFFIXES = sorted(READERS)
TEXT_SUFFIXES = [s for s in SUFFIXES if s != ".c3d"]


@pytest.fixture(scope="module")
def valid(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Path]:
    """One small valid file of each format, in a folder of its own."""
    return {s: write(tmp_path_factory.mktemp(s[1:]), s) for s in SUFFIXES}


def test_every_reader_has_a_writer_to_be_tested_with() -> None:
    assert set(WRITERS) == set(READERS)


@pytest.mark.parametrize("suffix", SUFFIXES)
def test_registered_under_its_suffixes(suffix: str) -> None:
    reader = READERS[suffix]
    assert isinstance(reader, Reader)
    assert suffix in reader.suffixes
    assert suffix == suffix.lower()


@pytest.mark.parametrize("suffix", SUFFIXES)
@pytest.mark.parametrize("positions", [False, True])
def test_reads_metres_and_seconds(valid: dict[str, Path], suffix: str, positions: bool) -> None:
    recording = open_recording(valid[suffix], positions=positions)
    assert len(recording) == 12
    assert recording.rate_hz == pytest.approx(120.0 if suffix == ".amc" else 100.0)
    assert len(set(recording.channels)) == len(recording.channels)
    assert valid[suffix].name.startswith(recording.name)
    if recording.is_markers:
        heights = recording.markers[..., 2]
        assert 0.5 < np.nanmax(heights) - np.nanmin(heights) < 2.5  # z is up, and in metres
    assert recording.is_markers or suffix in (".amc", ".bvh")
    assert recording.is_markers or not positions


@pytest.mark.parametrize("suffix", SUFFIXES)
def test_gzipped_is_the_same(valid: dict[str, Path], suffix: str, tmp_path: Path) -> None:
    for file in valid[suffix].parent.iterdir():
        shutil.copy(file, tmp_path)
    plain = open_recording(tmp_path / valid[suffix].name)
    packed = zipped(tmp_path / valid[suffix].name)
    assert np.array_equal(open_recording(packed).frames, plain.frames, equal_nan=True)
    assert open_recording(packed).name == plain.name


@pytest.mark.parametrize("suffix", SUFFIXES)
def test_upper_case_suffix(valid: dict[str, Path], suffix: str, tmp_path: Path) -> None:
    for file in valid[suffix].parent.iterdir():
        shutil.copy(file, tmp_path)
    path = tmp_path / valid[suffix].name
    loud = path.rename(path.with_suffix(suffix.upper()))
    assert len(open_recording(loud)) == 12


@pytest.mark.parametrize("suffix", SUFFIXES)
def test_a_folder_of_one_take_opens_like_its_file(valid: dict[str, Path], suffix: str) -> None:
    folder = valid[suffix].parent
    (only,) = open_recordings(folder)
    assert np.array_equal(only.frames, open_recording(folder).frames, equal_nan=True)
    assert np.array_equal(only.frames, open_recording(valid[suffix]).frames, equal_nan=True)


@pytest.mark.parametrize("suffix", SUFFIXES)
def test_reading_twice_is_bit_identical(valid: dict[str, Path], suffix: str) -> None:
    first, second = (open_recording(valid[suffix], positions=True) for _ in range(2))
    assert first.frames.tobytes() == second.frames.tobytes()


@pytest.mark.parametrize("suffix", SUFFIXES)
def test_rate_option_resamples(valid: dict[str, Path], suffix: str) -> None:
    recording = open_recording(valid[suffix])
    at_50 = open_recording(valid[suffix], rate_hz=50.0)
    assert at_50.rate_hz == 50.0
    assert np.array_equal(at_50.frames, resample(recording, 50.0).frames, equal_nan=True)
    with pytest.raises(InvalidValueError, match="rate_hz"):
        open_recording(valid[suffix], rate_hz=-1.0)


@pytest.mark.parametrize("suffix", SUFFIXES)
def test_hinted_rate_wins(valid: dict[str, Path], suffix: str) -> None:
    assert open_recording(valid[suffix], hints=Hints(rate_hz=77.0)).rate_hz == 77.0


@pytest.mark.parametrize("suffix", SUFFIXES)
def test_missing_file(suffix: str, tmp_path: Path) -> None:
    with pytest.raises(RecordingError, match=re.escape(f"nowhere{suffix}") + ".*expected"):
        open_recording(tmp_path / f"nowhere{suffix}")


@pytest.mark.parametrize("suffix", SUFFIXES)
@pytest.mark.parametrize("content", [b"", b" \n\n", b"\x00\xff\x13" * 700, b"P" * 2000, b"1\n"])
def test_empty_or_rubbish(suffix: str, content: bytes, tmp_path: Path) -> None:
    path = tmp_path / (UI_PRMD_NAME if suffix == ".txt" else f"take{suffix}")
    path.write_bytes(content)
    for file in (path, zipped(path)):
        with pytest.raises(RecordingError, match=f"{path.name}.*expected"):
            open_recording(file)


@pytest.mark.parametrize("suffix", SUFFIXES)
def test_truncated_gzip(valid: dict[str, Path], suffix: str, tmp_path: Path) -> None:
    packed = zipped(Path(shutil.copy(valid[suffix], tmp_path)))
    packed.write_bytes(packed.read_bytes()[:-20])
    with pytest.raises(RecordingError, match=f"{packed.name}.*gzip"):
        open_recording(packed)


@pytest.mark.parametrize("suffix", TEXT_SUFFIXES)
def test_wrong_column_count(valid: dict[str, Path], suffix: str, tmp_path: Path) -> None:
    lines = valid[suffix].read_text().rstrip().split("\n")
    separator = "\t" if suffix == ".trc" else "," if suffix in (".csv", ".txt") else " "
    for broken in (lines[-1] + f"{separator}1.5", lines[-1].rsplit(separator, 1)[0]):
        path = _beside(valid[suffix], tmp_path, "\n".join([*lines[:-1], broken]) + "\n")
        with pytest.raises(RecordingError, match=f"{path.name}.*expected"):
            open_recording(path)


@pytest.mark.parametrize("suffix", TEXT_SUFFIXES)
@pytest.mark.parametrize("cell", ["x", "1_0", "inf", "-inf", "1e999"])
def test_non_numeric_cell(valid: dict[str, Path], suffix: str, cell: str, tmp_path: Path) -> None:
    text = valid[suffix].read_text().rstrip()
    last = re.search(r"[-\d.e]+$", text)
    assert last is not None
    path = _beside(valid[suffix], tmp_path, text[: last.start()] + cell + "\n")
    with pytest.raises(RecordingError, match=f"{path.name}.*line.*expected a.* number"):
        open_recording(path)


@pytest.mark.parametrize("suffix", SUFFIXES)
def test_huge_values_are_a_question_of_units(
    valid: dict[str, Path], suffix: str, tmp_path: Path
) -> None:
    for file in valid[suffix].parent.iterdir():
        shutil.copy(file, tmp_path)
    path = tmp_path / valid[suffix].name
    for wrong in (1.0e3, 1.0e-5):  # millimetres as kilometres, or as almost nothing
        with pytest.raises(RecordingError, match=f"{path.stem}.*expected.*unit_m"):
            open_recording(path, hints=Hints(unit_m=wrong), positions=True)


@pytest.mark.parametrize("suffix", SUFFIXES)
@settings(
    max_examples=80, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture]
)
@given(data=st.data())
def test_damage_never_surprises(
    valid: dict[str, Path], suffix: str, tmp_path: Path, data: st.DataObject
) -> None:
    content = bytearray(valid[suffix].read_bytes())
    if data.draw(st.booleans(), "truncate"):
        del content[data.draw(st.integers(0, len(content) - 1), "length") :]
    for _ in range(data.draw(st.integers(0, 4), "changes")):
        if content:
            place = data.draw(st.integers(0, len(content) - 1), "place")
            content[place] = data.draw(st.integers(0, 255), "byte")
    path = _beside(valid[suffix], tmp_path, bytes(content))
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
