"""OptiTrack Motive, by a server of ours."""

import threading
import time
from pathlib import Path

import numpy as np
import pytest
from natnet_server import NatNetServer
from played import frames_of, texts_of
from servers import gather, keep_up, learned, learned_from

from mplearn.recording import FloatArray, Recording
from mplearn.sources import Source, open_source

pytest.importorskip("natnet")


def as_sent(markers: FloatArray) -> FloatArray:
    """Return what a file of the same frames holds, shape (T, 3 M) [m]."""
    return markers.astype("f4").astype(float).reshape(len(markers), -1)


def collect(
    source: Source, server: NatNetServer, markers: FloatArray, first: int = 0, lost: int = 0
) -> list:
    def send() -> None:
        assert server.asked.wait(60.0)
        for i, frame in enumerate(markers):
            at = first + i
            server.send({"Anna": np.nan_to_num(frame)}, 1000 + at, 5.0 + at / 100.0)
            keep_up(source, before + i)

    before = source.tally.frames
    thread = threading.Thread(target=send)
    items = gather(source, thread.start, len(markers) + lost)
    thread.join()
    return items


def test_what_is_streamed_is_learned_bit_for_bit(session: Recording, tmp_path: Path) -> None:
    with NatNetServer({"Anna": session.marker_names}) as server, open_source(server.name) as source:
        items = collect(source, server, session.markers)
    expected = as_sent(session.markers)
    np.testing.assert_array_equal(frames_of(items), expected)
    reference = learned_from(expected, session.channels, 100.0, tmp_path / "file")
    assert learned(items, tmp_path / "live") == reference
    assert source.tally.faults() == {}


def test_what_is_tracked_may_change(session: Recording) -> None:
    markers = np.nan_to_num(session.markers[:400], nan=0.5)
    with NatNetServer({"Anna": session.marker_names}) as server, open_source(server.name) as source:
        items = collect(source, server, markers[:200])
        server.asked.clear()
        server.sets["Ben"] = session.marker_names
        both = {"Anna": markers[200], "Ben": markers[200] + 1.0}
        server.send(both, 1200, 7.0, changed=True)
        assert server.asked.wait(10.0)
        time.sleep(0.05)

        def send() -> None:
            for i in range(201, 400):
                both = {"Anna": markers[i], "Ben": markers[i] + 1.0}
                server.send(both, 1000 + i, 5.0 + i / 100.0)

        items += gather(source, send, 200)
    frames = frames_of(items)
    assert np.isnan(frames[200]).all()
    np.testing.assert_array_equal(np.delete(frames, 200, 0), np.delete(as_sent(markers), 200, 0))
    assert texts_of(items, "subject") == ["'Ben' appeared in the stream"]
    assert (source.tally.unnamed, source.tally.lost) == (1, 1)


def test_a_server_that_comes_back_is_heard_again(
    session: Recording, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("mplearn.sources.protocols.natnet.GONE_S", 0.5)
    with NatNetServer({"Anna": session.marker_names}) as server, open_source(server.name) as source:
        items = collect(source, server, session.markers[:150])
        server.silent = True
        time.sleep(0.7)
        server.asked.clear()
        server.silent = False
        items += collect(source, server, session.markers[230:300], first=230, lost=80)
    frames = frames_of(items)
    assert np.isnan(frames[150:230]).all()
    np.testing.assert_array_equal(frames[230:], as_sent(session.markers[230:300]))
    assert "no Motive answers" in texts_of(items, "disconnected")[0]
    assert source.tally.reconnected == 1
    assert source.tally.lost == 80


def test_packets_that_cannot_be_read_are_counted(session: Recording) -> None:
    with NatNetServer({"Anna": session.marker_names}) as server, open_source(server.name) as source:
        items = collect(source, server, session.markers[:150])
        for data in (b"", b"\x07", b"\x07\0\xff\xff" + b"\xff" * 50, b"\x05\0\x01\0\x01"):
            server._socket.sendto(data, server._client)
        items += collect(source, server, session.markers[150:200], first=150)
    assert len(frames_of(items)) == 200
    assert source.tally.damaged == 4
