"""Our JSON lines over UDP, TCP and pipes: from a sender to what is learned."""

import io
import json
import os
import socket
import threading
import time
from contextlib import suppress
from pathlib import Path

import numpy as np
import pytest
from played import frames_of, texts_of
from servers import gather, learned

from mplearn.errors import InvalidValueError
from mplearn.recording import Recording, Skeleton, marker_channels
from mplearn.sources import Block, Source, Stream, open_source
from mplearn.sources.inbox import Sample
from mplearn.sources.played import PlayedSource
from mplearn.sources.protocols.addresses import host_and_port
from mplearn.sources.protocols.lines import LineParser, frame_line, header_line
from mplearn.sources.protocols.own import PipeReceiver
from mplearn.sources.received import ReceivedSource
from mplearn.sources.sending import LineSender, open_sender, send

FAST = 20.0  # times real time


def played(recording: Recording, speed: float = FAST) -> Source:
    stream = Stream(recording.channels, recording.rate_hz, unit_m=1.0, up="z")
    return PlayedSource(stream, [recording.frames], speed)


@pytest.mark.parametrize("kind", ["udp", "ndjson"])
def test_what_is_sent_is_learned_bit_for_bit(
    kind: str, session: Recording, learned_session: bytes, tmp_path: Path
) -> None:
    with open_source(f"{kind}:0") as source, open_sender(source.name) as sender:
        thread = threading.Thread(target=send, args=(played(session), sender))
        items = gather(source, thread.start, len(session))
        thread.join()
    np.testing.assert_array_equal(frames_of(items), session.frames)
    assert learned(items, tmp_path / "live") == learned_session
    assert source.tally.faults() == {}


def test_a_pipe_ends_and_nothing_is_dropped_for_a_slow_reader() -> None:
    read, write = os.pipe()
    source = ReceivedSource("ndjson:-", PipeReceiver(read))
    frames = np.arange(6000.0)[:, None]

    def fill() -> None:
        with os.fdopen(write, "wb") as out:
            send(PlayedSource(Stream(("a",), 100.0), [frames], np.inf), LineSender(out.write))

    thread = threading.Thread(target=fill)
    thread.start()
    time.sleep(0.3)  # more comes than may wait
    items = list(source)
    thread.join()
    os.close(read)
    np.testing.assert_array_equal(frames_of(items), frames)
    assert source.tally.faults() == {}
    assert source.ended


def test_lines_of_a_file() -> None:
    out = io.BytesIO()
    stream = Stream(("a", "b"), 50.0)
    block = Block(stream, np.array([[1.5, np.nan]]), np.array([0.02]), np.array([0.0]))
    LineSender(out.write).send(block)
    header, frame = out.getvalue().splitlines()
    assert json.loads(header) == {
        "mplearn": 1,
        "stream": 0,
        "rate_hz": 50.0,
        "channels": ["a", "b"],
    }
    assert json.loads(frame) == {"n": 1, "t": 0.02, "v": [1.5, None]}


def test_headers_say_all_of_a_stream() -> None:
    skeleton = Skeleton(
        ("hip", "knee", "toe"), (-1, 0, 1), np.arange(9.0).reshape(3, 3), (False, False, True)
    )
    channels = marker_channels(skeleton.names)
    stream = Stream(channels, 60.0, skeleton, 0.001, "-y", "Anna")
    read = LineParser().parse(header_line(stream), 0.0)
    assert isinstance(read, Stream)
    assert read.skeleton is not None
    assert (read.skeleton.names, read.skeleton.parents, read.skeleton.ends) == (
        skeleton.names,
        skeleton.parents,
        skeleton.ends,
    )
    np.testing.assert_array_equal(read.skeleton.offsets, skeleton.offsets)
    assert (read.channels, read.rate_hz, read.unit_m, read.up, read.subject) == (
        channels,
        60.0,
        0.001,
        "-y",
        "Anna",
    )


