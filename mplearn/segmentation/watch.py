"""Rests and reversals of a stream, found in its speed: one state machine.

While something moves, it looks for a reversal (a local minimum far below the peaks on both sides)
or a pause (a low speed that lasts); while nothing moves, for the rise that ends the pause.
"""

from __future__ import annotations

from typing import Any

from ..maths.compiling import njit
from ..recording import FloatArray
from .speed import DIP, KNOWN, LENGTH, MOVING, OPENING, REST, STILL, close, running_speed

_MOST = 0.95  # share of the peaks that a minimum lies below at least, whatever is known


@njit(cache=True)
def _crossing(level: float, inside: float, outside: float) -> float:
    """How far from a speed below the level to the one beside it the level is crossed, in [0, 1]."""
    if not inside < level < outside:
        return 0.0
    return float((level - inside) / (outside - inside))


@njit(cache=True)
def _dip_middle(m: Any, level: float, speeds: FloatArray) -> int:
    """Return the middle of the stretch around the valley in which the speed lies below `level`.

    Where a posture is held for a moment the valley itself lies anywhere within the hold.
    """
    size, t = speeds.shape[0], m.frames - 1
    first = last = m.valley_frame
    while first - 1 > max(m.start, t - size) and speeds[(first - 1) % size] < level:
        first -= 1
    while last + 1 < t and speeds[(last + 1) % size] < level:
        last += 1
    before = _crossing(level, speeds[first % size], speeds[(first - 1) % size])
    after = _crossing(level, speeds[last % size], speeds[(last + 1) % size])
    return int((first - before + last + after + 1.0) / 2.0)


@njit(cache=True)
def begin(m: Any, speeds: FloatArray) -> None:
    """Look at the motion that has just begun as far as it has come."""
    size, t = speeds.shape[0], m.frames - 1
    m.dip_frame = -1
    m.peak = 0.0
    for u in range(max(m.start, t - size + 1), t + 1):
        m.peak = max(m.peak, speeds[u % size])
    m.valley = speeds[t % size]
    m.valley_frame = t


@njit(cache=True)
def _watch_motion(
    m: Any,
    p: Any,
    s: float,
    low: float,
    hysteresis: float,
    ready: float,
    speeds: FloatArray,
    out: Any,
) -> int:
    """Look for the reversal or the pause that ends a motion."""
    t = m.frames - 1
    if s > m.peak:
        m.peak = s
        m.valley = s
        m.valley_frame = t
    elif s < m.valley:
        m.valley = s
        m.valley_frame = t
    if s >= 1.5 * low:
        m.dip_frame = -1
    elif s < low and m.dip_frame < 0:
        m.dip_frame = t
    n = 0
    if m.dip_frame >= 0:  # a pause may be beginning, which must not be cut before it is one
        ready = min(ready, 1.0)
    share = min(_MOST, hysteresis * ready)
    if m.dip_frame >= 0 and t - m.dip_frame >= p.still:
        if m.dip_frame - m.start >= p.shortest:
            n = close(m, p, m.dip_frame, 1.0 - m.valley / low, False, REST, out, 0)
        m.mode = STILL
        m.rest = 0.5 * low
        m.rest_frames = p.still
        m.dip_frame = -1
    elif m.valley < share * m.peak and s >= max(m.valley / share, low):
        # a stream's first motion may have begun before
        shortest = p.shortest // 2 if m.mode == OPENING else p.shortest
        if m.valley_frame - m.start >= shortest:
            sure = 1.0 - m.valley / (share * m.peak)
            middle = _dip_middle(m, max(m.valley / share, low), speeds)
            cause = DIP if m.valley < hysteresis * m.peak else KNOWN
            n = close(m, p, middle, sure, False, cause, out, 0)
            m.mode = MOVING
        m.valley = s
        m.valley_frame = t
    return n


@njit(cache=True)
def _watch_pause(m: Any, p: Any, s: float, low: float, speeds: FloatArray, out: Any) -> int:
    """Look for the rise that ends a pause."""
    t = m.frames - 1
    if m.mode == OPENING or low < m.rest:
        low = 2.0 * m.rest  # no motion was seen yet, or long ago: the rest itself is the measure
    if s <= low or m.mode == OPENING:
        m.rest_frames += 1
        m.rest += (s - m.rest) / m.rest_frames
    if s <= low:
        m.dip_frame = -1
    elif m.dip_frame < 0:
        m.dip_frame = t
    if s <= max(2.0 * low, 4.0 * m.rest):
        return 0
    if m.dip_frame - m.start < p.still:
        if m.mode == STILL:  # the pause was closed for its length just now: this is a motion
            m.mode = MOVING
            begin(m, speeds)
        return 0
    n = close(m, p, m.dip_frame, 1.0 - low / s, True, REST, out, 0)
    m.mode = MOVING
    return n


@njit(cache=True)
def watch(
    m: Any, p: Any, s: float, hysteresis: float, ready: float, speeds: FloatArray, out: Any
) -> int:
    """Judge speed `s` of the frame that `take_speed` has counted.

    Args:
        m: The state, a record of `STATE`.
        p: The settings, a record of `SETTINGS`.
        s: Speed.
        hysteresis: A minimum is a reversal if it lies below this share of the peaks around it,
        ready: times how much likelier a boundary is than without knowledge.
        speeds: The speeds before it, a ring.
        out: Receives what closes, of `CUT`.

    Returns:
        How many segments closed, 0 or 1.
    """
    low = p.still_share * running_speed(m)
    n = 0
    if m.mode != MOVING:
        n = _watch_pause(m, p, s, low, speeds, out)
    if n == 0 and m.mode != STILL:
        n = _watch_motion(m, p, s, low, hysteresis, ready, speeds, out)
    if n == 0 and m.frames - 1 - m.start >= p.longest:
        end = m.frames - 1
        if m.mode != STILL and m.valley_frame - m.start >= p.shortest:
            end = m.valley_frame
        n = close(m, p, end, 0.0, m.mode == STILL or m.peak <= low, LENGTH, out, 0)
        m.dip_frame = -1
    if n > 0 and m.mode != STILL:
        begin(m, speeds)
    return n
