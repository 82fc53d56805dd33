"""Packets that were cut or flipped on their way: each is counted, and none ends anything."""

import asyncio
import itertools
import random
import struct
import time
from collections.abc import Callable, Sequence
from xml.etree import ElementTree

import numpy as np
import pytest
import qtm_server
from natnet_server import FRAME, MODELS, NatNetServer, frame_content, packet
from qtm_server import COMMAND, DATA, EVENT, QTMServer

from mplearn.recording import Recording
from mplearn.sources import Change, Source, Stream, open_source
from mplearn.sources.inbox import Inbox, News, Sample
from mplearn.sources.protocols import lsl, qtm
from mplearn.sources.protocols.datagrams import DatagramReceiver
from mplearn.sources.protocols.lines import frame_line, header_line
from mplearn.sources.protocols.own import UDPReceiver
from mplearn.sources.protocols.vmc import VMCReceiver
from mplearn.sources.protocols.xsens import XsensReceiver

HERE = ("127.0.0.1", 0)
ODD = [struct.pack(">f", value) for value in (np.nan, np.inf, -np.inf, 3e38)]
ODD += [each[::-1] for each in ODD] + [b"\xff" * 4, b"\0" * 4, b"\x80\0\0\0"]


def mutated(data: bytes, rng: random.Random) -> bytes:
    """Return a packet as a broken sender, or a hostile one, would send it."""
    found, at = bytearray(data), rng.randrange(len(data))
    match rng.randrange(6):
        case 0:
            del found[at:]
        case 1:
            for _ in range(rng.randrange(1, 8)):
                found[rng.randrange(len(found))] = rng.randrange(256)
        case 2:
            found += rng.randbytes(rng.randrange(1, 50))
        case 3:
            found[at : at + 4] = rng.choice(ODD)
        case 4:
            found[rng.randrange(min(40, len(found)))] = rng.randrange(256)
        case _:
            del found[at : at + rng.randrange(1, 60)]
    return bytes(found)


def taken(receiver: DatagramReceiver, packets: Sequence[bytes]) -> tuple[list[Sample], int]:
    """Return the frames that packets hold, and how many of the packets could not be read."""
    inbox, damaged = Inbox(100_000), 0
    for number, data in enumerate(packets):
        try:
            receiver.take(data, HERE, 0.01 * number, inbox)
        except Exception:  # as the receiver's thread does
            damaged += 1
    items = inbox.take(0.0)
    damaged += sum(item.count for item in items if isinstance(item, News))
    return [item for item in items if isinstance(item, Sample)], damaged


def lines(session: Recording) -> list[bytes]:
    stream = Stream(session.channels, session.rate_hz, unit_m=1.0, up="z")
    rows = enumerate(session.frames[:150])
    return [header_line(stream) + frame_line(row, i, i / 100.0) for i, row in rows]


def suit(_: Recording) -> list[bytes]:
    from test_xsens import datagram, person

    places, turns = person()
    return [datagram(places[i], turns[i], i) for i in range(150)]


def avatar(_: Recording) -> list[bytes]:
    pytest.importorskip("pythonosc")
    from test_vmc import bundle

    return [bundle(i) for i in range(150)]


@pytest.mark.parametrize(
    ("kind", "sent"), [(UDPReceiver, lines), (XsensReceiver, suit), (VMCReceiver, avatar)]
)
def test_after_broken_packets_whole_ones_are_read_as_before(
    kind: type[DatagramReceiver], sent: Callable[[Recording], list[bytes]], session: Recording
) -> None:
    good = sent(session)
    rng = random.Random(0)
    amid = [each for data in good[:-20] for each in (data, mutated(data, rng), mutated(data, rng))]
    clean, broken = kind(HERE), kind(HERE)
    try:
        expected, none = taken(clean, good)
        found, damaged = taken(broken, amid + good[-20:])
    finally:
        clean.close(), broken.close()
    assert none == 0 < damaged < 260
    for one, other in zip(expected[-10:], found[-10:], strict=True):
        assert one.stream.channels == other.stream.channels
        assert (one.number, one.time_s) == (other.number, other.time_s)
        np.testing.assert_array_equal(one.values, other.values)
    if kind is not VMCReceiver:  # whose frames may be spread over many packets
        whole = {each.values.tobytes() for each in found}
        assert all(each.values.tobytes() in whole for each in expected)


