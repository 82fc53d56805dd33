"""Learning live on the command line: events as they come, an orderly end, a sender."""

import asyncio
import errno
import json
import os
import signal
import socket
import subprocess
import sys
import threading
import time
from pathlib import Path

import numpy as np
import pytest

from mplearn.demonstrator import demonstrate
from mplearn.learner import Event, LearnerConfig, MotionLearner
from mplearn.library import PrimitiveLibrary
from mplearn.recording import FloatArray, Recording
from mplearn.sources import Block, Change, Source, Stream, Tally, source_kinds
from mplearn.sources.buffered import BEHIND_S
from mplearn.sources.inbox import CAPACITY
from mplearn.sources.played import PlayedSource
from mplearn.sources.sending import open_sender
from mplearn.store import LifelongLearner
from mplearn_agents.cli import main
from mplearn_agents.learning.live import SOURCES, learn_live
from mplearn_agents.learning.waiting import waiting_for_learner
from mplearn_agents.terminal.event_lines import change_text
from mplearn_agents.terminal.interrupts import asked_in_loop, asked_to_stop

ENV = {**os.environ, "NO_COLOR": "1", "COLUMNS": "120"}
RUN = [sys.executable, "-m", "mplearn_agents.cli"]


@pytest.fixture(scope="module")
def take(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A recording of a person, as a table."""
    recording = demonstrate(["BAR", "BAL"] * 4, seed=2).recording
    path = tmp_path_factory.mktemp("take") / "take.csv"
    rows = [["Time", *recording.channels]]
    for i, frame in enumerate(recording.frames):
        rows.append([f"{i / 100:.2f}", *("" if np.isnan(v) else repr(float(v)) for v in frame)])
    path.write_text("\n".join(",".join(row) for row in rows))
    return path


def test_a_library_learned_live_is_that_of_the_file(
    take: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    live, file = tmp_path / "live.mplearn", tmp_path / "file.mplearn"
    assert main(["learn", "--live", f"recording:{take}", "--speed", "inf", "--out", str(live)]) == 0
    said = capsys.readouterr().out
    assert "learned primitive" in said
    assert "a body by 34 places" in said
    assert main(["learn", str(take), "--out", str(file)]) == 0
    assert PrimitiveLibrary.load(live).version == PrimitiveLibrary.load(file).version
    assert live.read_bytes() == file.read_bytes()


def test_events_as_lines_of_json(
    take: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    out = tmp_path / "live.mplearn"
    command = ["learn", "--live", f"recording:{take}", "--speed", "inf", "--json"]
    assert main([*command, "--out", str(out)]) == 0
    lines = [json.loads(line) for line in capsys.readouterr().out.splitlines()]
    names = [line["event"] for line in lines]
    assert {"Change", "SegmentClosed", "PrimitiveBorn", "Recognised", "Summary"} <= set(names)
    born = next(line for line in lines if line["event"] == "PrimitiveBorn")
    assert born["segment"]["end"] / 100 == born["time_s"]
    assert lines[-1]["primitives"] == len(PrimitiveLibrary.load(out))
    assert lines[-1]["frames"] == round(lines[-1]["watched_s"] * 100)
    assert not lines[-1]["stopped"]


@pytest.mark.parametrize("ending", [signal.SIGINT, signal.SIGTERM])
def test_stopped_it_writes_what_was_learned(ending: signal.Signals, tmp_path: Path) -> None:
    out = tmp_path / "live.mplearn"
    command = [*RUN, "learn", "--live", "demonstrator", "--speed", "20", "--out", str(out)]
    with subprocess.Popen(command, env=ENV, stdout=subprocess.PIPE, text=True) as process:
        assert process.stdout is not None
        for line in process.stdout:
            if "primitive" in line:
                break
        process.send_signal(ending)
        said = process.stdout.read()
        assert process.wait(30) == 0
    assert "stopped, written to" in " ".join(said.split())
    assert len(PrimitiveLibrary.load(out)) > 0


def test_what_is_sent_to_a_pipe_is_learned(take: Path, tmp_path: Path) -> None:
    out = tmp_path / "live.mplearn"
    send = [*RUN, "send", str(take), "--to", "ndjson:-", "--speed", "inf"]
    learn = [*RUN, "learn", "--live", "ndjson:-", "--json", "--out", str(out)]
    with subprocess.Popen(send, env=ENV, stdout=subprocess.PIPE) as sender:
        learned = subprocess.run(learn, env=ENV, stdin=sender.stdout, capture_output=True)
    assert learned.returncode == 0, learned.stderr
    summary = json.loads(learned.stdout.splitlines()[-1])
    assert summary["frames"] == len(take.read_text().splitlines()) - 1
    file = tmp_path / "file.mplearn"
    assert main(["learn", str(take), "--out", str(file)]) == 0
    assert out.read_bytes() == file.read_bytes()


@pytest.mark.parametrize(
    ("more", "message"),
    [
        ([], "give a recording, or --live SOURCE"),
        (["x.csv", "--live", "demonstrator"], "give a recording, or --live SOURCE"),
        (["--live", "radio:"], "a source begins with one of"),
        (["--live", "demonstrator", "--speed", "-1"], "speed must be positive, not -1"),
        (["--live", "udp:1", "--speed", "2"], "no option 'speed'"),
        (["--live", "demonstrator", "--seconds", "0"], "--seconds must be positive, not 0"),
        (["--live", "demonstrator", "--rate-hz", "0.1"], "rate_hz must lie in"),
        (["--live", "recording:nowhere.csv"], "no such file"),
    ],
)
def test_bad_input_is_refused(
    more: list[str], message: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["learn", "--out", str(tmp_path / "x"), *more]) == 2
    assert message in capsys.readouterr().err


def test_the_help_names_all_sources_and_imports_none() -> None:
    assert {each.partition(":")[0].partition("[")[0] for each in SOURCES.split(", ")} == {
        kind for kind in source_kinds() if kind != "mine"
    }
    code = "import sys; from mplearn_agents import cli; cli.build_parser(); "
    code += "sys.exit('mplearn.sources' in sys.modules)"
    assert subprocess.run([sys.executable, "-c", code], env=ENV).returncode == 0


def test_nowhere_to_send_is_refused(take: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["send", str(take), "--to", "radio:1"]) == 2
    assert "frames are sent to" in capsys.readouterr().err
    assert main(["send", str(take), "--to", "ndjson:127.0.0.1:1"]) == 2
    assert "nobody listens" in capsys.readouterr().err


class Slow(Source):
    """Says that it is behind, and breaks off once."""

    def __init__(self, inner: Source) -> None:
        self.name, self.tally, self._inner = "slow:", Tally(), inner

    @property
    def ended(self) -> bool:
        return self._inner.ended

    def read(self, timeout_s: float | None = None) -> list[Block | Change]:
        return [
            Change("behind", "frames are read 2.0 s after they \x1b[31mcame"),
            *self._inner.read(),
        ]

    def close(self) -> None:
        self._inner.close()


def test_changes_are_said_and_steer_no_terminal() -> None:
    lines: list[str] = []
    source = Slow(PlayedSource(Stream(("a",), 100.0), [np.zeros((120, 1))], np.inf))
    log = learn_live(source, threading.Event(), lines.append)
    assert log.watched_s == pytest.approx(1.2)
    assert any("behind: frames are read 2.0 s after they" in line for line in lines)
    assert not any("\x1b" in line for line in lines)
    assert "\x1b" not in change_text(Change("names", "\x1b[2J"))


def test_a_stretch_that_does_not_join_ends_the_stream() -> None:
    rng = np.random.default_rng(0)
    frames = np.cumsum(rng.normal(size=(300, 2)), axis=0) * 0.01
    stream = Stream(("a", "b"), 100.0)
    blocks = [
        Block(stream, part, np.arange(150) / 100, np.zeros(150), joins=False)
        for part in (frames[:150], frames[150:])
    ]

    class Two(Slow):
        def read(self, timeout_s: float | None = None) -> list[Block | Change]:
            self._inner.read()
            return [blocks.pop(0)] if blocks else []

    inner = PlayedSource(stream, [np.zeros((100, 2))], np.inf)
    log = learn_live(Two(inner), threading.Event(), lambda line: None)
    learner = MotionLearner(LearnerConfig(("a", "b"), 100.0))
    for part in (frames[:150], frames[150:]):
        learner.learn_many(part)
        learner.end_stream()
    assert log.learner is not None
    assert log.learner.n_frames == learner.n_frames
    assert len(log.learner.snapshot()) == len(learner.snapshot())


class Breaking(Source):
    """A source of somebody else, which breaks what it promised."""

    name = "mine"

    def __init__(self, recording: Recording) -> None:
        self.tally = Tally()
        stream = Stream(recording.channels, recording.rate_hz, unit_m=1.0, up="z")
        n = len(recording)
        times = np.arange(n) / recording.rate_hz
        wrong = Stream(("a", "b"), recording.rate_hz)
        few = np.zeros((5, 2)), times[:5], times[:5]
        self._blocks = [Block(stream, recording.frames, times, times), Block(wrong, *few)]

    @property
    def ended(self) -> bool:
        return False

    def read(self, timeout_s: float | None = None) -> list[Block | Change]:
        return [self._blocks.pop(0)]

    def close(self) -> None:
        pass


class Torn(Breaking):
    """Shows a recording, and then raises what sources of ours do not."""

    def read(self, timeout_s: float | None = None) -> list[Block | Change]:
        if len(self._blocks) < 2:
            raise OSError(errno.EIO, "input or output", "camera")
        return super().read(timeout_s)


def test_whatever_a_source_raises_what_was_learned_is_kept(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    torn = Torn(demonstrate(["BAR", "BAL"] * 3, seed=2).recording)
    monkeypatch.setattr("mplearn.sources.open_source", lambda *_, **__: torn)
    path = tmp_path / "not" / "yet" / "live.mplearn"  # where frames wait meanwhile
    assert main(["learn", "--live", "mine", "--out", str(path)]) == 2
    told = capsys.readouterr()
    assert "camera: input or output" in told.err
    assert "what was learned before is written" in told.out
    assert len(PrimitiveLibrary.load(path)) > 0


def test_frames_wait_in_the_next_folder_that_is_there(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    monkeypatch.setattr("mplearn.sources.buffered._IN_MEMORY_BYTES", 0)
    recording = demonstrate(["BAR"], seed=2).recording
    torn = Torn(recording)
    with waiting_for_learner(torn, beside=tmp_path / "not" / "yet" / "a.mplearn") as read:
        items = read.read(10.0)
        with pytest.raises(OSError, match="input or output"):
            while True:
                items += read.read(10.0)
    (block,) = items  # nothing is said of files that cannot be written
    assert isinstance(block, Block)
    assert np.array_equal(block.frames, recording.frames, equal_nan=True)


def test_what_was_learned_before_a_source_broke_is_kept(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    recording = demonstrate(["BAR", "BAL"] * 3, seed=2).recording
    broken = Breaking(recording)
    monkeypatch.setattr("mplearn.sources.open_source", lambda *_, **__: broken)
    kept = tmp_path / "live.mplearn", tmp_path / "life.db"
    command = ["learn", "--live", "mine", "--out", str(kept[0]), "--store", str(kept[1])]
    assert main(command) == 2
    told = capsys.readouterr()
    assert "must have shape" in told.err and len(told.err.splitlines()) == 1
    assert "what was learned before is written" in told.out
    assert not kept[1].with_name("life.db-wal").exists()  # it was closed
    assert len(PrimitiveLibrary.load(kept[0])) == len(PrimitiveLibrary.load(kept[1])) > 0


@pytest.mark.parametrize("known", [True, False])
def test_stopped_before_anything_came_it_says_so_and_keeps_what_was_known(
    known: bool, take: Path, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    store, out = tmp_path / "life.db", tmp_path / "out.mplearn"
    if known:
        assert main(["learn", str(take), "--store", str(store)]) == 0

    class Silent(PlayedSource):
        def read(self, timeout_s: float | None = None) -> list[Block | Change]:
            signal.raise_signal(signal.SIGTERM)
            return []

    silent = Silent(Stream(("a", "b"), 100.0), [np.zeros((10, 2))], np.inf)
    monkeypatch.setattr("mplearn.sources.open_source", lambda *_, **__: silent)
    command = ["learn", "--live", "mine", "--speed", "inf", "--store", str(store)]
    assert main([*command, "--out", str(out)]) == (0 if known else 130)
    assert out.exists() == store.exists() == known
    if known:
        assert len(PrimitiveLibrary.load(out)) == len(PrimitiveLibrary.load(store)) > 0


@pytest.mark.parametrize("ending", [signal.SIGINT, signal.SIGTERM])
def test_an_event_loop_is_asked_to_stop_and_not_interrupted(ending: signal.Signals) -> None:
    """However often: `timeout` asks twice, and people do."""
    before = signal.getsignal(ending)

    async def wait() -> None:
        with asked_in_loop() as asked:
            os.kill(os.getpid(), ending)
            await asyncio.wait_for(asked, 30.0)
            for _ in range(3):
                os.kill(os.getpid(), ending)
                await asyncio.sleep(0.01)

    asyncio.run(wait())
    assert signal.getsignal(ending) is before


def test_the_first_wish_to_stop_is_noted_and_the_second_interrupts() -> None:
    before = signal.getsignal(signal.SIGINT)
    with asked_to_stop() as stop:
        os.kill(os.getpid(), signal.SIGINT)
        os.kill(os.getpid(), signal.SIGTERM)  # as `timeout` does: the same wish
        time.sleep(0.6)
        assert stop.is_set()
        with pytest.raises(KeyboardInterrupt):
            os.kill(os.getpid(), signal.SIGINT)
            time.sleep(1.0)
    assert signal.getsignal(signal.SIGINT) is before


@pytest.mark.parametrize("as_json", [True, False])
def test_a_learner_slower_than_the_stream_misses_nothing(
    as_json: bool,
    monkeypatch: pytest.MonkeyPatch,
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
) -> None:
    n = 2 * CAPACITY  # a receiver by itself drops what comes once so many wait as half of these
    sent = threading.Event()
    learn_many = LifelongLearner.learn_many

    def slowly(life: LifelongLearner, frames: FloatArray) -> list[Event]:
        assert sent.wait(60.0)
        if life.n_frames == 0:
            time.sleep(1.5 * BEHIND_S)  # until it is said that frames wait
        return learn_many(life, frames)

    monkeypatch.setattr(LifelongLearner, "learn_many", slowly)
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as free:
        free.bind(("127.0.0.1", 0))
        address = f"udp:127.0.0.1:{free.getsockname()[1]}"

    def send() -> None:
        times = np.arange(n) / 100.0
        frames = np.sin(times[:, None] * [1.0, 2.0])
        stream = Stream(("a", "b"), 100.0)
        with open_sender(address) as sender:
            for i in range(0, n, 32):
                part = slice(i, i + 32)
                sender.send(Block(stream, frames[part], times[part], times[part]))
                time.sleep(0.002)  # so that the network, too, loses nothing
        sent.set()

    sending = threading.Timer(0.5, send)
    sending.start()
    command = ["learn", "--live", address, "--seconds", f"{0.75 * n / 100.0}"]
    command += ["--json"] if as_json else []
    assert main([*command, "--out", str(tmp_path / "x.mplearn")]) == 0
    sending.join()
    if not as_json:
        said = capsys.readouterr().out
        assert "frames that had come were not learned when it ended" in said
        assert "overrun" not in said
        return
    lines = [json.loads(line) for line in capsys.readouterr().out.splitlines()]
    assert lines[-1]["overrun"] == 0
    assert lines[-1]["frames"] + lines[-1]["lost"] + lines[-1]["unread"] > CAPACITY
    assert [line for line in lines if line.get("kind") == "behind"]
