"""What a person said of leaves: must-link and cannot-link constraints [Wagstaff2001]."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Protocol

import numpy as np

from ..recording import BoolArray
from ..state import Count, State

Key = tuple[int, int]  # person, and id of the leaf in that person's tree
Pair = tuple[Key, Key]


@dataclass(frozen=True, eq=False)
class ConstraintsState(State):
    """Pairs of leaves that a person said are one motion, and pairs that are not."""

    together: tuple[tuple[tuple[Count, Count], tuple[Count, Count]], ...]
    apart: tuple[tuple[tuple[Count, Count], tuple[Count, Count]], ...]


class Said(Protocol):
    """Pairs of leaves that are together, and apart."""

    @property
    def together(self) -> Collection[Pair]:
        """Pairs that are one motion."""

    @property
    def apart(self) -> Collection[Pair]:
        """Pairs that are not."""


class Constraints:
    """Pairs of leaves that are, or are not, one motion; the rules respect them.

    The latest word counts.
    """

    def __init__(self) -> None:
        self._together: set[Pair] = set()
        self._apart: set[Pair] = set()

    def must_link(self, keys: Iterable[Key]) -> None:
        """Note that some leaves are one motion."""
        pairs = _pairs(keys)
        self._together |= pairs
        self._apart -= pairs

    def cannot_link(self, sides: Sequence[Iterable[Key]]) -> None:
        """Note that leaves on different sides are different motions."""
        groups = [list(side) for side in sides]
        pairs = _pairs(key for side in groups for key in side)
        pairs -= {pair for side in groups for pair in _pairs(side)}
        self._apart |= pairs
        self._together -= pairs

    def follow(self, heirs: Mapping[Key, Sequence[Key]]) -> None:
        """Note what became of leaves that are gone: what holds of one holds of its heirs."""
        for old, new in heirs.items():
            for name in ("_together", "_apart"):
                pairs: set[Pair] = getattr(self, name)
                mine = {pair for pair in pairs if old in pair}
                others = {one if two == old else two for one, two in mine}
                taken = {_pair(key, other) for key in new for other in others if key != other}
                setattr(self, name, (pairs - mine) | taken)
        self._apart -= self._together

    def exchange(self, gone: Said, back: Said, keys: Collection[Key] = ()) -> None:
        """Take back what was said, and say something else instead, of leaves that are there."""
        there = set(keys)
        together, apart = (
            {pair for pair in pairs if there.issuperset(pair)}
            for pairs in (back.together, back.apart)
        )
        self._together = (self._together - set(gone.together)) | together
        self._apart = ((self._apart - set(gone.apart)) | apart) - self._together

    def among(self, keys: Sequence[Key]) -> tuple[BoolArray, BoolArray]:
        """Return which of some leaves are together, and which apart, shape (n, n) each."""
        places = {key: place for place, key in enumerate(keys)}
        together, apart = np.zeros((2, len(keys), len(keys)), dtype=np.bool_)
        for pairs, matrix in ((self._together, together), (self._apart, apart)):
            for one, two in pairs:
                i, j = places[one], places[two]
                matrix[i, j] = matrix[j, i] = True
        return together, apart

    def renamed(self, new_key: Mapping[Key, Key]) -> Constraints:
        """Return the same of leaves that have other names."""
        constraints = Constraints()
        for name in ("_together", "_apart"):
            pairs = {_pair(new_key[one], new_key[two]) for one, two in getattr(self, name)}
            setattr(constraints, name, {pair for pair in pairs if pair[0] != pair[1]})
        return constraints

    def merged(self, other: Constraints) -> Constraints:
        """Return what was said here and there; where that differs, leaves are together."""
        constraints = Constraints()
        constraints._together = self._together | other._together
        constraints._apart = (self._apart | other._apart) - constraints._together
        return constraints

    def keys(self) -> set[Key]:
        """Return the leaves of which something was said."""
        return {key for pair in self._together | self._apart for key in pair}

    def state(self) -> ConstraintsState:
        """Return everything that was said."""
        return ConstraintsState(tuple(sorted(self._together)), tuple(sorted(self._apart)))

    def load_state(self, state: ConstraintsState) -> None:
        """Resume from what `state` returned."""
        self._together = {_pair(*pair) for pair in state.together}
        self._apart = {_pair(*pair) for pair in state.apart}


def _pair(one: Key, two: Key) -> Pair:
    return (one, two) if one <= two else (two, one)


def _pairs(keys: Iterable[Key]) -> set[Pair]:
    listed = list(keys)
    return {_pair(one, two) for i, one in enumerate(listed) for two in listed[:i]}