def read_until(source: Source, done: Callable[[], bool], seconds: float = 60.0) -> None:
    """Read until something is so."""
    said: list[str] = []
    until = time.monotonic() + seconds
    while not done():
        said += [item.text for item in source.read(0.01) if isinstance(item, Change)]
        assert time.monotonic() < until, said


def test_broken_packets_of_motive_end_nothing(session: Recording) -> None:
    pytest.importorskip("natnet")
    markers, rng, numbers = np.nan_to_num(session.markers), random.Random(0), itertools.count()
    names = b"Anna\0" + struct.pack("<I", 2**32 - 1)  # so many, and none of them comes
    endless = packet(MODELS, struct.pack("<III", 1, 0, len(names)) + names)
    with NatNetServer({"Anna": session.marker_names}) as server, open_source(server.name) as source:
        read_until(source, server.asked.is_set)

        def whole() -> bool:
            i = next(numbers)
            server.send({"Anna": markers[i % len(markers)]}, i, i / 100.0)
            return source.tally.frames >= 120

        server.send_raw(endless)
        for i in range(150):
            frame = packet(FRAME, frame_content({"Anna": markers[i]}, 5000 + i, 50.0 + i / 100.0))
            for data in (frame, frame, server.models()):
                server.send_raw(mutated(data, rng))
            source.read(0.0)
        read_until(source, whole)
        assert source.tally.damaged > 100


def test_a_broken_packet_of_qtm_is_counted_and_the_connection_stays(
    session: Recording, capfd: pytest.CaptureFixture[str]
) -> None:
    pytest.importorskip("qtm_rt")
    markers = np.nan_to_num(session.markers[:120]) * 1000.0
    with QTMServer(session.marker_names) as server, open_source(server.name) as source:
        assert server.streaming.wait(10.0)
        for i, frame in enumerate(markers):
            server.send(frame, i, i / 100.0)
            server.send(frame, i, i / 100.0, more=7)
        read_until(source, lambda: source.tally.frames + source.tally.lost >= len(markers))
    assert source.tally.faults() == {"damaged": len(markers)}
    assert capfd.readouterr() == ("", "")


def test_a_qtm_that_says_nothing_and_answers_nothing_is_connected_to_again(
    session: Recording, monkeypatch: pytest.MonkeyPatch
) -> None:
    pytest.importorskip("qtm_rt")
    monkeypatch.setattr(qtm, "SILENT_S", 0.3)
    monkeypatch.setattr(qtm, "TIMEOUT_S", 0.3)
    markers, numbers = np.nan_to_num(session.markers[0]) * 1000.0, itertools.count()
    with QTMServer(session.marker_names) as server, open_source(server.name) as source:
        assert server.streaming.wait(10.0)

        def sent() -> bool:
            if server.streaming.is_set():
                i = next(numbers)
                server.send(markers, i, i / 100.0)
            return source.tally.frames >= 110

        read_until(source, sent)
        server.deaf = True
        server.streaming.clear()
        changes: list[str] = []
        while not any("does not answer" in text for text in changes):
            changes += [item.text for item in source.read(0.01) if isinstance(item, Change)]
            assert len(changes) < 9, changes
        server.deaf = False
        before = source.tally.frames
        read_until(source, lambda: sent() and source.tally.frames > before + 10)
        assert source.tally.reconnected == 1


class Connection:
    """What a client does with its connection."""

    aborted = False

    def write(self, data: bytes) -> None: ...

    def abort(self) -> None:
        self.aborted = True


