"""Scripts: in which order a person performs primitives."""

from __future__ import annotations

import itertools
from collections.abc import Iterator, Mapping, Sequence

import networkx as nx
import numpy as np

from mplearn.errors import InvalidValueError

from .primitives import PRIMITIVES, followers, primitive

Sequencing = Mapping[str, Mapping[str, float]]

VARIED: tuple[str, ...] = tuple(name for name in PRIMITIVES if name != "ARL")
"""All primitives between which a round is possible: from the guard one goes on by a punch."""

_AFTER_ONE_ARM = {"BAD": 0.5, "SQD": 0.5}

SEQUENCING: Sequencing = {
    "BAR": {"BAL": 1.0},
    "BAL": {"RAR": 0.5, "AR": 0.25, "MRL": 0.25},
    "RAR": {"RAL": 1.0},
    "RAL": _AFTER_ONE_ARM,
    "LAR": {"LAL": 1.0},
    "LAL": _AFTER_ONE_ARM,
    "AR": {"LPE": 0.6, "RPE": 0.4},
    "LPE": {"LPR": 1.0},
    "LPR": {"RPE": 0.65, "LPE": 0.35},
    "RPE": {"RPR": 1.0},
    "RPR": {"LKR": 0.5, "RKR": 0.3, "BAR": 0.2},
    "BAD": {"BAU": 1.0},
    "BAU": {"RAR": 0.45, "BAR": 0.3, "LAR": 0.25},
    "SQD": {"SQR": 1.0},
    "SQR": {"LAR": 0.65, "AR": 0.35},
    "LKR": {"LKT": 1.0},
    "LKT": {"RKR": 0.5, "MRL": 0.3, "BAR": 0.2},
    "RKR": {"RKT": 1.0},
    "RKT": {"MRL": 0.4, "LKR": 0.3, "AR": 0.3},
    "MRL": {"MLR": 1.0},
    "MLR": {"MMID": 1.0},
    "MMID": {"MRL": 0.25, "BAR": 0.3, "AR": 0.15, "LKR": 0.15, "RKR": 0.15},
}
"""Primitive -> probability of each that follows: the structure of the paper's session.

[Kulic2012, section 4.2.2, figures 13 and 14]: a bow down is always followed by a bow up and a squat
down by a squat raise, the lowering of one arm by a bow or a squat; bow up leads to any of the arm
raises, squat raise to the left arm. What the paper leaves open (punches, kicks, march) is ours.
"""


def drawn_sequencing(
    order: np.random.Generator,
    names: Sequence[str] = VARIED,
    *,
    person: np.random.Generator | None = None,
    own: float = 0.1,
) -> Sequencing:
    """Draw an order in which every primitive leads on to one or two others, and all are reached.

    One round leads through all primitives (an Eulerian circuit of the key postures); besides, each
    has one more follower, where its posture allows, that leads elsewhere on the round. So from one
    primitive to another it is a long way, several steps for most, and which way is a choice.

    Args:
        order: Source of what people have in common.
        names: The primitives, as many that leave a key posture as reach it.
        person: Source of one's own: how often each way is taken, and other ways. None: the common.
        own: Share of the primitives whose second follower is the person's own.

    Raises:
        InvalidValueError: There is no round through these primitives.

    Example:
        >>> import numpy as np
        >>> order = drawn_sequencing(np.random.default_rng(3))
        >>> all(1 <= len(followers) <= 2 for followers in order.values())
        True
    """
    postures: nx.MultiDiGraph[str] = nx.MultiDiGraph()
    for name in order.permutation(list(names)).tolist():
        postures.add_edge(primitive(name).start, primitive(name).end, key=name)
    if not nx.is_eulerian(postures):
        raise InvalidValueError(
            "no round leads through these primitives: each key posture must be left as often as "
            f"it is reached; given are {list(names)}"
        )
    circuit = [name for *_, name in nx.eulerian_circuit(postures, source="stand", keys=True)]
    graph: dict[str, dict[str, float]] = {}
    for name, following in itertools.pairwise([*circuit, circuit[0]]):
        others = [n for n in followers(name) if n in set(names) and n != following]
        graph[name] = {following: 0.6}
        if others:
            draw = order.random(2)
            if person is not None and draw[0] < own:
                draw = person.random(2)
            graph[name][others[int(draw[1] * len(others))]] = 0.4
    if person is not None:
        graph = {
            name: {other: w * float(np.exp(person.normal(0.0, 0.4))) for other, w in row.items()}
            for name, row in graph.items()
        }
    return graph


