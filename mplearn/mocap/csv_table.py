"""CSV with a header of channel names, and, where there are any, times and labels.

The first row names the columns; the separator is a comma, semicolon or tab. Special names are:

* ``time``, ``time_s`` or ``t``: seconds; without such a column `Hints.rate_hz` is needed;
* ``label``: class of the motion; consecutive rows with the same one are a `LabelledSegment`, rows
  without one belong to none;
* ``segment``: any text; where it changes a segment ends even if the label stays, so that
  repetitions can be told apart;
* ``person``: who moves, the same in every row.

All other columns are measurements, an empty cell is a missing one. Markers are three columns each,
``NAME.x, NAME.y, NAME.z`` [m], z up; angles are radians.
"""

from __future__ import annotations

import csv
import itertools
from dataclasses import replace
from pathlib import Path

import numpy as np

from ..recording import IntArray, LabelledSegment, Recording
from .clock import even_clock
from .files import bad_file, read_text, stem
from .numbers import numbers
from .options import option
from .reader import Hints, Reader
from .space import checked_markers, file_axes

_TIMES = ("time", "time_s", "t")
_TEXTS = ("label", "segment", "person")


class CSVReader(Reader):
    """Reads CSV files with named columns; see the module's docstring for the format."""

    format = "CSV"
    suffixes = (".csv",)

    def read(self, path: Path, hints: Hints, *, positions: bool) -> Recording:
        """Read the table; see `Reader.read`."""
        header, rows, places = _table(path)
        special = {name: header.index(name) for name in (*_TIMES, *_TEXTS) if name in header}
        for row, place in zip(rows, places, strict=True):
            if len(row) != len(header):
                raise bad_file(path, f"line {place} has {len(row)} columns", f"{len(header)}")
        measured = [i for i in range(len(header)) if i not in special.values()]
        if not measured or not rows:
            raise bad_file(
                path, f"{len(measured)} channels, {len(rows)} rows", "at least one of each"
            )
        cells = [[row[i] for i in measured] for row in rows]
        values = numbers(path, cells, len(measured), places)

        index = np.arange(len(rows))
        rate_hz = hints.rate_hz
        times = [special[name] for name in _TIMES if name in special]
        if len(times) > 1:
            raise bad_file(path, "several columns of times", f"one of {', '.join(_TIMES)}")
        if times:
            column = numbers(path, [[row[times[0]]] for row in rows], 1, places)[:, 0]
            clock = even_clock(path, column)
            index, values = clock.places.astype(int), clock.even(values)
            rate_hz = rate_hz or clock.rate_hz
        if rate_hz is None or np.isnan(rate_hz):
            raise bad_file(
                path, "no rate", f"a column {' or '.join(_TIMES)} [s], or {option('rate_hz')}"
            )
        frames = values
        texts = {
            name: [row[special[name]].strip() for row in rows] for name in special if name in _TEXTS
        }
        people = sorted(set(texts.get("person", [""])))
        if len(people) > 1:
            raise bad_file(path, f"several persons: {people[:5]}", "one person in a file")
        recording = Recording(
            frames=frames,
            rate_hz=rate_hz,
            channels=tuple(header[i] for i in measured),
            name=stem(path),
            person=people[0],
            labels=_segments(texts, index, people[0]),
        )
        if not recording.is_markers:
            return recording
        points = recording.markers @ file_axes(hints.up_axis, "z", "x").T * (hints.unit_m or 1.0)
        checked_markers(path, points, recording.marker_names)
        return replace(recording, frames=points.reshape(frames.shape))


def _table(path: Path) -> tuple[list[str], list[list[str]], list[int]]:
    lines = read_text(path).splitlines()
    separator = max(",;\t", key=lines[0].count)
    reader = csv.reader(lines, delimiter=separator, strict=True)
    rows, places = [], []
    try:
        header = [name.strip() for name in next(reader)]
        for row in reader:
            if any(cell.strip() for cell in row):
                rows.append(row)
                places.append(reader.line_num)
    except (csv.Error, StopIteration) as error:
        raise bad_file(
            path, f"not a table ({error})", "rows of cells below a row of names"
        ) from error
    if not all(header) or len(set(header)) != len(header):
        raise bad_file(path, f"columns named {header[:6]}", "names, each different")
    if all(_is_number(name) for name in header):
        raise bad_file(path, "the first row holds numbers", "the names of the columns")
    return header, rows, places


def _is_number(text: str) -> bool:
    try:
        float(text)
    except ValueError:
        return False
    return True


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
