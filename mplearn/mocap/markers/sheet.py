"""Tables as text: lines of cells, whatever separates them and however decimals are written."""

from __future__ import annotations

import csv
import re
from collections.abc import Iterator
from dataclasses import dataclass
from itertools import zip_longest
from pathlib import Path

from ..files import bad_file
from ..numbers import plain_number, says_missing

_DECIMAL_COMMA = re.compile(r"\s*[-+\u2212]?\d+,\d+(e[-+]?\d+)?\s*", re.I)
_DECIMAL_POINT = re.compile(r"\s*[-+\u2212]?\d*\.\d+(e[-+]?\d+)?\s*", re.I)
_THOUSANDS = r"[-+\u2212]?[1-9]\d{0,2}(?:\.\d{3})+"  # 1.660, of a table with 1.660,79, too
_WHOLE_THOUSANDS = re.compile(rf"\s*{_THOUSANDS}\s*")
_POINTS_FIRST = re.compile(rf"(?<![^\s;|\"]){_THOUSANDS},\d+(?![^\s;|\"])")
_POINTS_FIRST_QUOTED = re.compile(rf"\"\s*{_THOUSANDS},\d+\s*\"")
_AXIS = re.compile(r"[xyz]\d*", re.I)
_UNIT = re.compile(
    r"[\[(]?(mm|cm|m|meters?|millimeters?|s|sec|seconds|ms|deg|degrees|°|rad)[\])]?", re.I
)
_SEPARATOR = re.compile(r'"?sep=([,;\t]?)"?', re.I)
_RATE = re.compile(
    r"\b(?:fps|frames per second|frequency|frequenz|fréquence|frecuencia|frequenza|freq|"
    r"abtastrate|bildrate|(?:(?:frame|sampl(?:e|ing)|capture|data|camera)[\s_-]*)?rate)\b"
    r"[^\d\n]{0,12}?(\d+(?:\.\d+)?)\s*(?:hz|fps|1/s)?\W*$",
    re.I,
)
_HERTZ = re.compile(r"(\d+(?:\.\d+)?)\s*(?:hz|fps)\b", re.I)
_OTHER_RATE = re.compile(r"filter|(?:low|high|band)[\s_-]*pass|cut.?off|analog|emg|force", re.I)
_STEP = re.compile(
    r"\b(?:dt|time[\s_-]*step|(?:frame|sampl(?:e|ing))[\s_-]*(?:time|period|interval))\b"
    r"[^\d\n]{0,12}?(\d*\.?\d+)\s*(m?s)?\W*$",
    re.I,
)
_RATES_HZ = (1.0, 10_000.0)
_LONGEST = 500  # characters of a remark
_OPENS = ("[", "(", "{")
_OPEN_NUMBER = re.compile(r"\s*[\[({][^\d]*\d")
_TRIPLE = re.compile(
    r"\s*[\[({]\s*"
    + r"[\s,;]+".join(rf"(?:[\"']?{a}[\"']?\s*[:=]\s*)?([-+.\deE]+|nan|none|null)" for a in "xyz")
    + r"\s*[\])}]\s*",
    re.I,
)
_LOOK = 40  # lines
_COMMENT = "#%"


