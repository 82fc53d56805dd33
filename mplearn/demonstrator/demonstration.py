"""Whole performances: a script, or a session like the paper's, as a recording with its truth."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, replace

import numpy as np

from mplearn.recording import LabelledSegment, Recording

from .demonstrator import Demonstrator
from .performance import Block
from .person import Person
from .sequencing import check_script, markov_walk
from .variability import Variability

_BASE = tuple(f"base_{part}" for part in ("x", "y", "z", "qw", "qx", "qy", "qz"))
_SESSION_S = 16 * 60.0
_BALANCE = 0.5


@dataclass(frozen=True, eq=False)
class Demonstration:
    """A performance.

    Attributes:
        recording: What the cameras saw: markers [m], NaN where hidden; the truth as its labels.
        truth: The segments, in order, as a human observer would mark them (see `observer`); pauses
            are in none.
        posture: The noiseless truth behind it: base position [m] and quaternion (w, x, y, z), then
            the 40 joint angles [rad], in MuJoCo's qpos layout.

    Example:
        >>> shown = demonstrate(["SQD", "SQR"], seed=1, rate_hz=50.0)
        >>> [segment.label for segment in shown.truth], shown.posture.frames.shape[1]
        (['SQD', 'SQR'], 47)
    """

    recording: Recording
    truth: tuple[LabelledSegment, ...]
    posture: Recording


def demonstrate(
    script: Iterable[str],
    seed: int,
    *,
    person: Person | None = None,
    rate_hz: float = 100.0,
    variability: Variability | None = None,
) -> Demonstration:
    """Let a person perform a script.

    Args:
        script: Names of primitives (see `PRIMITIVES`), each starting where its predecessor ends.
        seed: Seed of everything random, an integer >= 0.
        person: Who moves; the average person where None.
        rate_hz: Frames per second [1/s], in [10, 1000].
        variability: Sizes of what is random; a person's where None.

    Raises:
        InvalidValueError: The script is empty, or names an unknown primitive or one that cannot
            follow its predecessor; the seed or the rate is not allowed.

    Example:
        >>> taught = demonstrate(["BAR", "BAL"], seed=1)
        >>> taught.recording.is_markers, [each.label for each in taught.truth if each.label]
        (True, ['BAR', 'BAL'])
    """
    names = tuple(script)
    check_script(names)
    demonstrator = Demonstrator(person, seed, rate_hz=rate_hz, variability=variability)
    return _gathered(demonstrator, demonstrator.blocks(names))


def paper_session(
    seed: int,
    *,
    person: Person | None = None,
    rate_hz: float = 100.0,
    variability: Variability | None = None,
) -> Demonstration:
    """Return the likes of the paper's data [Kulic2012, section 4.2.2].

    16 minutes of one person, about 751 segments of 22 types, about equally often, in the order of
    `SEQUENCING`, some joined fluidly, some with a pause between them. (751 is the average person's
    number; who moves faster performs more.)

    Args:
        seed: Seed of everything random, an integer >= 0.
        person: Who moves; the average person where None.
        rate_hz: Frames per second [1/s], in [10, 1000].
        variability: Sizes of what is random; a person's where None.

    Raises:
        InvalidValueError: The seed or the rate is not allowed.

    Example:
        >>> session = paper_session(101, rate_hz=10.0)
        >>> len({segment.label for segment in session.truth}), len(session.truth) > 700
        (22, True)
    """
    demonstrator = Demonstrator(person, seed, rate_hz=rate_hz, variability=variability)
    # an own source for the order: another person with the same seed performs the same script
    script = markov_walk(np.random.default_rng((demonstrator.seed, 0)), balance=_BALANCE)
    n_frames = round(_SESSION_S * demonstrator.rate_hz)
    return _gathered(demonstrator, demonstrator.blocks(script), n_frames)


def _gathered(
    demonstrator: Demonstrator, blocks: Iterable[Block], n_frames: int | None = None
) -> Demonstration:
    """Join blocks to a demonstration; of an endless performance take the first frames."""
    pieces: list[Block] = []
    length = 0
    for block in blocks:
        pieces.append(block)
        length += len(block.postures)
        if n_frames is not None and length >= n_frames:
            break
    recording = Recording(
        frames=np.concatenate([p.markers for p in pieces]).reshape(length, -1)[:n_frames],
        rate_hz=demonstrator.rate_hz,
        channels=demonstrator.channels,
        name=f"demonstration-{demonstrator.seed}",
        person=demonstrator.person.name,
    )
    truth = tuple(
        segment for piece in pieces for segment in piece.truth if segment.end <= len(recording)
    )
    recording = replace(recording, labels=truth)
    posture = replace(
        recording,
        frames=np.concatenate([p.postures for p in pieces])[:n_frames],
        channels=_BASE + demonstrator.body.joint_names,
    )
    return Demonstration(recording, truth, posture)
