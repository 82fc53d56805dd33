"""Planted anomalies: are wrong motions and wrong orders told from right ones."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np

from ...body import view_of
from ...demonstrator import demonstrate, paper_session
from ...learner import LearnerConfig, MotionLearner, SegmentClosed
from ...library import AnomalyScore, PrimitiveLibrary
from ...recording import FloatArray, LabelledSegment, Recording
from ...segmentation import make_segmenter
from ..matching import match_segments
from ..observing import observe
from ..rates import rate_learning
from ..sessions import SessionConfig, make_session
from .judged import Judged
from .sessions import by_person

UNKNOWN = ("SAR", "SAL", "TLO", "TLR", "TRO", "TRR", "RHR", "RWO", "RWI", "RHL")
_LEARNED_SHARE = 0.75
_UNUSED_SHARE = 0.4  # of a session: before its movements begin to be used up


@dataclass(frozen=True, eq=False)
class Motion:
    """A motion that was found in a stream.

    Attributes:
        label: What it shows; empty for nothing.
        frames: Shape (T, D).
    """

    label: str
    frames: FloatArray


def judge_paper_session(seed: int) -> tuple[str, dict[str, Judged]]:
    """Learn three quarters of a session like the paper's; judge the rest, and what is planted."""
    session = paper_session(seed)
    features = observe(session.recording)
    library, motions, classes = _learn(features, session.truth)
    strange = demonstrate(UNKNOWN * 4, seed=seed)
    unknown = found_motions(observe(strange.recording), strange.truth)
    rng = np.random.default_rng(seed)
    kinds = _wrong_motions(library, classes, motions, unknown, rng)
    allowed = {(a.label, b.label) for a, b in pairwise(session.truth)}
    kinds["wrong order"] = _wrong_orders(library, classes, motions, allowed, rng)
    return f"paper_session({seed})", kinds


def judge_people(
    takes: Iterable[Recording], incorrect: Iterable[Recording] = (), seed: int = 0
) -> Iterator[tuple[str, dict[str, Judged]]]:
    """Learn most of a session of each person's takes; judge the rest, and what is planted.

    Every fifth take is kept from learning altogether: motions never learned; a person of one take
    is left out. Motions are judged in
    sessions of random order, so that each part holds all classes; orders in one whose movements are
    followed by three others only, cut where movements begin to be used up.

    Args:
        takes: Recordings with labelled repetitions, of any number of people.
        incorrect: The like, performed wrongly on purpose by some of these people.
        seed: Seed of the order of presentation and of what is planted.

    Example:
        >>> import numpy as np
        >>> from mplearn import LabelledSegment, Recording
        >>> wave = 1 - np.cos(2 * np.pi * np.arange(400) / 100)  # four repetitions
        >>> def take(name, size, person="anna"):
        ...     labels = tuple(LabelledSegment(100 * k, 100 * k + 100, name) for k in range(4))
        ...     frames = size * wave[:, None]
        ...     return Recording(frames, 100.0, ("elbow",), name=name, labels=labels, person=person)
        >>> sizes = {"up": 1.0, "out": -1.0, "half up": 0.5, "half out": -0.5}
        >>> takes = [take(name, size) for name, size in sizes.items()]
        >>> [person for person, judged in judge_people(takes)]
        ['anna']
    """
    wrongly = by_person(incorrect)
    for person, own in by_person(takes).items():
        if len(own) < 2:
            continue
        rng = np.random.default_rng(seed)
        apart = range(int(rng.integers(min(5, len(own)))), len(own), 5)
        known = [take for i, take in enumerate(own) if i not in apart]
        library, right, classes = _learn(*_mixed_up(known, rng))
        unknown = found_motions(*_mixed_up([own[i] for i in apart], rng))
        kinds = _wrong_motions(library, classes, right, unknown, rng)
        if person in wrongly:
            wrong = found_motions(*_mixed_up(wrongly[person], rng))
            kinds |= _performed_wrongly(library, classes, right, wrong)
        kinds["wrong order"] = _orders_of(own, rng)
        yield person or "unnamed", kinds


def _mixed_up(
    takes: Sequence[Recording], rng: np.random.Generator
) -> tuple[Recording, tuple[LabelledSegment, ...]]:
    """Return the features of a session of random order, and what it shows."""
    session = make_session(takes, rng, SessionConfig(loyalty=0.0))
    return observe(session), session.labels


def found_motions(features: Recording, truth: Sequence[LabelledSegment]) -> list[Motion]:
    """Return the motions that the segmenter finds in features, in order, with what they show."""
    seen = view_of(features.channels).see(features.frames)
    segmenter = make_segmenter("kohlmorgen-lemm", seen.shape[1], features.rate_hz)
    found = [segment for segment in segmenter.segment(seen) if not segment.still]
    labels = match_segments(truth, found, features.rate_hz).labels
    return [
        Motion(label, features.frames[segment.start : segment.end])
        for label, segment in zip(labels, found, strict=True)
    ]


# ---- learning