@dataclass(frozen=True, eq=False)
class Sheet:
    """A text file as a table.

    Attributes:
        path: The file, for messages.
        lines: Its lines.
        separator: What separates cells; empty for white space.
        decimal_comma: Whether numbers have a decimal comma.
        points_apart: Whether thousands are apart by points, of whole numbers, too.
        cut_off: Whether the last line has no end.
        triples: Columns whose cells hold three numbers, ``[0.1, 0.2, 1.7]``: they count as three.
    """

    path: Path
    lines: list[str]
    separator: str
    decimal_comma: bool
    points_apart: bool = False
    cut_off: bool = False
    triples: frozenset[int] = frozenset()

    @classmethod
    def of(cls, path: Path, text: str, separators: str = ",;\t|") -> Sheet:
        """Return a text as a table; what separates its cells is found out."""
        lines = text.splitlines()
        if lines and (said := _SEPARATOR.fullmatch(lines[0].strip())):  # for Excel
            lines[0] = ""
            separators = said[1] or "\t"
        some = [line for line in lines[:_LOOK] if line.strip()]
        bare = [re.sub(r'"[^"]*"', "", line) for line in some]  # a quoted name may hold any of them
        if not any("|" in line for line in bare[1:][-2:]):  # only in names, subject|marker
            separators = separators.replace("|", "")
        # the first line that has many tells: names hold no separators, numbers may hold commas
        most = [max(map(line.count, separators)) for line in bare]
        telling = next((t for t, n in zip(bare, most, strict=True) if 0 < max(most) <= 2 * n), "")
        separator = max(separators, key=telling.count) if telling else ""
        sheet = cls(path, lines, separator, False)
        some_rows = [sheet.cells(i) for i in range(min(len(lines), _LOOK))]
        cells = [cell for row in some_rows for cell in row]
        commas = sum("," in cell and bool(_DECIMAL_COMMA.fullmatch(cell)) for cell in cells)
        points = commas and sum(bool(_DECIMAL_POINT.fullmatch(cell)) for cell in cells)
        opens = any(each in text for each in _OPENS)  # most tables hold none
        triples = {i for row in some_rows for i, c in enumerate(row) if _three(c)} if opens else ()
        cut_off = bool(text) and text[-1] not in "\r\n"
        apart = _POINTS_FIRST_QUOTED if separator == "," else _POINTS_FIRST
        points_apart = any("," in cell for cell in cells) and apart.search(text) is not None
        comma = commas > points
        return cls(path, lines, separator, comma, points_apart, cut_off, frozenset(triples))

    def cells(self, line: int) -> list[str]:
        """Return the cells of a line, counted from 0.

        Raises:
            RecordingError: Its quotes do not match.
        """
        text = self.lines[line]
        if not self.separator:
            return text.split()
        if '"' not in text:
            return self._spread(text.split(self.separator))
        try:
            return self._spread(next(csv.reader([text], delimiter=self.separator, strict=True), []))
        except csv.Error as error:
            raise bad_file(
                self.path, f"not a table (line {line + 1}: {error})", "rows of cells"
            ) from error

    def _spread(self, cells: list[str]) -> list[str]:
        """Return cells with three for each that holds three numbers, or names what does."""
        if not self.triples:
            return cells
        spread: list[str] = []
        for i, cell in enumerate(cells):
            if i not in self.triples:
                spread.append(cell)
            elif cell.strip() and not is_number(cell) and not cell.lstrip().startswith(_OPENS):
                spread += [f"{cell.strip()}.{axis}" for axis in "xyz"]
            else:
                damaged = _OPEN_NUMBER.match(cell)  # stays, and is refused as no number
                spread += _three(cell) or [cell if damaged else "", "", ""]
        return spread

    def rows(self, start: int, stop: int | None = None) -> Iterator[tuple[int, list[str]]]:
        """Yield the rows that hold anything, each with the number of its line, from 1.

        Decimal commas are points in them, and points between thousands left out.
        """
        for line in range(start, len(self.lines) if stop is None else stop):
            cells = self.cells(line)
            if any(cells) and any(cell.strip() for cell in cells):
                if self.points_apart:
                    cells = [
                        cell.replace(".", "") if _WHOLE_THOUSANDS.fullmatch(cell) else cell
                        for cell in cells
                    ]
                if self.decimal_comma:
                    cells = [
                        cell.replace(",", ".") if _DECIMAL_COMMA.fullmatch(cell) else cell
                        for cell in cells
                    ]
                yield line + 1, cells

    def is_data(self, line: int) -> bool:
        """Whether a line holds at least as many numbers, or marks for missing ones, as texts."""
        cells = [cell.strip() for cell in self.cells(line)]
        filled = [cell for cell in cells if cell]
        return bool(filled) and 2 * sum(map(is_number, filled)) >= len(filled)


def _three(cell: str) -> list[str]:
    """Return the three numbers of ``[0.1, 0.2, 1.7]`` or ``{"x": 0.1, "y": 0.2, "z": 1.7}``."""
    match = _TRIPLE.fullmatch(cell) if cell.lstrip().startswith(_OPENS) else None
    return [match[k] for k in (1, 2, 3)] if match else []


def is_number(text: str) -> bool:
    """Whether a cell holds a number, or says that one is missing."""
    text = text.strip()
    if says_missing(text):
        return bool(text)
    try:
        float(plain_number(text).replace(",", ".", 1))
    except ValueError:
        return False
    return True


@dataclass(frozen=True)
class Header:
    """Names of the columns of a table.

    Attributes:
        names: One for each column; markers' as ``NAME.x`` where axes stand in a row of their own.
        start: Line at which the data start, from 0.
        rate_hz: Rate that a remark above says [1/s], if one does.
    """

    names: tuple[str, ...]
    start: int
    rate_hz: float | None = None


