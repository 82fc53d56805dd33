"""Sources that come over a network: a thread that receives, and frames in order behind it."""

from __future__ import annotations

import threading
import time
from abc import ABC, abstractmethod
from typing import ClassVar

from .inbox import Inbox, News, Sample
from .sequencer import Sequencer
from .source import Block, Change, Source, Tally

SILENT_S = 1.0  # a stream from which nothing comes for so long is disconnected
PATIENT_S = 5.0  # before the first frame: so long
RETRY_S = (0.2, 5.0)  # between attempts to connect again: at first, and at most
BEHIND_S, CAUGHT_UP_S = 1.0, 0.2  # when it is said that frames wait, and that they no longer do
SLICE_S = 0.02  # a read wakes up so often while it waits for a frame that is missing
LOOK_S = (
    0.25  # and so often else; what took longer was held up, which is no silence of the sender's
)


class Receiver(ABC):
    """Speaks one protocol: what it receives goes to an inbox.

    Attributes:
        ordered: Whether the protocol keeps order and loses nothing while connected.
        hint: What to do where nothing comes.
    """

    ordered: ClassVar[bool] = False
    hint: str = ""

    @abstractmethod
    def receive(self, inbox: Inbox) -> None:
        """Connect and receive, in a thread, until `Inbox.closed`, or the connection is lost.

        It is called again after a while, unless it has called `Inbox.finish`.

        Raises:
            OSError: There is no connection; the reason is told, and it is tried again.
        """

    @abstractmethod
    def close(self) -> None:
        """Free what is open; `receive` has returned."""


class ReceivedSource(Source):
    """What a receiver brings, as frames in order.

    Args:
        name: What it was opened by.
        receiver: Speaks the protocol.
        rate_hz: Frames per second, where the caller knows better [1/s].
    """

    def __init__(self, name: str, receiver: Receiver, rate_hz: float | None = None) -> None:
        self.name, self.tally = name, Tally()
        self._receiver = receiver
        self._inbox = Inbox()
        self._sequencer = Sequencer(self.tally, ordered=receiver.ordered, rate_hz=rate_hz)
        self._connected: bool | None = None  # None: nothing came yet
        self._heard, self._heard_s = False, time.monotonic()
        self._read_s = self._heard_s  # when something was there to be read, were we not held up
        self._looked_s = self._heard_s
        self._late = self._over = self._unnamed = False
        self._thread = threading.Thread(target=self._receive, name=name, daemon=True)
        self._thread.start()

    @property
    def ended(self) -> bool:
        """Whether nothing more will come."""
        return self._over

    def close(self) -> None:
        """End it, and wait for the thread."""
        unread = self._inbox.close() + self._sequencer.n_pending
        self.tally.unread += 0 if self._over else unread
        self._over = True
        if self._thread is not threading.current_thread():
            self._thread.join(10.0)

    def read(self, timeout_s: float | None = None) -> list[Block | Change]:
        """Return what came; see `Source.read`."""
        until = None if timeout_s is None else time.monotonic() + timeout_s
        while not self._over:
            left = SILENT_S if until is None else max(until - time.monotonic(), 0.0)
            out = self._take(min(left, SLICE_S if self._sequencer.waits else LOOK_S))
            if out or (until is not None and time.monotonic() >= until):
                return out
        return []

    # ---- inside

    def _take(self, timeout_s: float) -> list[Block | Change]:
        items = self._inbox.take(timeout_s)
        now_s = time.monotonic()
        self._read_s += max(now_s - self._looked_s - LOOK_S, 0.0)
        self._looked_s = now_s
        out: list[Block | Change] = []
        samples: list[Sample] = []
        for item in items:
            if isinstance(item, Sample):
                if self._connected is False:
                    out += self._again(item.arrived_s)
                if not samples:
                    out += self._behind(now_s - item.arrived_s)
                samples.append(item)
                self._connected, self._heard, self._heard_s = True, True, item.arrived_s
                self._unnamed = False
                self._read_s = now_s
                continue
            out += self._sequencer.take(samples, now_s)
            samples = []
            out += self._news(item)
        out += self._sequencer.take(samples, now_s)
        out += self._silence(now_s)
        if self._inbox.finished:
            out += self._sequencer.finish()
            self._over = True
        return out

    def _news(self, news: News) -> list[Block | Change]:
        if news.kind == "damaged":
            self.tally.damaged += news.count
        elif news.kind == "names":  # frames came before it was said what they hold
            self.tally.unnamed += news.count
            if self._unnamed:
                return []  # said once, counted each
            self._unnamed = True
        out: list[Block | Change] = []
        if news.kind == "disconnected":
            out += self._sequencer.finish()
            if self._connected is False:
                return out
            self._connected = False
        return [*out, Change(news.kind, news.text, self._sequencer.time_s, news.count)]

    def _again(self, arrived_s: float) -> list[Change]:
        if not self._heard:
            return [Change("connected", "frames come now", self._sequencer.time_s)]
        self.tally.reconnected += 1
        after = f"after {arrived_s - self._heard_s:.1f} s"
        return [Change("connected", f"frames come again, {after}", self._sequencer.time_s)]

    def _silence(self, now_s: float) -> list[Change]:
        silent_s = now_s - self._read_s
        if self._connected is None and silent_s > PATIENT_S:
            text = f"nothing has come for {PATIENT_S:g} s"
            text += f": {self._receiver.hint}" if self._receiver.hint else ""
        elif self._connected and silent_s > SILENT_S:
            text = f"nothing has come for {SILENT_S:g} s"
        else:
            return []
        self._connected = False
        return [Change("disconnected", text, self._sequencer.time_s)]

    def _behind(self, lag_s: float) -> list[Change]:
        """Say that whoever reads is slower than the frames come, or no longer."""
        if not self._late and lag_s > BEHIND_S:
            self._late = True
            text = f"frames are read {lag_s:.1f} s after they came"
            return [Change("behind", text, self._sequencer.time_s)]
        if self._late and lag_s < CAUGHT_UP_S:
            self._late = False
            return [Change("behind", "frames are read as they come again", self._sequencer.time_s)]
        return []

    def _receive(self) -> None:
        """Receive until it is closed, and connect again where the connection is lost."""
        pause_s = RETRY_S[0]
        while not self._inbox.closed:
            began_s = time.monotonic()
            try:
                self._receiver.receive(self._inbox)
                why = "the connection was closed"
            except Exception as error:  # a client of others may raise anything
                why = str(error) or repr(error)
            if self._inbox.ending:
                break
            self._inbox.say("disconnected", why)
            if time.monotonic() - began_s > RETRY_S[1]:
                pause_s = RETRY_S[0]
            if self._inbox.pause(pause_s):
                break
            pause_s = min(2.0 * pause_s, RETRY_S[1])
        self._receiver.close()
