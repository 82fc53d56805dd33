"""A number for each person (or take) and primitive: how often, how long, how even."""

from __future__ import annotations

import re
from collections import defaultdict
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise
from types import MappingProxyType
from typing import Any, Literal, TypeAlias

import numpy as np

from ..errors import InvalidValueError
from ..extras import require
from ..library import RecognisedSegment, SegmentTable
from ..recording import FloatArray

Unit: TypeAlias = Literal["person", "take"]

_Executions: TypeAlias = Sequence[RecognisedSegment]  # of one primitive in one take

_NUMBER = re.compile(r"([0-9]+)")


@dataclass(frozen=True, eq=False)
class Measure:
    """A measure of each primitive, for each unit of a study.

    Attributes:
        name: What is measured, with its unit of measure.
        units: People, or takes, length U.
        primitives: Names of the primitives, length P.
        values: Shape (U, P); NaN where a unit shows too little of a primitive.

    Example:
        >>> import numpy as np
        >>> tempo = Measure("duration [s]", ("anna", "ben"), ("bow",), np.array([[1.2], [0.9]]))
        >>> float(tempo.of("ben", "bow"))
        0.9
        >>> tempo.to_pandas()["bow"].to_dict()
        {'anna': 1.2, 'ben': 0.9}
    """

    name: str
    units: tuple[str, ...]
    primitives: tuple[str, ...]
    values: FloatArray

    def of(self, unit: str, primitive: str) -> float:
        """Return the value of a unit and a primitive."""
        return float(self.values[self.units.index(unit), self.primitives.index(primitive)])

    def to_pandas(self) -> Any:
        """Return a `pandas.DataFrame`: a row a unit, a column a primitive.

        Raises:
            MissingDependencyError: pandas is not installed (extra ``tables``).
        """
        pandas = require("pandas", "tables")
        frame = pandas.DataFrame(self.values, self.units, self.primitives)
        return frame.rename_axis(index="unit", columns=self.name)

    def __repr__(self) -> str:
        """Return what was measured, and of how many."""
        n_units, n_primitives = len(self.units), len(self.primitives)
        return f"Measure({self.name!r}, {n_units} units, {n_primitives} primitives)"


def grouped(table: SegmentTable, unit: Unit) -> dict[str, dict[str, list[RecognisedSegment]]]:
    """Return the segments of each unit by take, in the order of time.

    Raises:
        InvalidValueError: ``unit`` is neither person nor take, or somebody is unnamed.
    """
    if unit not in ("person", "take"):
        raise InvalidValueError(f"unit must be 'person' or 'take', not {unit!r}")
    found: defaultdict[str, defaultdict[str, list[RecognisedSegment]]]
    found = defaultdict(lambda: defaultdict(list))
    for row in table:
        who = row.person if unit == "person" else row.take
        if not who:
            raise InvalidValueError(
                f"take {row.take!r} names no person: unit='take' compares takes instead"
            )
        found[who][row.take].append(row)
    return {
        who: {take: sorted(rows, key=lambda row: row.start_s) for take, rows in takes.items()}
        for who, takes in sorted(found.items())
    }


def names_of(table: SegmentTable) -> tuple[str, ...]:
    """Return the names of the primitives that a table holds, in order: P2 before P10."""
    return tuple(sorted({row.name for row in table if row.name}, key=_natural))


def _natural(name: str) -> tuple[list[tuple[int, str]], str]:
    """Return what names are ordered by: numbers in them by their size, all else as text."""
    parts = [part.lstrip("0") if k % 2 else part for k, part in enumerate(_NUMBER.split(name))]
    return [(len(part) if k % 2 else 0, part) for k, part in enumerate(parts)], name


def _measured(
    name: str,
    table: SegmentTable,
    unit: Unit,
    value: Callable[[Sequence[_Executions]], float],
) -> Measure:
    """Return what ``value`` says of each unit's executions of each primitive, take by take."""
    units, primitives = grouped(table, unit), names_of(table)
    values = np.empty((len(units), len(primitives)))
    for u, takes in enumerate(units.values()):
        performed: defaultdict[str, list[_Executions]] = defaultdict(list)
        for rows in takes.values():
            for primitive, executions in _by_name(rows).items():
                performed[primitive].append(executions)
        values[u] = [value(performed.get(primitive, ())) for primitive in primitives]
    return Measure(name, tuple(units), primitives, values)


