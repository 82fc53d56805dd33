"""XDF: what pyxdf reads is what we read."""

from __future__ import annotations

import struct
from pathlib import Path

import numpy as np
import pytest
import pyxdf
from mocap_writers import person, write_xdf

from mplearn.body import marker_set
from mplearn.errors import RecordingError, RecordingWarning
from mplearn.mocap import Hints, open_recording, open_recordings

UPPER = tuple(f"up{k}" for k in range(8))
LOWER = tuple(f"low{k}" for k in range(5))


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


def _beside(path: Path, other: Path, number: int) -> Path:
    """Put the stream of another file into a file, under another number."""
    path.write_bytes(path.read_bytes() + _renumbered(other.read_bytes(), number))
    return path


def _renumbered(data: bytes, number: int) -> bytes:
    """Return the chunks of stream 7, as that of another number, without the file's header."""
    out, at = b"", 4
    while at < len(data):
        width = data[at]
        length = int.from_bytes(data[at + 1 : at + 1 + width], "little")
        start, end = at + 1 + width, at + 1 + width + length
        chunk = data[start:end]
        if chunk[2:6] == struct.pack("<I", 7):
            out += data[at:start] + chunk[:2] + struct.pack("<I", number) + chunk[6:]
        at = end
    return out


@pytest.mark.parametrize("late_s", [0.0, 0.013, -0.6, 1.7])
def test_two_streams_of_one_body_are_joined_by_their_stamps(tmp_path: Path, late_s: float) -> None:
    """The second has its own clock of frames, in millimetres, and jitters."""
    t = np.arange(400)[:, None, None] / 100.0
    places = person(1, 8)[:, :, None][0].swapaxes(0, 1)

    def at(times: np.ndarray) -> np.ndarray:
        return places + 0.1 * np.sin(2.0 * times + np.arange(3))

    rng = np.random.default_rng(1)
    upper = write_xdf(tmp_path / "a.xdf", at(t), names=UPPER, times=100.0 + t[:, 0, 0])
    stamps = 100.0 + late_s + t[:, 0, 0]
    lower = write_xdf(
        tmp_path / "b.xdf", 1000.0 * at(t + late_s)[:, :5], names=LOWER, stream="legs",
        units="millimeters", times=stamps + rng.normal(0.0, 5e-4, 400),
    )  # fmt: skip
    recording = open_recording(_beside(upper, lower, 9), hints=Hints(unit_m=1.0, up_axis="z"))
    assert recording.marker_names == UPPER + LOWER
    assert recording.markers[:, :8] == pytest.approx(at(t), abs=1e-6)
    own = recording.markers[:, 8:]
    seen = ~np.isnan(own).any(axis=(1, 2))
    inside = (t[:, 0, 0] > late_s + 0.02) & (t[:, 0, 0] < late_s + 3.97)
    assert seen[inside].all() and not seen[~inside][5:-5].any()
    assert own[inside] == pytest.approx(at(t)[inside, :5], abs=2e-4)


def test_streams_of_several_people_are_people(tmp_path: Path) -> None:
    names = marker_set("plug_in_gait39").names
    people = [person(100, len(names)), person(100, len(names)) + np.array([1.0, 0.5, 0.0])]
    paths = [
        write_xdf(tmp_path / f"{who}.xdf", points, names=names, stream=who)
        for who, points in zip(("Anna", "Ben"), people, strict=True)
    ]
    found = open_recordings(_beside(*paths, 9), hints=Hints(unit_m=1.0, up_axis="z"))
    assert [each.person for each in found] == ["Anna", "Ben"]
    for each, points in zip(found, people, strict=True):
        assert each.markers == pytest.approx(points, abs=1e-5)


def test_a_bad_stream_costs_no_other(tmp_path: Path) -> None:
    points = person(100, 12)
    bad = write_xdf(tmp_path / "a.xdf", points, rate_hz=1e6, stream="torn")
    whole = write_xdf(tmp_path / "b.xdf", points[:, :8], names=UPPER)
    with pytest.warns(RecordingWarning, match="stream 'torn' is left out: .*a rate of 1e"):
        recording = open_recording(_beside(bad, whole, 9), hints=Hints(unit_m=1.0, up_axis="z"))
    assert recording.markers == pytest.approx(points[:, :8], abs=1e-6)


@pytest.mark.parametrize(
    ("stream", "rate_hz", "start_s", "moved", "says"),
    [
        ("filtered", 100.0, 100.0, 0.002, "what another one does"),
        ("later", 100.0, 500.0, 1.0, "at another time, or rate: 'later'"),
        ("slow", 25.0, 100.0, 1.0, "at another time, or rate: 'slow'"),
    ],
)
def test_other_streams_are_told(
    tmp_path: Path, stream: str, rate_hz: float, start_s: float, moved: float, says: str
) -> None:
    points = person(100, 12)
    path = write_xdf(tmp_path / "a.xdf", points)
    times = start_s + np.arange(100) / rate_hz
    other = write_xdf(
        tmp_path / "b.xdf", points + moved, rate_hz=rate_hz, times=times, stream=stream
    )
    with pytest.warns(RecordingWarning, match=says):
        recording = open_recording(_beside(path, other, 9), hints=Hints(unit_m=1.0, up_axis="z"))
    assert recording.markers == pytest.approx(points, abs=1e-6)
    assert recording.report is not None
    assert f"stream {stream!r}" in recording.report.left_out
