"""Ctrl-C and SIGTERM as a wish to end, not as a blow."""

from __future__ import annotations

import signal
import sys
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from types import FrameType

_SIGNALS = (signal.SIGINT, signal.SIGTERM)
_AGAIN_S = 0.1  # after this long a signal is sent again that nothing above has heard


@contextmanager
def interrupted() -> Iterator[list[int]]:
    """While this lasts, Ctrl-C and SIGTERM raise `KeyboardInterrupt`; yields the signals that came.

    Libraries make another error of it while they are imported, or none: the list says what it was.
    Where it is lost (in what C calls, as an object is deleted, in a library that catches all) it
    comes again a little later. Outside the main thread the list stays empty.
    """
    came: list[int] = []
    if threading.current_thread() is not threading.main_thread():
        yield came
        return

    def handle(number: int, frame: FrameType | None) -> None:
        came.append(number)
        signal.setitimer(signal.ITIMER_REAL, _AGAIN_S)
        raise KeyboardInterrupt

    def again(number: int, frame: FrameType | None) -> None:
        if sys.exc_info()[0] is None:  # nothing is on its way up, and yet this goes on
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
def python_interrupts() -> Iterator[None]:
    """While this lasts, Ctrl-C goes to Python's own handler: asyncio takes it over from no other.

    SIGTERM is Ctrl-C then. Outside the main thread nothing changes.
    """
    if threading.current_thread() is not threading.main_thread():
        yield
        return

    def interrupt(number: int, frame: FrameType | None) -> None:
        signal.raise_signal(signal.SIGINT)

    handlers = (signal.default_int_handler, interrupt)
    before = {each: signal.signal(each, by) for each, by in zip(_SIGNALS, handlers, strict=True)}
    try:
        yield
    finally:
        for each, handler in before.items():
            signal.signal(each, handler)


@contextmanager
def asked_to_stop() -> Iterator[threading.Event]:
    """While this lasts, Ctrl-C and SIGTERM set the event that it yields.

    A second Ctrl-C interrupts as ever. Outside the main thread the event is never set.
    """
    stop = threading.Event()
    if threading.current_thread() is not threading.main_thread():
        yield stop
        return

    def handle(number: int, frame: FrameType | None) -> None:
        if stop.is_set():
            raise KeyboardInterrupt
        stop.set()

    before = {each: signal.signal(each, handle) for each in _SIGNALS}
    try:
        yield stop
    finally:
        for each, handler in before.items():
            signal.signal(each, handler)
