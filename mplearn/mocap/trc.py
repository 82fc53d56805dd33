"""TRC: the marker table of OpenSim and Motion Analysis [OpenSim]."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from ..recording import Recording, marker_channels
from .clock import frame_numbers
from .files import bad_file, cmu_subject, read_text, stem
from .numbers import number, numbers
from .reader import Hints, Reader
from .space import checked_markers, file_axes, unit_m

_EXPECTED = (
    "a TRC file: two header lines of names and values, then 'Frame#', 'Time' and the markers"
)


class TRCReader(Reader):
    """Reads TRC files: y up, x forward as in OpenSim; missing is an empty cell or (0, 0, 0)."""

    suffixes = (".trc",)

    def read(self, path: Path, hints: Hints, *, positions: bool) -> Recording:
        """Read the markers; see `Reader.read`."""
        lines = read_text(path).splitlines()
        header = _header(path, lines)
        names = tuple(name for name in lines[3].rstrip().split("\t")[2:] if name.strip())
        names = tuple(name.strip().split(":")[-1] for name in names)
        if not names or len(set(names)) != len(names):
            raise bad_file(path, f"marker names {names[:6]}", "at least one, each different")
        if len(names) != _count(path, header, "NumMarkers"):
            raise bad_file(path, f"{len(names)} marker names", f"{header['NumMarkers']}, as said")
        rows, places = [], []
        width = 2 + 3 * len(names)
        for place, line in enumerate(lines[5:], start=6):
            if line.strip():
                cells = line.split("\t")
                while len(cells) > width and not cells[-1].strip():
                    cells.pop()
                rows.append(cells)
                places.append(place)
        if len(rows) != _count(path, header, "NumFrames") or not rows:
            raise bad_file(
                path, f"{len(rows)} frames", f"{header['NumFrames']}, as its header says"
            )
        values = numbers(path, rows, width, places)

        rate_hz = hints.rate_hz or number(path, header.get("DataRate", ""), "DataRate")
        if not 0 < rate_hz < np.inf:
            raise bad_file(path, f"DataRate {header.get('DataRate')!r}", "a positive number [1/s]")
        unit = hints.unit_m or unit_m(path, header.get("Units", ""))
        measured = values[:, 2:].reshape(len(rows), -1, 3)
        measured[(measured == 0.0).all(axis=2)] = np.nan
        index, _ = frame_numbers(path, values[:, 1])
        points = np.full((index[-1] + 1, len(names), 3), np.nan)
        points[index] = measured @ file_axes(hints.up_axis, "y", "x").T * unit
        checked_markers(path, points, names)
        return Recording(
            frames=points.reshape(len(points), -1),
            rate_hz=rate_hz,
            channels=marker_channels(names),
            name=stem(path),
            person=cmu_subject(stem(path)),
        )


def _header(path: Path, lines: list[str]) -> dict[str, str]:
    if len(lines) < 6 or not lines[0].startswith("PathFileType"):
        raise bad_file(path, f"starts with {lines[0][:40]!r}", _EXPECTED)
    if lines[3].split("\t")[0].strip() != "Frame#":
        raise bad_file(path, f"line 4 starts with {lines[3][:40]!r}", _EXPECTED)
    return dict(zip(lines[1].split(), lines[2].split(), strict=False))


def _count(path: Path, header: dict[str, str], name: str) -> int:
    text = header.get(name, "")
    if not text.isdecimal():
        raise bad_file(path, f"{name} is {text!r}", "a whole number")
    return int(text)
