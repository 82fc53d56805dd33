"""A corpus is the same whatever the workers, and whatever happens to them."""

import contextlib
import multiprocessing
import os
import random
import shutil
import signal
import tempfile
import threading
import time
from collections.abc import Callable
from concurrent.futures import Future, ThreadPoolExecutor
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import psutil
import pytest
from corpus_folder import write_take
from frail_workers import Frail
from hypothesis import given
from hypothesis import strategies as st
from little_room import little_room
from threadpoolctl import threadpool_info, threadpool_limits

from mplearn.corpus import (
    Corpus,
    Progress,
    Reading,
    Shard,
    deal,
    learn_corpus,
    recognise_corpus,
)
from mplearn.corpus.cluster import RayTasks, _pass_on
from mplearn.corpus.executors import Here
from mplearn.corpus.shard import ShardJournal, ShardTask, learn_shard
from mplearn.errors import (
    CorpusError,
    InvalidValueError,
    RecordingError,
    StoreError,
    StoreWriteError,
)
from mplearn.merging import merge_learners
from mplearn.mocap import Hints, TakeFiles, find_takes, readers, register_reader, registry
from mplearn.mocap.markers.csv_table import CSVReader
from mplearn.recording import Recording
from mplearn.store import Store, StoreReader


def n_threads() -> set[int]:
    """How many threads linear algebra has in this process."""
    pools = threadpool_info()
    return {pool["num_threads"] for pool in pools if pool["user_api"] == "blas"}


def test_what_learns_and_recognises_here_has_one_thread_of_linear_algebra(tmp_path: Path) -> None:
    for seed, name in enumerate(("one", "two")):
        write_take(tmp_path / "takes" / "anna" / f"{name}.csv", 20.0, seed)
    seen: list[set[int]] = []

    def show(*_: object) -> None:
        seen.append(n_threads())

    with threadpool_limits(2, user_api="blas"):
        corpus = learn_corpus(tmp_path / "takes", tmp_path / "learned", jobs=0, show=show)
        assert corpus.learner is not None and n_threads() == {2}
        path = corpus.learner.snapshot().save(tmp_path / "a.mplearn")
        n = len(seen)
        recognise_corpus(path, tmp_path / "takes", jobs=0, show=show)
        assert n_threads() == {2} and n > 0 and len(seen) > n
    assert seen == [{1}] * len(seen)


def saved(corpus: Corpus, folder: Path) -> bytes:
    assert corpus.learner is not None
    return corpus.learner.save(folder / "whole.mplearn").read_bytes()


class Shuffled:
    """Does all that was submitted so far in an order of its own, when the first is asked for."""

    def __init__(self, seed: int) -> None:
        self._random = random.Random(seed)
        self._todo: list[tuple[Future[Any], Callable[..., Any], tuple[Any, ...]]] = []
        self._lock = threading.Lock()
        self.order: list[str] = []

    def submit(self, work: Callable[..., Any], *args: Any) -> Future[Any]:
        future: Future[Any] = Future()
        with self._lock:
            self._todo.append((future, work, args))
            if len(self._todo) == 1:
                threading.Timer(0.05, self._do).start()
        return future

    def _do(self) -> None:
        with self._lock:
            todo, self._todo = self._todo, []
        self._random.shuffle(todo)
        for future, work, args in todo:
            self.order.append(str(args[0]))
            try:
                future.set_result(work(*args))
            except Exception as error:
                future.set_exception(error)

    def close(self) -> None:
        pass


@pytest.fixture(scope="module")
def alone(folder: Path, tmp_path_factory: pytest.TempPathFactory) -> bytes:
    """What one process after another learns."""
    into = tmp_path_factory.mktemp("alone")
    corpus = learn_corpus(folder, into / "shards", jobs=0)
    assert list(corpus.refused) == ["ben/broken"]
    assert "broken.csv" in corpus.refused["ben/broken"]
    assert [shard.person for shard in corpus.shards] == ["anna", "ben", "cleo", ""]
    assert corpus.progress.learned == 8
    assert corpus.progress.merged == 3
    return saved(corpus, into)


