"""Several people in one stream, and nobody says who moves."""

from __future__ import annotations

import time
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from ...errors import RecordingError
from ...learner import LearnerConfig, MotionLearner, PersonChanged, SegmentClosed
from ...recording import LabelledSegment, Recording
from ..boundaries import score_boundaries
from ..rates import rate_learning
from ..sessions import make_session
from ..streams import join_people
from ..table import Table, percent
from .learning import COLUMNS, NOTE, Outcome, mean_row, outcome_row
from .sessions import by_person


@dataclass(frozen=True)
class PeopleOutcome:
    """What came of one stream of several people.

    Attributes:
        interleaved: Whether the person changed within a session.
        people: Who took part.
        learning: As for one person; a class is a motion, whoever performs it.
        identified: Share of the motions that were taken for their own person's, each number that
            the learner gave standing for one person.
    """

    interleaved: bool
    people: tuple[str, ...]
    learning: Outcome
    identified: float


def learn_together(
    takes: Iterable[Recording], orders: int = 1, *, interleaved: Sequence[bool] = (False, True)
) -> Iterator[PeopleOutcome]:
    """Learn all people's takes as one stream, in several orders, each by a new learner.

    Args:
        takes: Recordings with labelled repetitions, of at least two people.
        orders: Orders of presentation, of the motions and of the people.
        interleaved: Protocols: one person after another (False), or the person drawn anew after
            each repetition (True).

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
        >>> outcome = next(learn_together(takes, interleaved=[False]))
        >>> outcome.people, outcome.interleaved
        (('ben', 'anna'), False)
    """
    people = by_person(takes)
    if len(people) < 2:
        raise RecordingError(f"a stream of several people needs at least two, not {list(people)}")
    for order in range(orders):
        rng = np.random.default_rng(order)
        sessions = [make_session(own, rng) for own in people.values()]
        for mixed in interleaved:
            yield learn_stream(join_people(sessions, rng, interleaved=mixed), mixed)


def learn_stream(stream: Recording, interleaved: bool) -> PeopleOutcome:
    """Learn one stream of several people, frame by frame, from nothing.

    Args:
        stream: As `join_people` makes it; labels name their person.
        interleaved: How it was made.
    """
    learner = MotionLearner(LearnerConfig(stream.channels, stream.rate_hz))
    begin = time.perf_counter()
    events = [event for each in learner.learn_recording(stream) for event in each]
    took_s = time.perf_counter() - begin
    closed = [event for event in events if isinstance(event, SegmentClosed)]
    segments = [event.segment for event in closed]
    placements = [event.placement for event in closed]
    changes = [event for event in events if isinstance(event, PersonChanged)]
    outcome = Outcome(
        learner,
        rate_learning(stream.labels, segments, placements, stream.rate_hz),
        score_boundaries(segments, stream.labels, stream.rate_hz),
        stream.duration_s / took_s,
    )
    people = tuple(dict.fromkeys(label.person for label in stream.labels))
    return PeopleOutcome(interleaved, people, outcome, _identified(stream.labels, changes))


def _identified(labels: Sequence[LabelledSegment], changes: Sequence[PersonChanged]) -> float:
    """Return the share of the motions that were taken for their own person's."""
    from scipy.optimize import linear_sum_assignment

    people = list(dict.fromkeys(label.person for label in labels))
    frames = np.array([change.frame for change in changes])
    numbers = np.array([0, *(change.person for change in changes)])
    counts = np.zeros((len(people), numbers.max() + 1))
    for label in labels:
        at = np.searchsorted(frames, (label.start + label.end) // 2, side="right")
        counts[people.index(label.person), numbers[at]] += 1
    return float(counts[linear_sum_assignment(-counts)].sum() / counts.sum())


def people_table(outcomes: Sequence[PeopleOutcome]) -> Table:
    """Return the outcomes of streams of several people, with their means.

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
        >>> table = people_table(list(learn_together(takes, interleaved=[False])))
        >>> table.columns[:2]
        ('session', 'extracted')
    """
    rows: list[tuple[str, ...]] = []
    for mixed in (False, True):
        name = "interleaved" if mixed else "block-wise"
        own = [outcome for outcome in outcomes if outcome.interleaved == mixed]
        for i, each in enumerate(own):
            row = outcome_row(f"{name}, order {i}", each.learning)
            rows.append((*row, percent(each.identified)))
        if len(own) > 1:
            mean = mean_row(f"{name}, mean", [each.learning for each in own])
            spread = [
                100 * float(np.std([getattr(each.learning.rates, rate) for each in own], ddof=1))
                for rate in ("false_positive", "false_negative")
            ]
            identified = float(np.mean([each.identified for each in own]))
            rows.append((*mean, percent(identified)))
            rows.append(
                (
                    f"{name}, standard deviation",
                    *("", "", ""),
                    *(f"{each:.1f} %" for each in spread),
                    *("",) * (len(COLUMNS) - 6),
                    "",
                )
            )
    people = ", ".join(outcomes[0].people) if outcomes else ""
    return Table(
        f"Several people in one stream, person unknown: {people}",
        (*COLUMNS, "person right"),
        tuple(rows),
        f"{NOTE} Block-wise: one person's session after another's; interleaved: who goes on is "
        "drawn after each repetition. Nobody is announced: from one frame to the next another "
        "body stands there. A class is a motion, whoever performs it. Person right: share of the "
        "motions taken for their own person's.",
    )
