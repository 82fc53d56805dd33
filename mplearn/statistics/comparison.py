"""Do groups of people, or conditions, differ? Permutation tests, exact whatever the distribution.

Whole people (or takes) are exchanged between the groups, never single segments: those of one person
are alike, and would make any two groups differ. A p-value counts the exchanges that are at least as
far from equal as what was found [Phipson2010], so that it is never too small; for several
primitives at once it is that of the largest of all statistics [Westfall1993].
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import combinations
from math import comb
from typing import Any

import numpy as np

from ..errors import InvalidValueError
from ..extras import require
from ..recording import BoolArray, FloatArray, IntArray
from .measures import Measure
from .transitions import Transitions

PERMUTATIONS = 999
_AT_ONCE = 1 << 22  # numbers in memory


@dataclass(frozen=True, eq=False)
class Comparison:
    """What a comparison of groups found.

    Attributes:
        what: What is compared.
        groups: Their names, length G.
        sizes: Units in each, length G.
        names: What is compared one by one (primitives), length K.
        means: Mean of each group, shape (G, K).
        statistics: How far from equal each is, length K.
        p_values: Of each by itself, length K; NaN where there is too little.
        adjusted: Of each among all, length K: the chance that any would be as far from equal.
        p_value: That the groups do not differ in anything.
        permutations: Exchanges of units between the groups that were tried.

    Example:
        >>> import numpy as np
        >>> from mplearn.statistics import Measure
        >>> seconds = np.array([[1.0], [1.1], [0.9], [1.9], [2.0], [2.1]])
        >>> people = ("a", "b", "c", "d", "e", "f")
        >>> groups = dict(zip(people, ("young",) * 3 + ("old",) * 3, strict=True))
        >>> found = compare(Measure("duration [s]", people, ("bow",), seconds), groups)
        >>> found.groups, found.sizes, round(found.p_value, 3)
        (('old', 'young'), (3, 3), 0.1)
        >>> found.to_pandas().loc["bow", ["mean of old", "mean of young"]].round(2).tolist()
        [2.0, 1.0]
    """

    what: str
    groups: tuple[str, ...]
    sizes: tuple[int, ...]
    names: tuple[str, ...]
    means: FloatArray
    statistics: FloatArray
    p_values: FloatArray
    adjusted: FloatArray
    p_value: float
    permutations: int

    def to_pandas(self) -> Any:
        """Return a `pandas.DataFrame`: a row for each of the names.

        Its columns are the mean of each group, ``statistic``, ``p_value`` and ``adjusted``.

        Raises:
            MissingDependencyError: pandas is not installed (extra ``tables``).
        """
        pandas = require("pandas", "tables")
        means = {
            f"mean of {group}": mean for group, mean in zip(self.groups, self.means, strict=True)
        }
        found = {"statistic": self.statistics, "p_value": self.p_values, "adjusted": self.adjusted}
        return pandas.DataFrame(means | found, self.names).rename_axis(self.what)

    def __repr__(self) -> str:
        """Return what was compared, and what came of it."""
        groups = " with ".join(
            f"{n} {name!r}" for name, n in zip(self.groups, self.sizes, strict=True)
        )
        return f"Comparison({self.what}, {groups}: p = {self.p_value:.3g})"


def compare(
    measure: Measure,
    groups: Mapping[str, str],
    *,
    permutations: int = PERMUTATIONS,
    seed: int = 0,
) -> Comparison:
    """Compare a measure between groups, primitive by primitive and all together.

    The statistic is that of a one-way analysis of variance, of the units' values [Anderson2001].

    Args:
        measure: A number for each unit and primitive.
        groups: Group of each unit, by its name; units without one are left out.
        permutations: Exchanges that are drawn; where there are fewer, all are tried.
        seed: Seed of the draws.

    Raises:
        InvalidValueError: There are not two groups of at least two units.

    Example:
        >>> values = np.array([[1.0], [1.1], [0.9], [1.0], [2.0], [2.1], [1.9], [2.0]])
        >>> measure = Measure("duration [s]", tuple("abcdefgh"), ("bow",), values)
        >>> groups = dict(zip("abcdefgh", ["slow"] * 4 + ["fast"] * 4))
        >>> round(compare(measure, groups).p_value, 3)
        0.029
    """
    chosen, names, codes = _coded(measure.units, groups)
    values = measure.values[chosen]
    members = _exchanges(codes, len(names), permutations, seed)
    found = np.concatenate(
        [
            _f_statistics(values, part)
            for part in _parts(members, len(names) * values.shape[1] + values.shape[0])
        ]
    )
    p_values, adjusted, p_value = _judged(found)
    means = np.array([_column_means(values[codes == g]) for g in range(len(names))])
    return Comparison(
        measure.name,
        names,
        tuple(np.bincount(codes, minlength=len(names)).tolist()),
        measure.primitives,
        means,
        found[0],
        p_values,
        adjusted,
        p_value,
        len(members) - 1,
    )


def compare_transitions(
    counted: Transitions,
    groups: Mapping[str, str],
    *,
    permutations: int = PERMUTATIONS,
    seed: int = 0,
) -> Comparison:
    """Compare what follows each primitive between groups, one by one and all together.

    The statistic is the log likelihood ratio of a matrix for each group against one for all, a row
    at a time [Anderson1957], of the units' own shares, so that nobody counts more for having moved
    longer.

    Args:
        counted: Transitions of each unit.
        groups: Group of each unit, by its name; units without one are left out.
        permutations: Exchanges that are drawn; where there are fewer, all are tried.
        seed: Seed of the draws.

    Returns:
        The comparison; its means are the share of each group's most frequent successor.

    Raises:
        InvalidValueError: There are not two groups of at least two units.

    Example:
        >>> import numpy as np
        >>> counts = np.zeros((6, 2, 2))
        >>> counts[:3, 0, 0], counts[3:, 0, 1] = 9.0, 9.0  # the young repeat, the old go on
        >>> people = ("a", "b", "c", "d", "e", "f")
        >>> groups = dict(zip(people, ("young",) * 3 + ("old",) * 3, strict=True))
        >>> found = compare_transitions(Transitions(people, ("bow", "rise"), counts), groups)
        >>> found.names, round(found.p_value, 3)
        (('bow', 'rise'), 0.1)
    """
    chosen, names, codes = _coded(counted.units, groups)
    counts = counted.counts[chosen]
    shares = counts / np.maximum(counts.sum(axis=2, keepdims=True), 1.0)
    members = _exchanges(codes, len(names), permutations, seed)
    n_cells = len(names) * counts.shape[1] ** 2
    found = np.concatenate([_likelihood_ratios(shares, m) for m in _parts(members, n_cells)])
    p_values, adjusted, p_value = _judged(found)
    with np.errstate(invalid="ignore", divide="ignore"):
        sums = np.array([counts[codes == g].sum(axis=0) for g in range(len(names))])
        means = (sums / sums.sum(axis=2, keepdims=True)).max(axis=2, initial=0.0)
    return Comparison(
        "transitions",
        names,
        tuple(np.bincount(codes, minlength=len(names)).tolist()),
        counted.primitives,
        means,
        found[0],
        p_values,
        adjusted,
        p_value,
        len(members) - 1,
    )


def _coded(
    units: Sequence[str], groups: Mapping[str, str]
) -> tuple[list[int], tuple[str, ...], IntArray]:
    """Return the units that have a group, the groups' names, and each one's number."""
    strangers = sorted(set(groups) - set(units))
    if strangers:
        raise InvalidValueError(
            f"{', '.join(strangers[:8])} are no units; there are {', '.join(list(units)[:30])}"
        )
    chosen = [k for k, unit in enumerate(units) if unit in groups]
    names = tuple(sorted({groups[units[k]] for k in chosen}))
    codes = np.array([names.index(groups[units[k]]) for k in chosen], dtype=np.int64)
    if len(names) < 2 or np.bincount(codes, minlength=len(names)).min() < 2:
        raise InvalidValueError(
            "a comparison needs two groups or more, of two units each at least, not "
            f"{ {name: int((codes == g).sum()) for g, name in enumerate(names)} }"
        )
    return chosen, names, codes


def _exchanges(codes: IntArray, n_groups: int, permutations: int, seed: int) -> BoolArray:
    """Return who is in which group, shape (1 + B, G, U): as it is, then as exchanged."""
    if permutations < 1:
        raise InvalidValueError(f"permutations must be at least 1, not {permutations}")
    n = len(codes)
    size = int((codes == 0).sum())
    if n_groups == 2 and comb(n, size) - 1 <= permutations:
        firsts = [set(chosen) for chosen in combinations(range(n), size)]
        own = set(np.flatnonzero(codes == 0).tolist())
        firsts.remove(own)
        drawn = np.array([[int(k not in first) for k in range(n)] for first in [own, *firsts]])
    else:
        rng = np.random.default_rng(seed)
        drawn = np.stack([codes, *(rng.permutation(codes) for _ in range(permutations))])
    return np.asarray(drawn[:, None, :] == np.arange(n_groups)[None, :, None])


def _parts(members: BoolArray, n_numbers: int) -> list[BoolArray]:
    """Return the exchanges in parts that fit into memory."""
    size = max(1, _AT_ONCE // max(1, n_numbers))
    return [members[k : k + size] for k in range(0, len(members), size)]


def _f_statistics(values: FloatArray, members: BoolArray) -> FloatArray:
    """Return F of each exchange and column, shape (B, K); NaN where there is too little."""
    seen = np.isfinite(values)
    filled = np.where(seen, values - _column_means(values), 0.0)
    inside = members.astype(np.float64)
    n = inside @ seen.astype(np.float64)  # (B, G, K)
    sums = inside @ filled
    with np.errstate(invalid="ignore", divide="ignore"):
        between = np.where(n > 0, sums**2 / n, 0.0).sum(axis=1)
        total, n_all, n_groups = (filled**2).sum(axis=0), seen.sum(axis=0), (n > 0).sum(axis=1)
        within = np.maximum(total - between, 1e-12 * total)
        found = (between / (n_groups - 1)) / (within / (n_all - n_groups))
    return np.where((n_groups > 1) & (n_all > n_groups) & (total > 0), found, np.nan)


def _column_means(values: FloatArray) -> FloatArray:
    seen = np.isfinite(values)
    n = seen.sum(axis=0)
    sums = np.where(seen, values, 0.0).sum(axis=0)
    return np.where(n > 0, sums / np.maximum(n, 1), np.nan)


def _likelihood_ratios(shares: FloatArray, members: BoolArray) -> FloatArray:
    """Return the log likelihood ratio of each row of the matrices, shape (B, P)."""
    n_units, size, _ = shares.shape
    inside = members.astype(np.float64)
    cells = inside @ shares.reshape(n_units, size * size)
    cells = cells.reshape(*inside.shape[:2], size, size)
    whole = shares.sum(axis=0)
    return np.asarray(_entropies(whole) - _entropies(cells).sum(axis=1))


def _entropies(cells: FloatArray) -> FloatArray:
    """Return n times the entropy of each row of sums [nat]."""
    sums = cells.sum(axis=-1)
    return np.asarray(_n_log_n(sums) - _n_log_n(cells).sum(axis=-1))


def _n_log_n(x: FloatArray) -> FloatArray:
    return np.asarray(x * np.log(np.where(x > 0, x, 1.0)))


def _judged(found: FloatArray) -> tuple[FloatArray, FloatArray, float]:
    """Return p-values of the first row among all: each, each among all columns, and of all.

    Columns are made comparable by their own ranks before the largest is taken.
    """
    known = np.isfinite(found).any(axis=0) & np.isfinite(found[0])
    n, width = found.shape
    p_values, adjusted = np.full(width, np.nan), np.full(width, np.nan)
    if not known.any():
        return p_values, adjusted, 1.0
    table = np.where(np.isfinite(found), found, -np.inf)[:, known]
    slack = 1e-9 * np.maximum(1.0, np.abs(np.where(np.isfinite(table), table, 0.0)))
    order = np.sort(table + slack, axis=0)
    ranks = np.empty_like(table)
    for k in range(table.shape[1]):  # share of exchanges at least as far from equal
        ranks[:, k] = (n - np.searchsorted(order[:, k], table[:, k], side="left")) / n
    p_values[known] = ranks[0]
    least = ranks.min(axis=1)
    adjusted[known] = [(least <= each + 1e-12).mean() for each in ranks[0]]
    return p_values, adjusted, float((least <= least[0] + 1e-12).mean())
