"""Tables with a header of column names: CSV, TSV and their like, from any tool.

The separator is a comma, semicolon, tab or white space; decimals have a point or a comma; an empty
cell, ``NaN``, ``NA`` or ``null`` is a missing measurement. Special names, in any spelling, are:

* ``time``, ``time_s``, ``t``, ``timestamp``, ``Time (ms)``, ...: when; without such a column a line
  above (``fps, 50``), a column ``fps``, the file's name (``walk_50hz.csv``), a JSON file of that
  name or `Hints.rate_hz` must say the rate;
* ``frame``, ``Frame#``, ``index``, ...: numbers of frames, which are no measurement;
* ``label``: class of the motion; consecutive rows with the same one are a `LabelledSegment`, rows
  without one belong to none;
* ``segment``: any text; where it changes a segment ends even if the label stays, so that
  repetitions can be told apart;
* ``person``: who moves, the same in every row.

All other columns are measurements. Markers are three columns each, ``NAME.x, NAME.y, NAME.z`` or
``NAME_x``, ``NAME X (mm)``, ``x_NAME``, ..., also below each other (names in one row, axes in the
next), or a row for each point (``frame, landmark, x, y, z``): metres and z up, unless the person
shows otherwise. Where most columns are markers, the others are left out. All other channels are
radians and metres; those whose names say ``(deg)`` or ``(mm)`` are converted.
"""

from __future__ import annotations

import itertools
import re
from collections.abc import Iterator
from dataclasses import dataclass, replace
from datetime import datetime
from pathlib import Path
from typing import ClassVar

import numpy as np

from ...errors import RecordingError
from ...option_names import option
from ...recording import FloatArray, IntArray, LabelledSegment, Recording
from ..clock import Clock, even_clock, in_seconds
from ..files import bad_file, head_text, read_text, stem
from ..findings import Findings
from ..numbers import measured_rows, says_missing, without_unseen
from ..placing.placed_markers import placed_markers
from ..placing.size import named_unit
from ..placing.space import Space
from ..rates import rate_beside
from ..reader import Hints, Reader
from .columns import (
    Columns,
    angle_factor,
    is_foreign,
    meaning_of,
    numbered_names,
    numbered_triples,
)
from .names import chosen_names
from .pictures import warn_of_pictures
from .sheet import Header, Sheet, find_header, is_number

_MARKERS_SHARE = 0.5  # of a table's columns, without what else a marker has: it is one of markers
_LEAST_MARKERS = 3  # that a .txt file must name to be taken for a table
_SAME_STEP = 0.01
_TURN = 2 * np.pi
_CLOCK = re.compile(  # 10:00:00.02, 1.5.2024 10:00:00,02, 5/1/2024 10:00:00.02 AM
    r"(?:(?P<date>\d{1,2}[./-]\d{1,2}[./-]\d{2,4}),?[ T]+)?"
    r"(?P<clock>(?:\d+:)?\d+:\d+(?:[.,]\d*)?)\s*(?P<half>[AP]M)?",
    re.I,
)


class CSVReader(Reader):
    """Reads tables with named columns; see the module's docstring for the format."""

    format = "CSV"
    suffixes: ClassVar[tuple[str, ...]] = (".csv", ".tsv", ".txt")
    usual = Space(1.0)  # what tables that do not say it are in

    def sheet(self, path: Path) -> Sheet:
        """Return the table that a file holds.

        Raises:
            RecordingError: There is none.
        """
        return Sheet.of(path, read_text(path))

    def columns(self, header: Header) -> Columns:
        """Return what the columns mean."""
        return meaning_of(header.names)

    def accepts(self, path: Path) -> bool:
        """Whether it is called a table, or is a text that begins like one of markers."""
        if not path.name.lower().removesuffix(".gz").endswith(".txt"):
            return True
        try:
            header = find_header(Sheet.of(path, head_text(path)))
        except RecordingError:
            return False
        return len(meaning_of(header.names).markers) >= _LEAST_MARKERS

    def read(self, path: Path, hints: Hints, *, positions: bool) -> Recording:
        """Read the table; see `Reader.read`."""
        findings = Findings(self.format)
        sheet = self.sheet(path)
        header = find_header(sheet)
        columns = self.columns(header)
        _check_names(path, columns)
        table = _of_somebody(_read(sheet, header, columns, findings), findings)
        if columns.points is not None:
            table = _by_points(path, table, columns)
        elif len(set(table.texts.get("who", ()))) > 1:
            table = _by_people(path, table)
        person = _person(path, table)
        rate_hz, clock = _clock(path, table, header.rate_hz or table.rate_hz, hints, findings)
        index = np.rint(clock.places).astype(np.int64)
        values = clock.even(table.values)
        labels = _segments(table.texts, index, person)
        if table.markers is None:
            return Recording(
                values,
                rate_hz,
                table.channels,
                stem(path),
                person,
                labels,
                report=findings.report(rate_hz),
            )
        points = values.reshape(len(values), -1, 3).copy()
        points = without_unseen(points)
        seen = (~np.isnan(points).any(axis=2)).sum(axis=0)
        kept, names = chosen_names(path, table.markers, seen, findings)
        points = points[:, kept]
        space = replace(self.usual, unit_m=table.unit_m or 1.0, says_unit=table.unit_m is not None)
        warn_of_pictures(points, names, findings)
        return placed_markers(
            *(path, points, names, rate_hz, space, hints, findings), person=person, labels=labels
        )