def test_an_equal_header_is_the_same_stream() -> None:
    parser, line = LineParser(), header_line(Stream(("a",), 100.0))
    assert parser.parse(line, 0.0) is parser.parse(line, 1.0)
    sample = parser.parse(frame_line(np.ones(1), 3, 0.5), 2.0)
    assert isinstance(sample, Sample)
    assert (sample.number, sample.time_s, sample.arrived_s) == (3, 0.5, 2.0)


@pytest.mark.parametrize(
    "line",
    [
        b"[]",
        b"{",
        b"\xff\xfe",
        b"[" * 100_000,
        b'{"mplearn": 2, "channels": ["a"]}',
        b'{"mplearn": 1}',
        b'{"mplearn": 1, "channels": ["a"], "markers": ["b"]}',
        b'{"mplearn": 1, "channels": []}',
        b'{"mplearn": 1, "channels": [1]}',
        b'{"mplearn": 1, "channels": ["a"], "rate_hz": -1}',
        b'{"mplearn": 1, "channels": ["a"], "rate_hz": NaN}',
        b'{"mplearn": 1, "channels": ["a"], "rate_hz": 1e-300}',
        b'{"mplearn": 1, "channels": ["a", "b", "a"], "rate_hz": 100}',
        b'{"mplearn": 1, "channels": ["a"], "rate_hz": "100"}',
        b'{"mplearn": 1, "channels": ["a"], "unit": "parsec"}',
        b'{"mplearn": 1, "channels": ["a"], "unit_m": -1}',
        b'{"mplearn": 1, "channels": ["a"], "up": "w"}',
        b'{"mplearn": 1, "channels": ["a"], "subject": 4}',
        b'{"mplearn": 1, "joints": ["a"]}',
        b'{"mplearn": 1, "joints": ["a"], "parents": [4], "offsets": [[0, 0, 0]]}',
        b'{"stream": "x", "v": [1]}',
        b'{"v": [1]}',
        b'{"stream": 1, "v": 1}',
        b'{"stream": 1, "v": [[1]]}',
        b'{"stream": 1, "v": [{}]}',
        b'{"stream": 1, "v": [1e999, ' + b"9" * 400 + b"]}",
        b'{"stream": 1, "v": [1], "n": 1.5}',
        b'{"stream": 1, "v": [1], "t": "now"}',
        b'{"stream": 1, "v": [1], "t": Infinity}',
        b'{"stream": 1, "v": [1], "t": 1' + b"0" * 400 + b"}",
        b'{"stream": 1, "v": [1], "n": 1' + b"0" * 400 + b"}",
        b'{"stream": 1, "v": [1], "n": -1' + b"0" * 30 + b"}",
        b'{"mplearn": 1, "joints": ["a"], "parents": [1e400], "offsets": [[0, 0, 0]]}',
        b'{"mplearn": 1, "joints": ["a"], "parents": [0], "offsets": [[1' + b"0" * 400 + b",0,0]]}",
    ],
)
def test_a_line_that_cannot_be_read_costs_nothing_else(line: bytes) -> None:
    header = b'{"mplearn": 1, "stream": 1, "channels": ["a"], "rate_hz": 100}\n'
    good = b'{"stream": 1, "n": %d, "v": [%d]}\n'
    with open_source("udp:0") as source:
        host, port = host_and_port(source.name[4:], 0)
        with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as out:
            for data in (header, good % (0, 5), line[:60_000], good % (1, 6), good % (2, 7)):
                out.sendto(data, (host, port))
        items = gather(source, lambda: None, 3)
    assert frames_of(items)[:, 0].tolist() == [5, 6, 7]
    assert source.tally.damaged + source.tally.unnamed == 1
    assert texts_of(items, "damaged") or texts_of(items, "names")


