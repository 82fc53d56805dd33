"""From samples as a network brings them to frames in order: nothing twice, gaps as NaN."""

from __future__ import annotations

import math
from collections import deque
from dataclasses import replace

import numpy as np

from ..recording import FloatArray
from .clock import EvenClock, Interpolation, Pace, measured_pace
from .inbox import CAPACITY, Sample
from .source import Block, Change, ChangeKind, Stream, Tally

FILLED_S = 2.0  # a longer gap is not filled with NaN: another stretch begins
PATIENCE_S, PATIENCE_FRAMES = 0.05, 8  # a frame that is out of order is waited for so long
JUMP_S = 1.0  # a clock that differs by more from ours, between two frames, jumped
AT_ONCE_S = 0.1  # a jump of the numbers within so much of our time is none of the motion
GONE_S = 1.0  # who was not seen for so long is gone, if somebody else is there
MEASURED_S, MEASURED_FRAMES = 1.0, 12  # from which a rate is measured that is not said
UNEVEN = 0.2  # frames that stamps of a stream in order are off: single lost frames are not seen
REMEMBERED = 2048  # places that were given up
PEOPLE = 64  # that are named, at most


class Sequencer:
    """Puts samples of one stream in order, at an even rate.

    Places of frames come from the sender's numbers; where there are none from its times; where
    there are neither they follow each other. A frame that is missing is waited for a moment, then
    given up.

    Args:
        tally: Where to count what became of them.
        ordered: Whether the network itself keeps order and loses nothing (TCP).
        rate_hz: Frames per second, where the caller knows better [1/s].
    """

    def __init__(self, tally: Tally, *, ordered: bool, rate_hz: float | None = None) -> None:
        self._tally, self._ordered, self._rate_hz = tally, ordered, rate_hz
        self._raw: Stream | None = None  # as the sender describes it
        self._stream: Stream | None = None  # the same, with its rate
        self._pace: Pace | None = None
        self._unpaced: list[Sample] = []
        self._clock, self._interpolation = EvenClock(1.0), Interpolation(1.0)
        self._next = 0  # place of the next frame
        self._base: int | None = None  # the number that has place 0, in strides
        self._newest = (-1, math.nan)  # highest number, and its time on the sender's clock
        self._last: Sample | None = None
        self._off = 0.0  # how far stamps are off an even clock, on average [frames]
        self._pending: dict[int, Sample] = {}
        self._given_up: dict[int, None] = {}
        self._rows: list[tuple[FloatArray | None, float]] = []
        self._out: list[Block | Change] = []
        self._joins, self._lost = False, 0
        self._told = (0, 0)  # doubled and late, as of the last block
        self._dropped = 0  # samples that nobody took in time, and whose places are still to come
        self._subject: str | None = None
        self._others: deque[str] = deque(maxlen=PEOPLE)

    @property
    def waits(self) -> bool:
        """Whether frames are held back for one that is missing."""
        return bool(self._pending)

    @property
    def n_pending(self) -> int:
        """Number of frames that are held back; they are forgotten where it is not finished."""
        return len(self._pending) + len(self._unpaced)

    @property
    def time_s(self) -> float:
        """Time of the next frame [s]."""
        return self._next / self._stream.rate_hz if self._stream else 0.0

    def take(self, samples: list[Sample], now_s: float) -> list[Block | Change]:
        """Take samples as they came, and return what is known by now.

        Args:
            samples: They may be empty, where only time has passed.
            now_s: On the clock of `time.monotonic` [s].
        """
        for sample in samples:
            self._take(sample)
        self._give_up(now_s)
        return self._handed_out()

    def finish(self) -> list[Block | Change]:
        """Return what is held back: nothing more will come, or the connection is lost."""
        self._set_pace(at_last=True)
        self._give_up(math.inf)
        return self._handed_out()

    # ---- inside

    def _take(self, sample: Sample) -> None:
        if not self._is_followed(sample):
            return
        if sample.dropped:
            self._tally.overrun += sample.dropped
            self._dropped += sample.dropped
            self._say("overrun", f"{sample.dropped} frames found the queue full", sample.dropped)
        if self._pace is None:
            self._unpaced.append(sample)
            self._set_pace()
            return
        if sample.stream is not self._raw:
            self._describe(sample)
        self._put(sample)
        self._last = sample

    def _is_followed(self, sample: Sample) -> bool:
        """Say whether a sample is of the person who is followed."""
        subject = sample.stream.subject
        if self._subject is None:
            self._subject = subject
        if subject == self._subject:
            return True
        if self._last is not None and sample.arrived_s - self._last.arrived_s > GONE_S:
            self._say("subject", f"{subject!r} is followed now: {self._subject!r} is gone")
            self._subject = subject
            self._break()
            self._base = None
            return True
        self._tally.foreign += 1
        if subject not in self._others:
            self._others.append(subject)
            self._say("subject", f"{subject!r} appeared; {self._subject!r} is followed")
        return False

    def _set_pace(self, *, at_last: bool = False) -> None:
        """Find out the rate from the first samples, where it is not said."""
        held = self._unpaced
        if not held:
            return
        said = self._rate_hz or held[0].stream.rate_hz
        pace = Pace(said) if said else None
        if pace is None:
            stamps = [s.time_s for s in held]
            times = [t for t in stamps if t is not None]
            if len(times) < len(held):
                times = [s.arrived_s for s in held]
            enough = len(held) >= MEASURED_FRAMES and times[-1] - times[0] >= MEASURED_S
            if not (enough or at_last or len(held) >= CAPACITY):
                return
            pace = measured_pace([s.number for s in held], times)
        self._unpaced = []
        if pace is None:
            self._tally.unnamed += len(held)
            self._say("damaged", f"{len(held)} frames show no rate", len(held))
            return
        self._pace = pace
        self._clock = EvenClock(pace.rate_hz)
        self._interpolation = Interpolation(pace.rate_hz)
        self._interpolation.restart(held[0].time_s or 0.0, self._next)
        for sample in held:
            if sample.stream is not self._raw:
                self._describe(sample)
            self._put(sample)
            self._last = sample

    def _describe(self, sample: Sample) -> None:
        """Take up another description of the stream."""
        assert self._pace is not None
        self._give_up(math.inf)
        self._hand_out()
        before, self._raw = self._raw, sample.stream
        said = self._rate_hz or sample.stream.rate_hz
        rate_hz = self._pace.rate_hz
        if before is not None and said and abs(said / rate_hz - 1.0) > 1e-3:
            self._say("clock", f"the rate is {said:g} Hz from here on, not {rate_hz:g} Hz")
            self._next = round(self._next * said / rate_hz)
            self._pace, rate_hz = Pace(said), said
            self._clock = EvenClock(said)
            self._base = None
            self._joins = False
        self._stream = replace(sample.stream, rate_hz=rate_hz)
        if not self._pace.even and sample.time_s is not None:
            self._interpolation.restart(sample.time_s, self._next)

    def _put(self, sample: Sample) -> None:
        """Find the place of a sample, and put it there."""
        assert self._pace is not None
        if sample.values.shape != (len(sample.stream.channels),):
            self._tally.damaged += 1
            wrong = f"a frame of {len(sample.values)} values, not {len(sample.stream.channels)}"
            self._say("damaged", wrong, 1)
        elif sample.number is not None:
            self._put_numbered(sample, sample.number)
        elif sample.time_s is not None:
            self._put_timed(sample, sample.time_s)
        else:
            self._fill(self._next + self._dropped, sample)

    def _passed(self, sample: Sample) -> tuple[float, float | None]:
        """Return the time since the last sample: ours, and the sender's [s]."""
        last = self._last
        if last is None:
            return 0.0, None
        ours = sample.arrived_s - last.arrived_s
        if sample.time_s is None or last.time_s is None:
            return ours, None
        return ours, sample.time_s - last.time_s

    def _put_numbered(self, sample: Sample, number: int) -> None:
        assert self._pace is not None
        rate_hz, stride = self._pace.rate_hz, self._pace.stride
        if self._base is None:
            self._base = number - self._next * stride
        place = round((number - self._base) / stride)
        ours, _ = self._passed(sample)
        last = self._last
        if sample.time_s is not None and number > self._newest[0]:
            counted = (number - self._newest[0]) / stride / rate_hz
            jump_s = sample.time_s - self._newest[1] - counted
            if abs(jump_s) > JUMP_S and counted < FILLED_S:
                self._say("clock", f"the sender's clock jumped by {jump_s:+.3f} s")
            self._newest = number, sample.time_s
        ahead = place - self._next
        if -rate_hz <= ahead <= FILLED_S * rate_hz:
            self._fill_or_wait(place, sample)
            return
        waited = max(round(ours * rate_hz) - 1, 0)
        since = last.number if last is not None else number
        ours_dropped = self._dropped and abs(ahead - self._dropped) <= FILLED_S * rate_hz
        if ahead > 0 and (waited >= 0.5 * ahead or ours_dropped):
            self._begin_stretch(place)
        else:
            self._say("clock", f"the sender's numbers jumped from {since} to {number}")
            place = self._go_on(ours)
            self._base = number - place * stride
            self._newest = number, sample.time_s if sample.time_s is not None else math.nan
        self._fill(place, sample)

    def _put_timed(self, sample: Sample, time_s: float) -> None:
        assert self._pace is not None
        rate_hz = self._pace.rate_hz
        ours, theirs = self._passed(sample)
        if theirs is not None and (
            theirs < -0.5 * JUMP_S or (theirs > JUMP_S and ours < 0.5 * theirs)
        ):
            self._say("clock", f"the sender's clock jumped by {theirs - ours:+.3f} s")
            place = self._go_on(ours)
            self._clock.restart(time_s, place)
            self._interpolation.restart(time_s, place)
        if not self._pace.even:
            self._interpolate(sample, time_s)
            return
        ahead = self._clock.ahead(time_s, self._next)
        steps = round(ahead)
        if self._ordered and (ahead < 0 or (self._off > UNEVEN and ahead < FILLED_S * rate_hz)):
            steps = 0  # the stamps jitter, and nothing can have been lost
        self._clock.follow(ahead - steps)
        self._off += 0.05 * (min(abs(ahead - round(ahead)), 1.0) - self._off)
        if steps > FILLED_S * rate_hz:
            self._begin_stretch(self._next + steps)
        self._fill_or_wait(self._next + steps, sample)

    def _interpolate(self, sample: Sample, time_s: float) -> None:
        assert self._pace is not None
        frames = self._interpolation.take(time_s, sample.values)
        if not frames and (self._last is not None and self._last.time_s is not None):
            if time_s == self._last.time_s:
                self._tally.doubled += 1
            elif time_s < self._last.time_s:
                self._tally.late += 1
        for place, values in frames:
            if place - self._next > FILLED_S * self._pace.rate_hz:
                self._begin_stretch(place)
            if place >= self._next:
                self._fill(place, replace(sample, values=values))

    def _go_on(self, passed_s: float) -> int:
        """Return the place that comes after some of our time, where the sender's says nothing."""
        assert self._pace is not None
        self._give_up(math.inf)
        missing = max(round(passed_s * self._pace.rate_hz) - 1, 0)
        place = self._next + (missing if passed_s > AT_ONCE_S else 0)
        if missing > FILLED_S * self._pace.rate_hz:
            self._begin_stretch(place)
        return place

    def _fill_or_wait(self, place: int, sample: Sample) -> None:
        """Put a sample in its place; let it wait where one before it may still come."""
        if place < self._next:
            if place in self._given_up:
                del self._given_up[place]
                self._tally.late += 1
            else:
                self._tally.doubled += 1
        elif place in self._pending:
            self._tally.doubled += 1
        elif self._ordered or place == self._next:
            self._fill(place, sample)
        else:
            self._pending[place] = sample
            if len(self._pending) > PATIENCE_FRAMES:
                self._skip_to(min(self._pending))

    def _fill(self, place: int, sample: Sample) -> None:
        """Put a sample in its place, and those that waited for it."""
        self._skip_to(place, pending=False)
        self._add(sample)
        self._take_pending()

    def _take_pending(self) -> None:
        while self._next in self._pending:
            self._add(self._pending.pop(self._next))

    def _add(self, sample: Sample) -> None:
        self._rows.append((sample.values, sample.arrived_s))
        self._next += 1
        self._tally.frames += 1

    def _skip_to(self, place: int, *, pending: bool = True) -> None:
        """Give up what is missing before a place."""
        missing = place - self._next
        for number in range(self._next, place):
            self._given_up[number] = None
            self._rows.append((None, math.nan))
        self._count_lost(missing)
        self._next = max(self._next, place)
        while len(self._given_up) > REMEMBERED:
            del self._given_up[next(iter(self._given_up))]
        if pending:
            self._take_pending()

    def _count_lost(self, missing: int) -> int:
        ours = min(max(missing, 0), self._dropped)
        self._dropped -= ours
        lost = max(missing - ours, 0)
        self._tally.lost += lost
        self._lost += lost
        return lost

    def _give_up(self, now_s: float) -> None:
        """Give up what has been waited for long enough."""
        while self._pending:
            oldest = min(s.arrived_s for s in self._pending.values())
            if now_s - oldest <= PATIENCE_S:
                return
            self._skip_to(min(self._pending))

    def _begin_stretch(self, place: int) -> None:
        """Begin another stretch after a gap that is too long to fill."""
        self._break()
        missing = place - self._next
        lost = self._count_lost(missing)
        self._lost = 0
        text = f"{missing} frames are missing: what comes is taken as another stretch"
        self._say("gap", text, lost)
        self._next = place

    def _break(self) -> None:
        self._give_up(math.inf)
        self._hand_out()
        self._joins = False

    def _say(self, kind: ChangeKind, text: str, count: int = 0) -> None:
        self._hand_out()
        self._out.append(Change(kind, text, self.time_s, count))

    def _hand_out(self) -> None:
        """Make a block of the rows that are ready."""
        rows, self._rows = self._rows, []
        if not rows or self._stream is None:
            return
        width = len(self._stream.channels)
        missing = np.full(width, np.nan)
        frames = np.array([missing if values is None else values for values, _ in rows])
        first = self._next - len(rows)
        doubled, late = self._tally.doubled, self._tally.late
        self._out.append(
            Block(
                self._stream,
                frames,
                (first + np.arange(len(rows))) / self._stream.rate_hz,
                np.array([arrived_s for _, arrived_s in rows]),
                self._joins,
                self._lost,
                doubled - self._told[0],
                late - self._told[1],
            )
        )
        self._joins, self._lost, self._told = True, 0, (doubled, late)

    def _handed_out(self) -> list[Block | Change]:
        self._hand_out()
        out, self._out = self._out, []
        return out