def test_whole_packets_of_qtm_are_read_between_any_broken_ones(session: Recording) -> None:
    """Whatever pieces they come in; a size that no packet has ends the connection."""
    protocol = pytest.importorskip("qtm_rt.protocol")
    markers, rng = np.nan_to_num(session.markers[:200]) * 1000.0, random.Random(0)
    frames, broken, connection = [], [], Connection()
    sent = b""

    def client() -> qtm.WholePackets:
        inner = protocol.QTMProtocol(loop=asyncio.new_event_loop(), on_disconnect=None)
        inner.on_packet, inner.on_event = frames.append, lambda event: None
        inner.loop.close()
        whole = qtm.WholePackets(inner, broken.append)
        whole.connection_made(connection)
        return whole

    for i in range(2000):
        content = qtm_server.frame_content(markers[i % 200], i, i / 100.0)
        bad = qtm_server.packet(DATA, mutated(content, rng))
        sent += qtm_server.packet(DATA, content)
        sent += bad if i % 2 else qtm_server.packet(rng.randrange(9), rng.randbytes(i % 40))
    sent += qtm_server.packet(EVENT, bytes([11])) + qtm_server.packet(EVENT, b"")
    endless = struct.pack("<qII", 0, 0, 2**32 - 1)
    sent += qtm_server.packet(DATA, endless + struct.pack("<II", 0, 1))
    sent += qtm_server.packet(DATA, endless + struct.pack("<II", 8, 1) * 9)
    whole = client()
    while sent:
        piece = rng.randrange(1, 5000)
        whole.data_received(sent[:piece])
        sent = sent[piece:]
    assert not connection.aborted
    assert 500 < len(broken) < 2000
    assert "its component 9 has 0 bytes, where 0 are left" in repr(broken[-1])
    found = {packet.data for packet in frames}
    expected = [qtm_server.frame_content(markers[i % 200], i, i / 100.0) for i in range(2000)]
    assert all(each in found for each in expected)
    for size in (0, 7, qtm.LARGEST + 1, 2**32 - 1):
        connection.aborted, n_bad = False, len(broken)
        whole = client()
        whole.data_received(struct.pack("<II", size, COMMAND) * 3)
        assert connection.aborted
        assert f"its size is {size} bytes" in repr(broken[-1])
        assert len(broken) == n_bad + 1


def test_a_qtm_that_speaks_nonsense_is_connected_to_again(
    session: Recording, monkeypatch: pytest.MonkeyPatch
) -> None:
    pytest.importorskip("qtm_rt")
    monkeypatch.setattr(qtm, "TIMEOUT_S", 0.3)
    markers, numbers = np.nan_to_num(session.markers[0]) * 1000.0, itertools.count()
    with QTMServer(session.marker_names) as server, open_source(server.name) as source:

        def whole() -> bool:
            if server.streaming.is_set():
                i = next(numbers)
                server.send(markers, i, i / 100.0)
            return source.tally.frames >= 120 * (source.tally.reconnected + 1)

        read_until(source, whole)
        for k, nonsense in enumerate((struct.pack("<II", 0, COMMAND), b"HTTP/1.1 400\r\n\r\n")):
            server.streaming.clear()
            server.send_raw(nonsense)
            read_until(source, lambda k=k: whole() and source.tally.reconnected > k)
        assert source.tally.damaged == 2
        server.deaf = True
        server.drop()
        begin = time.monotonic()
    assert time.monotonic() - begin < 5.0  # nobody waits for its answer


def test_broken_descriptions_of_lab_streams_are_refused_or_read() -> None:
    pylsl, rng = pytest.importorskip("pylsl"), random.Random(0)
    names = tuple(f"M{k}.{axis}" for k in range(20) for axis in "xyz")
    xml = lsl.described_info(pylsl, "walk", Stream(names, 100.0, unit_m=0.001)).as_xml()
    assert lsl.described(xml)[0].channels == names
    read = refused = 0
    for _ in range(1000):
        try:
            stream, columns = lsl.described(mutated(xml.encode(), rng).decode(errors="replace"))
        except (ValueError, ElementTree.ParseError):  # told, and it is tried again
            refused += 1
        else:
            read += 1
            assert len(stream.channels) == len(columns) <= 60
    assert refused > 100 and read > 50
    for number in ("0", "-1", "999999999", "60.5"):
        odd = xml.replace("<channel_count>60<", f"<channel_count>{number}<")
        with pytest.raises(ValueError, match=r"channels: 1 to|invalid literal"):
            lsl.described(odd)
