"""What a process sends: it never waits for who reads it."""

from __future__ import annotations

import threading
from collections import OrderedDict
from collections.abc import Callable
from multiprocessing.connection import Connection

from .messages import Header, pack

MOST_WAITING = 10_000  # messages; more are only there if nobody reads any longer

Message = tuple[Header, bytes]


class Outbox:
    """Sends messages from a thread of its own, in order.

    Of messages with a key only the latest is sent: who reads slowly gets fewer of them. Where more
    wait than anybody would read, the oldest are dropped.

    Args:
        connection: Where they go.
    """

    def __init__(self, connection: Connection) -> None:
        self._connection = connection
        self._waiting: OrderedDict[str | int, Callable[[], Message | None]] = OrderedDict()
        self._number = 0
        self._changed = threading.Condition()
        self._open = True
        self._thread = threading.Thread(target=self._run, name="outbox", daemon=True)
        self._thread.start()

    @property
    def broken(self) -> bool:
        """Whether nobody reads any more."""
        return not self._thread.is_alive()

    def post(self, header: Header, blob: bytes = b"", key: str | None = None) -> None:
        """Send a message; one with the same key that still waits is replaced."""
        self.post_later(lambda: (header, blob), key)

    def post_later(self, make: Callable[[], Message | None], key: str | None = None) -> None:
        """Send what ``make`` returns at the moment when it can be sent; None for nothing."""
        with self._changed:
            self._number += 1
            self._waiting[self._number if key is None else key] = make
            if len(self._waiting) > MOST_WAITING:
                self._waiting.popitem(last=False)
            self._changed.notify()

    def close(self) -> None:
        """Send what waits, and end."""
        with self._changed:
            self._open = False
            self._changed.notify()
        self._thread.join(timeout=2.0)

    def _run(self) -> None:
        while True:
            with self._changed:
                while self._open and not self._waiting:
                    self._changed.wait()
                if not self._waiting:
                    return
                _, make = self._waiting.popitem(last=False)
            message = make()
            if message is None:
                continue
            try:
                self._connection.send_bytes(pack(*message))
            except OSError:
                return