@dataclass(frozen=True, eq=False)
class _Table:
    """A table's measured columns, and what goes with them.

    Attributes:
        values: Shape (T, D).
        channels: Names of its columns, length D; empty for markers.
        markers: Names of the D / 3 markers; None where the columns are none.
        unit_m: Length of the markers' unit [m], where the header says it.
        times: Columns of times [any unit], each of shape (T,), with their unit [s] if it is said.
        numbers: Numbers of the frames, shape (T,); None where there are none.
        texts: Columns of texts by name, each of length T.
        rate_hz: What a column says of the rate [1/s], if one does.
    """

    values: FloatArray
    channels: tuple[str, ...]
    markers: tuple[str, ...] | None
    unit_m: float | None
    times: tuple[tuple[FloatArray, float | None], ...]
    numbers: FloatArray | None
    texts: dict[str, list[str]]
    rate_hz: float | None = None


def _check_names(path: Path, columns: Columns) -> None:
    special = {i for c in columns.markers.values() for i in c} | {*columns.frames, *columns.times}
    single = [name for i, name in enumerate(columns.names) if name and i not in special]
    unnamed = columns.nameless and not columns.markers
    if unnamed or (len(set(single)) != len(single) and not columns.doubled):
        raise bad_file(path, f"columns named {list(columns.names[:6])}", "names, each different")


