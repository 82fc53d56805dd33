"""Archives of recordings: each of them is a take, as those of a folder, or named with a reason."""

from __future__ import annotations

import bz2
import gc
import gzip
import io
import lzma
import shutil
import tarfile
import tracemalloc
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path
from zipfile import ZIP_BZIP2, ZIP_DEFLATED, ZIP_LZMA, ZipFile

import numpy as np
import pytest
from mocap_writers import bvh_values, write, write_amc, write_asf, write_bvh, write_trc

from mplearn.errors import RecordingError
from mplearn.mocap import find_takes, open_recording, open_recordings, open_takes, take_names
from mplearn.mocap.packed.archives import members, open_member, recordings_in

pytestmark = pytest.mark.filterwarnings("ignore::mplearn.errors.RecordingWarning")

KINDS = ["zip", "bzip2.zip", "lzma.zip", "tar", "tar.gz", "tgz", "tar.bz2", "tar.xz"]


def packed(folder: Path, archive: Path) -> Path:
    """Pack a folder as a user's tools do, with what they add."""
    files = sorted(path for path in folder.rglob("*") if path.is_file())
    if archive.suffix == ".zip":
        ways = {"bzip2": ZIP_BZIP2, "lzma": ZIP_LZMA}
        way = next((ways[name] for name in ways if name in archive.name), ZIP_DEFLATED)
        with ZipFile(archive, "w", way) as made:
            made.writestr("__MACOSX/walks/._slow.bvh", b"\0\5\26\7")
            for file in files:
                made.write(file, file.relative_to(folder))
        return archive
    mode = {"gz": "w:gz", "tgz": "w:gz", "bz2": "w:bz2", "xz": "w:xz"}
    with tarfile.open(archive, mode.get(archive.name.rpartition(".")[2], "w")) as tar:
        tar.add(folder, arcname=".")
    return archive


@pytest.fixture
def session(tmp_path: Path) -> Path:
    """A folder of takes in folders, of several formats and packings."""
    here = tmp_path / "session"
    for inner in ("walks", "runs", "motions"):
        (here / inner).mkdir(parents=True)
    write_bvh(here / "walks" / "slow.bvh")
    (here / "walks" / "._slow.bvh").write_bytes(b"\0\5\26\7")  # of macOS
    (here / "runs" / "slow.trc.gz").write_bytes(
        gzip.compress(write_trc(tmp_path / "a").read_bytes())
    )
    write(here, "C3D")
    write_asf(here / "motions" / "HDM_ab.asf")
    write_amc(here / "motions" / "HDM_ab_walk_01_120.amc")
    (here / "README.txt").write_text("who walked, and when")
    return here


NAMES = ["motions/HDM_ab_walk_01_120", "runs/slow", "take", "walks/slow"]


@pytest.mark.parametrize("kind", KINDS)
def test_what_is_in_an_archive_is_read_as_from_a_folder(
    tmp_path: Path, session: Path, kind: str
) -> None:
    archive = packed(session, tmp_path / f"packed.{kind}")
    wanted = {take.name: take.read(positions=True)[0] for take in find_takes(session).takes}
    assert list(wanted) == NAMES
    found = {take.name: take for take in open_takes(archive, positions=True).recordings}
    assert list(found) == NAMES and not open_takes(archive).unreadable
    for name, recording in found.items():
        assert recording.channels == wanted[name].channels
        assert recording.rate_hz == wanted[name].rate_hz
        assert np.array_equal(recording.frames, wanted[name].frames, equal_nan=True)
    one = open_recording(archive, take="runs/slow")
    assert np.array_equal(one.frames, open_recording(archive / "runs" / "slow.trc.gz").frames)
    assert take_names(archive / "walks") == ("slow",)
    with pytest.raises(RecordingError, match=r"archive of 4 takes; expected .* runs/slow"):
        open_recording(archive)
    with pytest.raises(RecordingError, match="no such file"):
        open_recording(archive / "walks" / "quick.bvh")


@pytest.mark.parametrize("kind", ["zip", "tar.gz"])
def test_a_folder_of_archives(tmp_path: Path, session: Path, kind: str) -> None:
    data = tmp_path / "data"
    (data / "more").mkdir(parents=True)
    archive = packed(session, data / f"anna.{kind}")
    shutil.copy(archive, data / "more" / archive.name)
    write_bvh(data / "alone.bvh")
    names = ["alone", *(f"{archive.name}/{name}" for name in NAMES)]
    assert [take.name for take in open_recordings(data)] == names
    takes = find_takes(data).takes
    assert [take.name for take in takes] == [*names, *(f"more/{name}" for name in names[1:])]
    assert {take.person for take in takes} == {"", "anna", "more"}


