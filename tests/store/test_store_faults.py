"""What can befall a store: each fault is named, and nothing that was written is lost."""

import os
import shutil
import sqlite3
import subprocess
import sys
import tempfile
import time
import warnings
from pathlib import Path

import numpy as np
import pytest
from streams import learner, stream, times

from mplearn.errors import (
    MPLearnError,
    StoreDamagedError,
    StoreError,
    StoreWarning,
    StoreWriteError,
)
from mplearn.store import LifelongLearner, Note, Rename, Store, StoreReader, check
from mplearn.store.life_state import LifeState
from mplearn.store.schema import READABLE, VERSION, migrate, version_of

FRAMES = stream(60)
OLD = Path(__file__).with_name("life-1.db")  # made by the first version of the tables


def feed(life: LifelongLearner, upto: int) -> None:
    part = FRAMES[life.n_frames : upto]
    life.learn_many(part, times(part, life.n_frames))


def files(path: Path) -> dict[str, bytes]:
    """Return the bytes of a store, and of what lies beside it."""
    beside = {end: path.with_name(path.name + end) for end in ("", "-wal")}
    return {end: each.read_bytes() for end, each in beside.items() if each.exists()}


def put(path: Path, content: dict[str, bytes]) -> Path:
    for end in ("", "-wal", "-shm"):
        path.with_name(path.name + end).unlink(missing_ok=True)
    for end, data in content.items():
        path.with_name(path.name + end).write_bytes(data)
    return path


def state_of(path: Path, **options: bool) -> LifeState:
    with LifelongLearner.open(path, **options) as life:
        return life.state()


@pytest.fixture(scope="module")
def left(tmp_path_factory: pytest.TempPathFactory) -> tuple[dict[str, bytes], LifeState]:
    """A store as a crash leaves it, with two checkpoints and a log, and what it must hold."""
    path = tmp_path_factory.mktemp("left") / "life.db"
    with LifelongLearner.open(path, learner, checkpoint_s=9) as life:
        for upto in (450, 900, 1200):
            feed(life, upto)
            assert isinstance(life.store, Store) and life.store.flush()
        life.execute(Rename(life.snapshot().ids[0], "bow"), when=1.0)
        feed(life, 1300)
        life.store.flush()
        connection = sqlite3.connect(path)  # what is in the write-ahead log goes into the file
        connection.execute("PRAGMA wal_checkpoint(TRUNCATE)")
        connection.close()
        return files(path), life.state()


@pytest.mark.skipif(
    not hasattr(os, "fork"), reason="processes are forked, which this system cannot"
)
def test_killed_at_any_moment_it_goes_on_to_the_bit() -> None:
    command = [sys.executable, "-m", "benchmarks.killing", "15"]
    done = subprocess.run(command, capture_output=True, text=True, timeout=600, check=False)
    assert done.returncode == 0, done.stdout + done.stderr
    assert "killed 15 times" in done.stdout


@pytest.mark.parametrize("seed", range(2))
def test_flipped_bits_are_named_or_do_no_harm(
    left: tuple[dict[str, bytes], LifeState], tmp_path: Path, seed: int
) -> None:
    content, expected = left
    rng = np.random.default_rng(seed)
    named = fallen_back = 0
    for k in range(12):
        data = bytearray(content[""])
        for at in rng.integers(len(data), size=1 + k % 3):
            data[at] ^= 1 << int(rng.integers(8))
        path = put(tmp_path / "life.db", {"": bytes(data)})
        try:
            with warnings.catch_warnings(record=True) as said:
                warnings.simplefilter("always")
                found = state_of(path)
        except StoreError as error:
            named += 1
            assert str(path) in str(error) or "record" in str(error) or "holds" in str(error)
        else:
            fallen_back += bool(said)
            assert found == expected
    assert named + fallen_back > 0