def _read(sheet: Sheet, header: Header, columns: Columns, findings: Findings) -> _Table:
    path, n_columns = sheet.path, len(columns.names)
    first = next((cells for _, cells in sheet.rows(header.start)), [])
    textual = dict(columns.texts)
    if columns.points is not None:
        textual["point"] = columns.points
    for i in columns.times:  # times of the day are texts
        if i < len(first) and first[i].strip() and not is_number(first[i]):
            textual[f"time {i}"] = i
    markers = [i for axes in columns.markers.values() for i in axes]
    measured = [i for i in columns.measured if i not in textual.values()]
    others = set(measured) - columns.of_markers - set(markers)
    are_markers = bool(markers) and len(markers) >= _MARKERS_SHARE * (len(markers) + len(others))
    if are_markers:
        wanted = markers
    elif columns.points is not None:
        wanted = [next(i for i in measured if columns.names[i].lower() == a) for a in "xyz"]
    else:
        wanted = measured
    of_points = are_markers or columns.points is not None
    if columns.who is not None and of_points:
        textual["who"] = columns.who
    elif columns.who is not None:  # who would be where no places are is measured, too
        wanted = measured = sorted([*measured, columns.who])
    texts: dict[str, list[str]] = {name: [] for name in textual}
    fine_at, fine_s = columns.fine or (None, 0.0)
    clocks = [
        *columns.times,
        *columns.frames,
        *columns.rates,
        *([fine_at] if fine_at is not None else []),
    ]
    clocks = [i for i in clocks if i not in textual.values()]
    if columns.nameless:
        findings.leave_out(["(no name)"] * len(columns.nameless))
        findings.note(f"{len(columns.nameless)} columns without a name left out")

    def rows() -> Iterator[tuple[int, list[str]]]:
        last = header.start
        begins: bool | None = None  # whether the first row begins with a number
        for line, cells in sheet.rows(header.start):
            begin = next(cell for cell in cells if cell.strip())
            begins = is_number(begin) if begins is None else begins
            if cells[0].strip() == header.names[0] and cells[0].strip() and not is_number(cells[0]):
                findings.note(f"line {line} repeats the names: left out")
                last = line
                continue
            if begins and line > last + 1 and last > header.start and not is_number(begin):
                findings.note(
                    f"what stands from line {line} on, {begin.strip()[:40]!r}, is left out"
                )
                return
            last = line
            if textual:
                while len(cells) > n_columns and not cells[-1].strip():
                    cells.pop()
                if len(cells) != n_columns:
                    raise bad_file(path, f"line {line} has {len(cells)} columns", f"{n_columns}")
                for name, i in textual.items():
                    texts[name].append(cells[i].strip())
            yield line, cells

    found = measured_rows(
        path,
        rows(),
        n_columns,
        findings,
        group=3 if are_markers and sheet.separator else 1,
        columns=[*clocks, *wanted],
        cut_off=sheet.cut_off,
    )
    place = {column: k for k, column in enumerate([*clocks, *wanted])}
    if of_points and len(set(texts.get("person", ()))) > 1 and "who" not in texts:
        texts["who"] = texts.pop("person")
    in_order = columns.points is None and "who" not in texts
    numbers = [
        i
        for i in columns.frames
        if _counts(found[:, place[i]], in_order=in_order)
        and not (is_foreign(columns.names[i]) and (np.diff(found[:, place[i]]) <= 0).any())
    ]
    if wanted == measured and not are_markers:  # what is only called a number of frames is measured
        wanted = [i for i in clocks if i in columns.frames and i not in numbers] + wanted
    if not wanted or not len(found):
        raise bad_file(path, f"{len(wanted)} channels, {len(found)} rows", "at least one of each")
    if not all(columns.names[i] for i in wanted):
        raise bad_file(path, f"columns named {list(columns.names[:6])}", "names, each different")
    times = [(found[:, place[i]], columns.time_unit_s(i)) for i in clocks if i in columns.times]
    times = [(x, unit_s) for x, unit_s in times if not np.isnan(x).all()]
    if numbers:  # beside which a clock may stand still
        times = [(x, unit_s) for x, unit_s in times if len(x) == 1 or np.ptp(x) != 0]
    if fine_at is not None and len(times) == 1 and _counts(times[0][0]):  # as ROS has stamps
        times = [(times[0][0] + fine_s * found[:, place[fine_at]], 1.0)]
    if not times:  # as pandas writes an index of times, or in another language
        index = [
            found[:, place[i]]
            for i in columns.frames
            if not columns.names[i] or (of_points and is_foreign(columns.names[i]))
        ]
        times = [(x, None) for x in index if (np.diff(x) > 0).all() and not _counts(x)]
    times += [(_of_day(path, texts.pop(n)), 1.0) for n in list(texts) if n.startswith("time ")]
    table = _Table(
        found[:, [place[i] for i in wanted]],
        tuple(columns.names[i] for i in wanted),
        None,
        None,
        tuple(times),
        found[:, place[numbers[0]]] if numbers else None,
        texts,
        _even_rate(found[:, [place[i] for i in columns.rates]]),
    )
    if are_markers:
        return _of_markers(table, columns, findings)
    return table if columns.points is not None else _in_si(table, wanted, columns, findings)


def _even_rate(said: FloatArray) -> float | None:
    """Return the rate that a column says in every row [1/s], if one does."""
    even = [float(column[0]) for column in said.T if (column == column[0]).all()]
    return even[0] if even and 0 < even[0] < np.inf else None


def _of_markers(table: _Table, columns: Columns, findings: Findings) -> _Table:
    """Return a table with its columns named as markers."""
    used = [i for axes in columns.markers.values() for i in axes]
    others = [columns.names[i] for i in columns.measured if i not in set(used)]
    if others:
        findings.leave_out(others)
        findings.note(f"{len(others)} columns that are no markers left out")
    if columns.doubled:
        findings.warn(
            f"the same name more than once: {', '.join(columns.doubled[:5])}; the first one is used"
        )
    units = {columns.units[i] for i in used if columns.units[i]}
    unit = named_unit(units.pop()) if len(units) == 1 else None
    return replace(table, channels=(), markers=tuple(columns.markers), unit_m=unit)


def _in_si(table: _Table, wanted: list[int], columns: Columns, findings: Findings) -> _Table:
    """Return a table of channels in radians and metres, as far as units are said."""
    values = table.values.copy()
    said = [columns.units[i] for i in wanted]
    for k, text in enumerate(said):
        values[:, k] *= angle_factor(text) or named_unit(text) or 1.0
    reach = np.nanmax(np.abs(values), initial=0.0)
    triples = numbered_triples([columns.names[i] for i in wanted])
    if triples:
        findings.warn(
            f"columns like {triples[0]} are taken as angles or places of their own; if the three "
            "are where a marker is, end their names in _x, _y and _z"
        )
    elif not any(said) and reach > 2 * _TURN:
        findings.note(
            f"the columns reach up to {reach:.4g} and are taken as radians and metres; if they are "
            "degrees or millimetres, write (deg) or (mm) behind their names"
        )
    return replace(table, values=values)


