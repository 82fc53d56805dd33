"""TRC: the marker table of OpenSim and Motion Analysis [OpenSim]."""

from __future__ import annotations

import re
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from ...recording import FloatArray, Recording
from ..clock import even_clock, in_seconds
from ..files import bad_file, cmu_subject, read_text, stem
from ..findings import Findings
from ..numbers import measured_rows, not_seen, number
from ..placing.placed_markers import placed_markers
from ..placing.size import said_unit
from ..placing.space import Space
from ..reader import Hints, Reader
from .columns import meaning_of
from .names import chosen_names
from .sheet import Sheet

_EXPECTED = (
    "a TRC file: two header lines of names and values, then 'Frame#', 'Time' and the markers"
)
_SAME_RATE = 0.01  # how far the rates of header and times may differ, as a share
_TABLE = re.compile(r"\s*frame\s*#?[\s,]", re.IGNORECASE)  # how the line of names begins


class TRCReader(Reader):
    """Reads TRC files: y up, x forward as in OpenSim; missing is an empty cell or (0, 0, 0)."""

    format = "TRC"
    suffixes = (".trc",)
    begins = ("PATHFILETYPE",)

    def read(self, path: Path, hints: Hints, *, positions: bool) -> Recording:
        """Read the markers; see `Reader.read`."""
        findings = Findings(self.format)
        text = read_text(path).lstrip("\r\n")
        sheet = Sheet.of(path, _tabbed(text), separators="\t")
        header = _Header.parse(path, sheet.lines)
        # between blanks an empty cell does not show
        group = 3 if "\t" in text or "," in text else 1
        values, labels = _table(sheet, header, group, findings)
        measured = values[:, 2:].reshape(len(values), -1, 3)
        measured[not_seen(measured)] = np.nan
        seen = (~np.isnan(measured).any(axis=2)).sum(axis=0)
        kept, names = chosen_names(path, labels, seen, findings)
        header.compare(path, "NumFrames", len(values), "frames", findings)
        header.compare(path, "NumMarkers", sum(bool(label) for label in labels), "names", findings)
        rate_hz, points = _in_time(path, header, values[:, 1], measured[:, kept], hints, findings)
        space, person = _space(path, header, hints), cmu_subject(stem(path))
        return placed_markers(path, points, names, rate_hz, space, hints, findings, person=person)


def _tabbed(text: str) -> str:
    """Return a file with tabs between its cells, where it has commas or blanks."""
    if "\t" in text:
        return text
    lines = text.splitlines()
    table = next((line for line in lines[:12] if _TABLE.match(line)), "")
    if "," in table:
        return text.replace(",", "\t")
    return "\n".join(re.sub(" +", "\t", line.strip()) for line in lines) if table else text


@dataclass(frozen=True)
class _Header:
    """What the lines above the table say.

    Attributes:
        values: By name in small letters, as text.
        names_at: Line of the markers' names, from 0.
    """

    values: dict[str, str]
    names_at: int

    @classmethod
    def parse(cls, path: Path, lines: list[str]) -> _Header:
        starts = ("pathfiletype", "datarate")  # the first line may be lost
        if len(lines) < 5 or not lines[0].lower().startswith(starts):
            raise bad_file(path, f"starts with {lines[0][:40]!r}", _EXPECTED)
        first = [line.split("\t")[0].strip('" ').lower() for line in lines[:12]]
        at = next((i for i, cell in enumerate(first) if cell.strip("# ") == "frame"), None)
        if at is None:
            raise bad_file(path, f"line 4 starts with {lines[3][:40]!r}", _EXPECTED)
        names, values = (lines[at - 2], lines[at - 1]) if at >= 2 else ("", "")
        pairs = [(names.split("\t"), values.split("\t")), (names.split(), values.split())]
        # a value left empty shows between tabs only; without tabs, words are all there is
        names_, values_ = pairs[0] if len(pairs[0][0]) > 1 else pairs[1]
        said = zip(names_, values_, strict=False)
        return cls({n.strip().lower(): v.strip() for n, v in said}, at)

    def compare(self, path: Path, name: str, count: int, what: str, findings: Findings) -> None:
        """Warn where a count in the header is another than what is there."""
        said = self.values.get(name.lower(), "")
        whole = re.fullmatch(r"0*(\d+)(?:\.0*)?", said, re.ASCII)  # or as a float
        if whole and whole[1] == str(count):
            return
        findings.warn(f"{name} is {said[:20] or 'missing'}, but {count} {what} are there and read")


