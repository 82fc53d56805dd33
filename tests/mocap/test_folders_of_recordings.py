"""Folders as they come: links, loops of them, pipes, and what may not be read."""

from __future__ import annotations

import os
from pathlib import Path

import pytest
from mocap_writers import write_bvh

from mplearn.errors import RecordingError
from mplearn.mocap import find_takes, open_recordings, open_takes
from mplearn_agents.cli import main

TABLE = "time_s,elbow\n" + "".join(f"{k / 50:.2f},{k % 7}\n" for k in range(100))


@pytest.fixture
def corpus(tmp_path: Path) -> Path:
    """A folder with three takes, one of them behind a link to a folder elsewhere."""
    here, elsewhere = tmp_path / "corpus", tmp_path / "elsewhere"
    for path in (here / "anna" / "bow.csv", here / "ben" / "bow.csv", elsewhere / "deep" / "c.csv"):
        path.parent.mkdir(parents=True)
        path.write_text(TABLE)
    (here / "cleo").symlink_to(elsewhere)
    return here


def test_a_recording_is_found_once_however_links_lead_to_it(corpus: Path):
    found = find_takes(corpus)
    assert [take.name for take in found.takes] == ["anna/bow", "ben/bow", "cleo/deep/c"]
    for link, to in (("anna/up", ".."), ("self", "."), ("a-link", "ben"), ("zoe", "cleo")):
        (corpus / link).symlink_to(to)
    assert [take.name for take in find_takes(corpus).takes] == [t.name for t in found.takes]
    assert [take.person for take in find_takes(corpus).takes] == ["anna", "ben", "cleo"]


def test_folders_called_like_files_are_folders(corpus: Path):
    (corpus / "x.bvh").mkdir()
    (corpus / "x.bvh" / "bow.csv").write_text(TABLE)
    found = find_takes(corpus)
    assert "x.bvh/bow" in [take.name for take in found.takes] and not found.unreadable


@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="this system has no named pipes")
def test_what_cannot_be_read_is_named_and_costs_nothing_else(
    corpus: Path, monkeypatch: pytest.MonkeyPatch
):
    names = [take.name for take in find_takes(corpus).takes]
    (corpus / "anna" / "gone.c3d").symlink_to("nowhere.c3d")
    (corpus / "dora").symlink_to("nowhere")
    (corpus / "loop.bvh").symlink_to("loop.bvh")
    (corpus / "README.md").symlink_to("nowhere")  # nobody misses it here
    os.mkfifo(corpus / "ben" / "live.csv")
    for secret in ("ben/secret.csv", "closed/bow.csv"):
        (corpus / secret).parent.mkdir(exist_ok=True)
        (corpus / secret).write_text(TABLE)
    access, scan = os.access, os.scandir
    monkeypatch.setattr(os, "access", lambda p, mode: "secret" not in str(p) and access(p, mode))

    def scanned(path: str) -> object:
        if Path(path).name == "closed":
            raise PermissionError(13, "Permission denied", str(path))
        return scan(path)

    monkeypatch.setattr(os, "scandir", scanned)
    found = find_takes(corpus)
    assert [take.name for take in found.takes] == names
    assert {name: str(error).split(": ", 1)[1] for name, error in found.unreadable.items()} == {
        "anna/gone.c3d": "a link to nowhere.c3d, where nothing is; expected a recording",
        "ben/live.csv": "a pipe or a device; expected a recording",
        "ben/secret.csv": "a file that may not be read; expected a recording",
        "closed": "Permission denied; expected a folder that may be read",
        "dora": "a link to nowhere, where nothing is; expected a recording",
        "loop.bvh": "a link to loop.bvh, where nothing is; expected a recording",
    }
    (corpus / "ben" / "live.csv").unlink()
    with pytest.warns(UserWarning, match="secret.csv: a file that may not be read"):
        assert len(open_recordings(corpus / "ben")) == 1
    with pytest.raises(RecordingError, match="may not be read"):
        open_takes(corpus / "ben", strict=True)


def test_a_folder_that_may_not_be_read_is_refused(corpus: Path, monkeypatch: pytest.MonkeyPatch):
    def refused(path: object) -> object:
        raise PermissionError(13, "Permission denied", str(path))

    monkeypatch.setattr(os, "scandir", refused)
    monkeypatch.setattr(Path, "iterdir", refused)
    for door in (find_takes, open_takes):
        with pytest.raises(RecordingError, match="Permission denied"):
            door(corpus)


def test_a_folder_whose_names_alone_may_be_read_costs_nothing_else(
    corpus: Path, monkeypatch: pytest.MonkeyPatch
):
    names = [take.name for take in find_takes(corpus).takes]
    shut = corpus / "shut"
    (shut / "within").mkdir(parents=True)
    for name in ("bow.csv", "notes", "within/bow.csv"):
        (shut / name).write_text(TABLE)

    def closed(function):
        def called(path, *args, **kwargs):
            if isinstance(path, str | os.PathLike) and shut in Path(path).parents:
                raise PermissionError(13, "Permission denied", str(path))
            return function(path, *args, **kwargs)

        return called

    for name in ("stat", "lstat"):
        monkeypatch.setattr(os, name, closed(getattr(os, name)))
    scan = os.scandir
    monkeypatch.setattr(os, "scandir", closed(scan))
    monkeypatch.setattr(os, "access", lambda path, mode: shut not in Path(path).parents)
    found = find_takes(corpus)
    assert [take.name for take in found.takes] == names
    assert sorted(found.unreadable) == ["shut/bow.csv", "shut/within"]
    assert "a file that may not be read" in str(found.unreadable["shut/bow.csv"])


def test_where_nothing_else_is_it_is_said_what_cannot_be_read(tmp_path: Path):
    (tmp_path / "gone.csv").symlink_to("nowhere.csv")
    for read in (find_takes, open_takes):
        with pytest.raises(RecordingError, match=r"gone.csv: a link to nowhere.csv"):
            read(tmp_path)


def test_folders_that_are_not_looked_into_are_told(tmp_path: Path, capsys):
    for folder in ("anna/day 1", "ben", "notes", ".hidden"):
        (tmp_path / folder).mkdir(parents=True)
    for name in ("walk", "anna/day 1/bow", "ben/bow", ".hidden/bow"):
        write_bvh(tmp_path / f"{name}.bvh")
    (tmp_path / "notes" / "to do.md").write_text("nothing")
    assert open_takes(tmp_path).folders == ("anna", "ben")
    assert main(["inspect", str(tmp_path), "--no-picture"]) == 0
    assert "not looked into, folders in it: anna, ben" in capsys.readouterr().out
    with pytest.raises(
        RecordingError, match=r"nothing readable.*in folders of it, day 1, is found by"
    ):
        open_takes(tmp_path / "anna")
