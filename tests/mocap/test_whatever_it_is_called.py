"""Files under names that are not their format's, and what lies there instead of a file."""

from __future__ import annotations

import gzip
import tracemalloc
from contextlib import suppress
from pathlib import Path
from zipfile import ZIP_BZIP2, ZIP_DEFLATED, ZIP_LZMA, ZIP_STORED, ZipFile

import numpy as np
import pytest
from mocap_writers import write, write_motive

from mplearn.anatomy import recognise
from mplearn.demonstrator import demonstrate
from mplearn.errors import RecordingError
from mplearn.mocap import open_recording, open_recordings
from mplearn_envs.data.library_source import LibrarySource

pytestmark = pytest.mark.filterwarnings("ignore::mplearn.errors.RecordingWarning")


@pytest.mark.parametrize("name", ["take", "take.txt", "take.csv", "take.bvh.txt", "take.BVH.bak"])
@pytest.mark.parametrize("format", ["BVH", "TRC", "MVNX"])
def test_a_format_that_names_itself_is_known_by_its_start(
    tmp_path: Path, format: str, name: str
) -> None:
    path = write(tmp_path, format)
    wanted = open_recording(path)
    other = tmp_path / "other" / name
    other.parent.mkdir()
    other.write_bytes(path.read_bytes())
    found = open_recording(other)
    assert found.channels == wanted.channels
    assert np.array_equal(found.frames, wanted.frames, equal_nan=True)


def test_copies_in_a_folder_are_no_takes(tmp_path: Path) -> None:
    path = write(tmp_path, "BVH")
    (tmp_path / "take.bvh.bak").write_bytes(path.read_bytes())
    (tmp_path / "take~").write_bytes(path.read_bytes())
    assert [take.name for take in open_recordings(tmp_path)] == ["take"]


@pytest.mark.parametrize("format", ["BVH", "C3D", "CSV", "SMPL"])
def test_packed_or_not_whatever_the_name(tmp_path: Path, format: str) -> None:
    """Browsers unpack what they load and leave its name; others pack and do not say so."""
    path = write(tmp_path, format)
    wanted, content = open_recording(path), path.read_bytes()
    plain = tmp_path / f"{path.name}.gz"
    plain.write_bytes(content)
    path.write_bytes(gzip.compress(content))
    for each in (plain, path):
        assert np.array_equal(open_recording(each).frames, wanted.frames, equal_nan=True)


@pytest.mark.parametrize("format", ["BVH", "C3D", "CSV", "SMPL", "XDF", "TRC"])
@pytest.mark.parametrize("name", ["takes/{}", "{}"])
def test_alone_in_a_zip_archive(tmp_path: Path, format: str, name: str) -> None:
    path = write(tmp_path, format)
    wanted = open_recording(path)
    of_its_name = [path] if format != "SMPL" else []  # which is that of an archive, too
    for packed in (tmp_path / "Export 3.zip", *of_its_name):
        with ZipFile(tmp_path / "packed", "w", ZIP_DEFLATED) as archive:
            for beside in ("__MACOSX/._a.bvh", "README.txt", "licence.md", "pictures/a.PNG"):
                archive.writestr(beside, "text")
            archive.mkdir("takes")
            archive.writestr(name.format(path.name), path.read_bytes())
        (tmp_path / "packed").replace(packed)
        found = open_recording(packed)
        assert found.channels == wanted.channels
        assert np.array_equal(found.frames, wanted.frames, equal_nan=True)
    assert [take.name for take in open_recordings(tmp_path)] == ["Export 3", path.stem]


def test_what_is_in_an_archive_is_named(tmp_path: Path) -> None:
    path = tmp_path / "a.zip"
    with ZipFile(path, "w") as archive:
        for name in ("walk.bvh", "run.bvh"):
            archive.writestr(name, write(tmp_path, "BVH").read_bytes())
    with pytest.raises(RecordingError, match=r"zip archive of 2 takes; expected .* run, walk"):
        open_recording(path)
    with ZipFile(path, "w") as archive:
        archive.writestr("[Content_Types].xml", "<xml/>")
        archive.writestr("xl/workbook.xml", "<xml/>")
    with pytest.raises(RecordingError, match="office program; expected a table saved as CSV"):
        open_recording(path)


