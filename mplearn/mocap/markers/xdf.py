"""XDF: what LabRecorder took from the lab streaming layer; streams of motion capture [XDF]."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from xml.etree import ElementTree

import numpy as np

from ...errors import RecordingError
from ...option_names import option
from ...recording import BoolArray, FloatArray, IntArray, Recording
from ..files import bad_file, read_bytes
from ..findings import Findings
from ..numbers import without_unseen
from ..placing.placed_markers import placed_markers
from ..placing.size import named_unit, spread_of
from ..placing.space import Space
from ..reader import Hints, Reader
from .columns import meaning_of
from .names import chosen_names
from .xdf_file import Stream, parse_xdf

_POSITION = re.compile(r"(?:position|pos)?_?([xyz])", re.I)
_AXIS = re.compile(r"[\s._:|/\-]*(?:pos(?:ition)?)?[\s._:|/\-]*[xyz]$", re.I)
_BREAK_S = 1.0  # a stream stands still for longer: frames are missing there
_BREAK_FRAMES = 500
_LOST, _AROUND = 1.5, 50  # how many frames late stamps are, at least; for how many, as before
_JITTERS = 3.0  # how many times the usual jitter they are later than that, at least
_SAME_RATE = 0.02  # by which rates of streams of one body may differ
_TOGETHER = 0.5  # of the time of the first stream, which others that go with it must cover
_COPIED = 0.05  # of a body's size: nobody stands so near to somebody else
_SHARED = 0.3  # of the markers of a stream: where others have as many of them, it is another person
_OFF = 0.1  # by which the usual step is off a nominal rate that is right


class XDFReader(Reader):
    """Reads the streams of markers of an XDF file.

    Streams of other markers at about the same rate are one body's, by their time stamps; of streams
    with the same markers each is a person's (`each_person`). The one with most markers counts as
    the first; what was recorded at another time, or rate, is left out.

    Time stamps jitter as the network does: frames are taken as even, as pyxdf takes them, with a
    gap where the stream stands still for a second and 500 frames, and where frames were lost:
    what comes after is late for good, and not only until a delay is made up for.
    """

    format = "XDF"
    suffixes = (".xdf",)

    def read(self, path: Path, hints: Hints, *, positions: bool) -> Recording:
        """Read the markers; see `Reader.read`."""
        findings = Findings(self.format)
        streams, cut = parse_xdf(path, read_bytes(path))
        if cut:
            findings.warn("the file is cut off; what is there is read")
        found = [(described_markers(s.info, s.n_channels), s) for s in streams if s.times]
        found = sorted(((m, s) for m, s in found if m), key=lambda pair: -len(pair[0]))
        if not found:
            raise bad_file(
                path,
                f"no markers in {len(streams)} streams of numbers",
                "a stream of motion capture, with channels x, y, z for each marker",
            )
        seen, problems = [], []
        for markers, stream in found:
            try:
                seen.append(_seen(path, markers, stream, hints, findings))
            except RecordingError as error:
                problems.append(error)
                findings.warn(f"stream {stream.name!r} is left out: {error}")
        if not seen:
            raise problems[0]
        first, *others = seen
        read = _joined(first, others, findings)
        findings.leave_out(
            f"stream {s.name!r}" for s in streams if all(s is not each.stream for each in read)
        )
        points = np.concatenate([each.on(first) for each in read], axis=1)
        called = _told_apart(read)
        often = (~np.isnan(points).any(axis=2)).sum(axis=0)
        kept, names = chosen_names(path, called, often, findings)
        space = Space(first.unit_m or 1.0, says_unit=first.unit_m is not None)
        points = points if len(kept) == points.shape[1] else points[:, kept]
        return placed_markers(path, points, names, first.rate_hz, space, hints, findings)


@dataclass(frozen=True, eq=False)
class _Seen:
    """Markers of a stream, at an even rate.

    Attributes:
        stream: The stream.
        names: Names of its M markers.
        points: Where they are, shape (T, M, 3), in the stream's unit; NaN where missing.
        rate_hz: Frames per second [1/s].
        start_s: Time of the first frame, by the clock that all streams of a file share [s].
        unit_m: The unit that the stream says [m]; None for none.
    """

    stream: Stream
    names: list[str]
    points: FloatArray
    rate_hz: float
    start_s: float
    unit_m: float | None

    @property
    def end_s(self) -> float:
        """Time of the last frame [s]."""
        return self.start_s + (len(self.points) - 1) / self.rate_hz

    def on(self, first: _Seen) -> FloatArray:
        """Return its points at another's frames, and in its unit; interpolated linearly."""
        if self is first:
            return self.points
        begin = (first.start_s - self.start_s) * self.rate_hz
        at = begin + np.arange(len(first.points)) * (self.rate_hz / first.rate_hz)
        before = np.clip(np.floor(at).astype(np.int64), 0, max(len(self.points) - 2, 0))
        after = np.minimum(before + 1, len(self.points) - 1)
        share = (at - before)[:, None, None]
        moved: FloatArray = (1.0 - share) * self.points[before] + share * self.points[after]
        moved[(at < -0.5) | (at > len(self.points) - 0.5)] = np.nan
        moved *= (self.unit_m or 1.0) / (first.unit_m or 1.0)
        return moved


