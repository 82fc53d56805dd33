"""The command line of a store: learning that is stopped and goes on, and looking after it."""

import json
import os
import signal
import sqlite3
import tempfile
import warnings
from contextlib import closing
from pathlib import Path

import numpy as np
import pytest
from rich.console import Console
from streams import CHANNELS, RATE_HZ, learner, stream

import mplearn.store.store
import mplearn_agents.learning.watched
from mplearn import PrimitiveLibrary, Recording
from mplearn.errors import StoreWarning, StoreWriteError
from mplearn.store import LifelongLearner, Store, StoreReader, backup
from mplearn.store.database import open_reading
from mplearn.store.life_state import LifeState
from mplearn_agents.cli import main
from mplearn_agents.learning.watched import learn
from mplearn_agents.terminal.plain_warnings import plain_warnings

TAKES = [Recording(stream(24, k), RATE_HZ, CHANNELS, name=f"take {k}") for k in range(3)]


@pytest.fixture
def store(tmp_path: Path) -> Path:
    path = tmp_path / "life.db"
    with LifelongLearner.open(path, learner) as life:
        for take in TAKES:
            for _ in life.learn_recording(take):
                pass
    return path


def refused(capsys: pytest.CaptureFixture[str], *argv: object) -> str:
    assert main([str(each) for each in argv]) == 2
    return capsys.readouterr().err


@pytest.mark.parametrize("number", [signal.SIGTERM, signal.SIGINT])
def test_learning_that_is_stopped_goes_on(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, number: signal.Signals
) -> None:
    whole = learner()
    for take in TAKES:
        for _ in whole.learn_recording(take, 50):
            pass
    console = Console(quiet=True)
    shown = mplearn_agents.learning.watched._show
    left = [0]

    def show(*args: object) -> None:
        left[0] -= 1
        if left[0] == 0:
            os.kill(os.getpid(), number)
        shown(*args)  # type: ignore[arg-type]

    monkeypatch.setattr(mplearn_agents.learning.watched, "_show", show)
    for stop, done in ((5, False), (30, False), (10**9, True)):
        left[0] = stop
        with LifelongLearner.open(tmp_path / "life.db", learner) as life:
            log = learn(life, TAKES, console, taken=life.taken)
            assert log.stopped == (not done)
    with LifelongLearner.open(tmp_path / "life.db") as life:
        assert life.learner.state() == whole.state()
        log = learn(life, TAKES, console, taken=life.taken)
        assert (log.already, len(log.segments), log.refused) == (3, 0, {})


@pytest.mark.parametrize(("stop", "code"), [(12, 130), (10**9, 0)])
def test_who_interrupts_learning_is_told_so_and_keeps_what_was_learned(
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
    stop: int,
    code: int,
) -> None:
    frames = TAKES[0].frames
    rows = np.column_stack((np.arange(len(frames)) / RATE_HZ, frames))
    data, out = tmp_path / "take.csv", tmp_path / "out.mplearn"
    np.savetxt(data, rows, delimiter=",", header="time,a,b,c,d", comments="")
    shown, left = mplearn_agents.learning.watched._show, [stop]

    def show(*args: object) -> None:
        left[0] -= 1
        if left[0] == 0:
            os.kill(os.getpid(), signal.SIGINT)
        shown(*args)  # type: ignore[arg-type]

    monkeypatch.setattr(mplearn_agents.learning.watched, "_show", show)
    argv = ["learn", str(data), "--observe", "channels", "--out", str(out)]
    assert main(argv) == code
    assert ("Stopped: what was learned" in capsys.readouterr().out) == bool(code)
    PrimitiveLibrary.load(out)