def _counts(values: FloatArray, *, in_order: bool = True) -> bool:
    """Whether a column holds numbers of frames: whole, and never going back."""
    return bool(
        not np.isnan(values).any()
        and (values == np.rint(values)).all()
        and (not in_order or (np.diff(values) >= 0).all())
    )


def _of_day(path: Path, texts: list[str]) -> FloatArray:
    """Return times that are written with a date, or as hours, minutes and seconds [s]."""
    times = []
    day, days = "", -1
    for row, text in enumerate(texts, start=1):
        found = _CLOCK.fullmatch(text.strip())
        try:
            if found and not text[:4].isdigit():
                days += (found["date"] or "") != day or days < 0
                day = found["date"] or ""
                parts = [float(part) for part in found["clock"].replace(",", ".").split(":")]
                seconds = sum(p * 60.0**k for k, p in enumerate(reversed(parts)))
                half = (found["half"] or "").upper()
                hour = parts[0] % 12 + (12 if half == "PM" else 0) if half else parts[0]
                times.append(86400.0 * days + seconds + 3600.0 * (hour - parts[0]))
            else:
                times.append(datetime.fromisoformat(text.replace("/", "-")).timestamp())
        except (ValueError, OverflowError) as error:
            raise bad_file(
                path,
                f"row {row} holds the time {text[:40]!r}",
                "a number, a date and time, or hours:minutes:seconds",
            ) from error
    return np.array(times, dtype=np.float64)


def _keys(path: Path, table: _Table, what: str) -> FloatArray:
    """Return what tells the frames apart in a table with several rows for each, shape (R,)."""
    keys = table.numbers
    if keys is None and table.times:
        keys = table.times[0][0]
    if keys is None or np.isnan(keys).any():
        raise bad_file(path, f"a row for each {what}, without frames or times", "a column 'frame'")
    return keys


def _by_points(path: Path, table: _Table, columns: Columns) -> _Table:
    """Return a table with a row for each point as one with a row for each frame."""
    keys = _keys(path, table, "point")
    frames, first, row = np.unique(keys, return_index=True, return_inverse=True)
    numbered = numbered_names(tuple(dict.fromkeys(table.texts["point"])))
    of_points = [numbered.get(name, name) for name in table.texts["point"]]
    if len(set(who := table.texts.get("who", []))) > 1:
        of_points = [f"{whose}:{name}" for whose, name in zip(who, of_points, strict=True)]
    names = list(dict.fromkeys(of_points))
    if len(frames) * len(names) > 4 * len(keys) + 1000:
        raise bad_file(path, f"{len(names)} points in {len(frames)} frames", "most points in each")
    column = {name: k for k, name in enumerate(names)}
    points = np.full((len(frames), len(names), 3), np.nan)
    axes = [[n.lower() for n in table.channels].index(axis) for axis in "xyz"]
    which = np.array([column[name] for name in of_points], dtype=np.int64)
    if len(np.unique(row * len(names) + which)) < len(which):
        raise bad_file(
            path, "several rows of one point at one time", "one, or a column 'person_id'"
        )
    points[row, which] = table.values[:, axes]
    unit = next((columns.units[i] for i, n in enumerate(columns.names) if n.lower() == "x"), "")
    texts = {name: [values[i] for i in first] for name, values in table.texts.items()}
    del texts["point"]
    texts.pop("who", None)
    return _Table(
        points.reshape(len(frames), -1),
        (),
        tuple(names),
        named_unit(unit),
        tuple((times[first], unit_s) for times, unit_s in table.times),
        None if table.numbers is None else table.numbers[first],
        texts,
        table.rate_hz,
    )


def _of_somebody(table: _Table, findings: Findings) -> _Table:
    """Return a table without the rows that name nobody, where others name people."""
    who = table.texts.get("who", [])
    kept = [row for row, name in enumerate(who) if not says_missing(name)]
    if len(kept) in (0, len(who)):
        return table
    findings.note(f"{len(who) - len(kept)} rows that name nobody left out")
    return replace(
        table,
        values=table.values[kept],
        times=tuple((times[kept], unit_s) for times, unit_s in table.times),
        numbers=None if table.numbers is None else table.numbers[kept],
        texts={name: [each[row] for row in kept] for name, each in table.texts.items()},
    )


