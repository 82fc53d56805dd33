"""Orders drawn at random: all is reached, it is a long way, people have most of it in common."""

import itertools

import networkx as nx
import numpy as np
import pytest

from mplearn.demonstrator import (
    GYMNASTICS,
    PRIMITIVES,
    VARIED,
    Person,
    drawn_sequencing,
    followers,
    markov_script,
)
from mplearn.errors import InvalidValueError


def graph(order: int, person: int | None = None) -> "nx.DiGraph[str]":
    habits = None if person is None else np.random.default_rng(person)
    drawn = drawn_sequencing(np.random.default_rng(order), person=habits)
    out: nx.DiGraph[str] = nx.DiGraph()
    out.add_edges_from((name, after) for name, row in drawn.items() for after in row)
    return out


@pytest.mark.parametrize("order", range(5))
def test_everything_can_be_reached_by_steps_that_are_possible(order: int) -> None:
    drawn = graph(order)
    assert set(drawn) == set(VARIED)
    assert nx.is_strongly_connected(drawn)
    assert all(after in followers(name) for name, after in drawn.edges)
    assert max(dict(drawn.out_degree()).values()) == 2


@pytest.mark.parametrize("order", range(5))
def test_most_ways_are_of_many_steps(order: int) -> None:
    steps = dict(nx.all_pairs_shortest_path_length(graph(order)))
    apart = np.array([n for row in steps.values() for n in row.values() if n])
    assert np.mean((apart >= 5) & (apart <= 15)) > 0.6


def test_people_differ_in_a_tenth_of_their_ways_and_in_how_often_they_take_them() -> None:
    one, other = (set(graph(3, person).edges) for person in (1, 2))
    assert 0 < len(one - other) < 0.15 * len(one)
    assert one - set(graph(4, 1).edges), "another order is another graph"
    weights = [
        drawn_sequencing(np.random.default_rng(3), person=np.random.default_rng(k))["BAR"]
        for k in (1, 2)
    ]
    assert weights[0] != weights[1]


def test_where_no_round_is_possible_it_says_so() -> None:
    with pytest.raises(InvalidValueError, match="as often as it is reached"):
        drawn_sequencing(np.random.default_rng(0), ("BAR", "BAL", "AR"))


def test_a_script_of_it_performs_what_the_graph_allows() -> None:
    drawn = drawn_sequencing(np.random.default_rng(0))
    script = markov_script(600, np.random.default_rng(1), drawn, balance=2.0)
    assert all(after in drawn[name] for name, after in itertools.pairwise(script))
    assert len(set(script)) > 0.95 * len(VARIED)


def test_people_are_who_they_were_before_there_were_gymnastics() -> None:
    person = Person.random(np.random.default_rng(7))
    common = [name for name in PRIMITIVES if name not in GYMNASTICS]
    assert [*person.tempo][: len(common)] == common
    drawn = (person.height_m, person.tempo["RWI"], person.reach["squat"], person.rest["elbow_l"])
    assert drawn == pytest.approx((1.7687834133, 1.0825669510, 0.9646072693, 0.0363286840))
    assert person.name == "person-248123"
