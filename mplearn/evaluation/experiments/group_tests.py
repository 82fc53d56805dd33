"""Are the tests that compare groups calibrated? Groups that do not differ, and groups that do."""

from __future__ import annotations

from collections.abc import Callable, Mapping

import numpy as np

from ...library import RecognisedSegment, SegmentTable
from ...statistics import (
    Comparison,
    compare,
    compare_transitions,
    durations,
    repetitions,
    tempo,
    transitions,
    variability,
)
from ..table import Table, percent

LEVEL = 0.05
_PEOPLE = 12  # half of them in each group
_MOTIONS = 40  # of each
_NAMES = ("bow", "lift", "reach", "squat", "turn")
_HABIT = 0.25  # how much people differ: standard deviation of the logarithm of what is theirs
_EXCHANGES = 199

Test = Callable[[SegmentTable, Mapping[str, str], int], Comparison]

TESTS: Mapping[str, Test] = {
    "transitions": lambda table, groups, seed: compare_transitions(
        transitions(table), groups, permutations=_EXCHANGES, seed=seed
    ),
    **{
        name: lambda table, groups, seed, measure=measure: compare(  # type: ignore[misc]
            measure(table), groups, permutations=_EXCHANGES, seed=seed
        )
        for name, measure in (
            ("durations", durations),
            ("repetitions", repetitions),
            ("tempo", tempo),
            ("variability", variability),
        )
    },
}


def made_up_study(
    rng: np.random.Generator, effect: float = 0.0
) -> tuple[SegmentTable, dict[str, str]]:
    """Make up the segments of people, each with habits of his or her own, in two groups.

    Args:
        rng: Source of all that is drawn.
        effect: How much the second group differs, in standard deviations of the habits: it is
            slower, less even, and prefers another successor.
    """
    size = len(_NAMES)
    usual = rng.dirichlet(np.ones(size), size)
    other = rng.dirichlet(np.ones(size), size)
    rows, groups = [], {}
    for k in range(_PEOPLE):
        second = k >= _PEOPLE // 2
        who, strength = f"p{k:02d}", effect * second
        groups[who] = "second" if second else "first"
        share = min(1.0, _HABIT * strength)
        chain = (1 - share) * usual + share * other
        chain = np.array([rng.dirichlet(30 * row + 0.05) for row in chain])
        length = np.exp(_HABIT * (rng.normal(size=size) + strength))
        unevenness = 0.1 * np.exp(_HABIT * (rng.normal() + strength))
        time_s, at = 0.0, int(rng.integers(size))
        for _ in range(_MOTIONS):
            lasts_s = float(length[at] * np.exp(unevenness * rng.normal()))
            row = (who, time_s, time_s + lasts_s, at, _NAMES[at], _NAMES[at], 0.1, 0.5, who)
            rows.append(RecognisedSegment(*row))
            time_s += lasts_s + 0.2
            at = int(rng.choice(size, p=chain[at]))
    return SegmentTable(rows), groups


def alarms(n: int, effect: float = 0.0, seed: int = 0) -> dict[str, float]:
    """Return the share of made-up studies in which each test finds a difference, at 5 %."""
    found = dict.fromkeys(TESTS, 0)
    for k in range(n):
        table, groups = made_up_study(np.random.default_rng((seed, k)), effect)
        for name, test in TESTS.items():
            found[name] += test(table, groups, k).p_value <= LEVEL
    return {name: count / n for name, count in found.items()}


def group_test_table(n: int = 1000, n_different: int = 200) -> Table:
    """Count how often each test finds a difference where there is none, and where there is one.

    Args:
        n: Studies without a difference.
        n_different: Studies with one.

    Example:
        >>> table = group_test_table(n=2, n_different=2)
        >>> len(table.rows), table.columns[0]
        (5, 'test')
    """
    same, large = alarms(n), alarms(n_different, effect=1.5, seed=1)
    return Table(
        "Tests that compare groups: differences found",
        ("test", "where there is none", "where there is one"),
        tuple((name, percent(same[name]), percent(large[name])) for name in TESTS),
        f"{n} made-up studies of {_PEOPLE} people in two groups without a difference, at the level "
        f"of {100 * LEVEL:.0f} % (5 +- 1.5 % expected: two standard errors), and {n_different} in "
        "which the second group differs by 1.5 standard deviations of what people differ by. Each "
        f"person has habits of his or her own. {_EXCHANGES} exchanges between the groups.",
    )
