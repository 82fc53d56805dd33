"""Even playing of a stream whose postures come unevenly."""

from __future__ import annotations

from collections import deque

from mplearn.errors import InvalidValueError
from mplearn.recording import FloatArray

_FASTEST = 1.05  # speed at which a delay is made up for; 1 is the sender's own
_MOST = 4096  # postures that wait


class Playback:
    """Plays the postures of a stream by their time stamps, ``delay_s`` after the newest that came.

    Postures come late, in bunches, or not at all; a robot that went to each as it comes would stop
    and dart. Here the time that is played goes on at a speed of its own: as fast as the sender's
    while what came reaches ``delay_s`` ahead, slower and at last not at all where less did. That
    also keeps two clocks together that do not run alike. Between postures it interpolates.

    Args:
        period_s: Control period [s].
        delay_s: How far behind the newest posture it plays; half the time in which it comes up to
            the sender's speed [s].
        longest_s: Longest gap that is interpolated, and most that it plays behind [s].
    """

    def __init__(self, period_s: float, delay_s: float = 0.1, longest_s: float = 1.0) -> None:
        if not period_s <= delay_s < longest_s:
            raise InvalidValueError(
                f"period_s <= delay_s < longest_s is needed, not {period_s}, {delay_s}, {longest_s}"
            )
        self.period_s, self.delay_s, self.longest_s = period_s, delay_s, longest_s
        self._waiting: deque[tuple[float, FloatArray]] = deque()
        self._stream: int | None = None
        self._time_s = 0.0
        self._speed = 0.0

    def add(self, stream: int, time_s: float, posture: FloatArray) -> bool:
        """Take the next posture that came; returns whether playing begins anew with it.

        It does where the posture does not follow the one before: in another stream, after a gap
        that is too long, in time that runs back, or where too much waits.

        Args:
            stream: What it is of.
            time_s: When it is due, on the sender's clock [s].
            posture: It, any shape.
        """
        anew = (
            stream != self._stream
            or len(self._waiting) >= _MOST
            or not 0 < time_s - self._waiting[-1][0] <= self.longest_s
            or time_s - self._time_s > self.longest_s + self.delay_s
        )
        if anew:
            self._waiting.clear()
            self._stream, self._time_s, self._speed = stream, time_s, 0.0
        self._waiting.append((time_s, posture))
        return anew

    def advance(self) -> FloatArray:
        """Return the posture of one period later; one must have been added."""
        waiting = self._waiting
        step = 0.5 * self.period_s / self.delay_s
        ahead = (waiting[-1][0] - self._time_s) / self.delay_s
        self._speed = min(ahead, self._speed + step, _FASTEST)
        self._time_s += self._speed * self.period_s
        while len(waiting) > 1 and waiting[1][0] <= self._time_s:
            waiting.popleft()
        (begin_s, posture), (end_s, following) = waiting[0], waiting[min(1, len(waiting) - 1)]
        if end_s == begin_s:
            return posture
        share = (self._time_s - begin_s) / (end_s - begin_s)
        return posture + share * (following - posture)
