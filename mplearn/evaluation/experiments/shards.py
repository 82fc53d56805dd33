"""A corpus learned in shards and merged, against all of it learned one after the other."""

from __future__ import annotations

from collections import Counter, defaultdict
from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np

from ...demonstrator import paper_session
from ...errors import RecordingError
from ...learner import LearnerConfig, MotionLearner
from ...library import PrimitiveLibrary, RecognisedSegment
from ...merging import merge_learners
from ...recording import Recording, Segment
from ...tables import recognise_recording
from ..matching import match_segments
from ..rates import ErrorRates
from ..sessions import make_session
from ..table import Table, percent
from .sessions import by_person

_BLOCK = 128  # frames


@dataclass(frozen=True)
class Asked(ErrorRates):
    """What a library says of sessions whose truth is known.

    Attributes:
        primitives: Number of primitives.
        classes: Classes of motions that own a primitive.
        n_classes: Classes that the sessions hold.
        n_motions: Motions that they hold.
        n_found: Moving segments that were found.
        n_wrong: Segments that were recognised as another class than they show, or though they show
            none.
        n_missed: Segments of a class that owns a primitive, and were not recognised.
        n_right: Segments that were recognised as what they show.
    """

    primitives: int
    classes: tuple[str, ...]
    n_classes: int
    n_motions: int
    n_found: int
    n_wrong: int
    n_missed: int
    n_right: int

    @property
    def coverage(self) -> float:
        """Share of the motions that were recognised rightly."""
        return self.n_right / max(1, self.n_motions)


def ask(library: PrimitiveLibrary, sessions: Sequence[Recording]) -> Asked:
    """Let a library recognise labelled sessions, and hold what it says against the truth.

    A primitive's class is that of more than half of the segments recognised as it.
    """
    said: list[tuple[str, int | None]] = []  # of each segment: what it shows, its primitive
    for session in sessions:
        rows = list(recognise_recording(library, session))
        found = [_segment(row, session.rate_hz) for row in rows]
        shown = match_segments(session.labels, found, session.rate_hz).labels
        said += zip(shown, (row.primitive for row in rows), strict=True)
    votes: defaultdict[int, Counter[str]] = defaultdict(Counter)
    for label, primitive in said:
        if primitive is not None:
            votes[primitive][label] += 1
    classes = {
        id: label
        for id, counts in votes.items()
        for label, n in counts.most_common(1)
        if label and 2 * n > counts.total()
    }
    known = set(classes.values())
    right = [bool(label) and classes.get(p or 0) == label for label, p in said]
    return Asked(
        primitives=len(library),
        classes=tuple(sorted(known)),
        n_classes=len({label.label for session in sessions for label in session.labels}),
        n_motions=sum(len(session.labels) for session in sessions),
        n_found=len(said),
        n_wrong=sum(p is not None and not r for (_, p), r in zip(said, right, strict=True)),
        n_missed=sum(p is None and label in known for label, p in said),
        n_right=sum(right),
    )


def _segment(row: RecognisedSegment, rate_hz: float) -> Segment:
    return Segment(round(row.start_s * rate_hz), round(row.end_s * rate_hz))


def shards_of_people(
    takes: Iterable[Recording], seed: int = 0
) -> tuple[list[Recording], list[Recording]]:
    """Return a session of each person's takes, and another of each, in other orders.

    Raises:
        RecordingError: There are fewer than two people.

    Example:
        >>> import numpy as np
        >>> from mplearn import LabelledSegment, Recording
        >>> wave = 1 - np.cos(2 * np.pi * np.arange(400) / 100)  # four repetitions
        >>> def take(name, size, person="anna"):
        ...     labels = tuple(LabelledSegment(100 * k, 100 * k + 100, name) for k in range(4))
        ...     frames = size * wave[:, None]
        ...     return Recording(frames, 100.0, ("elbow",), name=name, labels=labels, person=person)
        >>> takes = [take(f"up {who}", 1.0, who) for who in ("anna", "ben")]
        >>> takes += [take(f"out {who}", -1.0, who) for who in ("anna", "ben")]
        >>> learned, asked = shards_of_people(takes)
        >>> len(learned), len(asked)
        (2, 2)
    """
    people = by_person(takes)
    if len(people) < 2:
        raise RecordingError(f"shards by person need at least two people, not {list(people)}")
    rng = np.random.default_rng(seed)
    return (
        [make_session(own, rng) for own in people.values()],
        [make_session(own, rng) for own in people.values()],
    )


def demonstrated_shards(seeds: Sequence[int]) -> tuple[list[Recording], list[Recording]]:
    """Return halves of sessions like the paper's: one to learn, one to ask about."""
    halves: list[list[Recording]] = [[], []]
    for seed in seeds:
        session = paper_session(seed)
        recording = session.recording
        middle = session.truth[len(session.truth) // 2].start
        for half, (start, end) in zip(halves, ((0, middle), (middle, len(recording))), strict=True):
            whole = Recording(
                recording.frames,
                recording.rate_hz,
                recording.channels,
                f"{recording.name} {seed}",
                labels=tuple(session.truth),
            )
            half.append(whole.sliced(start, end))
    return halves[0], halves[1]


def shard_table(title: str, learned: Sequence[Recording], asked: Sequence[Recording]) -> Table:
    """Learn shards one after the other by one learner, and each by its own, merged.

    Args:
        title: What they are.
        learned: A labelled session a shard.
        asked: Labelled sessions of the same people and motions.

    Example:
        >>> from mplearn.demonstrator import demonstrate
        >>> def session(seed):
        ...     return demonstrate(["BAR", "BAL"] * 4, seed=seed, rate_hz=50.0).recording
        >>> table = shard_table("Two halves", [session(1), session(2)], [session(3)])
        >>> [row[0] for row in table.rows]
        ['one pass', 'shards, merged']
    """
    config = LearnerConfig(learned[0].channels, learned[0].rate_hz)
    whole = MotionLearner(config)
    for shard in learned:
        _learn(whole, shard)
    parts = [_learn(MotionLearner(config), shard) for shard in learned]
    rows = []
    for name, learner in (("one pass", whole), ("shards, merged", merge_learners(parts))):
        each = ask(learner.snapshot(), asked)
        rows.append(
            (
                name,
                str(each.primitives),
                f"{len(each.classes)} of {each.n_classes}",
                percent(each.false_positive),
                percent(each.false_negative),
                percent(each.coverage),
            )
        )
    return Table(
        f"Shards, merged, against one pass: {title}",
        ("learned", "primitives", "classes", "false positives", "false negatives", "coverage"),
        tuple(rows),
        f"{len(learned)} shards. The library of each recognises other sessions of the same kind. "
        "False positives and negatives are shares of the segments found, coverage is the share of "
        "the motions that are recognised rightly. A primitive's class is that of more than half of "
        "the segments recognised as it.",
    )


def _learn(learner: MotionLearner, session: Recording) -> MotionLearner:
    for _ in learner.learn_recording(session, _BLOCK):
        pass
    return learner
