"""The lab streaming layer, with an outlet of ours."""

import itertools
import os
import signal
import subprocess
import sys
import threading
import time
import uuid
from pathlib import Path

import numpy as np
import pytest
from played import frames_of, texts_of
from servers import gather, learned

from mplearn.errors import InvalidValueError
from mplearn.recording import Recording
from mplearn.sources import Block, Change, Stream, open_source
from mplearn.sources.inbox import Inbox
from mplearn.sources.played import PlayedSource
from mplearn.sources.protocols import lsl, lsl_process
from mplearn.sources.protocols.lsl import LSLReceiver, described, described_info
from mplearn.sources.received import ReceivedSource
from mplearn.sources.sending import open_sender, send

pylsl = pytest.importorskip("pylsl")


@pytest.fixture(scope="module", autouse=True)
def network() -> None:
    """Skip where streams of this machine are not found, as without multicast."""
    probe = f"probe-{uuid.uuid4()}"
    outlet = pylsl.StreamOutlet(pylsl.StreamInfo(probe, "MoCap", 1, 100.0, "double64", probe))
    found = pylsl.resolve_byprop("name", probe, minimum=1, timeout=10.0)
    del outlet
    if not found:
        pytest.skip("the lab streaming layer finds no stream of this machine: is multicast off?")


@pytest.fixture
def name() -> str:
    return f"test-{uuid.uuid4()}"


def connected(source: object, outlet: object) -> None:
    until = time.monotonic() + 10.0
    while not outlet.have_consumers():
        assert time.monotonic() < until
        time.sleep(0.01)


def test_what_an_outlet_pushes_is_learned_bit_for_bit(
    name: str, session: Recording, learned_session: bytes, tmp_path: Path
) -> None:
    stream = Stream(session.channels, 100.0, unit_m=1.0)
    with open_source(f"lsl:{name}") as source, open_sender(f"lsl:{name}") as sender:
        sender.offer(stream)
        connected(source, sender._outlet)
        played = PlayedSource(stream, [session.frames], 20.0)
        thread = threading.Thread(target=send, args=(played, sender))
        items = gather(source, thread.start, len(session))
        thread.join()
    np.testing.assert_array_equal(frames_of(items), session.frames)
    assert learned(items, tmp_path / "live") == learned_session
    assert source.tally.faults() == {}


def test_an_outlet_that_comes_back_is_found_and_what_was_lost_is_counted(name: str) -> None:
    stream = Stream(("a", "b"), 100.0)
    frames = np.arange(200.0).reshape(100, 2)
    with open_source(f"lsl:{name}", observe="channels") as source:
        items = []
        for start, end in ((0, 40), (60, 100)):
            outlet = pylsl.StreamOutlet(described_info(pylsl, name, stream))
            connected(source, outlet)
            for i in range(start, end):
                if i % 10 != 5:  # the sender loses some itself
                    outlet.push_sample(frames[i].tolist(), 50.0 + i / 100)
            until = time.monotonic() + 10.0
            last = frames[end - 1, 0]
            while not any(isinstance(i, Block) and last in i.frames[:, 0] for i in items):
                items += source.read(0.1)
                assert time.monotonic() < until
            del outlet
            until = time.monotonic() + 10.0
            while len(texts_of(items, "disconnected")) < 1 and time.monotonic() < until:
                items += source.read(0.1)
    came = frames_of(items)[:, 0]
    expected = [2.0 * i for i in range(100) if i % 10 != 5 and not 40 <= i < 60]
    assert came[~np.isnan(came)].tolist() == expected
    assert source.tally.frames == len(expected)
    assert source.tally.lost == 100 - len(expected)
    assert source.tally.reconnected == 1


def test_where_the_library_crashes_the_stream_is_connected_again(name: str) -> None:
    receiver = LSLReceiver(name)
    outlet = pylsl.StreamOutlet(described_info(pylsl, name, Stream(("a", "b"), 100.0)))
    with ReceivedSource(f"lsl:{name}", receiver) as source:
        items: list[Block | Change] = []
        for start in (0, 100):
            connected(source, outlet)
            for i in range(start, start + 50):
                outlet.push_sample([float(i), -float(i)], 50.0 + i / 100)
            until = time.monotonic() + 10.0
            last = start + 49.0
            while not any(isinstance(i, Block) and last in i.frames[:, 0] for i in items):
                items += source.read(0.1)
                assert time.monotonic() < until
            if not start:
                first = receiver._process
                assert first is not None
                first.send_signal(signal.SIGSEGV)  # as if liblsl had crashed
                while not texts_of(items, "disconnected"):
                    items += source.read(0.1)
                while outlet.have_consumers():
                    time.sleep(0.01)
    came = frames_of(items)[:, 0]
    assert came[~np.isnan(came)].tolist() == [*range(50), *range(100, 150)]
    assert source.tally.reconnected == 1
    assert texts_of(items, "disconnected") == [
        "the process that pulls the stream ended (signal 11)"
    ]
    second = receiver._process
    assert second is not None
    assert second is not first
    assert first.returncode == -signal.SIGSEGV
    assert second.poll() is not None, "it would go on where nobody reads"


def test_who_pulls_ends_when_nobody_reads(name: str) -> None:
    outlet = pylsl.StreamOutlet(described_info(pylsl, name, Stream(("a",), 100.0)))
    command = [sys.executable, lsl_process.__file__, "name", name]
    with subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE) as process:
        connected(None, outlet)
        assert process.stdout is not None
        assert process.stderr is not None
        process.stdout.close()  # as where the process that reads is killed
        assert process.wait(10.0) == 0
        assert b"Traceback" not in process.stderr.read()