def _seen(
    path: Path,
    markers: dict[str, tuple[int, int, int]],
    stream: Stream,
    hints: Hints,
    findings: Findings,
) -> _Seen:
    """Return the markers of a stream, at an even rate; the stream's values are let go."""
    columns = [i for axes in markers.values() for i in axes]
    values = stream.values(columns)
    stream.raw.clear()
    values[~np.isfinite(values)] = np.nan
    rate_hz, values = _even(path, stream, values, hints, findings)
    points = without_unseen(values.reshape(len(values), -1, 3))
    unit_m = described_unit(stream.info, stream.n_channels, columns)
    return _Seen(stream, list(markers), points, rate_hz, _start(stream, rate_hz), unit_m)


def _start(stream: Stream, rate_hz: float) -> float:
    """Return when the first frame of a stream was, by all of its first second: stamps jitter."""
    times = np.array(stream.times[: max(1, round(rate_hz))])
    return float(np.median(times - np.arange(len(times)) / rate_hz))


def _joined(first: _Seen, others: Sequence[_Seen], findings: Findings) -> list[_Seen]:
    """Return the streams that go with the first one, itself before them, and tell the others."""
    read, away = [first], []
    for each in others:
        same_rate = abs(each.rate_hz / first.rate_hz - 1.0) < _SAME_RATE
        together_s = min(each.end_s, first.end_s) - max(each.start_s, first.start_s)
        whole_s = first.end_s - first.start_s
        if not same_rate or together_s <= _TOGETHER * whole_s:
            away.append(each)
        elif any(_is_copy(each, other) for other in read):
            findings.warn(f"stream {each.stream.name!r} holds what another one does: left out")
        else:
            read.append(each)
    if len(read) > 1:
        listed = ", ".join(repr(each.stream.name) for each in read)
        findings.note(f"{len(read)} streams of markers, joined by their time stamps: {listed}")
    if away:
        listed = ", ".join(repr(each.stream.name) for each in away)
        findings.warn(f"other streams hold markers at another time, or rate: {listed}")
    return read


def _is_copy(one: _Seen, other: _Seen) -> bool:
    """Say whether two streams hold the same markers in the same places, as filtered ones do."""
    shared = [name for name in one.names if name in other.names]
    if 2 * len(shared) < len(one.names):
        return False
    here = one.on(other)[:, [one.names.index(name) for name in shared]]
    there = other.points[:, [other.names.index(name) for name in shared]]
    apart = np.linalg.norm(here - there, axis=2)
    size = spread_of(there)
    return bool(np.isfinite(apart).any() and np.nanmedian(apart) < _COPIED * size)


def _told_apart(read: Sequence[_Seen]) -> list[str]:
    """Return the names of all markers, after their streams where several have the same ones."""
    once = Counter(name.lower() for each in read for name in set(each.names))
    shared = sum(number - 1 for number in once.values())
    if shared <= _SHARED * min(len(each.names) for each in read):
        return [name for each in read for name in each.names]
    streams = [each.stream.name or f"stream {k}" for k, each in enumerate(read)]
    if len(set(streams)) < len(streams):
        streams = [f"{stream} {k}" for k, stream in enumerate(streams)]
    pairs = zip(streams, read, strict=True)
    return [f"{stream.replace(':', ' ')}:{name}" for stream, each in pairs for name in each.names]