def test_the_order_in_which_shards_are_done_changes_no_byte(
    folder: Path, alone: bytes, tmp_path: Path
) -> None:
    orders = set()
    for seed in (1, 2):
        workers = Shuffled(seed)
        corpus = learn_corpus(folder, tmp_path / f"{seed}", executor=workers)
        assert saved(corpus, tmp_path) == alone
        orders.add(tuple(workers.order))
    assert len(orders) == 2


def test_shards_of_one_person_are_merged_first_and_in_any_order(
    folder: Path, tmp_path: Path
) -> None:
    libraries = set()
    for seed in (1, 2):
        workers = Shuffled(seed)
        corpus = learn_corpus(folder, tmp_path / f"{seed}", executor=workers, shard_takes=1)
        libraries.add(saved(corpus, tmp_path))
        assert corpus.progress.merged == len(corpus.shards) - 2  # that of a broken take is empty
        assert sum(what.startswith("(") for what in workers.order) == 4  # three, and nobody
        assert not (tmp_path / f"{seed}" / "merged").exists()
    assert len(libraries) == 1


class Elsewhere(Here):
    """Works in another folder, as the machines of a cluster do."""

    def __init__(self, folder: Path) -> None:
        self._folder = folder

    def submit(self, work: Callable[..., Any], *args: Any) -> Future[Any]:
        with contextlib.chdir(self._folder):
            return super().submit(work, *args)


