"""Learners of parts of a corpus, joined to one that goes on learning."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import reduce
from typing import Any

from ..errors import InvalidValueError
from ..graph import TransitionGraph
from ..people.union import unite
from ..tree import ROOT
from .chain import Chain
from .learner import MotionLearner


def merge(learners: Sequence[MotionLearner]) -> MotionLearner:
    """Return a learner that knows what all of some know, as if their streams followed each other.

    The learners stay as they are; a stream that one is in the middle of is ended for the merged
    one. Where markers are observed, people are matched by their bodies: who is known to both is one
    person, all others are kept apart; without markers all is one person's. Primitives that several
    have learned become one (`mplearn.people.union`); the counts of transitions are added, so that
    they do not depend on the order of the learners but for the names of primitives; what none had
    recognised alone is counted where it is known now. The first learner's primitives keep their
    ids, as far as they stay what they were.

    Raises:
        InvalidValueError: There are no learners, or they have other configurations.
    """
    if not learners:
        raise InvalidValueError("at least one learner is needed to merge")
    for other in learners[1:]:
        if other.config != learners[0].config:
            raise InvalidValueError(
                f"learners must have the same configuration, not {learners[0].config} and "
                f"{other.config}"
            )
    return reduce(_merged, learners[1:], _ended(learners[0]))


def _ended(learner: MotionLearner) -> MotionLearner:
    """Return a copy of a learner whose stream is over."""
    copy = MotionLearner.from_state(learner.state())
    copy.end_stream()
    return copy


def _merged(first: MotionLearner, second: MotionLearner) -> MotionLearner:
    learner, second = _ended(first), _ended(second)
    people = {person: person for person in second.tree.people}
    if learner._observer is not None and second._observer is not None:
        people |= learner._observer.unite(second._observer)
        learner._n_people = learner._observer.identity.n_people
    joined = unite(first.tree, second.tree, people)
    graph = TransitionGraph()
    graph.absorb(first.graph, {id: joined.first[id] for id in first.graph.ids})
    graph.absorb(second.graph, {id: joined.second[id] for id in second.graph.ids})
    for id in joined.tree.leaves:
        graph.add_node(id)
    links = [
        *_renamed(first.state()["chain"]["links"], 0, joined.first, 0),
        *_renamed(
            second.state()["chain"]["links"], joined.new_number, joined.second, first.n_frames
        ),
    ]
    learner.tree = joined.tree
    learner.graph = graph
    learner._chain = Chain(graph, learner.config.rate_hz, learner.config.longest_pause_s)
    learner._chain.load_state({"links": links, "paused_frames": 0, "broken": True})
    learner.n_frames = learner._stream_start = first.n_frames + second.n_frames
    learner._person = people.get(second._person, first._person)
    _relabel(learner._chain, joined.moved)
    _count_late(learner._chain, joined.placed)
    return learner


def _relabel(chain: Chain, moved: Mapping[int, int]) -> None:
    """Let segments be what they turned out to be; their transitions were counted."""
    for link in chain._links:
        primitive = moved.get(link.number, link.primitive)
        link.primitive = None if primitive == ROOT else primitive


def _count_late(chain: Chain, placed: Mapping[int, int]) -> None:
    """Count the transitions of segments that are known only now."""
    late = {i for i, link in enumerate(chain._links) if link.number in placed}
    late = {i for i in late if chain._links[i].primitive is None}
    for i in late:
        chain._links[i].primitive = placed[chain._links[i].number]
    for i in range(1, len(chain._links)):
        if late & {i - 1, i}:
            chain._count(i)


def _renamed(
    links: Sequence[Any], n_before: int, new_id: Mapping[int, int], frames: int
) -> list[Any]:
    """Return the links of a chain, with other numbers, ids and frames."""
    out = []
    for number, primitive, follows, (start, end, decided_at, *rest), nearest, like in links:
        segment = (start + frames, end + frames, decided_at + frames, *rest)
        ids = [None if id is None else new_id.get(id) for id in (primitive, nearest)]
        like = None if like is None else like + n_before
        out.append((number + n_before, ids[0], follows, segment, ids[1], like))
    return out
