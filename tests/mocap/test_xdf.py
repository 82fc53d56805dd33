"""XDF: what pyxdf reads is what we read."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
import pyxdf
from mocap_writers import person, write_xdf

from mplearn.errors import RecordingError, RecordingWarning
from mplearn.mocap import open_recording


@pytest.mark.parametrize("typed", [True, False])
@pytest.mark.parametrize("jitter_s", [0.0, 0.003])
def test_as_pyxdf_reads_it(tmp_path: Path, typed: bool, jitter_s: float) -> None:
    points = person(300, 6)
    times = 50.0 + np.arange(300) / 120.0
    times += np.random.default_rng(0).normal(0.0, jitter_s, 300) if jitter_s else 0.0
    times[150:] += 10.0  # the stream stood still
    path = write_xdf(tmp_path / "a.xdf", points, rate_hz=120.0, times=times, typed=typed)
    streams, _ = pyxdf.load_xdf(str(path), verbose=False)
    theirs = next(s for s in streams if s["info"]["type"] == ["MoCap"])
    recording = open_recording(path)
    assert recording.marker_names == tuple(f"M{i}" for i in range(6))
    assert recording.rate_hz == pytest.approx(theirs["info"]["effective_srate"], rel=2e-3)
    seen = ~np.isnan(recording.frames).any(axis=1)
    assert np.array_equal(recording.frames[seen], theirs["time_series"].astype(np.float64))
    at = theirs["time_stamps"] - theirs["time_stamps"][0]
    ours = np.flatnonzero(seen) / recording.rate_hz
    assert np.abs(ours - at).max() < 0.03


@pytest.mark.filterwarnings("ignore::mplearn.errors.RecordingWarning")
def test_millimetres_y_up_and_a_cut_file(tmp_path: Path) -> None:
    points = person(40, 6)
    y_up = np.stack([points[..., 0], points[..., 2], -points[..., 1]], axis=-1)
    path = write_xdf(tmp_path / "a.xdf", 1000.0 * y_up, units="millimeters")
    assert open_recording(path).markers == pytest.approx(points, abs=1e-4)
    path.write_bytes(path.read_bytes()[:-400])
    with pytest.warns(RecordingWarning, match="cut off"):
        recording = open_recording(path)
    assert recording.markers == pytest.approx(points[: len(recording)], abs=1e-4)
    assert 0 < len(recording) < 40


@pytest.mark.parametrize("nominal_hz", [25.0, 0.0])
@pytest.mark.parametrize("jitter_s", [0.001, 0.004])
def test_frames_that_were_lost_are_missing(
    tmp_path: Path, nominal_hz: float, jitter_s: float
) -> None:
    """At a low rate, a gap is far less than 500 frames; the time after it is not shifted."""
    points = person(300, 6)
    times = 50.0 + np.arange(300) / 25.0
    times += np.random.default_rng(0).normal(0.0, jitter_s, 300)
    kept = np.delete(np.arange(300), [*range(100, 112), *range(200, 240)])
    path = tmp_path / "a.xdf"
    write_xdf(path, points[kept], rate_hz=nominal_hz or 25.0, times=times[kept])
    if not nominal_hz:
        path.write_bytes(path.read_bytes().replace(b"<nominal_srate>25.0", b"<nominal_srate>00.0"))
    recording = open_recording(path)
    assert recording.rate_hz == pytest.approx(25.0, rel=1e-3)
    assert np.array_equal(np.flatnonzero(~np.isnan(recording.frames).any(axis=1)), kept)
    assert recording.markers[kept] == pytest.approx(points[kept], abs=1e-6)


def test_what_comes_late_and_is_made_up_for_is_not_lost(tmp_path: Path) -> None:
    points = person(300, 6)
    times = 50.0 + np.arange(300) / 25.0
    times[100:110] = times[110]  # the network held ten frames back
    recording = open_recording(write_xdf(tmp_path / "a.xdf", points, rate_hz=25.0, times=times))
    assert recording.markers == pytest.approx(points, abs=1e-6)


@pytest.mark.parametrize("jitter_s", [0.004, 0.01, 0.02])
def test_jitter_is_no_loss(tmp_path: Path, jitter_s: float) -> None:
    points = person(600, 6)
    times = 50.0 + np.arange(600) / 100.0
    times += np.random.default_rng(1).normal(0.0, jitter_s, 600)
    recording = open_recording(write_xdf(tmp_path / "a.xdf", points, rate_hz=100.0, times=times))
    assert recording.markers == pytest.approx(points, abs=1e-6)


def test_zeros_and_nines_are_what_was_not_seen(tmp_path: Path) -> None:
    points = person(40, 6)
    holed = points.copy()
    holed[5:9, 2], holed[20:22, 4] = 0.0, -9999.0
    recording = open_recording(write_xdf(tmp_path / "a.xdf", holed))
    gone = np.isnan(recording.markers).all(axis=2)
    assert np.argwhere(gone).tolist() == [*([k, 2] for k in range(5, 9)), [20, 4], [21, 4]]
    assert recording.markers[~gone] == pytest.approx(points[~gone], abs=1e-6)


def test_without_markers(tmp_path: Path) -> None:
    path = write_xdf(tmp_path / "a.xdf")
    for old, new in (
        (b"Position", b"Rotation"),
        (b"float32", b"strings"),
        (b"<info>", b"<!x><i>"),
        (b"XDF:", b"XDF;"),
    ):
        broken = path.read_bytes().replace(old, new).replace(b"_X</label>", b"_R</label>")
        other = tmp_path / "b.xdf"
        other.write_bytes(broken)
        with pytest.raises(RecordingError, match=r"b\.xdf.*expected"):
            open_recording(other)