def described_markers(
    info: ElementTree.Element, n_channels: int
) -> dict[str, tuple[int, int, int]]:
    """Return the markers of a stream by name, each with its channels x, y, z.

    Args:
        info: The stream's description, as the lab streaming layer has it.
        n_channels: How many values a sample has.
    """
    names = []
    fields = (_texts(info, n_channels, each) for each in ("label", "marker", "object", "type"))
    for i, (label, marker, thing, kind) in enumerate(zip(*fields, strict=True)):
        axis = _POSITION.fullmatch(kind)
        if axis is None:
            names.append(label or f"channel {i}")
        else:  # as the layer's conventions for motion capture say it
            names.append(f"{marker or thing or _AXIS.sub('', label)}.{axis[1].lower()}")
    return meaning_of(names).markers


def described_unit(
    info: ElementTree.Element, n_channels: int, columns: Sequence[int]
) -> float | None:
    """Return the length of the unit in which some channels are [m]; None where it is not said."""
    texts = _texts(info, n_channels, "unit")
    units = {texts[i] for i in columns} - {""}
    return named_unit(units.pop()) if len(units) == 1 else None


def _texts(info: ElementTree.Element, n_channels: int, field: str) -> list[str]:
    channels = info.findall("desc/channels/channel")[:n_channels]
    texts = [channel.findtext(field, "").strip() for channel in channels]
    return texts + [""] * (n_channels - len(texts))


def _even(
    path: Path, stream: Stream, values: FloatArray, hints: Hints, findings: Findings
) -> tuple[float, FloatArray]:
    """Return the rate, and the samples with frames of nothing where the stream stood still."""
    times = np.array(stream.times)
    if not np.isfinite(times).all():
        raise bad_file(path, "a time stamp is not finite", "seconds")
    steps = np.diff(times)
    usual = 1.0 / stream.rate_hz if stream.rate_hz else float(np.median(steps)) if len(steps) else 0
    broken = np.flatnonzero(
        (steps > _BREAK_S) & (steps > _BREAK_FRAMES * usual)
        | (steps < -_BREAK_S)
        | _are_lost(times, stream.rate_hz)
    )
    rate_hz = hints.rate_hz or _rate(times, broken) or stream.rate_hz
    if not 1e-3 < rate_hz < 1e5:
        raise bad_file(path, f"a rate of {rate_hz:.3g} Hz", f"a steady one, or {option('rate_hz')}")
    if stream.rate_hz and abs(rate_hz / stream.rate_hz - 1.0) > 0.05 and not hints.rate_hz:
        findings.warn(f"the nominal rate is {stream.rate_hz:g} Hz, the times say {rate_hz:.6g} Hz")
    lost = np.zeros(len(times), dtype=np.int64)
    for i in broken:
        lost[i + 1] = max(int(np.rint(steps[i] * rate_hz)) - 1, 0)
    if lost.sum() > 10 * len(times) + 1000:
        raise bad_file(path, "most of the time has no frames", "a stream with few gaps")
    if not lost.any():
        return rate_hz, values
    frames = np.full((len(times) + int(lost.sum()), values.shape[1]), np.nan)
    frames[np.arange(len(times)) + np.cumsum(lost)] = values
    return rate_hz, frames


def _are_lost(times: FloatArray, nominal_hz: float) -> BoolArray:
    """Return whether frames were lost between each sample and the next, shape (T - 1,).

    Samples come late by chance, never early: in a stretch, the least late ones tell.

    Args:
        times: Time stamps, shape (T,) [s].
        nominal_hz: The nominal rate [1/s]; 0 where that is not known.
    """
    steps = np.diff(times)
    step_s = float(np.median(steps)) if len(steps) else 0.0
    if nominal_hz and abs(step_s * nominal_hz - 1.0) > _OFF:  # wrong, or samples came in bursts
        return np.zeros(len(steps), dtype=bool)
    step_s = 1.0 / nominal_hz if nominal_hz else step_s
    late = times - step_s * np.arange(len(times))
    jitter_s = float(np.median(np.abs(steps - step_s))) if len(steps) else 0.0
    least_s = _LOST * step_s + _JITTERS * jitter_s
    lost: BoolArray = (steps > step_s + least_s) & (step_s > 0.0)
    for i in np.flatnonzero(lost) + 1:
        shift = late[i : i + _AROUND].min() - late[max(i - _AROUND, 0) : i].min()
        lost[i - 1] = shift > least_s
    return lost


def _rate(times: FloatArray, broken: IntArray) -> float:
    """Return the rate of the lines through the times between breaks; 0 for no such line."""
    above, below = 0.0, 0.0
    for piece in np.split(times, broken + 1):
        index = np.arange(len(piece)) - (len(piece) - 1) / 2
        above += float(index @ index)
        below += float(index @ (piece - piece.mean()))
    return above / below if below > 0 else 0.0