def test_a_damaged_checkpoint_costs_nothing(
    left: tuple[dict[str, bytes], LifeState], tmp_path: Path
) -> None:
    path = put(tmp_path / "life.db", left[0])
    connection = sqlite3.connect(path)
    newest, older = (s for (s,) in connection.execute("SELECT seq FROM checkpoint ORDER BY -seq"))
    assert newest > older
    connection.execute(
        "UPDATE checkpoint SET document = zeroblob(length(document)) WHERE seq = ?", (newest,)
    )
    connection.commit()
    connection.close()
    assert any("checkpoint" in each for each in check(path))
    with pytest.warns(StoreWarning, match=f"checkpoint {newest} is damaged"):
        assert state_of(path) == left[1]
    assert check(path) == ()  # a new one was written
    assert state_of(path) == left[1]


def test_a_damaged_record_is_named_and_what_came_before_can_be_had(
    left: tuple[dict[str, bytes], LifeState], tmp_path: Path
) -> None:
    for change, message in (
        ("UPDATE log SET data = zeroblob(length(data)) WHERE seq = ?", "another digest"),
        ("DELETE FROM log WHERE seq = ?", "is missing"),
    ):
        path = put(tmp_path / "life.db", left[0])
        connection = sqlite3.connect(path)
        last = connection.execute("SELECT max(seq) FROM log").fetchone()[0]
        connection.execute(change, (last - 2,))
        connection.commit()
        connection.close()
        for ask in (LifelongLearner.open, StoreReader):
            with pytest.raises(StoreDamagedError, match=f"record {last - 2} .*{message}"):
                ask(path)
        with (
            pytest.warns(StoreWarning, match="record"),
            LifelongLearner.open(path, salvage=True) as life,
        ):
            assert 0 < life.n_frames < left[1].learner.n_frames
            feed(life, 1500)
        with LifelongLearner.open(path) as life:
            assert life.n_frames == 1500


def test_truncated_files_are_named(
    left: tuple[dict[str, bytes], LifeState], tmp_path: Path
) -> None:
    content, expected = left
    whole = content[""]
    for share in (0.001, 0.01, 0.3, 0.7, 0.99, 0.9999):
        path = put(tmp_path / "life.db", {"": whole[: int(share * len(whole))]})
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", StoreWarning)
            try:
                found = state_of(path)
            except StoreError as error:
                assert "damaged" in str(error) or "no store" in str(error)
            else:  # what is missing was free, or an older checkpoint and the log did
                assert found == expected
    path = put(tmp_path / "life.db", {"": b""})
    with LifelongLearner.open(path, learner) as life:  # nothing was ever written there
        assert life.n_frames == 0
    assert expected.learner.n_frames == 1300


def test_power_that_fails_leaves_what_was_synced(tmp_path: Path) -> None:
    """Between two syncs sectors are written in any order, or not, or half."""
    path = tmp_path / "life.db"
    rng = np.random.default_rng(2)
    with LifelongLearner.open(path, learner, checkpoint_s=6) as life:
        assert isinstance(life.store, Store)
        feed(life, 500)
        life.store.flush()
        synced, known = files(path), life.state()
        for upto in (550, 600, 700, 950, 1000, 1050):
            known_by_commit = [known]  # a second of frames each: how many go together is luck
            for second in range(life.n_frames + 50, upto + 50, 50):
                feed(life, second)
                known_by_commit.append(life.state())
            life.store.flush()
            now = files(path)
            for _ in range(3):
                mixed = {
                    end: torn(synced.get(end, b""), now.get(end, b""), rng) for end in ("", "-wal")
                }
                found = state_of(put(tmp_path / "torn.db", mixed))
                assert found in known_by_commit
            synced, known = now, known_by_commit[-1]


def torn(old: bytes, new: bytes, rng: np.random.Generator) -> bytes:
    """Return bytes of which some sectors are old, and some new; beyond the end there is nothing."""
    size = 512
    length = max(len(old), len(new))
    old, new = old.ljust(length, b"\0"), new.ljust(length, b"\0")
    share = rng.random()
    return b"".join(
        (new if rng.random() < share else old)[at : at + size] for at in range(0, length, size)
    )


