"""Recordings and the demonstrator, at their own pace."""

import threading
import time
from itertools import islice
from pathlib import Path

import numpy as np
import pytest
from played import frames_of, learn, texts_of

from mplearn import LearnerConfig, MotionLearner
from mplearn.anatomy import as_bodies
from mplearn.demonstrator import Demonstrator
from mplearn.errors import InvalidValueError, MPLearnError
from mplearn.mocap import Hints, open_recording
from mplearn.recording import Recording
from mplearn.sources import Block, Source, Stream, open_source, register_source, source_kinds
from mplearn.sources.played import PlayedSource

FAST = float("inf")


def csv(recording: Recording, path: Path) -> Path:
    header = ",".join(["Time", *recording.channels])
    rows = [
        ",".join(
            [f"{i / recording.rate_hz:.6f}", *("" if np.isnan(v) else repr(float(v)) for v in f)]
        )
        for i, f in enumerate(recording.frames)
    ]
    path.write_text("\n".join([header, *rows]))
    return path


def test_what_is_learned_from_a_played_file_is_what_is_learned_from_the_file(
    session: Recording, tmp_path: Path
) -> None:
    path = csv(session, tmp_path / "session.csv")
    recording = as_bodies([open_recording(path, positions=True, hints=Hints(joint_axes=True))])
    learner = MotionLearner(
        LearnerConfig(recording.recordings[0].channels, recording.recordings[0].rate_hz)
    )
    expected = [e for each in learner.learn_recording(recording.recordings[0]) for e in each]
    with open_source(f"recording:{path}", speed=FAST) as source:
        live, events = learn(source)
    assert events == expected
    assert len(live.snapshot()) >= 2
    assert live.save(tmp_path / "a").read_bytes() == learner.save(tmp_path / "b").read_bytes()


def test_the_demonstrator_is_handed_out_frame_for_frame() -> None:
    with open_source("demonstrator:5", speed=FAST) as source:
        seen = frames_of(list(islice(source, 12)))
    expected = np.array([*islice(Demonstrator(seed=5).stream(), len(seen))])
    assert len(seen) >= 300
    np.testing.assert_array_equal(seen, expected)


def test_a_stream_is_played_at_its_pace() -> None:
    stream, frames = Stream(("a", "b"), 100.0), np.arange(60.0).reshape(30, 2)
    with PlayedSource(stream, [frames[:11], frames[11:]], speed=2.0) as source:
        begin = time.monotonic()
        items = [item for item in source if isinstance(item, Block)]
        took = time.monotonic() - begin
    assert took >= 29 / 200.0
    np.testing.assert_array_equal(frames_of(items), frames)
    arrived = np.concatenate([item.arrived_s for item in items])
    np.testing.assert_allclose(np.diff(arrived), 1 / 200.0)
    assert [item.joins for item in items] == [False] + [True] * (len(items) - 1)


def test_nothing_is_dropped_for_a_slow_reader_and_it_is_said() -> None:
    frames = np.arange(2000.0)[:, None]
    with PlayedSource(Stream(("a",), 100.0), [frames], speed=10.0) as source:
        items = source.read()
        source._began_s -= 1.5  # the reader sleeps
        items += list(source)
    np.testing.assert_array_equal(frames_of(items), frames)
    said = texts_of(items, "behind")
    assert len(said) == 2
    assert "after they came" in said[0]
    assert "again" in said[1]


@pytest.mark.parametrize("name", ["demonstrator", "demonstrator:3"])
def test_a_source_is_closed_from_another_thread(name: str) -> None:
    source = open_source(name, speed=0.01)
    threading.Timer(0.1, source.close).start()
    for _ in source:  # by itself it goes on a hundred times as long as the motion
        pass
    assert source.ended
    assert source.read() == []


def test_a_read_waits_no_longer_than_asked() -> None:
    with PlayedSource(Stream(("a",), 1.0), [np.zeros((5, 1))]) as source:
        assert len(source.read()) == 1
        assert source.read(0.01) == []
        assert source.read(0.0) == []


@pytest.mark.parametrize(
    ("name", "options", "message"),
    [
        ("recording", {}, "needs a file"),
        ("recording:nowhere.bvh", {}, "no such file"),
        ("demonstrator:x", {}, "a seed"),
        ("demonstrator", {"speed": 0.0}, "speed must be positive, not 0"),
        ("demonstrator", {"speed": float("nan")}, "speed must be positive"),
        ("demonstrator", {"colour": 1}, "no option 'colour'; it has speed, rate_hz"),
        ("radio:4", {}, "begins with one of demonstrator:"),
        ("", {}, "begins with one of"),
        ("demonstrator", {"observe": "dreams"}, "observe must be one of"),
    ],
)
def test_what_cannot_be_opened_is_refused(name: str, options: dict, message: str) -> None:
    with pytest.raises(MPLearnError, match=message):
        open_source(name, **options)


def test_a_source_of_a_users_own() -> None:
    def mine(address: str, wanted: object, *, n: int = 3) -> Source:
        """Numbers of mine."""
        return PlayedSource(Stream((address,), 50.0), [np.ones((n, 1))], FAST, f"mine:{address}")

    register_source("mine", mine)
    with open_source("mine:a", n=4) as source:
        (block,) = source
        assert source.name == "mine:a"
    assert isinstance(block, Block)
    assert (block.channels, block.rate_hz, len(block)) == (("a",), 50.0, 4)
    assert source_kinds()["mine"] == "Numbers of mine."
    with pytest.raises(InvalidValueError, match="lower case, not 'My Suit'"):
        register_source("My Suit", mine)