def check_script(script: tuple[str, ...]) -> None:
    """Check that a script can be performed.

    Raises:
        InvalidValueError: It is empty, names an unknown primitive, or a primitive that does not
            start in the posture where its predecessor ends.
    """
    if not script:
        raise InvalidValueError(f"a script needs at least one of {', '.join(PRIMITIVES)}")
    primitive(script[0])
    for index, (first, second) in enumerate(itertools.pairwise(script)):
        check_follows(first, second, index + 1)


def check_follows(first: str, second: str, index: int) -> None:
    """Check that ``second``, at that index of a script, can follow ``first``.

    Raises:
        InvalidValueError: It is unknown, or starts in another posture.
    """
    if primitive(second).start != primitive(first).end:
        raise InvalidValueError(
            f"primitive {second!r} at index {index} starts in posture "
            f"{PRIMITIVES[second].start!r}, but {first!r} ends in {PRIMITIVES[first].end!r}; "
            f"it can be followed by {', '.join(followers(first))}"
        )


def markov_walk(
    rng: np.random.Generator, graph: Sequencing = SEQUENCING, balance: float = 0.0
) -> Iterator[str]:
    """Yield primitives without end, each drawn by what came before it.

    Args:
        rng: Source of randomness.
        graph: Primitive -> weight of each follower.
        balance: How strongly primitives that came seldom so far are preferred: a follower's weight
            is multiplied by exp(-balance * (its count - the smallest count of the followers)).

    Raises:
        InvalidValueError: The graph names unknown or impossible followers, holds a dead end, or has
            no primitive that starts standing.

    Example:
        >>> from itertools import islice
        >>> import numpy as np
        >>> order = {"BAR": {"BAL": 1.0}, "BAL": {"BAR": 1.0}}
        >>> sorted(islice(markov_walk(np.random.default_rng(0), order), 2))
        ['BAL', 'BAR']
    """
    _check_graph(graph)
    if not (np.isfinite(balance) and balance >= 0.0):
        raise InvalidValueError(f"balance must be finite and >= 0, not {balance}")
    counts = dict.fromkeys(graph, 0)
    options = {name: 1.0 for name in graph if PRIMITIVES[name].start == "stand"}
    while True:
        names = list(options)
        seen = np.array([counts[name] for name in names])
        weights = np.array(list(options.values())) * np.exp(-balance * (seen - seen.min()))
        name = names[int(rng.choice(len(names), p=weights / weights.sum()))]
        counts[name] += 1
        yield name
        options = dict(graph[name])


def markov_script(
    length: int,
    rng: np.random.Generator,
    graph: Sequencing = SEQUENCING,
    balance: float = 0.0,
) -> tuple[str, ...]:
    """Return the first ``length`` primitives of a `markov_walk`.

    Raises:
        InvalidValueError: As `markov_walk`, or the length is no positive integer.

    Example:
        >>> markov_script(4, np.random.default_rng(1))
        ('BAD', 'BAU', 'RAR', 'RAL')
    """
    if isinstance(length, bool) or not isinstance(length, int | np.integer) or length < 1:
        raise InvalidValueError(f"length must be an integer of at least 1, not {length!r}")
    walk = markov_walk(rng, graph, balance)
    return tuple(next(walk) for _ in range(length))


def _check_graph(graph: Sequencing) -> None:
    for name, options in graph.items():
        possible = followers(name)
        impossible = [other for other in options if other not in possible or other not in graph]
        if impossible or not options:
            raise InvalidValueError(
                f"graph lets {name!r} be followed by {list(options)}; possible are those of "
                f"{[other for other in possible if other in graph]}, at least one"
            )
        if bad := {other: w for other, w in options.items() if not 0.0 < w < np.inf}:
            raise InvalidValueError(f"weights must be positive and finite, not {bad} at {name!r}")
    if not any(PRIMITIVES[name].start == "stand" for name in graph):
        raise InvalidValueError(f"no primitive of {list(graph)} starts standing")