def test_workers_may_be_elsewhere(
    folder: Path, alone: bytes, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(folder.parent)
    workers, into = Elsewhere(tmp_path), Path(os.path.relpath(tmp_path / "s"))
    corpus = learn_corpus(folder.name, into, executor=workers)
    assert saved(corpus, tmp_path) == alone
    library = Path(os.path.relpath(tmp_path / "a.mplearn"))
    corpus.learner.snapshot().save(library)
    assert recognise_corpus(library, folder.name, executor=workers).n_takes == 8


def test_what_ray_says_of_an_error_is_left_out() -> None:
    class RayTaskError(RecordingError):
        cause = RecordingError("no such file")

    plain = OSError("no room")
    for error, told in ((RayTaskError("a story"), RayTaskError.cause), (plain, plain)):
        done, to = Future[int](), Future[int]()
        done.set_exception(error)
        _pass_on(done, to)
        assert to.exception() is told


@pytest.mark.parametrize("address", ["", "head:6379"])
def test_the_cause_that_ray_gives_is_named(monkeypatch: pytest.MonkeyPatch, address: str) -> None:
    class RayError(Exception):
        """What errors of Ray are, but for those of Python."""

    class Ray:
        exceptions = SimpleNamespace(RayError=RayError)

        def __init__(self, error: Exception, cause: Exception | None) -> None:
            self.error, self.cause = error, cause

        def is_initialized(self) -> bool:
            return False

        def init(self, **_: object) -> None:
            raise self.error from self.cause

    token = RayError(
        'Last: Traceback (most recent call last):\n  File "x.py", line 1, in f\n    g(\n    ^^\n'
        "AuthenticationError: RAY_AUTH_MODE=token,\n  but no token was found"
    )
    for error, cause in ((token, None), (RuntimeError(""), token), (ConnectionError("x"), token)):
        ray = Ray(error, cause)
        monkeypatch.setattr("mplearn.corpus.cluster.require", lambda *_, ray=ray: ray)
        with pytest.raises(CorpusError, match="RAY_AUTH_MODE=token, but no token was found") as e:
            RayTasks(address)
        assert ("at 'head:6379'" if address else "does not start here") in str(e.value)
        assert "Traceback" not in str(e.value) and "x.py" not in str(e.value)


def _writer_of(into: Path) -> int:
    """Return the process that writes to a store there; 0 for none."""
    for lock in into.glob("*.lock"):
        words = lock.read_text(encoding="utf-8").split()
        if words:
            return int(words[1])
    return 0


class StopsAfter:
    """Sets an event once so many takes are done, and looks on."""

    def __init__(self, n_takes: int) -> None:
        self.stop, self._n = threading.Event(), n_takes

    def __call__(self, progress: Progress) -> None:
        if progress.learned >= self._n:
            self.stop.set()


def test_where_nothing_can_be_written_is_told(tmp_path: Path) -> None:
    write = "time_s,elbow\n" + "".join(f"{k / 50:.2f},{k % 7}\n" for k in range(200))
    (tmp_path / "takes").mkdir()
    (tmp_path / "takes" / "slow.csv").write_text(write)
    reading = Reading(observe="channels")
    (tmp_path / "file").write_text("")
    with pytest.raises(StoreError, match=r"cannot be a folder .*file: File exists"):
        learn_corpus(tmp_path / "takes", tmp_path / "file", reading=reading, jobs=0)
    (tmp_path / "into" / "plan.new").mkdir(parents=True)
    with pytest.raises(StoreError, match=r"plan.json cannot be written: Is a directory"):
        learn_corpus(tmp_path / "takes", tmp_path / "into", reading=reading, jobs=0)


def test_stopped_it_goes_on(folder: Path, alone: bytes, tmp_path: Path) -> None:
    stops = StopsAfter(2)
    first = learn_corpus(folder, tmp_path / "s", jobs=0, show=stops, stop=stops.stop)
    assert first.learner is None
    assert 2 <= first.progress.learned < 8
    again = learn_corpus(folder, tmp_path / "s", jobs=0)
    assert again.progress.already >= first.progress.learned
    assert saved(again, tmp_path) == alone
    third = learn_corpus(folder, tmp_path / "s", jobs=0)
    assert third.progress.already == 9
    assert saved(third, tmp_path) == alone


class Poison(CSVReader):
    """A reader that ends the process at one take, and has a fault at another."""

    format = "poison"
    suffixes = (".poison",)

    def read(self, path: Path, hints: Hints, *, positions: bool) -> Recording:
        if path.stem == "fault":
            raise ZeroDivisionError("a fault of a reader")
        if multiprocessing.parent_process() is not None:
            os.kill(os.getpid(), signal.SIGKILL)
        raise RecordingError("not here")


def test_what_kills_a_process_is_named_and_nothing_else_is_lost(
    folder: Path, alone: bytes, tmp_path: Path
) -> None:
    takes = tmp_path / "takes"
    shutil.copytree(folder, takes)
    for name in ("fault", "kill"):
        (takes / "cleo" / f"{name}.poison").write_text("x", encoding="utf-8")
    killed, seen, deaths = [], [], []

    def kill(progress: Progress) -> None:
        """End a worker in the middle of its work, too."""
        seen.append(progress.learned)
        deaths.append(progress.deaths)
        if not killed and progress.learned >= 1:
            worker = _writer_of(tmp_path / "s")
            if worker:
                os.kill(worker, signal.SIGKILL)
                killed.append(worker)

    register_reader(Poison())
    try:
        corpus = learn_corpus(takes, tmp_path / "s", jobs=2, show=kill)
    finally:
        registry._registered[:] = [r for r in readers() if not isinstance(r, Poison)]
    assert killed
    assert seen == sorted(seen)
    assert sorted(corpus.refused) == ["ben/broken", "cleo/fault", "cleo/kill"]
    assert "2 times: the process ended" in corpus.refused["cleo/kill"]
    assert "ZeroDivisionError: a fault of a reader" in corpus.refused["cleo/fault"]
    assert corpus.progress.deaths >= 4
    assert deaths == sorted(deaths)
    assert corpus.progress.learned == 8
    assert all(report.memory_bytes > 1e6 for report in corpus.reports if report.learned)
    assert saved(corpus, tmp_path) == alone


def test_a_take_that_a_worker_has_in_hand_killed_nobody(folder: Path, tmp_path: Path) -> None:
    stops, deaths = StopsAfter(1), []

    def show(progress: Progress) -> None:
        deaths.append(progress.deaths)
        stops(progress)

    learn_corpus(folder, tmp_path / "s", jobs=1, show=show, stop=stops.stop)
    assert len(deaths) > 1
    assert not any(deaths)


def test_a_command_that_is_killed_takes_its_workers_with_it_and_blames_no_take(
    folder: Path, tmp_path: Path
) -> None:
    into, parent = (
        tmp_path / "s",
        multiprocessing.get_context("spawn").Process(
            target=learn_corpus, args=(folder, tmp_path / "s"), kwargs={"jobs": 1}
        ),
    )
    parent.start()
    while not any('"begun"' in path.read_text() for path in into.glob("*.jsonl")):
        parent.join(0.02)
        assert parent.exitcode is None
    worker = _writer_of(into)
    parent.kill()
    parent.join()
    while _runs(worker):
        time.sleep(0.05)
    corpus = learn_corpus(folder, into, jobs=0)
    assert corpus.progress.deaths == 0
    assert corpus.progress.learned == 8


def _runs(process: int) -> bool:
    """Return whether a process that is no child of this one goes on."""
    try:
        return "zombie" not in psutil.Process(process).status()
    except psutil.NoSuchProcess:
        return False


_LIVES = st.lists(st.sampled_from(["learned", "died", "stopped"]), max_size=8)


@given(_LIVES)
def test_a_death_counts_once_another_worker_begins(lives: list[str]) -> None:
    with tempfile.TemporaryDirectory() as folder:
        writer, reader = (ShardJournal(Path(folder) / "0000.db") for _ in range(2))
        died = 0
        for k, end in enumerate(lives):
            writer.write("begun", f"{k}")
            reader.refresh()
            assert reader.report().deaths == died
            if end == "died":
                died += 1
            else:
                rest = {"keys": [], "watched_s": 1.0, "took_s": 1.0, "primitives": 1, "memory": 1}
                writer.write(end, f"{k}", **(rest if end == "learned" else {}))
        reader.refresh()
        again = ShardJournal(writer.path.with_suffix(".db"))
        assert again.report() == reader.report()
        assert again.report().deaths == died - (lives[-1:] == ["died"])


def test_who_ends_a_take_after_its_pool_is_seen_to_be_broken_died_of_nothing(
    folder: Path, alone: bytes, tmp_path: Path
) -> None:
    class Late(Here):
        """The first worker's work is lost while it still has its take in hand, which it ends."""

        journal: ShardJournal | None = None

        def submit(self, work: Callable[..., Any], *args: Any) -> Future[Any]:
            if work is learn_shard and self.journal is None:
                self.journal, self.take = ShardJournal(args[0].store), args[0].takes[0].name
                self.journal.write("begun", self.take)
                future: Future[Any] = Future()
                future.set_exception(RuntimeError("ended abruptly"))
                return future
            if self.journal is not None and not ended:
                ended.append(self.take)
                self.journal.take_back(self.take)
            return super().submit(work, *args)

    ended, deaths = [], []
    corpus = learn_corpus(
        folder, tmp_path / "s", executor=Late(), show=lambda now: deaths.append(now.deaths)
    )
    assert ended
    assert not any(deaths)
    assert saved(corpus, tmp_path) == alone


def test_what_an_earlier_worker_still_writes_is_read_before_anything_is_begun(
    folder: Path, tmp_path: Path
) -> None:
    takes = tuple(take for take in find_takes(folder).takes if take.person == "anna")
    learner = learn_corpus(folder, tmp_path / "s", jobs=0, people=["anna"]).learner
    assert learner is not None
    task = ShardTask(tmp_path / "0000.db", takes, Reading(), learner.config, tmp_path / "stop")
    journal = ShardJournal(task.store)
    with ThreadPoolExecutor(1) as pool:
        with contextlib.closing(Store(task.store)):
            for _ in range(2):
                journal.write("begun", takes[0].name)
            later = pool.submit(learn_shard, task)
            time.sleep(0.1)  # the later worker has read the journal, and waits for the store
            journal.take_back(takes[0].name)
        report = later.result()
    assert report.learned == tuple(take.name for take in takes)
    assert report.deaths == 1


def test_what_came_since_is_learned_in_shards_of_its_own(tmp_path: Path) -> None:
    for seed, name in enumerate(["anna/a", "ben/a"]):
        write_take(tmp_path / "takes" / f"{name}.csv", 15.0, seed)
    first = learn_corpus(tmp_path / "takes", tmp_path / "s", jobs=0)
    write_take(tmp_path / "takes" / "anna" / "0.csv", 15.0, 5)
    more = learn_corpus(tmp_path / "takes", tmp_path / "s", jobs=0)
    assert more.shards == (*first.shards, Shard("anna", ("anna/0",)))
    assert more.progress.already == 2
    assert more.learner is not None
    assert first.learner is not None
    assert more.learner.n_frames == first.learner.n_frames * 3 // 2


def test_other_rules_are_refused(folder: Path, tmp_path: Path) -> None:
    stops = StopsAfter(1)
    learn_corpus(folder, tmp_path / "s", jobs=0, show=stops, stop=stops.stop)
    for other in ({"reading": Reading("channels")}, {"rate_hz": 25.0}):
        with pytest.raises(InvalidValueError, match="other rules"):
            learn_corpus(folder, tmp_path / "s", jobs=0, **other)
    (tmp_path / "s" / "plan.json").write_text("{", encoding="utf-8")
    with pytest.raises(InvalidValueError, match=r"plan\.json"):
        learn_corpus(folder, tmp_path / "s", jobs=0)


def test_nothing_to_learn_is_said(tmp_path: Path) -> None:
    (tmp_path / "takes").mkdir()
    with pytest.raises(RecordingError, match="nothing readable"):
        learn_corpus(tmp_path / "takes", tmp_path / "s", jobs=0)
    (tmp_path / "takes" / "a.csv").write_text("time_s,a\n0,x\n", encoding="utf-8")
    with pytest.raises(RecordingError, match=r"a\.csv"):
        learn_corpus(tmp_path / "takes", tmp_path / "s", jobs=0)
    with pytest.raises(InvalidValueError, match="jobs"):
        learn_corpus(tmp_path / "takes", tmp_path / "s", jobs=-1)


def test_workers_that_die_again_and_again_end_nothing(
    folder: Path, alone: bytes, tmp_path: Path
) -> None:
    frail = Frail(jobs=2)
    corpus = learn_corpus(folder, tmp_path / "s", executor=frail)
    frail.close()
    assert frail.most == 2
    assert frail.deaths >= 3
    assert saved(corpus, tmp_path) == alone


def test_who_works_beside_one_that_dies_again_and_again_is_not_held_to_be_dying(
    folder: Path, tmp_path: Path
) -> None:
    class Beside:
        """Two workers; the first shard's comes to its first take and dies, three times."""

        jobs, deaths = 2, 0

        def __init__(self) -> None:
            self.given: list[Future[Any]] = []

        def submit(self, work: Callable[..., Any], *args: Any) -> Future[Any]:
            if self.deaths == 3 or work is not learn_shard:
                return Here().submit(work, *args)
            future: Future[Any] = Future()
            self.given.append(future)
            if args[0].store.stem == "0000":
                ShardJournal(args[0].store).write("begun", args[0].takes[0].name)
            if len(self.given) == 2:
                self.deaths += 1
                for each in self.given:
                    each.set_exception(RuntimeError("ended abruptly"))
                self.given = []
            return future

        def close(self) -> None:
            pass

    corpus = learn_corpus(folder, tmp_path / "s", executor=Beside())
    first = corpus.shards[0].takes[0]
    assert "was tried 3 times" in corpus.progress.refused[first]
    names = {name for shard in corpus.shards for name in shard.takes}
    learned = {name for report in corpus.reports for name in report.learned}
    assert learned == names - corpus.progress.refused.keys()
    assert len(corpus.progress.refused) == 2  # another cannot be read, whoever dies


def test_workers_that_die_at_once_end_it(folder: Path, tmp_path: Path) -> None:
    class Dying:
        def submit(self, work: Callable[..., Any], *args: Any) -> Future[Any]:
            future: Future[Any] = Future()
            future.set_exception(RuntimeError("no room"))
            return future

        def close(self) -> None:
            pass

    with pytest.raises(CorpusError, match="no room"):
        learn_corpus(folder, tmp_path / "s", executor=Dying())


@pytest.mark.parametrize("jobs", [0, -1, 1.5, "two"])
def test_an_executor_that_takes_nothing_is_refused_before_anything_is_read(
    jobs: Any, tmp_path: Path
) -> None:
    executor = SimpleNamespace(submit=Here().submit, close=Here().close, jobs=jobs)
    with pytest.raises(InvalidValueError, match="jobs must be a number from 1 on"):
        learn_corpus(tmp_path / "nothing", tmp_path / "s", executor=executor)
    with pytest.raises(InvalidValueError, match="jobs must be a number from 1 on"):
        recognise_corpus(tmp_path / "no.mplearn", tmp_path / "nothing", executor=executor)
    with pytest.raises(InvalidValueError, match="jobs must be a whole number, at least 1"):
        learn_corpus(tmp_path / "nothing", tmp_path / "s", jobs=jobs or -2)
    with pytest.raises(InvalidValueError, match=r"has submit\(work, \*args\)"):
        learn_corpus(tmp_path / "nothing", tmp_path / "s", executor=4)  # type: ignore[arg-type]
    assert not (tmp_path / "s").exists()


def test_the_tree_merges_as_merging_does(folder: Path, alone: bytes, tmp_path: Path) -> None:
    stores = tmp_path / "s"
    learn_corpus(folder, stores, jobs=0)
    parts = [StoreReader(stores / f"{k:04d}.db").life.learner for k in range(4)]
    assert merge_learners(parts).save(tmp_path / "whole.mplearn").read_bytes() == alone


NAMES = st.lists(
    st.tuples(st.sampled_from(["", "anna", "ben"]), st.integers(0, 99)), max_size=40, unique=True
)


def _files(names: list[tuple[str, int]]) -> list[TakeFiles]:
    return [TakeFiles(f"{who}/{k:02d}", who, (), CSVReader()) for who, k in names]


@given(NAMES, st.integers(1, 7), st.randoms())
def test_dealing_depends_on_the_takes_alone(
    names: list[tuple[str, int]], size: int, order: random.Random
) -> None:
    shards = deal(_files(names), size)
    shuffled = list(names)
    order.shuffle(shuffled)
    assert deal(_files(shuffled), size) == shards
    dealt = [name for shard in shards for name in shard.takes]
    assert sorted(dealt) == sorted(take.name for take in _files(names))
    assert all(1 <= len(shard.takes) <= size for shard in shards)
    assert all(name.startswith(shard.person) for shard in shards for name in shard.takes)
    assert deal(_files(names), size, shards) == shards


def test_a_journal_torn_by_a_death_is_read_on(tmp_path: Path) -> None:
    journal = ShardJournal(tmp_path / "0000.db")
    journal.write("begun", "a")
    with journal.path.open("a", encoding="utf-8") as file:
        file.write('{"what": "lear')
    again = ShardJournal(tmp_path / "0000.db")
    again.write("begun", "a")
    again.refresh()
    assert again.deaths("a") == 2
    assert not again.is_done("a")
    assert ShardJournal(tmp_path / "0000.db").deaths("a") == 2


def test_a_full_disk_costs_no_take_and_nothing_twice(
    folder: Path, alone: bytes, tmp_path: Path
) -> None:
    """Each time there is room for some more; what comes of it is what one pass makes."""
    learned: list[int] = []
    for most_bytes in (2_000, 20_000, 60_000, 110_000, 160_000, 220_000):
        with little_room(most_bytes), pytest.raises(StoreWriteError):
            learn_corpus(folder, tmp_path / "s", jobs=0)
        journals = [
            ShardJournal(path.with_suffix(".db")) for path in (tmp_path / "s").glob("*.jsonl")
        ]
        learned.append(sum(len(each.report().learned) for each in journals))
        assert not any(each.report().deaths for each in journals)
    assert learned == sorted(learned)
    assert learned[-1] > 0
    again = learn_corpus(folder, tmp_path / "s", jobs=0)
    assert again.progress.already >= learned[-1]
    assert list(again.refused) == ["ben/broken"]
    assert saved(again, tmp_path) == alone


def test_a_take_that_was_begun_without_room_to_say_how_it_ended_is_not_held_a_death(
    tmp_path: Path,
) -> None:
    journal = ShardJournal(tmp_path / "a.db")
    journal.write("begun", "bow")
    journal.write("refused", "bow", why="it is empty")
    with little_room(journal.path.stat().st_size + 45):
        for _ in range(3):
            journal.write("begun", "kick")
            with pytest.raises(StoreWriteError, match="cannot be written"):
                journal.write("learned", "kick", took_s=1.0)
            journal.take_back("kick")
    read = ShardJournal(tmp_path / "a.db")
    assert read.deaths("kick") == 0
    assert read.is_done("bow")
    assert not read.is_done("kick")