def test_on_a_full_disk_learning_goes_on_and_catches_up(tmp_path: Path) -> None:
    path = tmp_path / "life.db"
    whole = LifelongLearner(learner())
    life = LifelongLearner.open(path, learner, checkpoint_s=5)
    assert isinstance(life.store, Store)
    feed(life, 400)
    life.store.flush()
    pages = life.store._connection.execute("PRAGMA page_count").fetchone()[0]
    life.store._connection.execute(f"PRAGMA max_page_count = {pages}")
    with pytest.warns(StoreWarning, match="full; learning goes on in memory"):
        for upto in range(410, 1600, 10):
            feed(life, upto)
            time.sleep(0.002)
    assert isinstance(life.store.problem, StoreWriteError)
    life.execute(Note("nobody waits for this one"), when=1.0)
    assert life.store._running().n_pending < 1200 / 50 + 2  # a checkpoint stands for what is older
    behind = StoreReader(path).life
    assert 400 - 50 <= behind.n_frames < life.n_frames  # others read what is there
    life.store._connection.execute("PRAGMA max_page_count = 1000000")
    deadline = time.monotonic() + 60
    while life.store.problem is not None and time.monotonic() < deadline:
        time.sleep(0.05)
    feed(life, 1700)
    assert life.store.flush()
    life.close()
    for upto in (1590, 1700):
        feed(whole, upto)
        whole.execute(Note("nobody waits for this one"), when=1.0) if upto < 1700 else None
    with LifelongLearner.open(path) as again:
        assert again.learner.state() == whole.learner.state()
        assert [entry.command for entry in again.entries()] == [
            entry.command for entry in whole.entries()
        ]


LIMITED = """
import resource, sys, warnings
sys.path.insert(0, sys.argv[2])
from streams import learner, stream, times
from mplearn.errors import StoreWriteError
from mplearn.store import LifelongLearner
frames = stream(60)
life = LifelongLearner.open(sys.argv[1], learner, checkpoint_s=5)
life.learn_many(frames[:500]); life.store.flush()
hard = resource.getrlimit(resource.RLIMIT_FSIZE)[1]
resource.setrlimit(resource.RLIMIT_FSIZE, (400_000, hard))
warnings.simplefilter("ignore")
for at in range(500, 2500, 50):
    life.learn_many(frames[at : at + 50]); life.store.flush(0.05)
print("problem", type(life.store.problem).__name__, flush=True)
if sys.argv[3] == "catch up":
    resource.setrlimit(resource.RLIMIT_FSIZE, (hard, hard))
try:
    life.close()
    print("closed", life.n_frames)
except StoreWriteError as error:
    print("refused", error)
"""


@pytest.mark.parametrize("how", ["catch up", "stay full"])
def test_a_file_that_may_not_grow(tmp_path: Path, how: str) -> None:
    path = tmp_path / "life.db"
    command = [sys.executable, "-c", LIMITED, str(path), str(Path(__file__).parent), how]
    done = subprocess.run(command, capture_output=True, text=True, timeout=300, check=False)
    assert "problem StoreWriteError" in done.stdout, done.stdout + done.stderr
    n = StoreReader(path).life.n_frames
    if how == "catch up":
        assert "closed 2500" in done.stdout
        assert n == 2500
    else:
        assert "refused not all that was learned is in the store" in done.stdout
        assert 500 <= n < 2500
    whole = learner()
    whole.learn_many(FRAMES[:n])
    assert state_of(path).learner == whole.state()


READ_ONLY = """
import os, sys
from mplearn.store import LifelongLearner, StoreReader
StoreReader(sys.argv[2])  # all that is needed is loaded before rights are given up
if os.getuid() == 0:
    os.setuid(65534)
for ask in (LifelongLearner.open, StoreReader):
    try:
        print("read", ask(sys.argv[1]).life.n_frames)
    except Exception as error:
        print(type(error).__name__, error)
"""


