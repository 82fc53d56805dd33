"""A table of segments as a file: which format by its suffix, and the formats of plain tables."""

from __future__ import annotations

import csv
import io
from collections.abc import Callable
from os import PathLike
from pathlib import Path
from types import MappingProxyType
from typing import NamedTuple

from ..errors import InvalidValueError, RecordingError
from ..extras import require
from ..library import RecognisedSegment, SegmentTable
from ..writing import written_whole
from . import boris, eaf, motion_bids


def _write_text(path: Path, text: str) -> None:
    with written_whole(path) as file:
        file.write_text(text, encoding="utf-8", errors="backslashreplace")


def as_csv(table: SegmentTable) -> str:
    """Return a table with commas and a head; what is missing is empty."""
    out = io.StringIO()
    writer = csv.writer(out, lineterminator="\n")
    writer.writerow(RecognisedSegment._fields)
    for row in table:
        writer.writerow("" if value is None else value for value in row.as_dict().values())
    return out.getvalue()


def _read_csv(text: str) -> SegmentTable:
    rows = list(csv.reader(io.StringIO(text), strict=True))
    head, body = (rows[0], rows[1:]) if rows else ([], [])
    return SegmentTable.of_columns({name: [row[k] for row in body] for k, name in enumerate(head)})


class TableFormat(NamedTuple):
    """A format of tables of segments.

    Attributes:
        name: What it is called.
        write: Writes a table to a file.
        read: Reads it again.
    """

    name: str
    write: Callable[[SegmentTable, Path], object]
    read: Callable[[Path], SegmentTable]


def _text_format(
    name: str, write: Callable[[SegmentTable], str], read: Callable[[str], SegmentTable]
) -> TableFormat:
    return TableFormat(
        name,
        lambda table, path: _write_text(path, write(table)),
        lambda path: read(path.read_text(encoding="utf-8")),
    )


def _write_parquet(table: SegmentTable, path: Path) -> None:
    parquet = require("pyarrow.parquet", "tables")
    with written_whole(path) as file:
        parquet.write_table(table.to_arrow(), file)


def _read_parquet(path: Path) -> SegmentTable:
    table = require("pyarrow.parquet", "tables").read_table(path)
    return SegmentTable.of_columns(table.to_pydict())


def _write_feather(table: SegmentTable, path: Path) -> None:
    feather = require("pyarrow.feather", "tables")
    with written_whole(path) as file:
        feather.write_feather(table.to_arrow(), str(file))


def _read_feather(path: Path) -> SegmentTable:
    table = require("pyarrow.feather", "tables").read_table(str(path))
    return SegmentTable.of_columns(table.to_pydict())


FORMATS = MappingProxyType(
    {
        ".csv": _text_format("CSV", as_csv, _read_csv),
        ".parquet": TableFormat("Parquet", _write_parquet, _read_parquet),
        ".arrow": TableFormat("Arrow", _write_feather, _read_feather),
        ".boris": _text_format("BORIS", boris.as_project, boris.from_project),
        ".eaf": _text_format("ELAN", eaf.as_document, eaf.from_document),
        "_events.tsv": TableFormat("Motion-BIDS events", motion_bids.write, motion_bids.read),
    }
)
"""The formats, by how a file's name ends."""


def format_of(path: str | PathLike[str]) -> TableFormat:
    """Return the format that a file's name asks for.

    Raises:
        InvalidValueError: It asks for none.

    Example:
        >>> format_of("sub-01_task-walk_tracksys-vicon_events.tsv").name
        'Motion-BIDS events'
    """
    name = Path(path).name
    for ending, found in FORMATS.items():
        if name.lower().endswith(ending):
            return found
    raise InvalidValueError(
        f"a table of segments is a file named like *{', *'.join(FORMATS)}, not {name!r}"
    )


def write_segments(table: SegmentTable, path: str | PathLike[str]) -> Path:
    """Write a table to a file; `read_segments` returns the same.

    Args:
        table: The segments, of one take or of several.
        path: The file; its name decides the format, one of `FORMATS`.

    Raises:
        InvalidValueError: The name asks for no format.
        MissingDependencyError: The format needs a package of the extra ``tables``.

    Example:
        >>> row = RecognisedSegment("walk", 0.5, 1.7, 3, "step", "step", 0.2, 0.6, "anna", 0.9)
        >>> path = write_segments(SegmentTable([row]), "walk.eaf")
        >>> read_segments(path) == SegmentTable([row])
        True
    """
    path = Path(path)
    found = format_of(path)
    path.parent.mkdir(parents=True, exist_ok=True)
    found.write(table, path)
    return path


def read_segments(path: str | PathLike[str]) -> SegmentTable:
    """Read a table that `write_segments` wrote.

    Raises:
        InvalidValueError: The name is of no format.
        RecordingError: The file is missing, or holds something else.

    Example:
        >>> row = RecognisedSegment("walk", 0.5, 1.7, 3, "step", "step", 0.2, 0.6, "anna", 0.9)
        >>> read_segments(write_segments(SegmentTable([row]), "walk.csv")).column("name")
        ['step']
    """
    path = Path(path)
    try:
        return format_of(path).read(path)
    except (OSError, UnicodeDecodeError) as error:
        reason = getattr(error, "strerror", None) or error
        raise RecordingError(f"{path}: cannot be read ({reason})") from error
    except (ValueError, LookupError, TypeError, AttributeError, SyntaxError) as error:
        if isinstance(error, (InvalidValueError, RecordingError)):
            raise
        raise RecordingError(f"{path}: no table of segments ({error})") from error