@pytest.mark.parametrize("safe", ["", "1"])
def test_who_pulls_finds_modules_where_others_do(tmp_path: Path, safe: str) -> None:
    (tmp_path / "pylsl.py").write_text("raise ImportError('found')")
    environment = os.environ | {"PYTHONPATH": str(tmp_path), "PYTHONSAFEPATH": safe}
    command = [sys.executable, lsl_process.__file__, "name", "x"]
    done = subprocess.run(command, capture_output=True, env=environment, check=True, timeout=60)
    assert done.stdout == lsl_process.HEAD.pack(lsl_process.FAILED, 5) + b"found"


def test_who_pulls_may_end_amid_a_message(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    head = lsl_process.HEAD.pack(lsl_process.SAMPLES, 1000)
    script = tmp_path / "ends.py"
    script.write_text(f"import os; os.write(1, {head!r} + bytes(500)); os._exit(7)")
    monkeypatch.setattr(lsl_process, "__file__", str(script))
    with pytest.raises(OSError, match=r"the process that pulls the stream ended \(code 7\)"):
        LSLReceiver("x").receive(Inbox())


HANGS = "import time\ndef resolve_byprop(*a, **b): time.sleep(600)\n"


def hanging(folder: Path) -> dict[str, str]:
    """Return the environment of a process in which the library never returns."""
    (folder / "pylsl.py").write_text(HANGS)
    return dict(os.environ) | {"PYTHONPATH": str(folder), "PYTHONSAFEPATH": ""}


def test_where_the_library_hangs_it_is_ended_and_begun_anew(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    for key, value in hanging(tmp_path).items():
        monkeypatch.setenv(key, value)
    monkeypatch.setattr(lsl, "HANGS_S", 0.7)
    receiver = LSLReceiver("x")
    with pytest.raises(OSError, match=r"liblsl said nothing for 0\.7 s: it hangs"):
        receiver.receive(Inbox())
    assert receiver._process is not None
    assert receiver._process.returncode == -signal.SIGKILL


def test_a_source_whose_library_hangs_closes(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    for key, value in hanging(tmp_path).items():
        monkeypatch.setenv(key, value)
    receiver = LSLReceiver("x")
    source = ReceivedSource("lsl:x", receiver)
    while receiver._process is None:
        time.sleep(0.01)
    time.sleep(0.3)
    source.close()
    assert not source._thread.is_alive()
    assert receiver._process.returncode == -signal.SIGKILL


def test_who_hangs_ends_with_who_started_it(tmp_path: Path) -> None:
    command = [sys.executable, lsl_process.__file__, "name", "x", "attended"]
    pipes = {"stdin": subprocess.PIPE, "stdout": subprocess.PIPE}
    with subprocess.Popen(command, env=hanging(tmp_path), **pipes) as process:
        assert process.stdout is not None
        assert process.stdin is not None
        assert process.stdout.read(lsl_process.HEAD.size)  # it has begun to look
        process.stdin.close()  # as where its parent is killed
        assert process.wait(10.0) == 0


def test_who_pulls_ends_orderly_where_the_library_fails(tmp_path: Path) -> None:
    environment = hanging(tmp_path)
    (tmp_path / "pylsl.py").write_text("def resolve_byprop(*a, **b): raise ValueError('broken')\n")
    command = [sys.executable, lsl_process.__file__, "name", "x", "attended"]
    pipes = {"stdin": subprocess.PIPE, "stdout": subprocess.PIPE, "stderr": subprocess.PIPE}
    with subprocess.Popen(command, env=environment, **pipes) as process:
        assert process.stdout is not None
        assert process.stderr is not None
        said = process.stdout.read()  # while its standard input is open
        assert said.endswith(b"broken") and process.stderr.read() == b""
        assert process.wait(10.0) == 0


def test_time_in_which_a_program_stands_still_is_no_silence(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    """As after Ctrl-Z: who was stopped for a minute has heard nothing for a minute."""
    for key, value in hanging(tmp_path).items():
        monkeypatch.setenv(key, value)
    clock = itertools.count(step=60)
    monkeypatch.setattr(time, "monotonic", lambda: float(next(clock)))
    receiver, inbox = LSLReceiver("x"), Inbox()
    closing = threading.Timer(0.7, inbox.close)
    closing.start()
    with pytest.raises(OSError, match="signal 9"):
        receiver.receive(inbox)


def test_a_description_says_names_and_unit() -> None:
    info = described_info(pylsl, "x", Stream(("A.x", "A.y", "A.z"), 100.0, unit_m=0.001))
    stream, columns = described(info.as_xml())
    assert (stream.channels, stream.rate_hz, stream.unit_m) == (("A.x", "A.y", "A.z"), 100.0, 0.001)
    assert columns == [0, 1, 2]


def test_channels_without_names_are_counted() -> None:
    stream, _ = described(pylsl.StreamInfo("x", "EEG", 2, 0.0, "float32", "x").as_xml())
    assert (stream.channels, stream.rate_hz) == (("channel 0", "channel 1"), 0.0)
    with pytest.raises(ValueError, match="holds text"):
        described(pylsl.StreamInfo("x", "Markers", 1, 0.0, "string", "x").as_xml())


def test_a_stream_needs_a_name_to_be_sent() -> None:
    with pytest.raises(InvalidValueError, match="needs a name"), open_sender("lsl:"):
        pass


def test_a_source_that_finds_nothing_closes() -> None:
    source = open_source("lsl:nothing-of-this-name")
    source.close()
    assert source.ended
