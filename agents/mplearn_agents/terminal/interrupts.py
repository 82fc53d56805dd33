"""Ctrl-C and SIGTERM as a wish to end, not as a blow."""

from __future__ import annotations

import math
import signal
import sys
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager
from types import FrameType
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    import asyncio

_SIGNALS = (signal.SIGINT, signal.SIGTERM)
_ONE_WISH_S = 0.5  # `timeout` tells a process to end, and then its group, which it is in
_AGAIN_S = 0.1  # after this long a signal is sent again that nothing above has heard


class _Wish:
    """Tells a wish to end from the same one, said twice."""

    def __init__(self) -> None:
        self._until_s = -math.inf

    def is_new(self) -> bool:
        """Return whether a signal that has come is another wish than the one before."""
        now_s = time.monotonic()
        if now_s < self._until_s:
            return False
        self._until_s = now_s + _ONE_WISH_S
        return True

    def forget(self) -> None:
        """Take the next signal for a new wish."""
        self._until_s = -math.inf


@contextmanager
def interrupted() -> Iterator[list[int]]:
    """While this lasts, Ctrl-C and SIGTERM raise `KeyboardInterrupt`; yields the signals that came.

    Libraries make another error of it while they are imported, or none: the list says what it was.
    Where it is lost (in what C calls, as an object is deleted, in a library that catches all) it
    comes again a little later. Outside the main thread the list stays empty.
    """
    came: list[int] = []
    wish = _Wish()
    if threading.current_thread() is not threading.main_thread():
        yield came
        return

    def handle(number: int, frame: FrameType | None) -> None:
        if not wish.is_new():
            return
        came.append(number)
        signal.setitimer(signal.ITIMER_REAL, _AGAIN_S)
        raise KeyboardInterrupt

    def again(number: int, frame: FrameType | None) -> None:
        if sys.exc_info()[0] is None:  # nothing is on its way up, and yet this goes on
            wish.forget()
            signal.raise_signal(came[-1])
        else:
            signal.setitimer(signal.ITIMER_REAL, _AGAIN_S)

    def unheard(unraisable: sys.UnraisableHookArgs) -> None:
        if not isinstance(unraisable.exc_value, KeyboardInterrupt):
            report(unraisable)

    report = sys.unraisablehook
    before = {each: signal.signal(each, handle) for each in _SIGNALS}
    before[signal.SIGALRM] = signal.signal(signal.SIGALRM, again)
    sys.unraisablehook = unheard
    try:
        yield came
    finally:
        signal.setitimer(signal.ITIMER_REAL, 0.0)
        sys.unraisablehook = report
        for each, handler in before.items():
            signal.signal(each, handler)


@contextmanager
def asked_in_loop() -> Iterator[asyncio.Future[None]]:
    """While this lasts, Ctrl-C and SIGTERM resolve the future that it yields, of the running loop.

    More of them change nothing: what is put away then takes its time. Outside the main thread the
    future never resolves.
    """
    import asyncio

    loop = asyncio.get_running_loop()
    asked: asyncio.Future[None] = loop.create_future()
    if threading.current_thread() is not threading.main_thread():
        yield asked
        return

    def ask() -> None:
        if not asked.done():
            asked.set_result(None)

    before = {each: signal.getsignal(each) for each in _SIGNALS}
    for each in _SIGNALS:
        loop.add_signal_handler(each, ask)
    try:
        yield asked
    finally:
        for each, handler in before.items():
            loop.remove_signal_handler(each)
            signal.signal(each, handler)


@contextmanager
def asked_to_stop() -> Iterator[threading.Event]:
    """While this lasts, Ctrl-C and SIGTERM set the event that it yields.

    A second Ctrl-C interrupts as ever, if it comes half a second later or more. Outside the main
    thread the event is never set.
    """
    stop, wish = threading.Event(), _Wish()
    if threading.current_thread() is not threading.main_thread():
        yield stop
        return

    def handle(number: int, frame: FrameType | None) -> None:
        if wish.is_new():
            if stop.is_set():
                raise KeyboardInterrupt
            stop.set()

    before = {each: signal.signal(each, handle) for each in _SIGNALS}
    try:
        yield stop
    finally:
        for each, handler in before.items():
            signal.signal(each, handler)
