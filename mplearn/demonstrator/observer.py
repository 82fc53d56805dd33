"""The truth about a performance: what a human observer would mark.

That is "a stop in movement, or a change in movement direction" [Kulic2012, section 4.2.2]. A
motion is seen to begin and end where its speed (of all channels, weighted by how far they move the
body) passes 5 % of its own peak. Where at most 0.3 s lie between the end of one and the beginning
of the next, they share a boundary: the middle of the stop or, where they overlap, the moment of
least speed of their sum. A longer stop is a pause, part of no segment.
"""

from __future__ import annotations

import numpy as np

from mplearn.recording import LabelledSegment

from .movement import Movement, body_velocity

PAUSE_S = 0.3
"""A stop of more than this is a pause [s]."""

VISIBLE = 0.05
"""Share of its peak speed below which a movement is no longer seen to move."""

_GRID = 201


class Observer:
    """Marks the segments of a performance while it goes on.

    Args:
        rate_hz: Frames per second.
        person: Who moves, for the labels.
    """

    def __init__(self, rate_hz: float, person: str) -> None:
        self._rate_hz, self._person = rate_hz, person
        self._last: Movement | None = None
        self._start_s = 0.0

    def see(self, movement: Movement) -> tuple[LabelledSegment, ...]:
        """Take the next movement and return the segment that it closes, if there is one."""
        begin_s, _ = visible_s(movement)
        closed: tuple[LabelledSegment, ...] = ()
        if self._last is not None:
            _, end_s = visible_s(self._last)
            if begin_s - end_s <= PAUSE_S:
                begin_s = end_s = turning_point_s(self._last, movement)
            closed = self._close(self._last, end_s)
        self._last, self._start_s = movement, begin_s
        return closed

    def finish(self) -> tuple[LabelledSegment, ...]:
        """Return the last segment, if there is one."""
        if self._last is None:
            return ()
        return self._close(self._last, visible_s(self._last)[1])

    def _close(self, movement: Movement, end_s: float) -> tuple[LabelledSegment, ...]:
        start, end = round(self._start_s * self._rate_hz), round(end_s * self._rate_hz)
        return (LabelledSegment(start, end, movement.name, self._person),)


def visible_s(movement: Movement) -> tuple[float, float]:
    """Return when a movement is first and last seen [s]."""
    times = np.linspace(movement.start_s, movement.end_s, _GRID)
    speed = np.linalg.norm(body_velocity([movement], times), axis=1)
    seen = np.flatnonzero(speed > VISIBLE * speed.max())
    return float(times[seen[0]]), float(times[seen[-1]])


def turning_point_s(first: Movement, second: Movement) -> float:
    """Return when one movement gives way to the next [s]."""
    if second.start_s >= first.end_s:
        return 0.5 * (first.end_s + second.start_s)
    times = np.linspace(second.start_s, first.end_s, _GRID)
    speed = np.linalg.norm(body_velocity([first, second], times), axis=1)
    return float(times[np.argmin(speed)])
