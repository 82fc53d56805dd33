"""Qualisys Track Manager, by a server of ours."""

import threading
import time
from pathlib import Path

import numpy as np
import pytest
from played import frames_of, texts_of
from qtm_server import QTMServer, as_sent
from servers import gather, learned, learned_from

from mplearn.recording import Recording
from mplearn.sources import Source, open_source
from mplearn.sources.protocols.qtm import described

pytest.importorskip("qtm_rt")


def sent(server: QTMServer, markers: np.ndarray, first: int = 0) -> None:
    assert server.streaming.wait(10.0)
    for i, frame in enumerate(markers):
        at = first + i
        server.send(frame * 1000.0, at, at / 100.0)
        if i % 20 == 19:
            time.sleep(0.01)


def collect(
    source: Source, server: QTMServer, markers: np.ndarray, first: int = 0, lost: int = 0
) -> list:
    thread = threading.Thread(target=sent, args=(server, markers, first))
    items = gather(source, thread.start, len(markers) + lost)
    thread.join()
    return items


def test_what_is_streamed_is_learned_bit_for_bit(session: Recording, tmp_path: Path) -> None:
    with QTMServer(session.marker_names) as server, open_source(server.name) as source:
        items = collect(source, server, session.markers)
    expected = as_sent(session.markers)
    np.testing.assert_array_equal(frames_of(items), expected)
    reference = learned_from(expected, session.channels, 100.0, tmp_path / "file")
    assert learned(items, tmp_path / "live") == reference
    assert source.tally.faults() == {}


def test_labels_that_change_are_asked_for_again(session: Recording) -> None:
    markers = np.nan_to_num(session.markers[:400], nan=0.5)
    names = list(session.marker_names)
    with QTMServer(names) as server, open_source(server.name) as source:
        items = collect(source, server, markers[:200])
        server.relabel([*names[:5], "other", *names[6:]])
        time.sleep(0.5)
        items += collect(source, server, markers[200:], first=200)
    frames = frames_of(items)
    np.testing.assert_array_equal(frames, as_sent(markers))
    assert f"{names[5]} to other" in texts_of(items, "names")[0]


def test_a_dropped_connection_is_made_again(session: Recording) -> None:
    with QTMServer(session.marker_names) as server, open_source(server.name) as source:
        items = collect(source, server, session.markers[:200])
        server.drop()
        items += collect(source, server, session.markers[250:400], first=250, lost=50)
    frames = frames_of(items)
    np.testing.assert_array_equal(frames[:200], as_sent(session.markers[:200]))
    assert np.isnan(frames[200:250]).all()
    np.testing.assert_array_equal(frames[250:], as_sent(session.markers[250:400]))
    assert source.tally.lost == 50
    assert source.tally.reconnected == 1
    assert texts_of(items, "disconnected")


def test_nobody_there_is_said_and_waited_for(session: Recording) -> None:
    with open_source("qtm:127.0.0.1:1") as source:
        items = source.read(5.0)
        assert (
            "no Qualisys Track Manager answers at 127.0.0.1:1" in texts_of(items, "disconnected")[0]
        )


def test_settings() -> None:
    stream = described(
        "<Q><General><Frequency>240</Frequency></General><The_3D><AxisUpwards>-Y</AxisUpwards>"
        "<Label><Name>A</Name></Label><Label><Name/></Label></The_3D></Q>"
    )
    assert (stream.points, stream.rate_hz, stream.up, stream.unit_m) == (
        ("A", ""),
        240.0,
        "-y",
        1e-3,
    )
    for wrong in ("<Q/>", "<Q>", ""):
        with pytest.raises(ValueError, match=r"no labelled markers|cannot be read"):
            described(wrong)