def _by_people(path: Path, table: _Table) -> _Table:
    """Return a table with a row for each frame, of one with a row for each person in it."""
    assert table.markers is not None
    who = table.texts["who"]
    people = {name: k for k, name in enumerate(dict.fromkeys(who))}
    which = np.array([people[name] for name in who], dtype=np.int64)
    keys = _keys(path, table, "person")
    frames, first, row = np.unique(keys, return_index=True, return_inverse=True)
    if len(frames) * len(people) > 4 * len(keys) + 1000:
        raise bad_file(path, f"{len(people)} people in {len(frames)} frames", "most people in each")
    if len(np.unique(row * len(people) + which)) < len(which):
        raise bad_file(path, "several rows of one person at one time", "one")
    values = np.full((len(frames), len(people), table.values.shape[1]), np.nan)
    values[row, which] = table.values
    texts = {name: [each[i] for i in first] for name, each in table.texts.items() if name != "who"}
    return replace(
        table,
        values=values.reshape(len(frames), -1),
        markers=tuple(f"{name}:{marker}" for name in people for marker in table.markers),
        times=tuple((times[first], unit_s) for times, unit_s in table.times),
        numbers=None if table.numbers is None else table.numbers[first],
        texts=texts,
    )


def _person(path: Path, table: _Table) -> str:
    people = sorted(set(table.texts.get("person", [""])))
    if len(people) > 1:
        raise bad_file(path, f"several persons: {', '.join(people[:5])}", "one person a file")
    return people[0]


def _clock(
    path: Path, table: _Table, said_hz: float | None, hints: Hints, findings: Findings
) -> tuple[float, Clock]:
    """Return the rate, and where the rows lie on an even clock."""
    times = [in_seconds(values, unit, findings) for values, unit in table.times]
    if len(times) > 1 and not all(_same_steps(times[0], other) for other in times[1:]):
        raise bad_file(path, "several columns of times", "one")
    if times:
        clock = even_clock(path, times[0])
        if clock.jitters:
            findings.note(f"times jitter: resampled to an even {clock.rate_hz:.6g} Hz")
    elif table.numbers is not None and len(table.values) > 1:
        clock = _by_numbers(path, table.numbers)
    else:
        clock = Clock(np.nan, np.arange(len(table.values), dtype=np.float64), False)
    rate_hz = hints.rate_hz or (clock.rate_hz if clock.rate_hz > 0 else said_hz)
    rate_hz = rate_hz or rate_beside(path, findings)
    if rate_hz is None or not 0 < rate_hz < np.inf:
        raise bad_file(path, "no rate", f"a column 'time' [s], or {option('rate_hz')}")
    step = 1.0 if times or table.numbers is None else _usual_step(table.numbers)
    if step > 1 and hints.rate_hz is None:
        findings.warn(
            f"frames are numbered in steps of {step:g}, and {rate_hz:g} Hz is taken for "
            f"the rate of those that are there; {option('rate_hz')} settles it"
        )
    return rate_hz, clock


def _by_numbers(path: Path, numbers: FloatArray) -> Clock:
    """Return where rows lie by the numbers of their frames, which have a usual step."""
    steps = np.diff(numbers)
    usual = _usual_step(numbers)
    places = (numbers - numbers[0]) / (usual or 1.0)
    off = (places != np.rint(places)) | (np.concatenate([[1.0], steps]) <= 0)
    if off.any() or places[-1] > 10 * len(numbers) + 1000:
        row = int(np.argmax(off))
        raise bad_file(path, f"frame {numbers[row]:g} in row {row + 1}", "evenly numbered frames")
    return Clock(np.nan, places, False)


def _usual_step(numbers: FloatArray) -> float:
    return float(np.median(np.diff(numbers))) if len(numbers) > 1 else 1.0


def _same_steps(one: FloatArray, other: FloatArray) -> bool:
    if len(one) < 2:
        return False
    steps, others = np.diff(one), np.diff(other)
    return bool(abs(others.sum() - steps.sum()) <= _SAME_STEP * abs(steps.sum()))


def _segments(
    texts: dict[str, list[str]], index: IntArray, person: str
) -> tuple[LabelledSegment, ...]:
    labels = texts.get("label", [])
    marks = texts.get("segment", labels)
    keys = list(zip(labels, marks, strict=True))
    cuts = [0, *(i for i in range(1, len(keys)) if keys[i] != keys[i - 1]), len(keys)]
    return tuple(
        LabelledSegment(int(index[a]), int(index[b - 1]) + 1, labels[a], person)
        for a, b in itertools.pairwise(cuts)
        if b > a and labels[a]
    )
