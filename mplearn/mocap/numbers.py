"""Numbers from text: fast where all is well, exact about the cell where it is not."""

from __future__ import annotations

import re
from array import array
from collections.abc import Iterable, Sequence
from itertools import chain
from pathlib import Path

import numpy as np

from ..recording import BoolArray, FloatArray
from .files import bad_file
from .findings import Findings

MISSING = frozenset(
    (
        *("", "nan", "na", "n/a", "#n/a", "null", "none", "-", "--", "nil", "*", ".", "?"),
        *(
            "inf",
            "+inf",
            "-inf",
            "infinity",
            "+infinity",
            "-infinity",
            "missing",
            "undefined",
            "#value!",
            "#div/0!",
            "#num!",
            "#ref!",
            "#name?",
            "#null!",
        ),
    )
)
"""How tables write, in lower case, that there is no number."""
_MISSING = re.compile(r"[-+]?(?:nan\(.*\)|\d\.?#(?:ind|qnan|snan)\d*)", re.IGNORECASE)  # C runtimes
_FORTRAN = re.compile(r"[-+]?\d*\.?\d*[dD][-+]?\d{1,3}")  # 1.5D+03
# 1,660.79, 1.660,79, 1'660.79 and, as in French, with a blank
_THOUSANDS = re.compile(
    r"[-+]?[1-9]\d{0,2}([,.'\u2019\u00a0\u202f ])\d{3}(?:\1\d{3})*(?!\1)[.,]\d+"
)
_LONGEST = 400  # characters of a cell; no number has more digits
_NINES = re.compile(r"-?(?:9{4,}(?:\.[09]*)?|9{3}\.9+)")
_LIMITS = (-32768.0, 32767.0)  # of short integers
_NOWHERE = 1e6  # as FLT_MAX, -1e30: no unit of length leads there


def says_missing(cell: str) -> bool:
    """Whether a cell says that there is no number, an empty one too."""
    text = cell.strip()
    return text.lower() in MISSING or _MISSING.fullmatch(text) is not None


def plain_number(cell: str) -> str:
    """Return a number as Python reads it.

    Exponents may be Fortran's, thousands apart, and the minus that of typographers.

    Example:
        >>> plain_number("1.660,79"), plain_number("1.5D+03"), plain_number("\u22122")
        ('1660.79', '1.5e+03', '-2')
    """
    text = cell.strip().replace("\u2212", "-")
    if len(text) <= _LONGEST and (grouped := _THOUSANDS.fullmatch(text)):
        return text.replace(grouped[1], "").replace(",", ".")
    if len(text) <= _LONGEST and _FORTRAN.fullmatch(text):
        return text.lower().replace("d", "e")
    return text


def not_seen(points: FloatArray) -> BoolArray:
    """Return where tables say that a marker was not seen, for points (..., 3).

    All three are zero, -1, nines, a limit of short integers, or one number beyond a million.

    Example:
        >>> not_seen(np.array([[0.0, 0.0, 0.0], [-9999.0, -9999.0, -9999.0], [0.0, 0.0, 9999.0]]))
        array([ True,  True, False])
    """
    same: BoolArray = (points == points[..., :1]).all(axis=-1)
    gone: BoolArray = same & ((points[..., 0] == 0.0) | (points[..., 0] == -1.0))
    far = same & (np.abs(points[..., 0]) >= 999.9)
    for value in np.unique(points[far][..., 0]).tolist():
        if abs(value) >= _NOWHERE or value in _LIMITS or _NINES.fullmatch(repr(value)):
            gone |= same & (points[..., 0] == value)
    return gone


def without_unseen(points: FloatArray) -> FloatArray:
    """Return points, shape (T, M, 3), NaN where they were not seen.

    One that is at zero all the time stays where it lies amid the others, as the hips from which all
    is counted; elsewhere it was never seen.
    """
    gone = not_seen(points)
    found = np.where(gone[..., None], np.nan, points)
    always = np.flatnonzero((points == 0.0).all(axis=(0, 2)))
    others = found[~np.isnan(found).all(axis=(1, 2))]
    if len(always) == 1 and len(others):
        others = np.delete(others, always, axis=1)
        middle = np.nanmedian(others, axis=1, keepdims=True)
        spread = np.nanmedian(np.linalg.norm(others - middle, axis=2))
        if np.median(np.linalg.norm(middle, axis=2)) < spread:
            found[:, always] = points[:, always]
    return found


def number(path: Path, cell: str, where: str) -> float:
    """Return a finite number, or NaN where it is missing: an empty cell, or one of `MISSING`.

    Raises:
        RecordingError: The cell is not a number, or too large for one.
    """
    if says_missing(cell):
        return np.nan
    text = plain_number(cell)
    try:
        if "_" in text:  # Python reads "1_0" as ten
            raise ValueError
        value = float(text)
    except ValueError:
        raise bad_file(path, f"{where} holds {cell[:40]!r}", "a number") from None
    if np.isinf(value):
        raise bad_file(path, f"{where} is too large", "a number, or nan where it is missing")
    return value


