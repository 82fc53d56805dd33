"""Learners of parts of a corpus, joined to one that goes on learning."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import reduce
from typing import Any

from ..errors import InvalidValueError
from ..people import PeopleTree
from ..tree import PrimitiveTree
from ..tree.union import union
from .chain import Chain
from .learner import MotionLearner


def merge(learners: Sequence[MotionLearner]) -> MotionLearner:
    """Return a learner that knows what all of some know, as if their streams followed each other.

    The learners stay as they are; a stream that one is in the middle of is ended for the merged
    one. Primitives that several have learned become one (`mplearn.tree.union`); the counts of
    transitions are added, so that they do not depend on the order of the learners but for the
    names of primitives; what none had recognised alone is counted where it is known now. The first
    learner's primitives keep their ids.

    Raises:
        InvalidValueError: There are no learners, they have other configurations, or one of them has
            seen several people: whether those are the same is not known.
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
    second = _ended(second)
    joined = union(_only_tree(first.tree), _only_tree(second.tree))
    graph = first.graph.copy()
    graph.absorb(second.graph, {id: joined.new_id[id] for id in second.graph.ids})
    a, b = first.state(), second.state()
    own = joined.tree.state()
    later = _renamed(b["chain"]["links"], joined.new_number, joined.new_id, first.n_frames)
    learner = MotionLearner.from_state(
        a
        | {
            "tree": a["tree"]
            | {
                "n_seen": own["n_seen"],
                "next_id": own["next_id"],
                "trees": [[person, own] for person in first.tree.people],
            },
            "graph": graph.state(),
            "chain": a["chain"] | {"links": [*a["chain"]["links"], *later], "broken": True},
            "n_frames": first.n_frames + second.n_frames,
            "stream_start": first.n_frames + second.n_frames,
        }
    )
    for id in joined.change.born:
        learner.graph.add_node(id)
    _count_late(learner._chain, dict(joined.change.moved))
    return learner


def _count_late(chain: Chain, moved: Mapping[int, int]) -> None:
    """Count the transitions of segments that are known only now."""
    late = {i for i, link in enumerate(chain._links) if link.number in moved}
    for i in late:
        chain._links[i].primitive = moved[chain._links[i].number]
    for i in range(1, len(chain._links)):
        if late & {i - 1, i}:
            chain._count(i)


def _only_tree(tree: PeopleTree) -> PrimitiveTree:
    if len(tree.people) != 1:
        raise InvalidValueError(
            f"only learners that have seen one person can be merged, not {len(tree.people)}"
        )
    return tree.of(tree.people[0])


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
