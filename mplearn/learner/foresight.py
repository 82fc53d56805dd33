"""What comes next, with motions that have been seen too seldom to be primitives."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from ..graph import ProvisionalGraph, TransitionGraph
from .seen_segment import SeenSegment, run_before, step_s


@dataclass(frozen=True)
class NextMotion:
    """A motion that may come next, how likely, and when.

    Attributes:
        id: Its primitive; None where it has none yet.
        segments: Numbers of the latest segments that show it (`mplearn.tree.Placement.number`),
            oldest first; empty where they were too long ago.
        probability: How likely it is, in [0, 1].
        duration_s: Mean time from the start of the last motion until this one starts [s], see
            `mplearn.graph.Prediction`.
        duration_std_s: Standard deviation of that time [s].

    Example:
        >>> import numpy as np
        >>> from mplearn import LearnerConfig, MotionLearner
        >>> t = np.arange(850) / 100.0
        >>> swing = np.where(t % 2 < 1, np.sin(np.pi * t) ** 2, 0.0)[:, None]  # up, down, a rest
        >>> learner = MotionLearner(LearnerConfig(("elbow",), segmenter="zero-velocity"))
        >>> events = learner.learn_many(swing)  # the last was down
        >>> expected = learner.predict_next(k=1)[0]
        >>> expected.id, expected.probability > 0.5, round(expected.duration_s)
        (1, True, 2)
    """

    id: int | None
    segments: tuple[int, ...]
    probability: float
    duration_s: float
    duration_std_s: float


def foresee(
    graph: TransitionGraph, segments: Sequence[SeenSegment], rate_hz: float, k: int, *, broken: bool
) -> tuple[NextMotion, ...]:
    """Return the ``k`` motions most likely to come next, the most likely first.

    What is no primitive yet is foretold from the first time it has been seen: segments that are
    like each other are taken for one motion, and the transitions they take part in are counted
    beside the graph's. After a motion that was never followed by anything, its nearest primitive
    stands in for it.

    Args:
        graph: The transitions between primitives.
        segments: The latest segments.
        rate_hz: Frames per second [1/s].
        k: How many to return at most.
        broken: Whether what comes next does not follow the last of them.

    Raises:
        InvalidValueError: ``k`` is not positive.
    """
    motions = motions_of(segments)
    extended = ProvisionalGraph(graph)

    def run(i: int) -> list[int]:
        return run_before(segments, i, graph.order, lambda seen: motions[seen.number])

    for i, seen in enumerate(segments):
        motion = motions[seen.number]
        if motion < 0:
            extended.add_node(motion)
        if seen.follows and i > 0 and min(motion, motions[segments[i - 1].number]) < 0:
            before = run(i)
            extended.observe(before[-1], motion, step_s(segments, i, rate_hz), before=before[:-1])
    history: list[int] = []
    if segments and not broken:
        last, nearest = motions[segments[-1].number], segments[-1].nearest
        history = [*run(len(segments) - 1), last]
        if nearest is not None and nearest in graph and not extended.followers((last,)).any():
            history = [nearest]
    shown: dict[int, list[int]] = {}
    for number, motion in motions.items():
        shown.setdefault(motion, []).append(number)
    return tuple(
        NextMotion(
            each.id if each.id in graph else None,
            tuple(shown.get(each.id, ())),
            each.probability,
            each.duration_s,
            each.duration_std_s,
        )
        for each in extended.predict(history, k)
    )


def motions_of(segments: Sequence[SeenSegment]) -> dict[int, int]:
    """Return the motion that each segment shows, by number.

    It is the primitive, or that of the segment which it is like; where there is neither, the motion
    is new and goes by -1 minus the segment's number.
    """
    motions: dict[int, int] = {}
    for seen in segments:
        motion = seen.primitive
        if motion is None:
            like = None if seen.like is None else motions.get(seen.like)
            motion = -1 - seen.number if like is None else like
        motions[seen.number] = motion
    return motions
