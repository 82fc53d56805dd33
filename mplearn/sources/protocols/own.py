"""Our own format, received: JSON lines over TCP, from a pipe, or in datagrams."""

from __future__ import annotations

import os
import selectors
import socket
import sys
import time

from ...errors import InvalidValueError, MPLearnError
from ..inbox import Inbox, Sample
from ..received import ReceivedSource, Receiver
from ..registry import Wanted
from ..source import Source
from .addresses import LOOPBACK, bound, host_and_port, shown
from .datagrams import DatagramReceiver
from .lines import LineParser, UnnamedError

PORT = 9750
LONGEST = 1 << 22  # bytes of a line
WAKE_S = 0.1
SILENT_S = 1.0  # a sender that was not heard for so long gives way to another


def open_udp(address: str, wanted: Wanted) -> Source:
    """Our JSON in datagrams: ``udp:[HOST:]PORT``, where this machine listens."""
    receiver = UDPReceiver(host_and_port(address, PORT, host=LOOPBACK))
    return ReceivedSource(f"udp:{receiver.address}", receiver, wanted.hints.rate_hz)


def open_ndjson(address: str, wanted: Wanted) -> Source:
    """Our JSON lines: ``ndjson:-`` from standard input, ``ndjson:[HOST:]PORT`` over TCP."""
    receiver: PipeReceiver | TCPReceiver
    if address == "-":
        receiver = PipeReceiver()
    else:
        receiver = TCPReceiver(host_and_port(address, PORT, host=LOOPBACK))
    return ReceivedSource(f"ndjson:{receiver.address}", receiver, wanted.hints.rate_hz)


class UDPReceiver(DatagramReceiver):
    """JSON lines in datagrams; senders are told apart by their address."""

    def __init__(self, address: tuple[str, int]) -> None:
        super().__init__(address)
        self._parsers: dict[tuple[str, int], LineParser] = {}

    def take(self, data: bytes, sender: tuple[str, int], arrived_s: float, inbox: Inbox) -> None:
        """Take the lines of a datagram."""
        parser = self._parsers.get(sender)
        if parser is None:
            if len(self._parsers) >= 64:
                self._parsers.clear()
            parser = self._parsers[sender] = LineParser()
        for line in data.splitlines():
            _take_line(parser, line, arrived_s, inbox, wait=False)


class _Lines:
    """Bytes as they come, cut into lines."""

    def __init__(self) -> None:
        self.parser, self._rest, self._skips = LineParser(), b"", False

    def take(self, data: bytes, inbox: Inbox) -> None:
        arrived_s = time.monotonic()
        *lines, self._rest = (self._rest + data).split(b"\n")
        for line in lines:
            if self._skips:
                self._skips = False
            else:
                _take_line(self.parser, line, arrived_s, inbox, wait=True)
        if len(self._rest) > LONGEST:
            if not self._skips:
                inbox.damaged(f"a line of more than {LONGEST} bytes")
            self._rest, self._skips = b"", True

    def end(self, inbox: Inbox) -> None:
        """Take the last line, which may lack its end."""
        rest, self._rest = self._rest, b""
        if rest and not self._skips:
            _take_line(self.parser, rest, time.monotonic(), inbox, wait=True)


def _take_line(
    parser: LineParser, line: bytes, arrived_s: float, inbox: Inbox, *, wait: bool
) -> None:
    try:
        read = parser.parse(line, arrived_s)
    except UnnamedError as error:
        inbox.say("names", str(error), 1)
    except (ValueError, KeyError, TypeError, OverflowError, MPLearnError) as error:
        inbox.damaged(f"a line cannot be read: {error}")
    else:
        if isinstance(read, Sample):
            inbox.put(read, wait=wait)


class PipeReceiver(Receiver):
    """JSON lines from standard input; where whoever reads is slow, the sender waits."""

    ordered = True
    address = "-"

    def __init__(self, descriptor: int | None = None) -> None:
        try:
            self._descriptor = sys.stdin.fileno() if descriptor is None else descriptor
        except (OSError, ValueError):
            raise InvalidValueError("ndjson:- needs a standard input") from None

    def receive(self, inbox: Inbox) -> None:
        """Receive until the pipe ends."""
        lines = _Lines()
        with selectors.DefaultSelector() as selector:
            try:
                selector.register(self._descriptor, selectors.EVENT_READ)
                always = False
            except PermissionError:  # a file: it never lets one wait
                always = True
            while not inbox.closed:
                if not always and not selector.select(WAKE_S):
                    continue
                data = os.read(self._descriptor, 1 << 16)
                if not data:
                    lines.end(inbox)
                    inbox.finish()
                    return
                lines.take(data, inbox)

    def close(self) -> None:
        """Leave the input open: it is not ours."""


class TCPReceiver(Receiver):
    """JSON lines from whoever connects, one sender at a time.

    Args:
        address: Host and port to listen at.
    """

    ordered = True

    def __init__(self, address: tuple[str, int]) -> None:
        self._listening = bound(socket.SOCK_STREAM, address)
        self._listening.listen(4)
        self._listening.setblocking(False)
        self.address = shown(self._listening.getsockname())
        self.hint = f"it listens at {self.address}"

    def receive(self, inbox: Inbox) -> None:
        """Receive until it is closed; senders come and go."""
        sender: socket.socket | None = None
        lines, heard_s = _Lines(), 0.0
        with selectors.DefaultSelector() as selector:
            selector.register(self._listening, selectors.EVENT_READ)
            try:
                while not inbox.closed:
                    for key, _ in selector.select(WAKE_S):
                        if key.fileobj is self._listening:
                            other, at = self._listening.accept()
                            if sender is not None and time.monotonic() - heard_s < SILENT_S:
                                other.close()
                                inbox.say(
                                    "subject", f"a second sender at {shown(at)} was turned away"
                                )
                                continue
                            if sender is not None:
                                selector.unregister(sender)
                                sender.close()
                            sender, lines, heard_s = other, _Lines(), time.monotonic()
                            sender.settimeout(WAKE_S)
                            selector.register(sender, selectors.EVENT_READ)
                            continue
                        assert sender is not None
                        try:
                            data = sender.recv(1 << 16)
                        except (ConnectionError, TimeoutError):
                            data = b""
                        heard_s = time.monotonic()
                        if data:
                            lines.take(data, inbox)
                            continue
                        lines.end(inbox)
                        selector.unregister(sender)
                        sender.close()
                        sender = None
                        inbox.say("disconnected", "the sender closed the connection")
            finally:
                if sender is not None:
                    sender.close()

    def close(self) -> None:
        """Close the socket."""
        self._listening.close()
