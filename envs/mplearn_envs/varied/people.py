"""The varied library: 140 primitives, and the ways of eight people among them.

The primitives are the same for all, and each person has an own graph of them: the ways in which
that person was seen to go on, and how often. So what was learned with some people can be tried with
others: `SPLITS` names who is who. ``python -m mplearn_envs.varied.build`` makes the files.
"""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import replace
from functools import cache
from pathlib import Path
from typing import Any

from mplearn.errors import InvalidValueError
from mplearn.graph import TransitionGraph
from mplearn.library import PrimitiveLibrary
from mplearn_envs.skills.feasibility import Feasibility
from mplearn_envs.skills.skills import Foreknowledge

PATH = Path(__file__).parent / "varied.mplearn"
FACTS = Path(__file__).parent / "facts.json"  # people's ways, and what the humanoid makes of them
SPLITS: dict[str, tuple[int, ...]] = {
    "train": (0, 1, 2, 3, 4, 5),
    "test": (6, 7),
    "all": (0, 1, 2, 3, 4, 5, 6, 7),
}
Ways = list[tuple[int, int, int]]  # before, after, how often


def people_of(split: str | int | tuple[int, ...]) -> tuple[int, ...]:
    """Return the numbers of the people of a split, or of a person, or some people as given.

    Raises:
        InvalidValueError: There is no such split or person.
    """
    if isinstance(split, str) and split in SPLITS:
        return SPLITS[split]
    given = (split,) if isinstance(split, int) else split
    if not isinstance(given, (tuple, list)) or not given or not set(given) <= set(SPLITS["all"]):
        raise InvalidValueError(
            f"people must be one of {tuple(SPLITS)}, or numbers among {SPLITS['all']}, "
            f"not {split!r:.80}"
        )
    return tuple(int(person) for person in given)


@cache
def varied_library() -> PrimitiveLibrary:
    """Return the primitives, with the transitions of the people of "train" together."""
    return PrimitiveLibrary.load(PATH)


@cache
def library_of(person: int) -> PrimitiveLibrary:
    """Return the primitives with the transitions of one person."""
    library = varied_library()
    return replace(library, graph=graph_of(_facts()["ways"][person], library.ids))


def graph_of(ways: Ways, ids: Sequence[int]) -> TransitionGraph:
    """Return a graph of some primitives with these transitions."""
    graph = TransitionGraph(order=1)
    for id in ids:
        graph.add_node(id)
    for before, after, times in ways:
        for _ in range(times):
            graph.observe(before, after, 1.0)
    return graph


def starts() -> tuple[int, ...]:
    """Return the ids of the primitives that begin where the humanoid stands at rest."""
    return tuple(_facts()["starts"])


@cache
def foreknowledge() -> Foreknowledge:
    """Return what the humanoid makes of it, at the speed and in the style that are usual."""
    facts = _facts()
    verdicts = {id: Feasibility((), *rest) for id, *rest in facts["verdicts"]}
    durations_s = {int(id): time_s for id, time_s in facts["durations_s"]}
    transitions = {(before or None, after): time_s for before, after, time_s in facts["times"]}
    return Foreknowledge(verdicts, durations_s, transitions)


@cache
def _facts() -> dict[str, Any]:
    facts: dict[str, Any] = json.loads(FACTS.read_text("utf-8"))
    return facts
