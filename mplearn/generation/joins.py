"""Joining pieces of motion so that position and velocity are continuous."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ..recording import FloatArray


def joined(pieces: Sequence[FloatArray], rate_hz: float, blend_s: float) -> FloatArray:
    """Join pieces, shape (T_i, D) each, into one motion, shape (sum T_i, D).

    Each piece begins where the motion before it was going, and is back on its own course after
    ``blend_s`` (or at its end, if that comes first).
    """
    motion = [np.asarray(pieces[0])]
    for piece in pieces[1:]:
        before = motion[-1]
        velocity = (before[-1] - before[-2]) * rate_hz if len(before) > 1 else 0 * before[-1]
        expected = before[-1] + velocity / rate_hz
        motion.append(drawn_from(piece, expected, velocity, rate_hz, blend_s))
    return np.concatenate(motion)


def drawn_from(
    frames: FloatArray,
    posture: FloatArray,
    velocity: FloatArray,
    rate_hz: float,
    blend_s: float,
) -> FloatArray:
    """Return frames, shape (T, D), bent so that they start at a posture with a velocity.

    The difference fades by the quintic that has this offset and slope at first, and no offset,
    slope or curvature after ``blend_s`` (inertial blending).

    Args:
        frames: The motion, shape (T, D).
        posture: Where to start, shape (D,).
        velocity: Velocity at the start, shape (D,) [1/s].
        rate_hz: Frames per second [1/s].
        blend_s: How long the difference takes to fade [s].
    """
    span = min(blend_s, (len(frames) - 1) / rate_hz)
    own = (frames[1] - frames[0]) * rate_hz if len(frames) > 1 else np.zeros_like(velocity)
    offset, slope = posture - frames[0], velocity - own
    if span * rate_hz < 1:  # no time to blend in
        return np.concatenate([[posture], frames[1:]])
    s = np.minimum(np.arange(len(frames)) / rate_hz / span, 1.0)[:, None]
    fading = 1 - 10 * s**3 + 15 * s**4 - 6 * s**5
    leaning = s - 6 * s**3 + 8 * s**4 - 3 * s**5
    return np.asarray(frames + fading * offset + leaning * (span * slope))