def _table(
    sheet: Sheet, header: _Header, group: int, findings: Findings
) -> tuple[FloatArray, list[str]]:
    """Return frame numbers, times and coordinates, shape (T, 2 + 3M), and the M names.

    Args:
        sheet: The file.
        header: Its header.
        group: How many cells at a row's end may be missing at once.
        findings: Where to tell what contradicts itself.
    """
    path, lines = sheet.path, sheet.lines
    labels = _labels(sheet.cells(header.names_at)[2:])
    if not labels:
        raise bad_file(path, "no marker names", "at least one")
    start = header.names_at + 1
    if start < len(lines) and _names_axes(lines[start].replace('"', "")):
        start += 1
    values = measured_rows(
        path, sheet.rows(start), 2 + 3 * len(labels), findings, group=group, cut_off=sheet.cut_off
    )
    if not len(values):
        raise bad_file(path, "0 frames", "at least one")
    return values, labels


def _labels(cells: list[str]) -> list[str]:
    """Return the markers' names: above the first of three columns each, or as some write them."""
    labels = [name.strip() for name in cells]
    while labels and not labels[-1]:
        labels.pop()
    if not any(name for i, name in enumerate(labels) if i % 3):
        return labels[::3]
    if len(labels) % 3 == 0 and labels[::3] == labels[1::3] == labels[2::3]:
        return labels[::3]
    triples = meaning_of(labels).markers  # a name for each column: nose_x, nose_y, nose_z
    if [i for axes in triples.values() for i in axes] == list(range(len(labels))):
        return list(triples)
    return [name for name in labels if name]  # one after the other


def _names_axes(line: str) -> bool:
    words = line.split()
    return bool(words) and all(word[:1].upper() in ("X", "Y", "Z") for word in words)


def _in_time(
    path: Path,
    header: _Header,
    times_s: FloatArray,
    points: FloatArray,
    hints: Hints,
    findings: Findings,
) -> tuple[float, FloatArray]:
    """Return the rate and the points at even times, shape (T', M, 3)."""
    said = re.sub(r"(?<=\d)\s*(hz|fps)$", "", header.values.get("datarate", ""), flags=re.I)
    rate_hz = (
        number(path, said.replace(",", "."), "DataRate")
        if said or hints.rate_hz is None
        else np.nan
    )
    clock = None
    # frames' numbers, where times should be
    counted = 2.0 < rate_hz < np.inf and bool((np.diff(times_s) == 1.0).all())
    if np.isnan(times_s).all() or not np.ptp(times_s) or counted:
        if len(points) > 1:
            findings.note("there are no times; frames are taken as even")
    else:
        times_s = in_seconds(times_s, None, findings)
        clock = even_clock(path, times_s)
        points = clock.even(points.reshape(len(points), -1)).reshape(-1, *points.shape[1:])
        if clock.jitters:
            findings.note(f"times jitter: resampled to an even {clock.rate_hz:.6g} Hz")
    if hints.rate_hz is not None:
        return hints.rate_hz, points
    if clock is None or np.isnan(clock.rate_hz):
        if not 0 < rate_hz < np.inf:
            raise bad_file(path, f"DataRate {said[:40]!r}", "a positive number [1/s]")
        return rate_hz, points
    rounded_s = 1e-3  # times may be rounded to milliseconds
    slack = _SAME_RATE + 2 * rounded_s / max(float(np.ptp(times_s)), rounded_s)
    if not (0 < rate_hz < np.inf and abs(clock.rate_hz / rate_hz - 1.0) <= slack):
        findings.warn(
            f"DataRate is {said[:20] or 'missing'}, the times say {clock.rate_hz:.6g} Hz, "
            "which is used"
        )
        rate_hz = clock.rate_hz
    return rate_hz, points


def _space(path: Path, header: _Header, hints: Hints) -> Space:
    text = header.values.get("units", "")
    unit = said_unit(path, text, hints)
    return Space(unit or 0.001, "y", "x", says_unit=unit is not None)
