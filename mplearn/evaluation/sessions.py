"""Sessions: executions of many primitives in one stream, by one person, with the truth.

Recorded takes repeat one movement. A session joins executions from all of a person's takes in a
Markov order, as a teacher would mix them, so that segmentation, clustering and the graph have
something to find. Nothing is resampled; only the head of an execution is bent, over 0.2-0.6 s, so
that it leaves from the posture in which the one before it ended.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from ..errors import InvalidValueError, RecordingError
from ..maths.easing import minimum_jerk
from ..recording import FloatArray, LabelledSegment, Recording
from .executions import all_without_gaps, split_repetitions, stood_like


@dataclass(frozen=True)
class SessionConfig:
    """How a session is joined.

    Attributes:
        blend_s: Shortest and longest time over which the posture at a join is blended [s].
        n_successors: How many movements usually follow a movement.
        loyalty: Probability that one of those follows, as long as they are not used up.
        executions: How often each repetition is used.

    Example:
        >>> SessionConfig(executions=2, loyalty=1.0).n_successors  # of each movement, and no others
        3
    """

    blend_s: tuple[float, float] = (0.2, 0.6)
    n_successors: int = 3
    loyalty: float = 0.85
    executions: int = 1

    def __post_init__(self) -> None:
        low, high = self.blend_s
        if not 0 < low <= high < math.inf:
            raise InvalidValueError(f"blend_s must be 0 < low <= high, not {self.blend_s}")
        if not 0 <= self.loyalty <= 1:
            raise InvalidValueError(f"loyalty must lie in [0, 1], not {self.loyalty}")
        for name in ("n_successors", "executions"):
            if getattr(self, name) < 1:
                raise InvalidValueError(f"{name} must be at least 1, not {getattr(self, name)}")


@dataclass(frozen=True)
class _Execution:
    """Consecutive labels of one take that belong together: out and back."""

    take: int
    labels: tuple[LabelledSegment, ...]


def make_session(
    takes: Sequence[Recording], rng: np.random.Generator, config: SessionConfig | None = None
) -> Recording:
    """Join a person's takes into one session.

    Each repetition is split at its reversal (`split_repetitions`), the first of a take dropped; the
    halves of a repetition stay together. Which movement follows which is drawn from a Markov chain
    that is itself drawn from `rng`. Marker takes are turned and shifted horizontally so that the
    body goes on where it stands. Missing measurements stay missing.

    Args:
        takes: Recordings of one person with labelled repetitions; same columns, same rate.
        rng: Source of the order, of the chain, and of the blending times.
        config: How to join.

    Returns:
        The session; its labels follow each other from frame 0 to the end.

    Raises:
        RecordingError: There are no takes, they do not match, or hold too few repetitions.

    Example:
        >>> import numpy as np
        >>> from mplearn import LabelledSegment, Recording
        >>> wave = 1 - np.cos(2 * np.pi * np.arange(400) / 100)  # four repetitions
        >>> def take(name, size):
        ...     labels = tuple(LabelledSegment(100 * k, 100 * k + 100, name) for k in range(4))
        ...     return Recording(size * wave[:, None], 100.0, ("elbow",), name=name, labels=labels)
        >>> takes = [take("up", 1.0), take("out", -1.0)]
        >>> session = make_session(takes, np.random.default_rng(0))
        >>> sorted({label.label for label in session.labels})
        ['out-back', 'out-out', 'up-back', 'up-out']
    """
    config = config or SessionConfig()
    check_alike(takes, "session", ("channels", "rate_hz", "person"))
    first = takes[0]
    split = split_repetitions(takes)
    filled = all_without_gaps(split)
    movements = [
        [_Execution(i, take.labels[k : k + 2]) for k in range(0, len(take.labels), 2)]
        * config.executions
        for i, take in enumerate(split)
    ]
    pieces: list[FloatArray] = []
    labels: list[LabelledSegment] = []
    widths = (config.blend_s[0] * first.rate_hz, config.blend_s[1] * first.rate_hz)
    end = 0
    last: FloatArray | None = None
    for execution in _order(movements, rng, config):
        take = split[execution.take]
        start = execution.labels[0].start
        piece = slice(start, execution.labels[-1].end)
        frames = filled[execution.take][piece]
        if last is not None:
            frames = _continue(last, frames, widths, rng, aligned=first.is_markers)
        last = frames[-1]
        pieces.append(np.where(np.isnan(take.frames[piece]), np.nan, frames))
        labels += [
            replace(label, start=label.start - start + end, end=label.end - start + end)
            for label in execution.labels
        ]
        end += len(frames)
    return Recording(
        frames=np.concatenate(pieces),
        rate_hz=first.rate_hz,
        channels=first.channels,
        name=f"session-{first.person}" if first.person else "session",
        person=first.person,
        labels=tuple(labels),
    )


def check_alike(recordings: Sequence[Recording], what: str, attributes: tuple[str, ...]) -> None:
    """Check that recordings can be joined.

    Args:
        recordings: The recordings.
        what: What they are joined to.
        attributes: What they must agree in.

    Raises:
        RecordingError: There are none, or they differ.
    """
    if not recordings:
        raise RecordingError(f"a {what} needs at least one take")
    first = recordings[0]
    for other in recordings[1:]:
        for name in attributes:
            if getattr(other, name) != getattr(first, name):
                raise RecordingError(
                    f"the recordings of a {what} must agree in {name}: {other.name!r} differs "
                    f"from {first.name!r}"
                )


def _continue(
    last: FloatArray,
    frames: FloatArray,
    widths: tuple[float, float],
    rng: np.random.Generator,
    *,
    aligned: bool,
) -> FloatArray:
    """Bend the first frames so that they leave from `last` without a jump.

    The bend takes the least time of `widths` in which it is no faster than the movement itself, if
    there is one, but not less than a time drawn from them.
    """
    if aligned:
        frames = stood_like(frames, last)
    offset = last - frames[0]
    fastest = np.linalg.norm(frames[4:] - frames[:-4], axis=1).max() / 4.0
    needed = 1.875 * np.linalg.norm(offset) / max(float(fastest), 1e-12)
    width = round(float(np.clip(needed, rng.uniform(*widths), widths[1])))
    x = np.arange(1, width + 1) / (width + 1)
    fade = 1.0 - minimum_jerk(x)
    bent = frames.copy()
    bent[:width] += fade[:, None] * offset
    return bent


def _order(
    movements: Sequence[Sequence[_Execution]], rng: np.random.Generator, config: SessionConfig
) -> list[_Execution]:
    """Draw the order of all executions from a random Markov chain over movements."""
    n = len(movements)
    left = [[each[i] for i in rng.permutation(len(each))] for each in movements]
    chain = np.full((n, n), (1.0 - config.loyalty) / n)
    for row in chain:
        usual = rng.choice(n, size=min(config.n_successors, n), replace=False)
        row[usual] += config.loyalty * rng.dirichlet(np.full(len(usual), 3.0))
    order: list[_Execution] = []
    at = int(rng.integers(n))
    while any(left):
        if order:
            weight = chain[at] * np.array([len(each) > 0 for each in left])
            if weight.sum() <= 0.0:  # a chain of full loyalty has run dry here
                weight = np.array([len(each) for each in left], dtype=np.float64)
            at = int(rng.choice(n, p=weight / weight.sum()))
        order.append(left[at].pop())
    return order