def encrypted(path: Path) -> None:
    """Write an archive that says that it is encrypted."""
    with ZipFile(path, "w") as made:
        made.writestr("a.bvh", "HIERARCHY")
    data = bytearray(path.read_bytes())
    for start, flags in ((b"PK\3\4", 6), (b"PK\1\2", 8)):
        data[data.index(start) + flags] |= 1
    path.write_bytes(data)


def changed(path: Path, at: dict[bytes, int], to: int) -> None:
    """Set a byte of the last file's headers in an archive, in front of it and in the directory."""
    data = bytearray(path.read_bytes())
    for start, place in at.items():
        data[data.rindex(start) + place] = to
    path.write_bytes(data)


@pytest.mark.parametrize(
    ("at", "to", "says"),
    [
        ({b"PK\3\4": 6, b"PK\1\2": 8}, 1, "encrypted; expected an archive .* no password"),
        ({b"PK\3\4": 8, b"PK\1\2": 10}, 9, "method 9.*; expected one packed by deflate"),
    ],
)
def test_one_file_that_cannot_be_unpacked_costs_no_other(
    tmp_path: Path, at: dict[bytes, int], to: int, says: str
) -> None:
    text = write_bvh(tmp_path / "a").read_bytes()
    path = tmp_path / "a.zip"
    with ZipFile(path, "w") as made:
        for name in ("walks/one.bvh", "walks/two.bvh"):
            made.writestr(name, text)
    changed(path, at, to)
    takes = open_takes(path)
    assert [take.name for take in takes.recordings] == ["walks/one"]
    assert list(takes.unreadable) == ["walks/two"]
    with pytest.raises(RecordingError, match=f"walks/two.bvh: .*{says}"):
        open_recording(path / "walks" / "two.bvh")


def test_an_archive_stays_open_while_a_file_in_it_is_read(tmp_path: Path) -> None:
    """Of many archives only the latest are kept open, and threads may read others."""
    text = bytes(100_000)
    for k in range(9):
        with tarfile.open(tmp_path / f"{k}.tar", "w") as tar:
            info = tarfile.TarInfo("a.bvh")
            info.size = len(text)
            tar.addfile(info, io.BytesIO(text))
    with open_member(tmp_path / "0.tar", "a.bvh") as file:
        start = file.read(1)
        for k in range(1, 9):
            assert list(members(tmp_path / f"{k}.tar")) == ["a.bvh"]
        gc.collect()
        assert start + file.read() == text


def test_what_lies_in_a_folder_of_an_archive(tmp_path: Path) -> None:
    names = ["a.bvh", "a.d/x.bvh", "a/b/c.bvh", "a/b.bvh", "a/b-c.bvh", "a0/d.bvh", "\u00e9/e.bvh"]
    with ZipFile(tmp_path / "a.zip", "w") as made:
        for name in names:
            made.writestr(name, "HIERARCHY")
    for folder in ("", "a", "a.d", "a/b", "a0", "\u00e9", "b"):
        wanted = [n for n in sorted(names) if not folder or n.startswith(f"{folder}/")]
        assert list(recordings_in(tmp_path / "a.zip", folder)) == wanted


def nested(path: Path) -> None:
    with ZipFile(path, "w") as made:
        made.writestr("a.bvh", write_bvh(path.with_name("a")).read_bytes())
        made.writestr("parts/inner.zip", b"PK\3\4")


def of_pictures(path: Path) -> None:
    with ZipFile(path, "w") as made:
        made.writestr("front.png", b"\x89PNG")
        made.writestr("notes.doc", b"text")


