"""XDF: what LabRecorder took from the lab streaming layer; streams of motion capture [XDF]."""

from __future__ import annotations

import re
from collections.abc import Sequence
from pathlib import Path
from xml.etree import ElementTree

import numpy as np

from ...recording import BoolArray, FloatArray, IntArray, Recording
from ..files import bad_file, read_bytes
from ..findings import Findings
from ..numbers import without_unseen
from ..options import option
from ..placing.placed_markers import placed_markers
from ..placing.size import named_unit
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
_OFF = 0.1  # by which the usual step is off a nominal rate that is right


class XDFReader(Reader):
    """Reads the stream of markers of an XDF file; the one with most of them, if there are several.

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
        markers, stream = found[0]
        findings.leave_out(f"stream {s.name!r}" for s in streams if s is not stream)
        if len(found) > 1:
            findings.warn(f"{len(found)} streams hold markers; {stream.name!r} is read")
        columns = [i for axes in markers.values() for i in axes]
        values = stream.values(columns)
        stream.raw.clear()
        values[~np.isfinite(values)] = np.nan
        rate_hz, values = _even(path, stream, values, hints, findings)
        points = values.reshape(len(values), -1, 3)
        points = without_unseen(points)
        seen = (~np.isnan(points).any(axis=2)).sum(axis=0)
        kept, names = chosen_names(path, list(markers), seen, findings)
        unit = described_unit(stream.info, stream.n_channels, columns)
        space = Space(unit or 1.0, says_unit=unit is not None)
        points = points if len(kept) == points.shape[1] else points[:, kept]
        return placed_markers(path, points, names, rate_hz, space, hints, findings)


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
