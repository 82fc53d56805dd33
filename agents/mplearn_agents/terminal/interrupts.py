"""Ctrl-C and SIGTERM as a wish to end, not as a blow."""

from __future__ import annotations

import signal
import sys
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from types import FrameType

_SIGNALS = (signal.SIGINT, signal.SIGTERM)
_AGAIN_S = 0.01  # after this long a signal is sent again that nobody above could hear


@contextmanager
def interrupted() -> Iterator[list[int]]:
    """While this lasts, Ctrl-C and SIGTERM raise `KeyboardInterrupt`; yields the signals that came.

    Libraries make another error of it while they are imported, or none: the list says what it was.
    Where Python cannot raise it (in what C calls, or as an object is deleted) it comes a little
    later. Outside the main thread the list stays empty.
    """
    came: list[int] = []
    if threading.current_thread() is not threading.main_thread():
        yield came
        return

    def handle(number: int, frame: FrameType | None) -> None:
        came.append(number)
        raise KeyboardInterrupt

    def unheard(unraisable: sys.UnraisableHookArgs) -> None:
        if not isinstance(unraisable.exc_value, KeyboardInterrupt):
            report(unraisable)
            return
        number = came[-1] if came else signal.SIGINT
        again = threading.Timer(_AGAIN_S, signal.pthread_kill, (main.ident, number))
        again.daemon = True
        again.start()
        waiting.append(again)

    main = threading.main_thread()
    waiting: list[threading.Timer] = []
    report = sys.unraisablehook
    before = {each: signal.signal(each, handle) for each in _SIGNALS}
    sys.unraisablehook = unheard
    try:
        yield came
    finally:
        sys.unraisablehook = report
        for again in waiting:
            again.cancel()
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
