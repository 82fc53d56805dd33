"""Numbers from text: fast where all is well, exact about the cell where it is not."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import chain
from pathlib import Path

import numpy as np

from ..recording import FloatArray
from .files import bad_file


def number(path: Path, cell: str, where: str) -> float:
    """Return a finite number, or NaN for an empty cell or a written ``nan``.

    Raises:
        RecordingError: The cell is not a number, or not finite.
    """
    text = cell.strip()
    if not text:
        return np.nan
    try:
        if "_" in text:  # Python reads "1_0" as ten
            raise ValueError
        value = float(text)
    except ValueError:
        raise bad_file(path, f"{where} holds {cell[:40]!r}", "a number") from None
    if np.isinf(value):
        raise bad_file(path, f"{where} is infinite", "a finite number, or nan where it is missing")
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
