"""One tidy table of segments: a row a segment, a column a variable [Wickham2014]."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Mapping, Sequence
from typing import Any, NamedTuple

from ..errors import RecordingError
from ..extras import require


class RecognisedSegment(NamedTuple):
    """A segment of a recording, and what a library says of it.

    Attributes:
        take: Name of the recording.
        start_s: When it begins [s].
        end_s: When it ends [s].
        primitive: Id of the primitive that it is an execution of; None where none is like it.
        name: The primitive's name; "" where there is none.
        nearest: Name of the nearest primitive, recognised or not; "" where there is none.
        distance: To the nearest primitive [nats a frame]; NaN where there is none.
        p_value: Share of what was learned that is at least as far out, in (0, 1]; NaN as above.
        person: Who moves; "" where unknown.
        confidence: How sure the segmenter is of the boundary at the end, in [0, 1].

    Example:
        >>> row = RecognisedSegment("walk", 0.5, 1.7, 3, "step", "step", 0.2, 0.6, "anna")
        >>> round(row.duration_s, 6), row.name
        (1.2, 'step')
        >>> RecognisedSegment.from_dict(row.as_dict()).primitive
        3
    """

    take: str
    start_s: float
    end_s: float
    primitive: int | None
    name: str
    nearest: str
    distance: float
    p_value: float
    person: str = ""
    confidence: float = math.nan

    @property
    def duration_s(self) -> float:
        """Length [s]."""
        return self.end_s - self.start_s

    def as_dict(self) -> dict[str, Any]:
        """Return it as values that JSON has; NaN is None."""
        return {
            key: None if isinstance(value, float) and math.isnan(value) else value
            for key, value in self._asdict().items()
        }

    @classmethod
    def from_dict(cls, values: Mapping[str, Any]) -> RecognisedSegment:
        """Return the segment that `as_dict` described; texts of numbers will do.

        Raises:
            RecordingError: A value is missing, or is not of its kind.
        """
        try:
            return cls(
                **{name: _KINDS[name](values[name]) for name in cls._fields}  # type: ignore[arg-type]
            )
        except (KeyError, TypeError, ValueError) as error:
            raise RecordingError(f"no segment of a table: {dict(values)} ({error!r})") from error


def _number(value: Any) -> float:
    return math.nan if value is None or value in ("", "n/a") else float(value)


def _text(value: Any) -> str:
    return "" if value is None else str(value)


def _id(value: Any) -> int | None:
    if value is None or value in ("", "n/a") or value != value:
        return None
    return int(float(value))


_KINDS = {
    **dict.fromkeys(("take", "name", "nearest", "person"), _text),
    **dict.fromkeys(("start_s", "end_s", "distance", "p_value", "confidence"), _number),
    "primitive": _id,
}


class SegmentTable(Sequence[RecognisedSegment]):
    """Segments in the order of their takes and of their times.

    Args:
        rows: The segments.

    Example:
        >>> row = RecognisedSegment("walk", 0.5, 1.7, 3, "step", "step", 0.2, 0.6, "anna", 0.9)
        >>> table = SegmentTable([row])
        >>> len(table), table[0].name, table.column("end_s")
        (1, 'step', [1.7])
    """

    def __init__(self, rows: Iterable[RecognisedSegment] = ()) -> None:
        self._rows = tuple(rows)

    def __len__(self) -> int:
        """Number of segments."""
        return len(self._rows)

    def __getitem__(self, index: Any) -> Any:
        """Return a segment, or a table of some."""
        found = self._rows[index]
        return SegmentTable(found) if isinstance(index, slice) else found

    def __iter__(self) -> Iterator[RecognisedSegment]:
        """Go through the segments."""
        return iter(self._rows)

    def __eq__(self, other: object) -> bool:
        """Whether two tables hold the same; NaN is NaN."""
        if not isinstance(other, SegmentTable):
            return NotImplemented
        return [row.as_dict() for row in self] == [row.as_dict() for row in other]

    __hash__ = None  # type: ignore[assignment]

    def __repr__(self) -> str:
        """Return how many segments of how many takes there are."""
        return f"SegmentTable({len(self)} segments of {len(set(self.column('take')))} takes)"

    def column(self, name: str) -> list[Any]:
        """Return a variable of all segments, by the name of an attribute of theirs."""
        return [getattr(row, name) for row in self._rows]

    def columns(self) -> dict[str, list[Any]]:
        """Return all columns by name; a missing value is None."""
        rows = [row.as_dict() for row in self._rows]
        return {name: [row[name] for row in rows] for name in RecognisedSegment._fields}

    def to_pandas(self) -> Any:
        """Return a `pandas.DataFrame`; primitives are of type Int64, which has missing values.

        Raises:
            MissingDependencyError: pandas is not installed (extra ``tables``).
        """
        pandas = require("pandas", "tables")
        frame = pandas.DataFrame(self.columns(), columns=RecognisedSegment._fields)
        numbers = ("start_s", "end_s", "distance", "p_value", "confidence")
        return frame.astype({"primitive": "Int64", **dict.fromkeys(numbers, "float64")})

    def to_arrow(self) -> Any:
        """Return a `pyarrow.Table`.

        Raises:
            MissingDependencyError: pyarrow is not installed (extra ``tables``).
        """
        pa = require("pyarrow", "tables")
        number, text = pa.float64(), pa.string()
        kinds = {
            name: text if kind is _text else pa.int64() if kind is _id else number
            for name, kind in _KINDS.items()
        }
        schema = pa.schema([(name, kinds[name]) for name in RecognisedSegment._fields])
        return pa.table(self.columns(), schema=schema)

    @classmethod
    def of_columns(cls, columns: Mapping[str, Sequence[Any]]) -> SegmentTable:
        """Return the table that has these columns.

        Raises:
            RecordingError: One is missing, or holds other values.
        """
        lacking = [name for name in RecognisedSegment._fields if name not in columns]
        if lacking:
            raise RecordingError(f"a table of segments needs columns {', '.join(lacking)}")
        values = zip(*(columns[name] for name in RecognisedSegment._fields), strict=True)
        names = RecognisedSegment._fields
        return cls(
            RecognisedSegment.from_dict(dict(zip(names, row, strict=True))) for row in values
        )
