"""The file that keeps a life of learning, and what others see of it meanwhile."""

import shutil
import sqlite3
import threading
import time
from contextlib import closing
from pathlib import Path

import numpy as np
import pytest
from streams import CHANNELS, RATE_HZ, learner, stream, times

from mplearn import LearnerConfig, MotionLearner, PrimitiveLibrary, Recording
from mplearn.errors import InvalidValueError, NotAStoreError, StoreError, StoreInUseError
from mplearn.store import (
    Delete,
    LifelongLearner,
    Merge,
    Rename,
    StoreReader,
    backup,
    check,
    info,
    library_of,
)
from mplearn_envs.data.library_source import LibrarySource

FRAMES = stream(90)


def feed(life: LifelongLearner, upto: int, at_once: int = 37) -> None:
    """Show it the stream from where it is."""
    for at in range(life.n_frames, upto, at_once):
        part = FRAMES[at : min(at + at_once, upto)]
        life.learn_many(part, times(part, at))


def crashed(path: Path, to: Path) -> Path:
    """Return the store as it would be found if the process was killed now."""
    for end in ("", "-wal"):
        if (beside := path.with_name(path.name + end)).exists():
            shutil.copy(beside, to.with_name(to.name + end))
    return to


@pytest.fixture(scope="module")
def kept(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A store that was closed, to be copied."""
    path = tmp_path_factory.mktemp("kept") / "life.db"
    with LifelongLearner.open(path, learner, checkpoint_s=10) as life:
        feed(life, 3000)
        life.execute(Rename(life.snapshot().ids[0], "bow"), by="Anna")
        feed(life, 3400)
    return path


def test_it_goes_on_after_a_crash_as_if_nothing_had_happened(tmp_path: Path) -> None:
    path = tmp_path / "life.db"
    whole = LifelongLearner(learner())
    rng = np.random.default_rng(0)
    stops = sorted(rng.integers(100, len(FRAMES), 6).tolist())
    life = LifelongLearner.open(path, learner, checkpoint_s=4)
    for k, stop in enumerate(stops):
        feed(life, stop, int(rng.integers(1, 90)))
        assert life.store is not None and life.store.flush()
        again = crashed(path, tmp_path / f"crash {k}.db")
        life.close()
        path, life = again, LifelongLearner.open(again, checkpoint_s=4)
        assert stop - RATE_HZ < life.n_frames <= stop
        feed(whole, life.n_frames)
        assert life.state() == whole.state()
    for each in (life, whole):
        each.execute(Merge(*each.snapshot().ids[:2]), when=1.0)
        each.execute(Delete(each.snapshot().ids[-1]), when=2.0)
    again = crashed(path, tmp_path / "last.db")  # what execute returned from is written
    life.close()
    with LifelongLearner.open(again) as life:
        assert life.state() == whole.state()
        for each in (life, whole):
            each.undo()
        assert life.snapshot().version == whole.snapshot().version
    assert [entry.command.kind for entry in StoreReader(again).life.entries()] == [
        "merge",
        "delete",
        "undo",
    ]


def test_it_closes_in_the_middle_of_a_motion(tmp_path: Path) -> None:
    whole = LifelongLearner(learner())
    feed(whole, 2000)
    for upto in (333, 1111, 1112, 2000):
        with LifelongLearner.open(tmp_path / "life.db", learner) as life:
            feed(life, upto)
            assert life.n_frames == upto
    with LifelongLearner.open(tmp_path / "life.db") as life:
        assert life.learner.state() == whole.learner.state()
    assert sorted(each.name for each in tmp_path.iterdir()) == ["life.db"]


def test_recordings_are_learned_once_and_go_on_where_they_were_left(tmp_path: Path) -> None:
    takes = [Recording(stream(30, k), RATE_HZ, CHANNELS, name=f"take {k}") for k in range(3)]
    whole = MotionLearner(LearnerConfig(CHANNELS, RATE_HZ))
    for take in takes:
        for _ in whole.learn_recording(take, 50):
            pass
    for stop in (3, 17, 40, 1000):
        with LifelongLearner.open(tmp_path / "life.db", learner) as life:
            n = 0
            for take in takes:
                for _ in life.learn_recording(take, 50):
                    n += 1
                    if n == stop:
                        break
                if n == stop:
                    break
    with LifelongLearner.open(tmp_path / "life.db") as life:
        assert [life.taken(take) for take in takes] == [len(take.frames) for take in takes]
        assert list(life.learn_recording(takes[1])) == []
        assert life.learner.state() == whole.state()


def test_others_read_it_while_it_grows(tmp_path: Path) -> None:
    path = tmp_path / "life.db"
    with LifelongLearner.open(path, learner, checkpoint_s=8) as life:
        store = life.store
        assert store is not None
        reader = StoreReader(path)
        assert not reader.refresh()
        for upto in (500, 1000, 2500, 2560, 4000):
            feed(life, upto)
            life.execute(Rename(life.snapshot().ids[0], f"first {upto}")) if upto > 1000 else None
            assert store.flush()
            assert reader.refresh()
            assert reader.life.n_frames > upto - RATE_HZ
            assert library_of(path).version == reader.life.snapshot().version
            if upto > 1000:
                assert reader.life.state() == life.state()
        assert info(path).records < 30 * 2
        assert PrimitiveLibrary.load(path).version == life.snapshot().version
        assert not reader.refresh()
        copy = backup(path, tmp_path / "copy.db")
        with pytest.raises(InvalidValueError, match="exists already"):
            backup(path, copy)
        with pytest.raises(NotAStoreError, match="there is no store"):
            backup(tmp_path / "none.db", tmp_path / "other.db")
        feed(life, 4500)
    assert reader.refresh()
    assert reader.life.n_frames == 4500
    assert check(copy) == check(path) == ()
    with LifelongLearner.open(copy) as life:  # a backup is a store
        feed(life, 4500)
        assert life.learner.state() == reader.life.learner.state()


def test_an_environment_reads_it_at_each_reset(tmp_path: Path) -> None:
    path = tmp_path / "life.db"
    with LifelongLearner.open(path, learner) as life:
        assert life.store is not None
        source = LibrarySource(str(path))
        assert source.live
        for upto in (1000, 2000):
            feed(life, upto)
            assert life.store.flush()
            assert source.now().version == StoreReader(path).life.snapshot().version


def test_reading_and_writing_do_not_hold_each_other_up(tmp_path: Path) -> None:
    path = tmp_path / "life.db"
    with LifelongLearner.open(path, learner, checkpoint_s=2) as life:
        feed(life, 200)
        ended, read, problems = threading.Event(), [0], []

        def look() -> None:
            reader = StoreReader(path)
            while not ended.is_set():
                try:
                    reader.refresh()
                except StoreError as error:
                    problems.append(error)
                    return
                read[0] += 1

        thread = threading.Thread(target=look)
        thread.start()
        still = np.zeros((37, len(CHANNELS)))
        for turn in range(5000):  # with the gaps of a live stream, until a slow machine read
            if turn < 65:
                feed(life, 200 + 37 * turn)
            elif read[0] > 3 or not thread.is_alive():
                break
            else:
                life.learn_many(still)
            time.sleep(0.005)
        ended.set()
        thread.join()
        assert not problems
        assert read[0] > 3
        assert life.store is not None and life.store.problem is None


def test_file_and_log_do_not_grow_once_nothing_new_comes(tmp_path: Path) -> None:
    path = tmp_path / "life.db"
    still = np.zeros((1500, len(CHANNELS)))
    with LifelongLearner.open(path, learner, checkpoint_s=5) as life:
        feed(life, 2500)
        sizes = []
        for _ in range(5):
            for part in np.array_split(still, 6):  # no checkpoint is passed over on a slow machine
                life.learn_many(part)
                assert life.store is not None and life.store.flush()
            with closing(sqlite3.connect(path)) as file:  # all that was written is in the file
                file.execute("PRAGMA wal_checkpoint(TRUNCATE)").fetchall()
            sizes.append((path.stat().st_size, info(path).records, info(path).parts))
    assert max(records for _, records, _ in sizes) <= 60
    assert sizes[-1][0] <= sizes[0][0]
    assert sizes[-1][2] <= sizes[0][2]


def test_one_writes_at_a_time(tmp_path: Path) -> None:
    path = tmp_path / "life.db"
    with LifelongLearner.open(path, learner):
        with pytest.raises(StoreInUseError, match=r"is being written to by process \d+ on"):
            LifelongLearner.open(path)
        assert StoreReader(path).life.n_frames == 0
    with LifelongLearner.open(path):
        pass


def test_what_is_no_store_is_named(tmp_path: Path, kept: Path) -> None:
    other = tmp_path / "other.db"
    connection = sqlite3.connect(other)
    connection.execute("CREATE TABLE t (x)")
    connection.close()
    (tmp_path / "text.db").write_text("hello, this is no store at all")
    newer = Path(shutil.copy(kept, tmp_path / "newer.db"))
    connection = sqlite3.connect(newer)
    connection.execute("PRAGMA user_version = 99")
    connection.close()
    cases = {
        other: "a database of another program",
        tmp_path / "text.db": "is no store",
        tmp_path: "is a folder",
        tmp_path / "none" / "life.db": "there is no folder",
        newer: "written by a newer mplearn: version 99",
    }
    for path, message in cases.items():
        before = path.read_bytes() if path.is_file() else b""
        for ask in (lambda p: LifelongLearner.open(p, learner), StoreReader, check, info):
            with pytest.raises(StoreError, match=message):
                ask(path) if path.exists() else LifelongLearner.open(path, learner)
        assert (path.read_bytes() if path.is_file() else b"") == before
    for ask in (LifelongLearner.open, StoreReader, check, info):
        with pytest.raises(NotAStoreError, match="there is no store"):
            ask(tmp_path / "missing.db")
    assert not (tmp_path / "missing.db").exists()


def test_a_clock_that_jumps_changes_nothing_but_dates(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    clock = iter(np.random.default_rng(0).choice([-1e9, 0.0, 1e5, 1e12], 100_000))
    monkeypatch.setattr("time.time", lambda: float(next(clock)))
    path = tmp_path / "life.db"
    with LifelongLearner.open(path, learner, checkpoint_s=3) as life:
        feed(life, 1500)
        for at in range(1500, 3000, 100):
            life.learn_many(FRAMES[at : at + 100])
    whole = learner()
    whole.learn_many(FRAMES[:3000])
    with LifelongLearner.open(path) as life:
        assert life.learner.state() == whole.state()