def test_frames_before_their_header_are_said_once_and_counted() -> None:
    header = b'{"mplearn": 1, "channels": ["a"], "rate_hz": 100}\n'
    lines = [b'{"n": %d, "v": [5]}\n' % n for n in range(9)]
    with open_source("udp:0") as source:
        host, port = host_and_port(source.name[4:], 0)
        with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as out:
            for data in (*lines[:6], header, *lines[6:]):
                out.sendto(data, (host, port))
                time.sleep(0.005)
        items = gather(source, lambda: None, 3)
    assert len(frames_of(items)) == 3
    assert source.tally.unnamed == 6
    assert len(texts_of(items, "names")) == 1


def test_a_sender_that_comes_back_goes_on(session: Recording) -> None:
    with open_source("ndjson:0") as source:
        items = []
        for start, end in ((0, 150), (180, 300)):
            with open_sender(source.name) as sender:
                stream = Stream(session.channels, 100.0, unit_m=1.0, up="z")
                times = np.arange(start, end) / 100.0
                sender.send(Block(stream, session.frames[start:end], times, times))
                items += gather(source, lambda: None, 0)
            until = time.monotonic() + 10
            while time.monotonic() < until and not texts_of(items, "disconnected")[start // 180 :]:
                items += source.read(0.1)
    frames = frames_of(items)
    np.testing.assert_array_equal(frames[:150], session.frames[:150])
    assert np.isnan(frames[150:180]).all()
    np.testing.assert_array_equal(frames[180:], session.frames[180:300])
    assert source.tally.faults() == {"lost": 30, "reconnected": 1}


def test_a_second_sender_is_turned_away_and_said() -> None:
    with (
        open_source("ndjson:0", observe="channels") as source,
        open_sender(source.name) as first,
        open_sender(source.name) as second,
    ):
        stream = Stream(("a",), 100.0)
        for i in range(3):
            one = Block(stream, np.full((1, 1), float(i)), np.array([i / 100]), np.zeros(1))
            first.send(one)
            with suppress(OSError):
                second.send(one)
        items = gather(source, lambda: None, 3)
        until = time.monotonic() + 5
        while not texts_of(items, "subject") and time.monotonic() < until:
            items += source.read(0.1)
    assert frames_of(items)[:, 0].tolist() == [0, 1, 2]
    assert "turned away" in texts_of(items, "subject")[0]


def test_silence_is_said() -> None:
    with open_source("udp:0", observe="channels") as source, open_sender(source.name) as sender:
        one = Block(Stream(("a",), 100.0), np.ones((1, 1)), np.zeros(1), np.zeros(1))
        sender.send(one)
        gather(source, lambda: None, 1)
        source._source._looked_s -= 3.0  # who reads was held up, which is no silence
        source._source._read_s -= 3.0
        assert not texts_of(source.read(0.0), "disconnected")
        source._source._read_s -= 2.0
        items = source.read(0.0)
        assert texts_of(items, "disconnected") == ["nothing has come for 1 s"]
        later = Block(one.stream, one.frames, np.array([0.01]), np.zeros(1))
        items = gather(source, lambda: sender.send(later), 1)
    assert texts_of(items, "connected")[0].startswith("frames come again, after")


@pytest.mark.parametrize(
    "name", ["udp:70000", "udp:x:y", "ndjson:no.such.host.invalid:1", "udp:-1"]
)
def test_an_address_that_is_none_is_refused(name: str) -> None:
    with pytest.raises(InvalidValueError):
        open_source(name)


def test_a_port_that_is_taken_is_refused() -> None:
    with open_source("udp:0") as source, pytest.raises(InvalidValueError, match="cannot listen at"):
        open_source(source.name)


@pytest.mark.parametrize("to", ["radio:4", "", "udp:x:99999", "ndjson:127.0.0.1:1"])
def test_nowhere_to_send_is_refused(to: str) -> None:
    with pytest.raises(InvalidValueError), open_sender(to):
        pass


def test_addresses() -> None:
    assert host_and_port("", 5, host="h") == ("h", 5)
    assert host_and_port("7", 5, host="h") == ("h", 7)
    assert host_and_port("a.b:7", 5) == ("a.b", 7)
    assert host_and_port("[::1]:7", 5) == ("::1", 7)
    assert host_and_port("::1", 5) == ("::1", 5)