def find_header(sheet: Sheet) -> Header:
    """Return the names of a table's columns: one row, or names above axes, or above units.

    Raises:
        RecordingError: There is no row of names above rows of numbers.
    """
    start = 0
    rate_hz = None
    above: list[list[str]] = []
    for line in range(min(len(sheet.lines), _LOOK)):
        cells = [cell.strip() for cell in sheet.cells(line)]
        if not any(cells):
            continue
        if above and sheet.is_data(line):
            start = line
            break
        if line == 0 or not above:
            width = _width_below(sheet, line)
            said = _said_rate(sheet.lines[line])
            filled = sum(map(bool, cells))
            marked = 2 * len(cells) < width and (cells[0][:1] in _COMMENT or said is not None)
            if marked or (4 * filled < width and not _data_follow(sheet, line, width)):
                rate_hz = said or rate_hz
                continue  # a remark, not the names
            cells = _uncommented(cells)
            if sheet.is_data(line):
                raise bad_file(
                    sheet.path, "the first row holds numbers", "the names of the columns"
                )
        above.append(cells)
        start = line + 1
    if not above:
        raise bad_file(sheet.path, "an empty table", "rows of cells below a row of names")
    return Header(_joined_names(above), start, rate_hz)


def _said_rate(line: str) -> float | None:
    """Return the rate that a remark says [1/s], perhaps by its step in time, if it says one."""
    line = line.rstrip(" ,;\t")
    if len(line) > _LONGEST:
        return None
    found = _RATE.search(line)
    hertz = _HERTZ.findall(line)
    step = _STEP.search(line)
    if found and _OTHER_RATE.search(line[: found.start()]):
        return None
    if found:
        rate_hz = float(found[1])
    elif len(hertz) == 1 and not _OTHER_RATE.search(line):
        rate_hz = float(hertz[0])
    elif step and float(step[1]) > 0:
        rate_hz = (1000.0 if step[2] == "ms" else 1.0) / float(step[1])
    else:
        return None
    return rate_hz if _RATES_HZ[0] <= rate_hz <= _RATES_HZ[1] else None


def _uncommented(cells: list[str]) -> list[str]:
    """Return a row without the mark of a comment before it, as numpy writes headers."""
    first = cells[0].lstrip(_COMMENT).strip()
    return [first, *cells[1:]]


def _width_below(sheet: Sheet, line: int) -> int:
    """Return how many cells the widest of the lines below has."""
    below = range(line + 1, min(len(sheet.lines), line + _LOOK))
    return max((len(sheet.cells(k)) for k in below), default=0)


def _data_follow(sheet: Sheet, line: int, width: int) -> bool:
    """Whether the next line that is not empty holds as many numbers as the table is wide."""
    below = range(line + 1, min(len(sheet.lines), line + _LOOK))
    after = next((k for k in below if sheet.lines[k].strip()), None)
    return after is not None and sheet.is_data(after) and 2 * len(sheet.cells(after)) > width


def _joined_names(above: list[list[str]]) -> tuple[str, ...]:
    axes = next((i for i, row in enumerate(above) if i and _names_axes(row)), None)
    if axes is None:
        names = above[0]
        if len(above) > 1 and _names_units(above[1]):
            pairs = zip_longest(names, above[1][: len(names)], fillvalue="")
            names = [_with_unit(name, unit) for name, unit in pairs]
        width = max((i + 1 for i, name in enumerate(names) if name), default=0)
        return tuple(names[:width])
    # above the axes, or above what kind of points they are
    names = max(reversed(above[:axes]), key=lambda row: len({cell for cell in row if cell}))
    letters = above[axes]
    units = above[axes + 1] if len(above) > axes + 1 and _names_units(above[axes + 1]) else []
    joined: list[str] = []
    current = ""
    for name, letter, unit in zip_longest(names, letters, units, fillvalue=""):
        current = name or current
        axis = letter[:1].lower() if _AXIS.fullmatch(letter) else ""
        own = f"{current}.{axis}" if axis else letter or name
        joined.append(_with_unit(own, unit))
    index = above[-1]
    if len(above) > axes + 1 and index[0] and not any(index[1:]):  # pandas' name of the index
        joined[0] = index[0]
    while joined and not joined[-1]:
        joined.pop()
    return tuple(joined)


def _with_unit(name: str, unit: str) -> str:
    return f"{name} ({unit.strip('[]()')})" if unit and name else name


def _names_axes(row: list[str]) -> bool:
    filled = [cell for cell in row if cell]
    return len(filled) >= 3 and 2 * sum(bool(_AXIS.fullmatch(c)) for c in filled) >= len(filled)


def _names_units(row: list[str]) -> bool:
    filled = [cell for cell in row if cell]
    return bool(filled) and all(_UNIT.fullmatch(cell) for cell in filled)
