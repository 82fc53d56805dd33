"""A stream kept as XDF: pyxdf, and our reader, read what came."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import pyxdf
from played import Given, blocks, frames_of

from mplearn.errors import InvalidValueError
from mplearn.mocap import open_recording
from mplearn.recording import Recording
from mplearn.sources import Block, Stream, open_source
from mplearn.sources.recorded import RecordedSource


def test_what_comes_is_what_the_file_holds(session: Recording, tmp_path: Path) -> None:
    path = tmp_path / "take.xdf"
    stream = Stream(session.channels, 100.0, unit_m=1.0, subject="An<na>\x07")
    given = blocks(stream, session.frames, size=7)
    with RecordedSource(Given(given), path) as source:
        np.testing.assert_array_equal(frames_of(list(source)), session.frames)
    (theirs,), _ = pyxdf.load_xdf(str(path), verbose=False, dejitter_timestamps=False)
    np.testing.assert_array_equal(theirs["time_series"], session.frames)
    np.testing.assert_allclose(np.diff(theirs["time_stamps"]), 0.01, atol=1e-6)
    assert theirs["footer"]["info"]["sample_count"] == [str(len(session))]
    ours = open_recording(path)
    assert ours.channels == session.channels
    assert ours.rate_hz == pytest.approx(100.0)
    np.testing.assert_array_equal(ours.frames, session.frames)


def test_names_that_change_are_another_stream_of_the_file(tmp_path: Path) -> None:
    stream = Stream(("a", "b"), 50.0)
    frames = np.arange(40.0).reshape(20, 2)
    items = blocks(stream, frames[:10]) + blocks(
        replace(stream, channels=("a", "c")), frames[10:], 10
    )
    with RecordedSource(Given(items), tmp_path / "x.xdf") as source:
        list(source)
    streams, _ = pyxdf.load_xdf(str(tmp_path / "x.xdf"), verbose=False)
    assert [len(each["time_series"]) for each in streams] == [10, 10]


def test_a_file_that_was_never_finished_is_read(tmp_path: Path) -> None:
    path = tmp_path / "take.xdf"
    source = open_source("demonstrator:2", speed=float("inf"), record=path)
    n = 0
    while n < 400:
        n += sum(len(item) for item in source.read() if isinstance(item, Block))
    source._source._file.flush()
    whole = path.read_bytes()
    source.close()
    path.write_bytes(whole[:-1000])
    with pytest.warns(match="cut off"):
        cut = open_recording(path)
    assert 100 < len(cut) <= n + 100


def test_only_xdf_is_written(tmp_path: Path) -> None:
    with pytest.raises(InvalidValueError, match=r"named .xdf, not 'a.bvh'"):
        open_source("udp:0", record=tmp_path / "a.bvh")
