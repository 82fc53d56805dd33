"""Learners of parts of a corpus, as one that goes on learning."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import replace

from ..errors import InvalidValueError
from ..learner import LearnerConfig, LearnerState, MotionLearner
from ..learner.chain import Chain
from .graphs import merge_graphs
from .people import merged_people
from .watching import merge_watching


def merge_learners(learners: Iterable[MotionLearner], people: Sequence[str] = ()) -> MotionLearner:
    """Return a learner that knows what all of some know, as if their streams followed each other.

    The learners stay as they are; a stream that one is in the middle of is ended for the merged
    one. Where markers are observed, people are matched by their bodies, as seen by the same
    markers: who is known to both is one person, all others are kept apart, as are those who are
    told to be by their names; without markers all is one person's. Primitives that several
    have learned become one (`merge_people`); the counts of transitions are added, so that they do
    not depend on the order of the learners but for the names of primitives; what none had
    recognised alone is counted where it is known now. The first learner's primitives keep their
    ids, as far as they stay what they were. Where there are several people, primitives with fewer
    executions, of all of them, than several people need (`PeopleConfig.min_exemplars`) wait again:
    they were born while each person was alone.

    Each learner is copied once, however many there are; exemplars never are. Which leaves of
    different people are one primitive is found once, when all are there.

    Args:
        learners: At least one.
        people: Who moved before each of them, where that is known; empty for those of whom it is
            not. People seen under different names are never one, whatever their bodies; who alone
            was seen under a name, by the same markers, is one person.

    Raises:
        InvalidValueError: There are no learners, or not as many names; or they have other
            configurations; bodies may be observed by other markers. Or it is no list of learners.

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
    alone = isinstance(learners, MotionLearner)
    learners = () if alone else tuple(learners)
    if alone or not all(isinstance(each, MotionLearner) for each in learners):
        raise InvalidValueError(
            "what is merged is a list of learners: merge_learners([one, other])"
        )
    for other in learners[1:]:
        _check_rules(learners[0], other)
    merged = merged_learner((_copied(each) for each in learners), people)
    merged.tree.wake()
    return merged


def merged_learner(learners: Iterable[MotionLearner], people: Sequence[str] = ()) -> MotionLearner:
    """Return what `merge_learners` makes of some, all of which are used up.

    Of people whose learners' models are made lazily, they are made once they are asked for.

    Raises:
        InvalidValueError: As `merge_learners`; some are used up by then.

    Example:
        >>> import numpy as np
        >>> from mplearn.learner import LearnerConfig, MotionLearner
        >>> learners = [MotionLearner(LearnerConfig(("elbow",))) for _ in range(3)]
        >>> events = [learner.learn_many(np.zeros((100, 1))) for learner in learners]
        >>> merged_learner(learners).n_frames
        300
    """
    merged, several = _merged(learners, people)
    if several:
        merged.chain.revise(merged.tree.prune())
    return merged


def merged_state(learners: Iterable[MotionLearner], people: Sequence[str] = ()) -> LearnerState:
    """Return the state of what some learners know that will be merged with others yet.

    All of them are used up. Nothing is made to wait again, so that the order in which many are
    merged does not matter to it. Nothing is copied, and where the learners' models are made lazily,
    only those of people whom several know are made.

    Raises:
        InvalidValueError: As `merge_learners`; some are used up by then.

    Example:
        >>> import numpy as np
        >>> from mplearn.learner import LearnerConfig, MotionLearner
        >>> learners = [MotionLearner(LearnerConfig(("elbow",))) for _ in range(2)]
        >>> events = [learner.learn_many(np.zeros((100, 1))) for learner in learners]
        >>> merged_state(learners).n_frames
        200
    """
    return _merged(learners, people)[0].state()


def _merged(learners: Iterable[MotionLearner], names: Sequence[str]) -> tuple[MotionLearner, bool]:
    """Return the first learner, which knows what all know; and whether there were several."""
    all_of_them = list(learners)
    if not all_of_them:
        raise InvalidValueError("at least one learner is needed to merge")
    if isinstance(names, str) or (names and len(names) != len(all_of_them)):
        given = repr(names) if isinstance(names, str) else len(names)
        raise InvalidValueError(
            f"a name of each of {len(all_of_them)} learners' people is needed, not {given}"
        )
    first, *others = all_of_them
    for other in others:
        _check_rules(first, other)
    for each in all_of_them:
        each.end_stream()
    if not others:
        return first, False
    people = _matched(all_of_them, names or [""] * len(all_of_them))
    merged = merged_people([each.tree for each in all_of_them], people)
    graph = merge_graphs(
        (each.graph, {id: new_id[id] for id in each.graph.ids})
        for each, new_id in zip(all_of_them, merged.new_ids, strict=True)
    )
    for id in merged.tree.leaves:
        graph.add_node(id)
    chain = Chain(graph, first.config.rate_hz, first.config.longest_pause_s)
    n_frames = 0
    for each, new_id, n_before in zip(all_of_them, merged.new_ids, merged.new_numbers, strict=True):
        each.chain.rename(new_id)
        chain.append(each.chain, n_before, n_frames)
        n_frames += each.n_frames
    chain.correct(merged.moved)
    chain.count_late(merged.placed)
    person = first.latest_person
    for each, own in zip(all_of_them, people, strict=True):
        person = own.get(each.latest_person, person)
    first.adopt(merged.tree, chain, n_frames, person)
    return first, True


def _matched(learners: Sequence[MotionLearner], names: Sequence[str]) -> list[dict[int, int]]:
    """Return the number of each person of each learner in the first, which knows them all then."""
    first, *others = learners
    called = (
        {} if first.watching is None else dict.fromkeys(range(first.watching.n_people), names[0])
    )
    people = [{person: person for person in first.tree.people}]
    for other, name in zip(others, names[1:], strict=True):
        own = {person: person for person in other.tree.people}
        if first.watching is not None and other.watching is not None:
            own |= merge_watching(first.watching, other.watching, name, called)
        people.append(own)
    return people


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
    return MotionLearner.from_state(learner.state(), lazily=True)