def _learn(
    features: Recording, truth: Sequence[LabelledSegment]
) -> tuple[PrimitiveLibrary, list[Motion], Mapping[int, str]]:
    """Learn the first part of a stream.

    Returns:
        What was learned, the motions of the rest, and the class of each primitive.
    """
    cut = truth[round(_LEARNED_SHARE * len(truth))].start
    first = replace(features, frames=features.frames[:cut], labels=())
    rest = replace(features, frames=features.frames[cut:], labels=())
    learner = MotionLearner(LearnerConfig(features.channels, features.rate_hz))
    events = [event for each in learner.learn_recording(first) for event in each]
    closed = [event for event in events if isinstance(event, SegmentClosed)]
    rates = rate_learning(
        [motion for motion in truth if motion.end <= cut],
        [event.segment for event in closed],
        [event.placement for event in closed],
        features.rate_hz,
    )
    later = [
        replace(motion, start=motion.start - cut, end=motion.end - cut)
        for motion in truth
        if motion.start >= cut
    ]
    return learner.snapshot(), found_motions(rest, later), rates.classes


# ---- motions


def _wrong_motions(
    library: PrimitiveLibrary,
    classes: Mapping[int, str],
    right: Sequence[Motion],
    unknown: Sequence[Motion],
    rng: np.random.Generator,
) -> dict[str, Judged]:
    known = [motion for motion in right if motion.label in classes.values()]
    usual = tuple(library.score_motion(motion.frames) for motion in known)
    mixed, small = [], []
    for motion in known:
        others = [other for other in known if other.label != motion.label]
        if others:
            mixed.append(_mixed(motion.frames, others[rng.integers(len(others))].frames, rng))
        small.append(motion.frames[0] + 0.5 * (motion.frames - motion.frames[0]))
    planted = {
        "never learned": [motion.frames for motion in unknown],
        "half the channels of another": mixed,
        "half as far": small,
    }
    return {
        kind: Judged(usual, tuple(library.score_motion(frames) for frames in wrong))
        for kind, wrong in planted.items()
    }


def _mixed(frames: FloatArray, other: FloatArray, rng: np.random.Generator) -> FloatArray:
    """Return frames of which half the channels move as in another motion, from where they are."""
    at = np.linspace(0, len(other) - 1, len(frames)).round().astype(np.int64)
    moved = rng.permutation(frames.shape[1])[: frames.shape[1] // 2]
    out = frames.copy()
    out[:, moved] = frames[0, moved] + other[at][:, moved] - other[0, moved]
    return out


def _performed_wrongly(
    library: PrimitiveLibrary,
    classes: Mapping[int, str],
    right: Sequence[Motion],
    wrong: Sequence[Motion],
) -> dict[str, Judged]:
    """Judge incorrect executions of what is known, alone and as repetitions, out and back."""
    scores = [
        [(m.label, library.score_motion(m.frames)) for m in motions if m.label in classes.values()]
        for motions in (right, wrong)
    ]
    single = [tuple(score for _, score in each) for each in scores]
    whole = [tuple(_repetitions(each)) for each in scores]
    return {
        "performed wrongly": Judged(*single),
        "performed wrongly, whole repetitions": Judged(*whole),
    }


def _repetitions(scores: Sequence[tuple[str, AnomalyScore]]) -> Iterator[AnomalyScore]:
    """Yield the mean score of each way out and the way back after it, and the less usual p."""
    for (label, out), (after, back) in pairwise(scores):
        if label.endswith("-out") and after == label.removesuffix("out") + "back":
            p_value = min(1.0, 2 * min(out.p_value, back.p_value))  # Bonferroni's, of two
            yield AnomalyScore(0.5 * (out.score + back.score), p_value)


# ---- orders


def _orders_of(takes: Sequence[Recording], rng: np.random.Generator) -> Judged:
    """Judge orders in a session whose every movement is followed by a few others only."""
    whole = make_session(takes, rng, SessionConfig(loyalty=1.0, executions=4))
    truth = whole.labels[: round(_UNUSED_SHARE * len(whole.labels))]
    session = observe(replace(whole, frames=whole.frames[: truth[-1].end], labels=truth))
    library, motions, classes = _learn(session, truth)
    allowed = {(a.label, b.label) for a, b in pairwise(truth)}
    return _wrong_orders(library, classes, motions, allowed, rng)


def _wrong_orders(
    library: PrimitiveLibrary,
    classes: Mapping[int, str],
    motions: Sequence[Motion],
    allowed: set[tuple[str, str]],
    rng: np.random.Generator,
) -> Judged:
    """Replace recognised primitives by others that never follow where they stand."""
    sequence = [library.recognise(motion.frames).primitive for motion in motions]
    right, wrong = [], []
    for t in range(1, len(sequence)):
        before, now = sequence[t - 1 : t + 1]
        if before is None or now is None or classes.get(now) != motions[t].label:
            continue
        strange = [
            id
            for id in library.ids
            if classes.get(id) and (classes.get(before), classes[id]) not in allowed
        ]
        if (classes.get(before), classes[now]) in allowed and strange:
            history = sequence[max(t - library.graph.order, 0) : t]
            planted = strange[int(rng.integers(len(strange)))]
            right.append(library.score_order([*history, now])[-1])
            wrong.append(library.score_order([*history, planted])[-1])
    return Judged(tuple(right), tuple(wrong))
