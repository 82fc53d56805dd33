"""Tables of key points: of DeepLabCut [Mathis2018], of SLEAP [Pereira2022], and their like, as CSV.

Names stand in rows of heads above the columns, in one row (``nose.x, nose.y, nose.score``, or
``inst0.nose.x`` where a row holds all animals), or a row is one point (``frame_idx, track, node, x,
y, score``).
"""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path

import numpy as np

from ...errors import RecordingError
from ...recording import FloatArray
from ..files import bad_file, head_text, read_text
from ..findings import Findings
from ..markers.sheet import Sheet
from ..numbers import numbers, without_cut_row
from ..reader import Hints
from .animals import (
    COORDS,
    SURE,
    AnimalReader,
    Animals,
    Track,
    by_frame,
    often_seen,
    points_of,
    rate_of,
    span_of,
)

_HEADS = ("scorer", "individuals", "bodyparts", "coords")  # as they stand, the last two always
_FRAMES = ("frame_idx", "frame")
_TRACKS = ("track", "instance", "individual", "animal")
_NODES = ("node", "bodypart", "keypoint")
_INSTANCE = re.compile(r"(inst(?:ance)?_?\d+)[._](.+)", re.IGNORECASE)  # of several in a row
_PICTURE = re.compile(r".*?(\d+)\.\w+")  # a file whose name ends with the frame's number
_LOOK = 6  # rows in which heads are looked for
_FEWEST = 3  # points that a table must name to be taken for one of key points


class DeepLabCutReader(AnimalReader):
    """Reads DeepLabCut's tables: rows of heads, (scorer, individuals,) bodyparts and coords."""

    format = "DeepLabCut"
    suffixes = (".csv",)

    def accepts(self, path: Path) -> bool:
        """Whether there is a row of coords, with likelihoods or under the names of other heads."""
        rows = _first_rows(path)
        at = _coords_row(rows)
        if at is None:
            return False
        named = {row[0].lower() for row in rows[: at + 1] if row}
        return not named.isdisjoint(_HEADS) or "likelihood" in map(str.lower, rows[at])

    def _animals(self, path: Path, hints: Hints) -> Animals:
        findings = Findings(self.format)
        rows = _rows(path, findings)
        at = _coords_row([row for _, row in rows[:_LOOK]])
        if at is None or at == 0:
            raise bad_file(path, "no rows of key points", "heads scorer, bodyparts and coords")
        heads: dict[str, list[str]] = {}
        for name, (_, row) in zip(reversed(_HEADS), reversed(rows[: at + 1]), strict=False):
            heads[row[0].lower() if row[0].lower() in _HEADS else name] = row
        coords, parts = rows[at][1], heads.get("bodyparts", rows[at - 1][1])
        width = len(coords)
        animals = (*heads.get("individuals", ()), *[""] * width)[:width]
        body = [(n, row) for n, row in rows[at + 1 :] if any(row[1:])]  # below the index' name
        cells = [
            [_PICTURE.sub(r"\1", row[0]) if "/" in row[0] else row[0], *row[1:]] for _, row in body
        ]
        table = numbers(path, cells, width, [n for n, _ in body])
        table = by_frame(path, table[:, 0], table)
        columns: dict[str, dict[str, dict[str, int]]] = {}
        for k in range(1, width):
            points = columns.setdefault(animals[k], {})
            points.setdefault(parts[k] if k < len(parts) else "", {})[coords[k].lower()] = k
        return Animals.in_columns(path, table, columns, hints, findings)


class SLEAPReader(AnimalReader):
    """Reads SLEAP's tables: a row for each frame and track, or for each point of them."""

    format = "SLEAP"
    suffixes = (".csv",)

    def accepts(self, path: Path) -> bool:
        """Whether the first row names ``frame_idx``, and points or nodes."""
        rows = _first_rows(path)
        if not rows or "z" in map(str.lower, rows[0]):
            return False
        head = _Head.of(rows[0])
        return head.is_sleap and bool(head.points)

    def _animals(self, path: Path, hints: Hints) -> Animals:
        return _flat(path, hints, Findings(self.format))