@pytest.mark.parametrize("method", [ZIP_STORED, ZIP_DEFLATED, ZIP_BZIP2, ZIP_LZMA])
def test_a_bad_archive_is_refused(tmp_path: Path, method: int) -> None:
    path, rng = tmp_path / "a.zip", np.random.default_rng(0)
    with ZipFile(path, "w", method) as archive:
        archive.writestr("a.bvh", write(tmp_path, "BVH").read_bytes())
    whole = path.read_bytes()
    for _ in range(200):
        data = bytearray(whole)
        for at in rng.integers(0, len(data), 4):
            data[at] = rng.integers(256)
        path.write_bytes(data[: rng.integers(len(data) // 2, len(data) + 1)])
        with suppress(RecordingError):
            open_recording(path)
    with ZipFile(path, "w", ZIP_DEFLATED) as archive:
        archive.writestr("a.bvh", bytes(30_000_000))
    with pytest.raises(RecordingError, match="expands to more than"):
        open_recording(path)


def test_what_expands_without_end_is_refused_before_it_fills_the_memory(tmp_path: Path) -> None:
    path = tmp_path / "a.zip"
    with ZipFile(path, "w", ZIP_LZMA) as archive:  # which unpacks all that it is given
        archive.writestr("a.bvh", bytes(150_000_000))
    tracemalloc.start()
    with pytest.raises(RecordingError, match="expands to more than"):
        open_recording(path)
    most = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert most < 100_000_000


@pytest.mark.parametrize(
    ("content", "says"),
    [
        (b"version https://git-lfs.github.com/spec/v1\noid sha256:0\nsize 9\n", "Git LFS"),
        (b"\xef\xbb\xbf<html lang='en'><body>Sign in</body></html>", "page of the web"),
        (b"PK\x03\x04", "zip archive"),
    ],
)
def test_what_has_no_name_of_a_format_is_called_so_too(
    tmp_path: Path, content: bytes, says: str
) -> None:
    path = tmp_path / "takes.zip"
    path.write_bytes(content)
    with pytest.raises(RecordingError, match=says):
        open_recording(path)


@pytest.mark.parametrize("name", ["my.mplearn", "take.bvh"])
def test_a_library_is_no_recording(tmp_path: Path, name: str) -> None:
    path = LibrarySource(None).now().save(tmp_path / name)
    with pytest.raises(RecordingError, match="library of primitives"):
        open_recording(path)


def test_motive_saved_with_semicolons_and_decimal_commas(tmp_path: Path) -> None:
    path = write_motive(tmp_path / "a.csv")
    wanted = open_recording(path)
    path.write_text(path.read_text().replace(",", ";").replace(".", ","))
    found = open_recording(path)
    assert (found.rate_hz, found.channels) == (wanted.rate_hz, wanted.channels)
    assert np.allclose(found.frames, wanted.frames, equal_nan=True)


def test_topics_before_the_names_of_markers(tmp_path: Path) -> None:
    take = demonstrate(["BAR"], 4, rate_hz=50.0).recording.sliced(0, 60)
    head = [f"/rig/{name}/position/{axis}" for name in take.marker_names for axis in "xyz"]
    rows = [[f"{k / 50:.3f}", *map(repr, map(float, row))] for k, row in enumerate(take.frames)]
    path = tmp_path / "a.csv"
    path.write_text("\n".join(map(",".join, [["time", *head], *rows])) + "\n")
    found = open_recording(path)
    assert recognise(found).apply(found).frames == pytest.approx(
        recognise(take).apply(take).frames, nan_ok=True
    )