def _by_name(rows: Sequence[RecognisedSegment]) -> dict[str, _Executions]:
    found: defaultdict[str, list[RecognisedSegment]] = defaultdict(list)
    for row in rows:
        if row.name:
            found[row.name].append(row)
    return dict(found)


def repetitions(table: SegmentTable, unit: Unit = "person") -> Measure:
    """Return how often each primitive was performed.

    Example:
        >>> rows = [RecognisedSegment("t", k, k + 0.5, 1, "bow", "bow", 0.1, 0.9, "anna")
        ...         for k in range(3)]
        >>> repetitions(SegmentTable(rows)).of("anna", "bow")
        3.0
    """
    return _measured("repetitions", table, unit, lambda takes: sum(map(len, takes)))


def durations(table: SegmentTable, unit: Unit = "person") -> Measure:
    """Return how long each primitive takes, on average [s].

    Example:
        >>> rows = [RecognisedSegment("t", 0.0, 0.5, 1, "bow", "bow", 0.1, 0.9, "anna")]
        >>> durations(SegmentTable(rows)).of("anna", "bow")
        0.5
    """

    def value(takes: Sequence[_Executions]) -> float:
        return _mean([row.duration_s for rows in takes for row in rows])

    return _measured("duration [s]", table, unit, value)


def tempo(table: SegmentTable, unit: Unit = "person") -> Measure:
    """Return how fast each primitive is repeated [1/min], by the median time between starts.

    Only what lies between two executions in a take counts, whatever is done in between.

    Example:
        >>> rows = [
        ...     RecognisedSegment("t", start, start + 0.5, 1, "bow", "bow", 0.1, 0.9, "anna")
        ...     for start in (0.0, 2.0, 4.0)
        ... ]
        >>> tempo(SegmentTable(rows)).of("anna", "bow")
        30.0
    """

    def value(takes: Sequence[_Executions]) -> float:
        gaps = [b.start_s - a.start_s for rows in takes for a, b in pairwise(rows)]
        return 60.0 / float(np.median(gaps)) if gaps else np.nan

    return _measured("tempo [1/min]", table, unit, value)


def variability(table: SegmentTable, unit: Unit = "person") -> Measure:
    """Return how uneven the durations of each primitive are: their coefficient of variation.

    Example:
        >>> rows = [
        ...     RecognisedSegment("t", 0.0, end, 1, "bow", "bow", 0.1, 0.9, "anna")
        ...     for end in (0.9, 1.1)
        ... ]
        >>> round(variability(SegmentTable(rows)).of("anna", "bow"), 2)
        0.14
    """

    def value(takes: Sequence[_Executions]) -> float:
        lengths = [row.duration_s for rows in takes for row in rows]
        return float(np.std(lengths, ddof=1) / np.mean(lengths)) if len(lengths) > 1 else np.nan

    return _measured("variability of duration", table, unit, value)


def spread(table: SegmentTable, unit: Unit = "person") -> Measure:
    """Return how far executions lie from what was learned of their primitive [nats a frame].

    Example:
        >>> rows = [RecognisedSegment("t", 0.0, 0.5, 1, "bow", "bow", 0.1, 0.9, "anna")]
        >>> spread(SegmentTable(rows)).of("anna", "bow")
        0.1
    """

    def value(takes: Sequence[_Executions]) -> float:
        return _mean([row.distance for rows in takes for row in rows])

    return _measured("distance [nats a frame]", table, unit, value)


def _mean(values: Sequence[float]) -> float:
    return float(np.mean(values)) if len(values) else np.nan


MEASURES: Mapping[str, Callable[..., Measure]] = MappingProxyType(
    {
        "repetitions": repetitions,
        "durations": durations,
        "tempo": tempo,
        "variability": variability,
        "spread": spread,
    }
)
"""The measures by name."""
