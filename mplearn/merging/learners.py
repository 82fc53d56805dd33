"""Learners of parts of a corpus, as one that goes on learning."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import replace

from ..errors import InvalidValueError
from ..learner import LearnerConfig, LearnerState, MotionLearner
from ..learner.chain import Chain
from .graphs import merge_graphs
from .people import merged_into
from .watching import merge_watching


def merge_learners(learners: Sequence[MotionLearner]) -> MotionLearner:
    """Return a learner that knows what all of some know, as if their streams followed each other.

    The learners stay as they are; a stream that one is in the middle of is ended for the merged
    one. Where markers are observed, people are matched by their bodies, as seen by the same
    markers: who is known to both is one person, all others are kept apart; without markers all is
    one person's. Primitives that several
    have learned become one (`merge_people`); the counts of transitions are added, so that they do
    not depend on the order of the learners but for the names of primitives; what none had
    recognised alone is counted where it is known now. The first learner's primitives keep their
    ids, as far as they stay what they were. Where there are several people, primitives with fewer
    executions, of all of them, than several people need (`PeopleConfig.min_exemplars`) wait again:
    they were born while each person was alone.

    Each learner is copied once, however many there are; exemplars never are.

    Raises:
        InvalidValueError: There are no learners, or they have other configurations; bodies may be
            observed by other markers.

    Example:
        >>> import numpy as np
        >>> from mplearn.learner import LearnerConfig, MotionLearner
        >>> t = np.arange(1200) / 100.0
        >>> swing = np.where(t % 2 < 1, np.sin(np.pi * t) ** 2, 0.0)[:, None]
        >>> config = LearnerConfig(("elbow",), segmenter="zero-velocity")
        >>> shards = [MotionLearner(config), MotionLearner(config)]
        >>> for shard in shards:
        ...     events = shard.learn_many(swing)
        >>> merged = merge_learners(shards)
        >>> len(merged.snapshot()), merged.n_frames
        (2, 2400)
    """
    for other in learners[1:]:
        _check_rules(learners[0], other)
    merged = _merged(_copied(each) for each in learners)
    merged.withdraw_young()
    return merged.learner()


def merged_state(learners: Iterable[MotionLearner], *, last: bool = True) -> LearnerState:
    """Return the state of what `merge_learners` makes of some, all of which are used up.

    Nothing is copied, and two at a time are held, so that many fit into memory.

    Args:
        learners: The learners.
        last: Whether these are all; if what comes of it will be merged with others, nothing is made
            to wait again, so that the order in which many are merged does not matter to it.

    Raises:
        InvalidValueError: As `merge_learners`; some are used up by then.
    """
    merged = _merged(learners)
    if last:
        merged.withdraw_young()
    return merged.state()


def _merged(learners: Iterable[MotionLearner]) -> _Merged:
    merged: _Merged | None = None
    for each in learners:
        if merged is not None:
            _check_rules(merged.first, each)
        each.end_stream()
        if merged is None:
            merged = _Merged(each)
        else:
            merged.take(each)
    if merged is None:
        raise InvalidValueError("at least one learner is needed to merge")
    return merged


def _check_rules(one: MotionLearner, other: MotionLearner) -> None:
    if _rules(one) != _rules(other):
        raise InvalidValueError(
            f"learners must have the same configuration, not {one.config} and {other.config}"
        )


def _rules(learner: MotionLearner) -> LearnerConfig:
    """Return a configuration without what a merged learner can have several of."""
    config = learner.config
    return config if learner.watching is None else replace(config, channels=learner.channels)


def _copied(learner: MotionLearner) -> MotionLearner:
    return MotionLearner.from_state(learner.state())


class _Merged:
    """What some learners know, one after the other.

    Args:
        first: The first of them; it is used up, and so are all others.
    """

    def __init__(self, first: MotionLearner) -> None:
        self.first = first
        self._state = first.state()
        self._tree, self._graph, self._chain = first.tree, first.graph, first.chain
        self._watching = first.watching

    def take(self, other: MotionLearner) -> None:
        """Merge another learner into what is known."""
        state, n_frames = other.state(), self._state.n_frames
        people = {person: person for person in other.tree.people}
        if self._watching is not None and other.watching is not None:
            people |= merge_watching(self._watching, other.watching)
        merged = merged_into(self._tree, other.tree, people)
        parts = ((self._graph, merged.first), (other.graph, merged.second))
        graph = merge_graphs((each, {id: new[id] for id in each.ids}) for each, new in parts)
        for id in merged.tree.leaves:
            graph.add_node(id)
        config = self._state.config
        chain = Chain(graph, config.rate_hz, config.longest_pause_s)
        self._chain.rename(merged.first)
        other.chain.rename(merged.second)
        chain.append(self._chain, 0, 0)
        chain.append(other.chain, merged.new_number, n_frames)
        chain.correct(merged.moved)
        chain.count_late(merged.placed)
        self._tree, self._graph, self._chain = merged.tree, graph, chain
        self._state = replace(
            self._state,
            n_frames=n_frames + state.n_frames,
            stream_start=n_frames + state.n_frames,
            person=people.get(state.person, self._state.person),
        )

    @property
    def _alone(self) -> bool:
        return self._tree is self.first.tree and self._graph is self.first.graph

    def withdraw_young(self) -> None:
        """Let what several people have shown too seldom wait again, if there were several parts."""
        if not self._alone:
            self._chain.revise(self._tree.withdraw_young())

    def learner(self) -> MotionLearner:
        """Return a learner that knows it all."""
        if self._alone:
            return self.first
        return MotionLearner.from_state(self.state())

    def state(self) -> LearnerState:
        """Return the state of a learner that knows it all."""
        return replace(
            self._state,
            watches=() if self._watching is None else self._watching.state(),
            tree=self._tree.state(),
            graph=self._graph.state(),
            chain=self._chain.state(),
        )