def numbers(
    path: Path, rows: Sequence[Sequence[str]], n_columns: int, lines: Sequence[int]
) -> FloatArray:
    """Return the cells of a table as an array.

    Args:
        path: The file, for messages.
        rows: T rows of cells, as text; an empty cell is a missing measurement.
        n_columns: How many cells each row must have.
        lines: The line of the file that each row stands on, length T, for messages.

    Returns:
        Shape (T, n_columns), NaN where a cell is empty.

    Raises:
        RecordingError: A row has another number of cells, or a cell is not a finite number.
    """
    for row, line in zip(rows, lines, strict=True):
        if len(row) != n_columns:
            raise bad_file(path, f"line {line} has {len(row)} columns", f"{n_columns}, as before")
    count = len(rows) * n_columns
    try:
        values = np.fromiter(map(float, chain.from_iterable(rows)), np.float64, count)
        plain = not np.isinf(values).any() and not any("_" in c for c in chain.from_iterable(rows))
    except ValueError:
        plain = False
    if not plain:
        values = np.array(
            [
                number(path, cell, f"line {line}, column {column + 1}")
                for row, line in zip(rows, lines, strict=True)
                for column, cell in enumerate(row)
            ]
        )
    return values.reshape(len(rows), n_columns)


def without_cut_row(
    rows: list[tuple[int, list[str]]], text: str, findings: Findings
) -> list[tuple[int, list[str]]]:
    """Return rows of cells, each with its line, without one in which a text ends.

    Args:
        rows: All rows.
        text: What they stand in.
        findings: Where to tell of the row.
    """
    cut = text[-1:] not in "\r\n" and len(rows) > 1 and len(rows[-1][1]) < len(rows[-2][1])
    if not cut:
        return rows
    findings.warn(f"the last row, line {rows[-1][0]}, is cut off: left out")
    return rows[:-1]


def measured_rows(
    path: Path,
    rows: Iterable[tuple[int, list[str]]],
    n_columns: int,
    findings: Findings,
    *,
    group: int = 1,
    columns: Sequence[int] | None = None,
    cut_off: bool = False,
) -> FloatArray:
    """Return the cells of a table as an array, as far as they are there.

    Empty cells behind the last column are dropped, those of whole groups cut off at a row's end
    are missing, and columns behind the last in most rows are left out: findings tell.

    Args:
        path: The file, for messages.
        rows: The line of the file that each row stands on, and its cells.
        n_columns: How many columns have a name.
        findings: Where to tell what contradicts itself.
        group: How many columns at a row's end belong together: three for markers.
        columns: Which columns to return; all of them by default. Others may hold any text.
        cut_off: Whether the file ends within its last row, which is left out then.

    Returns:
        Shape (T, n_columns), NaN where a cell is empty.

    Raises:
        RecordingError: A row has another number of cells, or a cell is not a finite number.
    """
    values, lines = array("d"), array("q")
    extra: list[tuple[int, int]] = []
    n_cut = 0
    ends_early = False
    row: list[str] = []
    short: tuple[int, int] | None = None  # a row that ends early, and that may be the last one
    for line, row in rows:
        if short is not None:
            break
        cells = row
        while len(cells) > n_columns and not cells[-1].strip():
            cells.pop()
        if len(cells) > n_columns:
            extra.append((line, len(cells)))
            cells = cells[:n_columns]
        elif len(cells) < n_columns:
            if group == 1 or (n_columns - len(cells)) % group:
                short = line, len(cells)
                continue
            n_cut += 1
            cells = cells + [""] * (n_columns - len(cells))
        if columns is not None:
            cells = [cells[i] for i in columns]
        values.extend(_row(path, cells, line))
        lines.append(line)
        ends_early = len(row) < n_columns
    else:
        if cut_off and ends_early and 0 < n_cut < len(lines):  # its last number may be cut, too
            n_cut -= 1
            short = lines.pop(), len(row)
            del values[len(lines) * (n_columns if columns is None else len(columns)) :]
        if short is not None and lines and cut_off:  # the last row of a file that was cut off
            findings.warn(f"the last row, line {short[0]}, is cut off: left out")
            short = None
    if short is not None:
        raise bad_file(path, f"line {short[0]} has {short[1]} columns", f"{n_columns}")
    n_rows = len(lines)
    if extra and len(extra) <= n_rows // 2:
        line, count = extra[0]
        raise bad_file(path, f"line {line} has {count} columns", f"{n_columns}")
    if extra:
        findings.leave_out(["(no name)"] * -(-(max(count for _, count in extra) - n_columns) // 3))
        findings.warn("there are more columns than names; those behind the named ones are left out")
    if n_cut:
        tell = findings.warn if n_cut == n_rows else findings.note
        tell(f"{n_cut} of {n_rows} rows end early; what they would hold is missing")
    width = n_columns if columns is None else len(columns)
    return np.frombuffer(values, np.float64).reshape(n_rows, width).copy()


def _row(path: Path, cells: list[str], line: int) -> list[float]:
    try:
        row = [float(cell) if cell else np.nan for cell in cells]
    except ValueError:
        row = None
    if row is None or np.inf in row or -np.inf in row or any("_" in cell for cell in cells):
        return [
            number(path, cell, f"line {line}, column {column + 1}")
            for column, cell in enumerate(cells)
        ]
    return row
