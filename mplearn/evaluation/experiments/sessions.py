"""The sessions that learning is measured on: the synthetic demonstrator's, and people's."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterable, Iterator, Sequence

import numpy as np

from ...demonstrator import paper_session
from ...learner import LearnerConfig, MotionLearner
from ...recording import Recording
from ..observing import observe
from ..sessions import SessionConfig, make_session
from .learning import Outcome, learn_session

ORDERS = 5


def learn_paper_sessions(seeds: Sequence[int]) -> Iterator[tuple[str, Outcome]]:
    """Learn sessions like the paper's: 16 minutes, 22 types, about 751 segments."""
    for i, seed in enumerate(seeds):
        demonstration = paper_session(seed)
        if i == 0:
            compile_kernels(demonstration.recording)
        yield (
            f"paper_session({seed})",
            learn_session(demonstration.recording, demonstration.truth),
        )


def learn_people(takes: Iterable[Recording], orders: int = ORDERS) -> Iterator[tuple[str, Outcome]]:
    """Learn each person's takes, joined into sessions in several orders, by a new learner each.

    Example:
        >>> import numpy as np
        >>> from mplearn import LabelledSegment, Recording
        >>> wave = 1 - np.cos(2 * np.pi * np.arange(400) / 100)  # four repetitions
        >>> def take(name, size):
        ...     labels = tuple(LabelledSegment(100 * k, 100 * k + 100, name) for k in range(4))
        ...     frames = size * wave[:, None]
        ...     return Recording(frames, 100.0, ("elbow",), name=name, labels=labels, person="anna")
        >>> outcomes = learn_people([take("up", 1.0), take("out", -1.0)], orders=1)
        >>> [(name, outcome.rates.n_classes) for name, outcome in outcomes]
        [('anna, order 0', 4)]
    """
    for person, own in by_person(takes).items():
        for order in range(orders):
            session = make_session(own, np.random.default_rng(order))
            if order == 0:
                compile_kernels(session)
            yield f"{person or 'unnamed'}, order {order}", learn_session(session)


def observed_sessions(
    takes: Iterable[Recording], orders: int = ORDERS, executions: int = 1
) -> Iterator[tuple[str, Recording]]:
    """Join each person's takes into sessions in several orders, as the learner sees them.

    Args:
        takes: Recordings with labelled repetitions, of any number of people.
        orders: Sessions a person.
        executions: How often each repetition comes in a session.

    Example:
        >>> import numpy as np
        >>> from mplearn import LabelledSegment, Recording
        >>> wave = 1 - np.cos(2 * np.pi * np.arange(400) / 100)  # four repetitions
        >>> def take(name, size):
        ...     labels = tuple(LabelledSegment(100 * k, 100 * k + 100, name) for k in range(4))
        ...     frames = size * wave[:, None]
        ...     return Recording(frames, 100.0, ("elbow",), name=name, labels=labels, person="anna")
        >>> sessions = list(observed_sessions([take("up", 1.0), take("out", -1.0)], orders=2))
        >>> [name for name, session in sessions]
        ['anna, order 0', 'anna, order 1']
    """
    for person, own in by_person(takes).items():
        for order in range(orders):
            rng = np.random.default_rng(order)
            session = make_session(own, rng, SessionConfig(executions=executions))
            yield f"{person or 'unnamed'}, order {order}", observe(session)


def compile_kernels(recording: Recording) -> None:
    """Let the start of a recording be learned and forgotten, so that no timing holds compiling."""
    learner = MotionLearner(LearnerConfig(recording.channels, recording.rate_hz))
    learner.learn_many(recording.frames[:2500])


def by_person(takes: Iterable[Recording]) -> dict[str, list[Recording]]:
    """Group takes by who performs them, in the order of their first take.

    Example:
        >>> import numpy as np
        >>> from mplearn import Recording
        >>> takes = [
        ...     Recording(np.zeros((50, 1)), 50.0, ("x",), name=name, person=name[:4])
        ...     for name in ("anna 1", "anna 2", "carl 1")
        ... ]
        >>> {person: len(each) for person, each in by_person(takes).items()}
        {'anna': 2, 'carl': 1}
    """
    people: dict[str, list[Recording]] = defaultdict(list)
    for take in takes:
        people[take.person].append(take)
    return people
