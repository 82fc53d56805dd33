"""Where the cycles of rhythmic motion turn, found with look-ahead, and how cuts lie in them.

The truth knows what no on-line segmenter may: the whole motion. Steps turn where one ankle is
farthest ahead of the other, which is about where a foot strikes, if it was lifted past the other on
its way; other motion where its main oscillation, the first principal component of the posture, is
at an extreme. Only what repeats counts: a bout ends where a half of a cycle lasts much longer, or
leads much farther, than the one a cycle before.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np
from scipy.signal import butter, find_peaks, sosfiltfilt

from ..recording import BoolArray, FloatArray, IntArray

BAND_HZ = (0.2, 4.0)
"""Cycles are sought from a fifth to four in a second [1/s]."""

STEP_M = 0.1
"""Least prominence of an extreme of one ankle ahead of the other: half of a short step [m]."""

LEVEL = 0.6  # of how far ahead: an ankle is no higher above the other where a step turns
LIFT_M = 0.025  # of one ankle over the other as they pass, at the least [m]
PROMINENCE = 0.35  # of the oscillation's usual height, for other motion
LEAST_CYCLES = 1.5  # of a bout of labelled motion
LEAST_STRIDES = 2.0  # of a bout of steps, which nobody says are steps
_LONGEST_S = 2.5  # half of a cycle
_LONGER, _FARTHER = 1.7, 2.0  # than a cycle before, at most
_EDGE = 0.25  # of the half of a cycle at an end of a bout: cuts this near belong half to it


@dataclass(frozen=True, eq=False)
class Bout:
    """A stretch of rhythmic motion.

    Attributes:
        label: What goes on.
        turns: Frames at which the motion turns, twice a cycle, length n >= 4.
    """

    label: str
    turns: IntArray

    @property
    def n_cycles(self) -> float:
        """How many cycles it holds."""
        return 0.5 * (len(self.turns) - 1)

    def overlaps(self, other: Bout) -> bool:
        """Return whether both go on at some time."""
        return bool(self.turns[0] < other.turns[-1] and other.turns[0] < self.turns[-1])


@dataclass(frozen=True)
class CutScore:
    """How cuts lie in the cycles of a bout.

    Attributes:
        bout: The bout.
        per_cycle: Cuts a cycle.
        spread: Root mean square distance of the cuts' phases from the mean of their half of the
            cycle [cycle]; NaN for fewer than three cuts.
    """

    bout: Bout
    per_cycle: float
    spread: float


def find_steps(ahead: FloatArray, above: FloatArray, rate_hz: float) -> list[Bout]:
    """Return the bouts of walking, forward or backward, and running.

    Where a knee is raised, a person kicks or jogs on the spot, an ankle rises about as far as it
    goes ahead or back; where the trunk turns over feet that stand, none leaves the floor; in a
    boxer's stance none passes the other: these are no steps.

    Args:
        ahead: How far the left ankle is ahead of the right one, shape (T,) [m].
        above: How far it is above it, shape (T,) [m].
        rate_hz: Frames per second [1/s].
    """
    band = _band(ahead, rate_hz)
    if band is None:
        return []
    turns, heights = _turns(band, STEP_M)
    level = np.abs(above[turns]) <= LEVEL * np.abs(ahead[turns])
    passed = level[:-1] & level[1:] & (ahead[turns[:-1]] * ahead[turns[1:]] < 0)
    found: list[Bout] = []
    for way in (1, -1):  # forward the ankle that comes ahead is lifted, backward the other
        steps = passed.copy()
        for i in np.flatnonzero(passed):
            start, end = turns[i : i + 2]
            lifts = way * np.sign(ahead[end]) * above[start:end]
            steps[i] = lifts.max() >= LIFT_M
        bouts = _bouts("steps", turns, heights, LEAST_STRIDES, rate_hz, steps)
        found += [bout for bout in bouts if not any(map(bout.overlaps, found))]
    return found


def find_oscillation(label: str, posture: FloatArray, rate_hz: float) -> list[Bout]:
    """Return the bouts of the main oscillation of a motion.

    Args:
        label: What goes on.
        posture: The motion, shape (T, D).
        rate_hz: Frames per second [1/s].
    """
    band = _band(posture, rate_hz)
    if band is None:
        return []
    main = band @ np.linalg.svd(band, full_matrices=False)[2][0]
    height = 2 * np.sqrt(2) * float(main.std())
    if height <= 0:
        return []
    return _bouts(label, *_turns(main, PROMINENCE * height), LEAST_CYCLES, rate_hz)


def shifted(bout: Bout, frames: int) -> Bout:
    """Return a bout that was found in a piece of a take, in frames of the take."""
    return Bout(bout.label, bout.turns + frames)


def score_cuts(bout: Bout, cuts: Iterable[int]) -> CutScore:
    """Return how cuts lie in the cycles of a bout.

    A phase is linear between turns. The cuts are divided into halves of the cycle, so that cuts at
    both turns, as at one, have a small spread.

    Args:
        bout: The bout.
        cuts: Frames of all boundaries of the take.
    """
    first, last = bout.turns[0], bout.turns[-1]
    near_first, near_last = _EDGE * np.diff(bout.turns)[[0, -1]]
    found = np.asarray(sorted(cuts), dtype=np.float64)
    found = found[(found >= first - near_first) & (found <= last + near_last)]
    inner = int(((found > first + near_first) & (found < last - near_last)).sum())
    per_cycle = (inner + 0.5 * (len(found) - inner)) / bout.n_cycles
    if len(found) < 3:
        return CutScore(bout, per_cycle, float("nan"))
    phase = np.interp(found, bout.turns, 0.5 * np.arange(len(bout.turns)))
    centre = np.angle(np.exp(4j * np.pi * phase).mean()) / (4 * np.pi)
    halves = 2 * (phase - centre)
    half = np.round(halves)
    off = 0.5 * (halves - half)
    for parity in (0, 1):
        of_one = half % 2 == parity
        if of_one.any():
            off[of_one] -= off[of_one].mean()
    return CutScore(bout, per_cycle, float(np.sqrt((off**2).mean())))


def _band(motion: FloatArray, rate_hz: float) -> FloatArray | None:
    """Return the part of a motion in which cycles lie; None where it is too short."""
    if len(motion) < max(30, round(rate_hz)):
        return None
    high = min(BAND_HZ[1], 0.4 * rate_hz)
    filt = butter(2, [BAND_HZ[0], high], "bandpass", fs=rate_hz, output="sos")
    centred = motion - motion.mean(axis=0)
    return np.asarray(
        sosfiltfilt(filt, centred, axis=0, padlen=min(len(motion) - 2, round(rate_hz)))
    )


def _bouts(
    label: str,
    turns: IntArray,
    heights: FloatArray,
    least: float,
    rate_hz: float,
    counted: BoolArray | None = None,
) -> list[Bout]:
    """Return the bouts of at least so many cycles among turns, n; halves that count, (n - 1,)."""
    lasts, leads = np.diff(turns), np.abs(np.diff(heights))
    whole = lasts <= _LONGEST_S * rate_hz
    if counted is not None:
        whole &= counted
    found: list[Bout] = []
    start = 0
    for i in range(len(lasts) + 1):
        if i < len(lasts) and whole[i] and _repeats(lasts, leads, start, i):
            continue
        if 0.5 * (i - start) >= least:
            found.append(Bout(label, turns[start : i + 1]))
        start = i if i < len(lasts) and whole[i] else i + 1
    return found


def _repeats(lasts: IntArray, leads: FloatArray, start: int, i: int) -> bool:
    """Whether a half of a cycle is like the one a cycle before, and leads as far as the last."""
    if i - 2 >= start and not 1 / _LONGER <= lasts[i] / lasts[i - 2] <= _LONGER:
        return False
    return i - 1 < start or bool(1 / _FARTHER <= leads[i] / leads[i - 1] <= _FARTHER)


def _turns(motion: FloatArray, prominence: float) -> tuple[IntArray, FloatArray]:
    """Return the extremes of a motion, high and low in turn: frames and heights, length n each."""
    found = [
        (int(at), sign)
        for sign in (1, -1)
        for at in find_peaks(sign * motion, prominence=prominence)[0]
    ]
    kept: list[tuple[int, int]] = []
    for at, sign in sorted(found):
        if not kept or kept[-1][1] != sign:
            kept.append((at, sign))
        elif sign * motion[at] > sign * motion[kept[-1][0]]:  # of two alike, the farther one
            kept[-1] = (at, sign)
    turns = np.array([at for at, _ in kept], dtype=np.int64)
    return turns, motion[turns]
