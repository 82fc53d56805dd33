"""The other processes, seen from the page server: started, heard, and started again."""

from __future__ import annotations

import asyncio
import multiprocessing
import signal
import threading
from collections.abc import Callable
from multiprocessing.connection import Connection
from typing import Any

from mplearn.spawning import deaf_to_interrupts

from .messages import Header, unpack
from .outbox import Outbox

SOONEST_S, LATEST_S = 0.5, 10.0  # pause before a process is started again

Hear = Callable[[Header, bytes], None]


class Worker:
    """A process that is started again when it ends on its own.

    Args:
        name: What it is called.
        target: What it runs; it gets the arguments, and its end of a pipe last.
        arguments: See there.
        hear: Called in the event loop with each message.
        ended: Called in the event loop when the process has ended, with the reason.
        grace_s: How long it may go on with what it does when all end [s].
    """

    def __init__(
        self,
        name: str,
        target: Callable[..., None],
        arguments: tuple[Any, ...],
        hear: Hear,
        ended: Callable[[str], None],
        grace_s: float = 5.0,
    ) -> None:
        self.name = name
        self._grace_s = grace_s
        self._target, self._arguments = target, arguments
        self._hear, self._ended = hear, ended
        self._pause_s = SOONEST_S
        self._closing = False
        self._again: asyncio.TimerHandle | None = None
        self._process: Any = None
        self._outbox: Outbox | None = None
        self._connection: Connection | None = None

    @property
    def pid(self) -> int | None:
        """Number of the process; None while there is none."""
        return None if self._process is None else self._process.pid

    def start(self) -> None:
        """Start the process; to be called in the event loop."""
        context = multiprocessing.get_context("spawn")  # no threads are carried over
        mine, theirs = context.Pipe()
        process = context.Process(
            target=self._target,
            args=(*self._arguments, theirs),
            name=f"mplearn-{self.name}",
            daemon=True,
        )
        with deaf_to_interrupts():
            process.start()
        theirs.close()
        self._process, self._connection, self._outbox = process, mine, Outbox(mine)
        loop = asyncio.get_running_loop()
        threading.Thread(
            target=self._listen, args=(loop, mine, process), name=self.name, daemon=True
        ).start()

    def send(self, header: Header, blob: bytes = b"") -> None:
        """Send a message to the process; it is lost while there is none."""
        if self._outbox is not None:
            self._outbox.post(header, blob)

    def settled(self) -> None:
        """Take note that the process does well: the next pause is a short one."""
        self._pause_s = SOONEST_S

    async def close(self) -> None:
        """End the process, which may finish what it does."""
        self._closing = True
        if self._again is not None:
            self._again.cancel()
        outbox, connection, process = self._outbox, self._connection, self._process
        if outbox is None or connection is None:
            return
        outbox.post({"kind": "end", "do": "end"})
        await asyncio.to_thread(outbox.close)
        await asyncio.to_thread(process.join, self._grace_s)
        if process.is_alive():
            process.kill()
            await asyncio.to_thread(process.join)
        connection.close()

    def _listen(self, loop: asyncio.AbstractEventLoop, mine: Connection, process: Any) -> None:
        try:
            while True:
                header, blob = unpack(mine.recv_bytes())
                loop.call_soon_threadsafe(self._hear, header, blob)
        except (EOFError, OSError):
            pass
        except RuntimeError:  # the loop is closed
            return
        process.join()
        try:
            loop.call_soon_threadsafe(self._over, _reason(process.exitcode))
        except RuntimeError:
            return

    def _over(self, reason: str) -> None:
        if self._closing:
            return
        if self._outbox is not None and self._connection is not None:
            self._connection.close()
            self._outbox = None
        self._ended(reason)
        self._again = asyncio.get_running_loop().call_later(self._pause_s, self.start)
        self._pause_s = min(2 * self._pause_s, LATEST_S)


def _reason(code: int | None) -> str:
    if code is None or code == 0:
        return "it ended"
    if code > 0:
        return f"it failed with code {code}"
    try:
        return f"it was ended by {signal.Signals(-code).name}"
    except ValueError:
        return f"it was ended by signal {-code}"