class KeyPointsReader(AnimalReader):
    """Reads other tables of points in a picture: ``nose_x, nose_y, nose_likelihood``, ..."""

    format = "key points"
    suffixes = (".csv",)

    def accepts(self, path: Path) -> bool:
        """Whether the first row names x, y and a likelihood, and no z, of three points or more."""
        rows = _first_rows(path)
        points = _Head.of(rows[0]).points if rows else {}
        flat = [own for own in points.values() if {"x", "y"} <= own.keys()]
        return (
            len(flat) >= _FEWEST
            and not any("z" in own for own in points.values())
            and all(not own.keys().isdisjoint(SURE) for own in flat)
        )

    def _animals(self, path: Path, hints: Hints) -> Animals:
        return _flat(path, hints, Findings(self.format))


@dataclass(frozen=True)
class _Head:
    """What the names in the first row of a table say.

    Attributes:
        points: Columns of each point, by its name and by ``x``, ``y``, ... in small letters; where
            a row is one point, those of a point without a name.
        frame: Column of the frames' numbers; None where there is none.
        track: Column that tells animals apart; None where there is none.
        node: Column of the points' names where a row is one point; None where it is not.
        is_sleap: Whether it is SLEAP's.
    """

    points: dict[str, dict[str, int]]
    frame: int | None
    track: int | None
    node: int | None
    is_sleap: bool

    @classmethod
    def of(cls, row: Sequence[str]) -> _Head:
        """Return what a row of names says."""
        names = [name.lower() for name in row]

        def column(wanted: tuple[str, ...]) -> int | None:
            return next((names.index(name) for name in wanted if name in names), None)

        node = column(_NODES) if {"x", "y"} <= set(names) else None
        points: dict[str, dict[str, int]] = {}
        for k, name in enumerate(row):
            match = re.fullmatch(r"(.+)[._ ](\w+)", name)
            if match and match[2].lower() in COORDS and match[1].lower() not in _TRACKS:
                points.setdefault(match[1], {})[match[2].lower()] = k
        if node is not None:
            points = {"": {name: names.index(name) for name in names if name in COORDS}}
        return cls(points, column(_FRAMES), column(_TRACKS), node, "frame_idx" in names)

    @property
    def coords(self) -> dict[tuple[str, str], int]:
        """The column of each coordinate of each point."""
        return {(p, c): k for p, each in self.points.items() for c, k in each.items()}


def _flat(path: Path, hints: Hints, findings: Findings) -> Animals:
    """Read a table with one row of names."""
    head, lines, body = _named_rows(path, findings)
    coords = head.coords
    used = [*([] if head.frame is None else [head.frame]), *coords.values()]
    values = numbers(path, [[row[k] for k in used] for row in body], len(used), lines)
    at = np.arange(len(values), dtype=np.float64)
    if head.frame is not None:
        at, values = values[:, 0], values[:, 1:]
    who = [row[head.track] if head.track is not None else "" for row in body]
    seen: Counter[str] = Counter()
    for track, n_values in zip(who, np.isfinite(values).sum(axis=1).tolist(), strict=True):
        seen[track] += n_values
    rows: dict[str, list[int]] = {}
    for k, track in enumerate(who):
        rows.setdefault(track, []).append(k)
    nodes = [row[head.node] if head.node is not None else "" for row in body]
    most = 10 * values.size + 100_000  # numbers that tables may hold

    def begins_at_once() -> bool:
        """Whether all tables can begin with the file's first frame."""
        whole = len(at) and at.min() >= 0 and (at == np.rint(at)).all()
        width = {
            each: len(coords) * len({nodes[k] for k in rows[each]}) for each in often_seen(seen)
        }
        return bool(whole) and most >= sum(
            (at[rows[each]].max() - at.min() + 1) * n for each, n in width.items()
        )

    begins = at.min() if begins_at_once() else None  # what is done at once has the same time
    if begins is None and len(rows) > 1:
        findings.note("pictures far apart: each animal's begin with the first that it is seen in")

    def track_of(animal: str) -> Track:
        own = rows[animal]
        of_node = [nodes[k] for k in own]
        table, place = _by_node(path, at[own], values[own], of_node, begins, most)
        points: dict[str, dict[str, int]] = {}
        for node, begin in place.items():
            for k, (point, coord) in enumerate(coords):
                points.setdefault(point or node, {})[coord] = begin + k
        return points_of(path, table, points)

    return Animals(path, seen, track_of, rate_of(path, hints, findings), findings)


