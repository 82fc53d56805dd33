"""Sessions: executions of many primitives in one stream, by one person or several, with the truth.

Recorded takes repeat one movement. A session joins executions from all of a person's takes in a
Markov order, as a teacher would mix them, so that segmentation, clustering and the graph have
something to find. Nothing is resampled; only the head of an execution is bent, over 0.2-0.6 s, so
that it leaves from the posture in which the one before it ended. Several people's sessions make one
stream, in which one body is replaced by another from one frame to the next.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np

from ..errors import InvalidValueError, RecordingError
from ..recording import FloatArray, LabelledSegment, Recording
from .executions import RigidFit, fit_standing, split_repetitions, without_gaps


@dataclass(frozen=True)
class SessionConfig:
    """How a session is joined.

    Attributes:
        blend_s: Shortest and longest time over which the posture at a join is blended [s].
        n_successors: How many movements usually follow a movement.
        loyalty: Probability that one of those follows, as long as they are not used up.
        executions: How often each repetition is used.
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
    """
    config = config or SessionConfig()
    _check_alike(takes, "session", ("channels", "rate_hz", "person"))
    first = takes[0]
    split = split_repetitions(takes)
    filled = [without_gaps(take.frames) for take in split]
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


def join_people(
    sessions: Sequence[Recording],
    rng: np.random.Generator,
    *,
    interleaved: bool,
    motions: int = 2,
) -> Recording:
    """Join the sessions of several people into one stream, in which nobody is announced.

    One person's session comes after another's; or, interleaved, each is cut after every so many
    motions, and who goes on is drawn in proportion to what is left of each session: as often as
    not it is somebody else. Where the person changes, another body stands there from one frame to
    the next: nothing is blended, though marker sessions are turned and shifted horizontally so that
    all stand in the same place.

    Args:
        sessions: One recording a person, labelled, as `make_session` or the demonstrator make them;
            same columns, same rate.
        rng: Source of the order.
        interleaved: Whether the person changes within a session.
        motions: Motions after which the person may change: the two of a repetition.

    Returns:
        The stream; each label names its person.

    Raises:
        RecordingError: There are no sessions, they do not match, or one holds no labels.
    """
    _check_alike(sessions, "stream", ("channels", "rate_hz"))
    pieces = [
        _cut(session, motions if interleaved else len(session.labels)) for session in sessions
    ]
    left = [list(reversed(each)) for each in pieces]
    frames: list[FloatArray] = []
    labels: list[LabelledSegment] = []
    end = 0
    before = -1
    fit: RigidFit | None = None
    while any(left):
        weights = np.array([len(each) for each in left], dtype=np.float64)
        if not interleaved and before >= 0 and left[before]:
            weights = np.eye(len(left))[before]
        at = int(rng.choice(len(left), p=weights / weights.sum()))
        piece = left[at].pop()
        if at != before and frames and piece.is_markers:
            fit = _fit_seen(piece.frames, frames[-1])
        frames.append(piece.frames if fit is None else fit.apply(piece.frames))
        labels += [
            replace(
                label,
                start=label.start + end,
                end=label.end + end,
                person=label.person or sessions[at].person,
            )
            for label in piece.labels
        ]
        end += len(piece)
        before = at
    return Recording(
        frames=np.concatenate(frames),
        rate_hz=sessions[0].rate_hz,
        channels=sessions[0].channels,
        name="interleaved" if interleaved else "block-wise",
        labels=tuple(labels),
    )


def _check_alike(recordings: Sequence[Recording], what: str, attributes: tuple[str, ...]) -> None:
    """Check that recordings can be joined."""
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


def _cut(session: Recording, motions: int) -> list[Recording]:
    """Cut a session after every so many motions; pauses belong to what comes before them."""
    if not session.labels or motions < 1:
        raise RecordingError(
            f"session {session.name!r} needs labels and pieces of at least one motion, not "
            f"{len(session.labels)} and {motions}"
        )
    ends = [label.end for label in session.labels[motions - 1 :: motions]]
    ends = [*(end for end in ends if end < session.labels[-1].end), len(session)]
    return [session.sliced(a, b) for a, b in pairwise([0, *ends])]


def _fit_seen(frames: FloatArray, before: FloatArray) -> RigidFit:
    """Fit the first frame of markers to the last one before, by the markers that both show."""
    source, target = (
        frame.reshape(-1, 3) for frame in (_held(frames[::-1])[-1], _held(before)[-1])
    )
    seen = np.isfinite(source).all(axis=1) & np.isfinite(target).all(axis=1)
    return fit_standing(source[seen].ravel(), target[seen].ravel())


def _held(frames: FloatArray) -> FloatArray:
    """Return frames in which a missing measurement is the one before it, if there is one."""
    rows = np.where(np.isnan(frames), 0, np.arange(len(frames))[:, None])
    return np.take_along_axis(frames, np.maximum.accumulate(rows, axis=0), axis=0)


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
        frames = fit_standing(frames[0], last).apply(frames)
    offset = last - frames[0]
    fastest = np.linalg.norm(frames[4:] - frames[:-4], axis=1).max() / 4.0
    needed = 1.875 * np.linalg.norm(offset) / max(float(fastest), 1e-12)
    width = round(float(np.clip(needed, rng.uniform(*widths), widths[1])))
    x = np.arange(1, width + 1) / (width + 1)
    fade = 1.0 - x**3 * (10.0 - 15.0 * x + 6.0 * x**2)  # minimum jerk, 1 -> 0
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