@pytest.mark.skipif(sys.platform == "win32", reason="rights are others there")
def test_a_store_that_may_only_be_read(
    left: tuple[dict[str, bytes], LifeState], tmp_path_factory: pytest.TempPathFactory
) -> None:
    folder = Path(tempfile.gettempdir()) / f"read-only-{os.getpid()}"
    folder.mkdir(mode=0o755)
    try:
        path = put(folder / "life.db", left[0])
        other = put(tmp_path_factory.mktemp("other") / "life.db", left[0])
        path.chmod(0o444)
        folder.chmod(0o555)
        command = [sys.executable, "-c", READ_ONLY, str(path), str(other)]
        done = subprocess.run(command, capture_output=True, text=True, timeout=300, check=False)
        assert "StoreWriteError" in done.stdout, done.stdout + done.stderr
        assert "cannot be written" in done.stdout
        assert "read 1300" in done.stdout
    finally:
        folder.chmod(0o755)
        shutil.rmtree(folder)


def test_a_file_that_needs_no_change_to_be_read_is_read_as_it_is(tmp_path: Path) -> None:
    path = Path(shutil.copy(OLD, tmp_path / "life.db"))
    connection = sqlite3.connect(path, isolation_level=None)
    assert (migrate(connection, READABLE), version_of(connection)) == (1, READABLE)
    connection.close()
    before = path.read_bytes()
    known = StoreReader(path).life.n_frames
    assert known > 0 and path.read_bytes() == before
    with LifelongLearner.open(path) as life:
        assert life.n_frames == known
    connection = sqlite3.connect(path)
    assert version_of(connection) == VERSION > READABLE
    connection.close()


def test_an_old_file_is_brought_up_to_date(tmp_path: Path) -> None:
    path = Path(shutil.copy(OLD, tmp_path / "life.db"))
    connection = sqlite3.connect(path)
    assert connection.execute("PRAGMA user_version").fetchone() == (1,)
    rows = connection.execute("SELECT seq, kind, at, data FROM log").fetchall()
    connection.close()
    with pytest.raises(StoreError, match=rf"is of version 1, this is {VERSION}"):
        StoreReader(path)
    with LifelongLearner.open(path) as life:
        assert life.n_frames == 1000
        assert [entry.command for entry in life.entries()] == [Note("an old file")]
        whole = learner()
        whole.learn_many(FRAMES[:1000])
        assert life.learner.tree.leaves == whole.tree.leaves
        feed(life, 1500)
    assert check(path) == ()
    assert len(rows) > 5
    with LifelongLearner.open(path) as life:
        assert life.n_frames == 1500


def test_a_migration_is_whole_or_not_at_all(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = Path(shutil.copy(OLD, tmp_path / "life.db"))

    def failing(connection: sqlite3.Connection) -> None:
        connection.execute("ALTER TABLE log ADD COLUMN half BLOB")
        raise sqlite3.OperationalError("database or disk is full")

    first = __import__("mplearn.store.schema", fromlist=["schema"]).MIGRATIONS[0]
    monkeypatch.setattr("mplearn.store.schema.MIGRATIONS", (first, failing))
    with pytest.raises(StoreWriteError, match="full"):
        LifelongLearner.open(path)
    monkeypatch.undo()
    with LifelongLearner.open(path) as life:
        assert life.n_frames == 1000


def test_every_fault_is_an_error_of_ours() -> None:
    assert issubclass(StoreError, MPLearnError)


def test_what_a_link_leads_to_is_written_and_links_in_a_circle_are_named(tmp_path: Path) -> None:
    real, link, circle = (tmp_path / name for name in ("real.db", "link.db", "circle.db"))
    link.symlink_to(real)
    circle.symlink_to(circle)
    with LifelongLearner.open(link, learner) as life:
        feed(life, 100)
    assert link.is_symlink() and real.exists()
    assert state_of(real) == state_of(link)
    with pytest.raises(StoreError, match=r"circle\.db cannot be written"):
        LifelongLearner.open(circle, learner)
