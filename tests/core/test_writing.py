"""Files are written whole or not at all, to what their names lead to."""

import os

import pytest

from mplearn.errors import LibraryError
from mplearn.library import PrimitiveLibrary
from mplearn.writing import written_whole


def test_what_goes_wrong_leaves_what_was_there(tmp_path):
    file = tmp_path / "a.csv"
    file.write_text("old")
    with pytest.raises(KeyboardInterrupt), written_whole(file) as new:
        new.write_text("half")
        raise KeyboardInterrupt
    assert [(each.name, each.read_text()) for each in tmp_path.iterdir()] == [("a.csv", "old")]


def test_links_modes_and_endings_stay(tmp_path):
    file, link = tmp_path / "a.csv", tmp_path / "b"
    file.write_text("old")
    file.chmod(0o640)
    link.symlink_to(file)
    with written_whole(link) as new:
        assert new.suffix == ".csv" and new.parent == tmp_path
        new.write_text("new")
    assert link.is_symlink() and file.read_text() == "new"
    assert file.stat().st_mode & 0o7777 == 0o640


def test_what_is_no_file_is_never_replaced(tmp_path):
    pipe, circle = tmp_path / "pipe", tmp_path / "circle"
    os.mkfifo(pipe)
    circle.symlink_to(circle)
    with written_whole(pipe) as given:
        assert given == pipe.resolve()
    assert pipe.is_fifo()
    for bad, error in ((tmp_path, IsADirectoryError), (circle, OSError)):
        with pytest.raises(error) as found, written_whole(bad):
            pass
        assert found.value.filename == str(bad)
    with pytest.raises(FileNotFoundError) as found, written_whole(tmp_path / "no" / "a.csv"):
        pass
    assert found.value.filename == str(tmp_path / "no" / "a.csv")
    assert {each.name for each in tmp_path.iterdir()} == {"pipe", "circle"}


def test_a_pipe_is_no_library(tmp_path):
    os.mkfifo(tmp_path / "pipe")
    with pytest.raises(LibraryError, match="no file"):
        PrimitiveLibrary.load(tmp_path / "pipe")