def test_commands(store: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    before = PrimitiveLibrary.load(store)
    one, two = before.ids[:2]
    for argv in (
        ["rename", store, one, "bow [/red] \\low"],
        ["store", "merge", store, "bow [/red] \\low", two, "--by", "Anna"],
        ["store", "note", store, "slow", "--primitive", one],
        ["store", "undo", store, 2, "--by", "Ben"],
        ["store", "redo", store],
        ["store", "undo", store, 2],
        ["store", "freeze", store, two],
        ["store", "unfreeze", store, two],
        ["store", "split", store, one],
        ["store", "delete", store, before.ids[2]],
        ["store", "undo", store],
        ["store", "undo", store, 9],
    ):
        assert main([str(each) for each in argv]) == 0, argv
    capsys.readouterr()
    after = StoreReader(store).life.snapshot()
    assert after.rename(one, f"P{one}").version == before.version
    assert main(["store", "log", str(store), "--json"]) == 0
    log = json.loads(capsys.readouterr().out)
    assert [each["kind"] for each in log][:4] == ["rename", "merge", "note", "undo"]
    assert log[1]["by"] == "Anna" and log[1]["undone"]
    for action in ("info", "log"):
        assert main(["store", action, str(store)]) == 0
    assert main(["store", "history", str(store), str(two)]) == 0
    said = capsys.readouterr().out
    assert "born from" in said and "merge" in said and "by Anna" in said
    assert main(["store", "info", str(store), "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["primitives"] == len(before)
    assert main(["store", "backup", str(store), str(tmp_path / "copy.db")]) == 0
    assert main(["store", "check", str(tmp_path / "copy.db")]) == 0
    assert main(["show", str(store)]) == 0
    assert "bow [/red]" in capsys.readouterr().out


def test_what_cannot_be_is_said_in_a_line(
    store: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert "there is no store" in refused(capsys, "store", "info", tmp_path / "none.db")
    assert "no primitive" in refused(capsys, "store", "delete", store, "nobody")
    assert "no command that can be undone" in refused(capsys, "store", "undo", store)
    assert "exists already" in refused(capsys, "store", "backup", store, store)
    (tmp_path / "b.db").write_bytes(store.read_bytes()[:5000])
    (tmp_path / "c.db").write_bytes(b"no database")
    assert "no store" in refused(capsys, "store", "check", tmp_path / "c.db")
    assert main(["store", "check", str(tmp_path / "b.db")]) == 1
    assert "b.db is damaged" in capsys.readouterr().out
    with closing(sqlite3.connect(store)) as connection:  # no page of it is free
        connection.execute("VACUUM INTO ?", [str(tmp_path / "d.db")])
    whole = (tmp_path / "d.db").read_bytes()
    middle = len(whole) // 2
    (tmp_path / "d.db").write_bytes(whole[:middle] + bytes(2000) + whole[middle + 2000 :])
    assert main(["store", "check", str(tmp_path / "d.db")]) == 1
    told = capsys.readouterr().out
    assert "d.db is damaged" in told and "\\n" not in told and told.count("\n") == 1
    assert main(["store", "check", str(tmp_path / "b.db"), "--salvage"]) == 1  # nothing is left
    assert "b.db is damaged" in capsys.readouterr().out
    assert "--out, or a store" in refused(capsys, "learn", tmp_path)


def fill_disk(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Let stores of this test take little more than what they begin with."""
    opened = mplearn.store.store.open_writing

    def full(path: Path) -> sqlite3.Connection:
        connection = opened(path)
        pages = connection.execute("PRAGMA page_count").fetchone()[0]
        connection.execute(f"PRAGMA max_page_count = {pages + 8}")
        return connection

    monkeypatch.setattr(mplearn.store.store, "open_writing", full)
    monkeypatch.setenv("TMPDIR", str(tmp_path))
    monkeypatch.setattr(tempfile, "tempdir", None)


def learning(tmp_path: Path, how: str) -> list[str]:
    """Return the command that learns a take from a file, or as it comes."""
    data = tmp_path / "take.csv"
    rows = np.column_stack((np.arange(len(TAKES[0].frames)) / RATE_HZ, TAKES[0].frames))
    np.savetxt(data, rows, delimiter=",", header="time,a,b,c,d", comments="")
    take = ["--live", f"recording:{data}", "--speed", "inf"] if how == "live" else [str(data)]
    return ["learn", *take, "--observe", "channels"]


@pytest.mark.parametrize("how", ["file", "live"])
@pytest.mark.parametrize("store", ["full", "", "sound"])
def test_where_the_library_cannot_be_written_what_was_learned_is_kept(
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
    how: str,
    store: str,
) -> None:
    if store != "sound":
        fill_disk(tmp_path, monkeypatch)
    (tmp_path / "file").touch()
    out, life = tmp_path / "file" / "out.mplearn", tmp_path / "life.db"
    argv = [*learning(tmp_path, how), "--out", str(out)]
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", StoreWarning)
        assert main(argv + ["--store", str(life)] * bool(store)) == 3
    told = capsys.readouterr()
    rescued = [*tmp_path.glob("mplearn-*/*")]
    (kept,) = [life] if store == "sound" else rescued
    assert rescued == [] or store != "sound"
    assert f"cannot write {out}: " in told.err
    assert f"the library is in {kept}" in told.err
    assert ("the same command goes on" in told.err) == (bool(store) and how == "file")
    assert ("written to" in told.out.split("segments")[-1]) == (store == "sound")
    assert len(PrimitiveLibrary.load(kept)) > 0


@pytest.mark.parametrize("how", ["file", "live"])
@pytest.mark.parametrize("with_out", [True, False])
def test_where_the_disk_stays_full_the_library_is_kept_elsewhere(
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
    how: str,
    with_out: bool,
) -> None:
    fill_disk(tmp_path, monkeypatch)
    out = tmp_path / "out.mplearn"
    argv = [*learning(tmp_path, how), "--store", str(tmp_path / "life.db")]
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", StoreWarning)  # it says that learning goes on
        assert main(argv + ["--out", str(out)] * with_out) == 3
    told = capsys.readouterr()
    (kept,) = [out] if with_out else tmp_path.glob("mplearn-*/life.mplearn")
    assert f"the library is in {kept}" in told.err
    assert "full" in told.err
    assert ("written to" in told.out.split("segments")[-1]) == with_out
    assert f"and {tmp_path / 'life.db'}" not in " ".join(told.out.split("segments")[-1].split())
    whole = learner()
    for _ in whole.learn_recording(TAKES[0]):
        pass
    assert len(PrimitiveLibrary.load(kept)) == len(whole.tree.leaves) > 0
    assert StoreReader(tmp_path / "life.db").life.n_frames < whole.n_frames  # what fitted is sound


@pytest.mark.parametrize("disk", ["full", "sound"])
def test_where_a_take_is_an_error_what_was_learned_before_is_kept(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], disk: str
) -> None:
    if disk == "full":
        fill_disk(tmp_path, monkeypatch)
    takes, life = tmp_path / "takes", tmp_path / "life.db"
    takes.mkdir()
    command = learning(tmp_path, "file")
    (tmp_path / "take.csv").rename(takes / "a.csv")
    rows = (takes / "a.csv").read_text().splitlines()
    (takes / "b.csv").write_text("\n".join([rows[0], *(f"{k / RATE_HZ},,,," for k in range(400))]))
    argv = [command[0], str(takes), *command[2:], "--strict", "--store", str(life)]
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", StoreWarning)
        assert main(argv) == (3 if disk == "full" else 2)
    told = capsys.readouterr().err
    assert "mplearn: b: " in told
    rescued = [*tmp_path.glob("mplearn-*/life.mplearn")]
    assert [f"the library is in {path}" in told for path in rescued] == [True] * (disk == "full")
    (kept,) = rescued or [life]
    assert len(PrimitiveLibrary.load(kept)) > 0


def test_what_could_not_be_written_is_not_said_to_be_done(
    store: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    whole = Store.close

    def close(self: Store, state: LifeState | None = None) -> None:
        whole(self, state)
        raise StoreWriteError("the disk is full")

    monkeypatch.setattr(Store, "close", close)
    for command in (["note", store, "x"], ["undo", store]):
        assert main(["store", *map(str, command)]) == 2
        told = capsys.readouterr()
        assert told.out == "" and told.err == "mplearn: the disk is full\n"


def test_a_backup_that_fails_leaves_nothing(store: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    copy = store.with_name("copy.db")

    class Full:
        def __init__(self, connection: sqlite3.Connection) -> None:
            self.close, self._execute = connection.close, connection.execute

        def execute(self, words: str, *values: object) -> object:
            if not words.startswith("VACUUM"):
                return self._execute(words, *values)
            copy.with_name("copy.db-journal").write_bytes(b"half")
            raise sqlite3.OperationalError("database or disk is full")

    monkeypatch.setattr("mplearn.store.store.open_reading", lambda path: Full(open_reading(path)))
    with pytest.raises(StoreWriteError):
        backup(store, copy)
    assert [path.name for path in store.parent.glob("copy.db*")] == []


def test_warnings_are_a_line() -> None:
    with plain_warnings():
        said = warnings.formatwarning(StoreWarning("a store\nis full"), StoreWarning, "x.py", 3)
        other = warnings.formatwarning("of somebody else", UserWarning, "x.py", 3)
    assert said == "mplearn: warning: a store is full\n"
    assert "x.py:3" in other