@pytest.mark.parametrize(
    ("name", "made", "says"),
    [
        ("a.7z", b"7z\xbc\xaf\x27\x1c\0\4", "a 7z archive, .* expected the files unpacked"),
        ("a.RAR", b"Rar!\x1a\7\1\0", "a RAR archive, .* expected the files unpacked"),
        ("a.bvh", b"7z\xbc\xaf\x27\x1c\0\4", "a 7z archive"),
        ("a.tar.zst", b"\x28\xb5\x2f\xfd", "no archive"),
        ("a.zip", b"PK\3\4 and no more", "damaged .* expected a whole zip archive"),
        (
            "a.tar.gz",
            gzip.compress(bytes(600), mtime=0)[:-9],
            "damaged .* expected a whole tar archive",
        ),
        ("a.zip", b"<!doctype html><html>sign in</html>", "page of the web"),
        ("a.tgz", b"version https://git-lfs.github.com/spec/v1\n", "Git LFS"),
        ("a.zip", b"", "empty"),
        ("a.zip", encrypted, "encrypted"),
        ("a.zip", nested, "parts/inner.zip: it is an archive"),
        ("a.zip", of_pictures, "an archive with nothing readable"),
    ],
)
def test_an_archive_that_cannot_be_read_is_named_and_costs_nothing_else(
    tmp_path: Path, name: str, made: bytes | Callable[[Path], None], says: str
) -> None:
    data = tmp_path / "data"
    data.mkdir()
    write_bvh(data / "walk.bvh")
    if isinstance(made, bytes):
        (data / name).write_bytes(made)
    else:
        made(data / name)
    (data / "a").unlink(missing_ok=True)
    with pytest.warns(UserWarning, match=says):
        found = open_recordings(data)
    assert "walk" in [take.name for take in found]
    for problems in (open_takes(data).unreadable, find_takes(data).unreadable):
        assert len(problems) == 1 and next(iter(problems)).startswith(name)
    with pytest.raises(RecordingError, match=says):
        open_recordings(data, strict=True)


def test_what_also_lies_unpacked_is_learned_once(tmp_path: Path, session: Path) -> None:
    archive = packed(session, session.with_suffix(".zip"))
    found = find_takes(tmp_path)
    assert [take.name for take in found.takes] == [f"session/{name}" for name in NAMES]
    assert "lies unpacked beside it" in str(found.unreadable["session.zip"])
    shutil.copy(archive, session / "all.zip")
    assert "lies unpacked beside it" in str(open_takes(session).unreadable["all.zip"])
    one = tmp_path / "one"
    one.mkdir()
    write_bvh(one / "walk.bvh")
    packed(one, tmp_path / "walk.zip").rename(one / "walk.zip")
    assert [take.name for take in open_takes(one).recordings] == ["walk"]
    write_bvh(one / "walk.bvh", bvh_values(7))  # another of that name
    assert take_names(one) == ("walk.bvh", "walk.zip")


@pytest.mark.parametrize("pack", [bz2.compress, lzma.compress])
def test_other_packings_of_one_file(tmp_path: Path, pack: Callable[[bytes], bytes]) -> None:
    path = write_bvh(tmp_path / "a.bvh")
    wanted = open_recording(path)
    ending = "bz2" if pack is bz2.compress else "xz"
    other = tmp_path / f"b.bvh.{ending}"
    other.write_bytes(pack(path.read_bytes()))
    assert np.array_equal(open_recording(other).frames, wanted.frames)
    assert [take.name for take in open_recordings(tmp_path)] == ["a", "b"]
    other.write_bytes(other.read_bytes()[:-20])
    with pytest.raises(
        RecordingError, match=f"damaged .* a whole {'bzip2' if ending == 'bz2' else ending}"
    ):
        open_recording(other)
    other.write_bytes(pack(bytes(30_000_000)))
    with pytest.raises(RecordingError, match="expands to more than"):
        open_recording(other)


def test_names_in_an_archive_lead_nowhere_else(tmp_path: Path) -> None:
    text = write_bvh(tmp_path / "a").read_bytes()
    with ZipFile(tmp_path / "a.zip", "w") as made:
        for name in ("../up.bvh", "/root.bvh", "./here.bvh", "of\\windows.bvh", "a//b.bvh"):
            made.writestr(name, text)
    names = ["a/b", "here", "of/windows", "root", "up"]
    assert [take.name for take in open_recordings(tmp_path / "a.zip")] == names


