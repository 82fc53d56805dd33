"""Which primitive follows which, for each person or take."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise

import numpy as np

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
