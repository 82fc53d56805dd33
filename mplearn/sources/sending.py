"""The other end: a recording, or any source, sent over a network at its own pace."""

from __future__ import annotations

import socket
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from threading import Event
from typing import BinaryIO

import numpy as np

from ..errors import InvalidValueError
from .protocols.addresses import LOOPBACK, host_and_port
from .protocols.lines import frame_line, header_line
from .protocols.own import PORT
from .sender import Sender
from .source import WAIT_S, Block, Source, Stream

HEADER_EACH_S, HEADERS_FIRST = 1.0, 5
"""In datagrams, of which some are lost, a header goes with the first frames, and then so often."""
CONNECT_S = 10.0


class LineSender(Sender):
    """Our JSON lines, to a file or a pipe.

    Args:
        write: Takes a line.
        repeat: Whether the header is sent again and again.
    """

    def __init__(self, write: Callable[[bytes], object], *, repeat: bool = False) -> None:
        self._write, self._repeat = write, repeat
        self._stream: Stream | None = None
        self._header, self._sent_s, self._first = b"", 0.0, 0

    def send(self, block: Block) -> None:
        """Send the frames that came, each with its number and its time."""
        if block.stream is not self._stream:
            self._stream, self._header = block.stream, header_line(block.stream)
            self._first = HEADERS_FIRST if self._repeat else 1
        for values, time_s, gap in zip(block.frames, block.times_s, block.gaps, strict=True):
            now_s = time.monotonic()
            if self._first or (self._repeat and now_s - self._sent_s > HEADER_EACH_S):
                self._write(self._header)
                self._sent_s, self._first = now_s, max(self._first - 1, 0)
            if not gap:
                number = round(time_s * block.rate_hz)
                self._write(frame_line(values, number, float(time_s)))

    def close(self) -> None:
        """Leave what it writes to open: it is not its own."""


@contextmanager
def open_sender(to: str) -> Iterator[Sender]:
    """Open where to send to.

    Args:
        to: ``udp:HOST:PORT``, ``ndjson:HOST:PORT`` (TCP), ``ndjson:-`` for standard output, or
            ``lsl:NAME`` for a stream of the lab streaming layer.

    Raises:
        InvalidValueError: It is nothing of these, or nobody listens there.
        MissingDependencyError: It needs an extra that is not installed.
    """
    kind, _, address = to.partition(":")
    if kind == "lsl":
        from .protocols.lsl import LSLSender

        outlet = LSLSender(address)
        try:
            yield outlet
        finally:
            outlet.close()
    elif kind == "ndjson" and address == "-":
        yield LineSender(_flushed(sys.stdout.buffer))
    elif kind in ("udp", "ndjson"):
        at = host_and_port(address, PORT, host=LOOPBACK)
        with _connected(kind, at) as opened:
            write = opened.sendall if kind == "ndjson" else _forgiving(opened)
            yield LineSender(write, repeat=kind == "udp")
    else:
        raise InvalidValueError(
            f"frames are sent to udp:HOST:PORT, ndjson:HOST:PORT, ndjson:- or lsl:NAME, not {to!r}"
        )


def send(source: Source, sender: Sender, stop: Event | None = None) -> int:
    """Send all that a source yields, as it comes; return the number of frames sent.

    Args:
        source: What to send; it is left open.
        sender: How.
        stop: Set to stop.
    """
    n = 0
    while not (source.ended or (stop is not None and stop.is_set())):
        for item in source.read(WAIT_S):
            if isinstance(item, Block):
                sender.send(item)
                n += int(np.count_nonzero(~item.gaps))
    return n


@contextmanager
def _connected(kind: str, at: tuple[str, int]) -> Iterator[socket.socket]:
    try:
        if kind == "ndjson":
            opened = socket.create_connection(at, CONNECT_S)
        else:
            family, _, _, _, to = socket.getaddrinfo(*at, type=socket.SOCK_DGRAM)[0]
            opened = socket.socket(family, socket.SOCK_DGRAM)
            opened.connect(to)
    except (OSError, UnicodeError) as error:
        raise InvalidValueError(f"nobody listens at {at[0]}:{at[1]}: {error}") from None
    with opened:
        opened.settimeout(None)
        yield opened


def _forgiving(opened: socket.socket) -> Callable[[bytes], object]:
    """Return a sender of datagrams to whom it is the same whether somebody listens."""

    def write(line: bytes) -> None:
        with suppress(ConnectionRefusedError):
            opened.send(line)

    return write


def _flushed(out: BinaryIO) -> Callable[[bytes], object]:
    def write(line: bytes) -> None:
        out.write(line)
        out.flush()

    return write
