"""Streams of several people: one body is replaced by another from one frame to the next."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from itertools import pairwise

import numpy as np

from ..errors import RecordingError
from ..maths.rigid_fit import RigidFit, fit_upright
from ..recording import FloatArray, LabelledSegment, Recording
from .sessions import check_alike


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
    check_alike(sessions, "stream", ("channels", "rate_hz"))
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
        frames.append(
            piece.frames if fit is None else fit.apply(piece.markers).reshape(piece.frames.shape)
        )
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
    return fit_upright(source[seen], target[seen])


def _held(frames: FloatArray) -> FloatArray:
    """Return frames in which a missing measurement is the one before it, if there is one."""
    rows = np.where(np.isnan(frames), 0, np.arange(len(frames))[:, None])
    return np.take_along_axis(frames, np.maximum.accumulate(rows, axis=0), axis=0)
