"""When what happens in a plan: progress of the motion, feet in the air, where the weight is.

A foot may leave the ground only when the weight is over the other one. Where the demonstrator was
quicker than the robot can be, the motion is slowed down just before, and no more than needed.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from mplearn.maths.easing import smooth_step
from mplearn.recording import FloatArray, IntArray

from .footwork import Footwork

RAMP_S = 0.3  # in which a motion that had to wait gathers speed
SWING_S = 0.4  # to raise or lower a foot where the motion itself does not [s], and the more
SWING_S_PER_M = 3.0  # the higher [s/m]
BESIDE = -2
GATHER_M = 0.04  # to this height a foot is raised that is put beside the other
LEAST_SWING_S = 0.4  # in which one foot carries, at least [s]
SHIFT_S = 0.5  # to bring the weight anywhere [s], and the more the farther:
SHIFT_S_PER_M = 2.5  # [s/m]


class Stretch(NamedTuple):
    """A part of a plan in which the same feet stand.

    Attributes:
        first: Frame of the motion at its start; not whole where speed differs.
        last: Frame at its end.
        up: Side of the foot that is in the air; -1 for none.
        lands: Frame of the motion in which that foot lands at its end; -1 where it lands not, or
            where it stood; `BESIDE` where it lands beside the other, as the robot stands.
        least_s: How long it takes at least [s].
    """

    first: int
    last: int
    up: int
    lands: int
    least_s: float


class Timeline(NamedTuple):
    """Times of a plan of K knots after its start.

    Attributes:
        progress: Where in the motion each knot is, shape (K,) [frames].
        up: Side of the foot in the air at each knot, -1 for none, shape (K,).
        stretches: The parts.
        ends: Knot at which each part ends (the start is knot 0), same length.
        patience: By how much least times are longer than they are.
    """

    progress: FloatArray
    up: IntArray
    stretches: tuple[Stretch, ...]
    ends: tuple[int, ...]
    patience: float

    def waits(self, knot: int, frame_s: float) -> bool:
        """Return whether the motion waits for the feet or the weight in the part of a knot.

        Args:
            knot: Which knot, the start being 0.
            frame_s: Time from frame to frame at the speed of performance [s].
        """
        part = self.stretches[int(np.searchsorted(self.ends[:-1], knot))]
        return (
            part.least_s > 0.0 and self.patience * part.least_s > (part.last - part.first) * frame_s
        )


def shift_time_s(distance_m: float) -> float:
    """Return how long the weight takes to move so far and come to rest [s]."""
    return SHIFT_S + SHIFT_S_PER_M * distance_m


def swing_time_s(height_m: float) -> float:
    """Return how long a foot takes to such a height, or from there to the ground [s]."""
    return SWING_S + SWING_S_PER_M * height_m


def stretches(
    n_frames: int,
    footwork: Footwork | None,
    up: int,
    rise_m: float,
    to_foot_m: float,
    apart_m: float,
    gathers: bool = False,
) -> list[Stretch]:
    """Divide a motion where feet leave the ground and land.

    Args:
        n_frames: Length of the motion.
        footwork: Its feet; None where both stay down.
        up: Side of the foot that is in the air before it; -1 for none.
        rise_m: How high it is [m].
        to_foot_m: How far the COG is from the foot that shall carry first [m].
        apart_m: How far the feet are apart [m].
        gathers: Whether the feet are put beside each other first.
    """
    last = n_frames - 1
    lifts = () if footwork is None else footwork.lifts
    begins_up = lifts[0].side if lifts and lifts[0].start < 0 else -1
    out = []
    if gathers:
        if up < 0:
            up = 0 if begins_up < 0 else begins_up
            out.append(Stretch(0, 0, -1, -1, shift_time_s(to_foot_m)))
        out.append(Stretch(0, 0, up, BESIDE, swing_time_s(max(rise_m, GATHER_M)) + SWING_S))
    elif up >= 0 and up != begins_up:
        out.append(Stretch(0, 0, up, -1, swing_time_s(rise_m)))
    here, loaded = 0, 1 - up if up >= 0 else -1
    for lift in lifts:
        start, end = max(lift.start, 0), min(lift.end, last)
        carried_on = lift.start < 0 and lift.side == up and not gathers
        if not carried_on and loaded != 1 - lift.side:
            far = to_foot_m if loaded < 0 else apart_m
            out.append(Stretch(here, start, -1, -1, shift_time_s(far)))
        elif start > here:
            out.append(Stretch(here, start, -1, -1, 0.0))
        if lift.start < 0 and not carried_on:
            height = 0.0 if footwork is None else float(footwork.rise[0, lift.side])
            out.append(Stretch(0, 0, lift.side, -1, swing_time_s(height)))
        lands = lift.end if lift.end < n_frames else -1
        out.append(Stretch(start, end, lift.side, lands, LEAST_SWING_S if lands >= 0 else 0.0))
        here, loaded = end, 1 - lift.side
    if here < last or not out:
        out.append(Stretch(here, last, -1, -1, 0.0))
    return out


def lay_out(
    parts: list[Stretch], frame_s: float, knot_s: float, wait_s: float, patience: float
) -> Timeline:
    """Give every part its time.

    Args:
        parts: The parts.
        frame_s: Time from frame to frame at the speed of performance [s].
        knot_s: Time from knot to knot [s].
        wait_s: How long the motion must not begin, at least [s].
        patience: By how much least times are longer than they are.
    """
    progress, up, ends = [], [], []
    n_knots, passed_s = 0, 0.0
    waited = wait_s > 0.0
    for part in parts:
        frames = part.last - part.first
        length_s, least_s = frames * frame_s, part.least_s * patience
        if frames == 0:
            rates = np.zeros(max(1, round(least_s / knot_s)))
            waited = True
        elif waited:
            delay_s = max(0.0, wait_s - passed_s, least_s - length_s - 0.5 * RAMP_S)
            total_s = delay_s + 0.5 * RAMP_S + length_s
            time = (np.arange(max(2, round(total_s / knot_s))) + 0.5) * knot_s
            x = np.clip((time - delay_s) / RAMP_S, 0.0, 1.0)
            rates = smooth_step(x)
            waited = False
        else:
            rates = _slowed(max(2, round(max(length_s, least_s) / knot_s)), length_s / knot_s)
        steps = np.cumsum(rates)
        total = steps[-1] if steps[-1] > 0 else 1.0
        progress.append(part.first + frames * steps / total)
        up.append(np.full(len(rates), part.up))
        n_knots += len(rates)
        passed_s += len(rates) * knot_s
        ends.append(n_knots)
    return Timeline(
        np.concatenate(progress), np.concatenate(up), tuple(parts), tuple(ends), patience
    )


def _slowed(n: int, needed: float) -> FloatArray:
    """Return n rates, 1 at both ends where they can be, that sum to about ``needed``."""
    x = (np.arange(n) + 0.5) / n
    if needed >= n:
        return np.ones(n)
    if needed >= 0.5 * n:
        return np.asarray(1.0 - 2.0 * (1.0 - needed / n) * np.sin(np.pi * x) ** 2)
    edge = max(needed / n, 1.0 / n)  # ramps down and up, each half of what is needed
    left = np.clip(np.minimum(x, 1.0 - x) / edge, 0.0, 1.0)
    return np.asarray(0.5 * (1.0 + np.cos(np.pi * left))) + 1e-12