@pytest.mark.parametrize("kind", ["zip", "tar"])
def test_files_whose_names_are_one_path_are_all_read(tmp_path: Path, kind: str) -> None:
    path, called = tmp_path / f"a.{kind}", ("a/b.bvh", "a\\b.bvh", "./a/b.bvh", "a/b (2).bvh")
    files = [
        (name, write_bvh(tmp_path / "one", bvh_values(10 + k)).read_bytes())
        for k, name in enumerate(called)
    ]
    if kind == "zip":
        with ZipFile(path, "w") as made:
            for name, text in files:
                made.writestr(name, text)
    else:
        with tarfile.open(path, "w") as tar:
            for name, text in files:
                info = tarfile.TarInfo(name)
                info.size = len(text)
                tar.addfile(info, io.BytesIO(text))
    read = {take.name: len(take) for take in open_recordings(path)}
    assert read == {"a/b": 10, "a/b (2)": 11, "a/b (3)": 12, "a/b (2) (2)": 13}


@pytest.mark.filterwarnings("ignore:Duplicate name")
@pytest.mark.parametrize("kind", ["zip", "tar"])
def test_of_a_file_that_was_appended_again_the_last_counts(tmp_path: Path, kind: str) -> None:
    path = tmp_path / f"a.{kind}"
    copies = [write_bvh(tmp_path / f"{k}", bvh_values(10 + k)).read_bytes() for k in range(3)]
    for name, text in (("b", copies[0]), ("a", copies[1]), ("b", copies[2]), ("b", copies[1])):
        if kind == "zip":
            with ZipFile(path, "a") as made:
                made.writestr(f"{name}.bvh", text)
        else:
            with tarfile.open(path, "a") as tar:
                info = tarfile.TarInfo(f"{name}.bvh")
                info.size = len(text)
                tar.addfile(info, io.BytesIO(text))
    a, b = open_recordings(path)
    assert (a.name, len(a), b.name, len(b)) == ("a", 11, "b", 11)
    assert a.report and b.report
    assert b.report.notes[-1] == "the archive holds 2 older copies of b.bvh, passed over"
    assert not any("older" in note for note in a.report.notes)


def test_a_file_without_a_name_is_none(tmp_path: Path) -> None:
    text = write_bvh(tmp_path / "a").read_bytes()
    with ZipFile(tmp_path / "a.zip", "w") as made:
        for name in ("n", "..", "walk.bvh"):
            made.writestr(name, text)
    path = tmp_path / "a.zip"
    data = bytearray(path.read_bytes())
    at = data.index(b"PK\1\2")
    data[at + 28] = 0  # length of the first name in the directory
    del data[at + 46]
    end = data.index(b"PK\5\6")
    data[end + 12] -= 1  # that of the directory
    path.write_bytes(data)
    assert [take.name for take in open_recordings(path)] == ["a"]


def test_what_expands_without_end_is_refused(tmp_path: Path) -> None:
    ends = tmp_path / "a.tar.gz"
    with tarfile.open(ends, "w:gz") as tar:
        info = tarfile.TarInfo("a.bvh")
        info.size = 40_000_000
        tar.addfile(info, io.BytesIO(bytes(info.size)))
    many = tmp_path / "many.zip"
    with ZipFile(many, "w", ZIP_DEFLATED) as made:
        for k in range(30):  # each of which alone may be as large as this
            made.writestr(f"{k}.bvh", bytes(3_000_000))
    tracemalloc.start()
    for archive in (ends, many):
        with pytest.raises(RecordingError, match="expands to more than"):
            open_recordings(archive)
    most = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert most < 20_000_000


@pytest.mark.parametrize("kind", ["zip", "tar", "tar.gz"])
def test_damaged_archives_raise_errors_of_ours(tmp_path: Path, session: Path, kind: str) -> None:
    archive, rng = packed(session, tmp_path / f"a.{kind}"), np.random.default_rng(0)
    whole = archive.read_bytes()
    for _ in range(60):
        data = bytearray(whole)
        for at in rng.integers(0, len(data), 6):
            data[at] = rng.integers(256)
        archive.write_bytes(data[: rng.integers(len(data) // 2, len(data) + 1)])
        with suppress(RecordingError):
            open_takes(archive)


def test_a_tar_archive_whose_sizes_lead_back_is_refused(tmp_path: Path) -> None:
    info = tarfile.TarInfo("a.bvh")
    header = bytearray(info.tobuf(tarfile.GNU_FORMAT))
    header[124:136] = (-1536).to_bytes(12, "big", signed=True)
    header[148:156] = b" " * 8
    header[148:156] = b"%06o\0 " % sum(header)
    path = tmp_path / "a.tar"
    path.write_bytes(bytes(header) + bytes(2048))
    with pytest.raises(RecordingError):
        open_takes(path)
