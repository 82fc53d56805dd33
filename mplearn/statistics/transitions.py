"""Which primitive follows which, for each person or take."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise
from typing import Any

import numpy as np

from ..extras import require
from ..library import SegmentTable
from ..recording import FloatArray
from .measures import Unit, grouped, names_of

_LONGEST_PAUSE_S = 2.0


@dataclass(frozen=True, eq=False)
class Transitions:
    """How often each primitive followed each other one.

    Attributes:
        units: People, or takes, length U.
        primitives: Names of the primitives, length P.
        counts: Shape (U, P, P): from the second axis to the third.

    Example:
        >>> import numpy as np
        >>> counts = np.array([[[0.0, 3.0], [1.0, 1.0]]])
        >>> Transitions(("anna",), ("bow", "rise"), counts).matrix("anna").tolist()
        [[0.0, 1.0], [0.5, 0.5]]
        >>> Transitions(("anna",), ("bow", "rise"), counts).to_pandas().iloc[0].to_dict()
        {'unit': 'anna', 'before': 'bow', 'after': 'rise', 'times': 3}
    """

    units: tuple[str, ...]
    primitives: tuple[str, ...]
    counts: FloatArray

    def matrix(self, *units: str) -> FloatArray:
        """Return the share of each successor after each primitive, of some units together.

        Shape (P, P); a row is NaN where a primitive was never followed by any.
        """
        chosen = [self.units.index(unit) for unit in units or self.units]
        counts = self.counts[chosen].sum(axis=0)
        with np.errstate(invalid="ignore"):
            return np.asarray(counts / counts.sum(axis=1, keepdims=True))

    def to_pandas(self) -> Any:
        """Return a `pandas.DataFrame`: a row for each unit and pair that it was seen to take.

        Its columns are ``unit``, ``before``, ``after`` and ``times``.

        Raises:
            MissingDependencyError: pandas is not installed (extra ``tables``).
        """
        pandas = require("pandas", "tables")
        unit, before, after = np.nonzero(self.counts)
        names = np.array(self.primitives, dtype=object)
        return pandas.DataFrame(
            {
                "unit": np.array(self.units, dtype=object)[unit],
                "before": names[before],
                "after": names[after],
                "times": self.counts[unit, before, after].astype(np.int64),
            }
        )

    def __repr__(self) -> str:
        """Return how many transitions of how many were counted."""
        n_units, n_primitives = len(self.units), len(self.primitives)
        counted = f"{self.counts.sum():.0f} of {n_primitives} primitives"
        return f"Transitions({counted}, {n_units} units)"


def transitions(
    table: SegmentTable, unit: Unit = "person", longest_pause_s: float = _LONGEST_PAUSE_S
) -> Transitions:
    """Count which primitive follows which.

    Args:
        table: The segments; what was recognised as nothing breaks the sequence.
        unit: Whether people or takes are told apart.
        longest_pause_s: A longer pause between two segments breaks it, too [s].

    Example:
        >>> from mplearn.library import RecognisedSegment
        >>> rows = [RecognisedSegment("t", k, k + 1, 1, name, name, 0.1, 0.9, "anna")
        ...         for k, name in enumerate(["down", "up", "down", "up"])]
        >>> transitions(SegmentTable(rows)).counts[0].tolist()
        [[0.0, 2.0], [1.0, 0.0]]
    """
    units, primitives = grouped(table, unit), names_of(table)
    place = {name: k for k, name in enumerate(primitives)}
    counts = np.zeros((len(units), len(primitives), len(primitives)))
    for u, takes in enumerate(units.values()):
        for rows in takes.values():
            for a, b in pairwise(rows):
                if a.name and b.name and b.start_s - a.end_s <= longest_pause_s:
                    counts[u, place[a.name], place[b.name]] += 1
    return Transitions(tuple(units), primitives, counts)