def _named_rows(path: Path, findings: Findings) -> tuple[_Head, list[int], list[list[str]]]:
    """Return what the first row says, and the numbers and cells of all others."""
    rows = _rows(path, findings)
    head = _Head.of(rows[0][1]) if rows else None
    if head is None or not head.coords or len(rows) < 2:
        raise bad_file(path, "no rows of key points", "names of columns, then a row for each frame")
    width = len(rows[0][1])
    for n, row in rows[1:]:
        if len(row) != width:
            raise bad_file(path, f"line {n} has {len(row)} columns", f"{width}, as the names")
    if head.frame is not None and (slots := _instances(rows[0][1])):
        rows = _one_a_row(rows, head.frame, slots)
        head = _Head.of(rows[0][1])
    return head, [n for n, _ in rows[1:]], [row for _, row in rows[1:]]


def _instances(row: Sequence[str]) -> dict[str, dict[str, int]]:
    """Return the columns of each instance of which a row holds several, by what they are."""
    slots: dict[str, dict[str, int]] = {}
    for k, name in enumerate(row):
        if match := _INSTANCE.fullmatch(name):
            slots.setdefault(match[1], {})[match[2]] = k
    return slots


def _one_a_row(
    rows: list[tuple[int, list[str]]], frame: int, slots: dict[str, dict[str, int]]
) -> list[tuple[int, list[str]]]:
    """Return a table with a row for each instance: who it is says its track, if not its place."""
    named = dict.fromkeys(name for own in slots.values() for name in own)
    names = [name for name in named if name.lower() not in _TRACKS]
    found = [(rows[0][0], [_FRAMES[0], _TRACKS[0], *names])]
    for n, row in rows[1:]:
        for slot, columns in slots.items():
            cells = [row[columns[name]] if name in columns else "" for name in names]
            track = next((row[k] for name, k in columns.items() if name.lower() in _TRACKS), "")
            if any(cells):
                found.append((n, [row[frame], track or slot, *cells]))
    return found


def _by_node(
    path: Path,
    at: FloatArray,
    values: FloatArray,
    nodes: list[str],
    begins: float | None,
    most: int,
) -> tuple[FloatArray, dict[str, int]]:
    """Return a table with a row for each frame, and the first column of each node in it.

    Args:
        path: The file, for errors.
        at: The frame of each row, shape (R,).
        values: The rows, shape (R, K).
        nodes: The node that each is of.
        begins: The table's first frame; that of the first row where None.
        most: Numbers that the table may hold.
    """
    first, last = span_of(path, at)
    first = first if begins is None else int(begins)
    n_values = values.shape[1]
    place = {node: n_values * j for j, node in enumerate(dict.fromkeys(nodes))}
    n_frames, n_columns = last - first + 1, n_values * len(place)
    if n_frames * n_columns > most:
        raise bad_file(path, "hardly any points in most frames", "most points in each")
    table = np.full((n_frames, n_columns), np.nan)
    begin = np.array([place[node] for node in nodes], dtype=np.int64)
    table[(at - first).astype(np.int64)[:, None], begin[:, None] + np.arange(n_values)] = values
    return table, place


def _first_rows(path: Path) -> list[list[str]]:
    return _rows_in(path, head_text(path))


@lru_cache(maxsize=1)  # each reader asks
def _rows_in(path: Path, head: str) -> list[list[str]]:
    try:
        sheet = _sheet(path, head)
        return [row for _, row in _cells(sheet, min(_LOOK, len(sheet.lines)))]
    except RecordingError:  # quotes that do not match: no table
        return []


def _rows(path: Path, findings: Findings) -> list[tuple[int, list[str]]]:
    text = read_text(path)
    return without_cut_row(_cells(_sheet(path, text)), text, findings)


def _sheet(path: Path, text: str) -> Sheet:
    return Sheet.of(path, text, separators=",;\t")


def _cells(sheet: Sheet, stop: int | None = None) -> list[tuple[int, list[str]]]:
    """Return the cells of each line that holds any, and the line's number."""
    return [(n, [cell.strip() for cell in row]) for n, row in sheet.rows(0, stop)]


def _coords_row(rows: list[list[str]]) -> int | None:
    """Return which row names coordinates alone; its first cell is the head's own name."""
    for k, row in enumerate(rows):
        cells = [cell.lower() for cell in row[1:]]
        if {"x", "y"} <= set(cells) <= COORDS:
            return k
    return None
