"""What all protocols over UDP have in common."""

from __future__ import annotations

import socket
import time
from abc import abstractmethod

from ..inbox import Inbox
from ..received import Receiver
from .addresses import LOOPBACK, bound, shown

LARGEST = 65536
ROOM = 1 << 22  # bytes that the system may keep for us
WAKE_S = 0.1


class DatagramReceiver(Receiver):
    """Listens for datagrams.

    Args:
        address: Host and port to listen at.

    Raises:
        InvalidValueError: The address is taken, or none of this machine.
    """

    def __init__(self, address: tuple[str, int]) -> None:
        self._socket = bound(socket.SOCK_DGRAM, address)
        self._socket.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, ROOM)
        self._socket.settimeout(WAKE_S)
        self.address = shown(self._socket.getsockname())
        self.hint = f"it listens at {self.address}"
        if address[0] == LOOPBACK:
            self.hint += (
                f"; senders on other machines are heard at 0.0.0.0:{self._socket.getsockname()[1]}"
            )

    def receive(self, inbox: Inbox) -> None:
        """Receive until it is closed."""
        while not inbox.closed:
            try:
                data, sender = self._socket.recvfrom(LARGEST)
            except TimeoutError:
                continue
            try:
                self.take(data, sender, time.monotonic(), inbox)
            except Exception as error:  # whatever it, or a package, meets in a datagram
                inbox.damaged(f"a packet from {shown(sender)} cannot be read: {error}")

    @abstractmethod
    def take(self, data: bytes, sender: tuple[str, int], arrived_s: float, inbox: Inbox) -> None:
        """Take a datagram.

        Raises:
            ValueError: It is none of the protocol; whatever else parsing raises is caught as well.
        """

    def close(self) -> None:
        """Close the socket."""
        self._socket.close()
