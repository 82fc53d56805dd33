"""The sending end of the link."""

from __future__ import annotations

import secrets
import socket
from typing import Self

from mplearn.errors import InvalidValueError, MPLearnError
from mplearn.recording import FloatArray
from mplearn_envs.robot import Robot

from .datagram import Datagram, encode, robot_code

HOST, PORT = "127.0.0.1", 47810


class LinkError(MPLearnError, OSError):
    """The link's socket cannot be opened."""


class Sender:
    """Sends postures of the upper body; a context manager, as it holds a socket.

    Nobody answers, so nothing here waits: what cannot be sent is lost.

    Args:
        robot: The robot.
        host: Where the lower body's computer is; this machine by default.
        port: Its UDP port.
        stream: Number of the stream; drawn at random where not given.
    """

    def __init__(
        self, robot: Robot, host: str = HOST, port: int = PORT, *, stream: int | None = None
    ) -> None:
        self.robot, self.host, self.port = robot, host, port
        self.stream = secrets.randbits(32) if stream is None else stream
        self.sequence = 0
        self._code = robot_code([robot.joint_names[i] for i in robot.upper_joints])
        self._socket = open_socket()

    def datagram(
        self, base: FloatArray, angles: FloatArray, time_s: float, last: bool = False
    ) -> bytes:
        """Return the next datagram of the stream without sending it."""
        n = len(self.robot.upper_joints)
        if base.shape != (7,) or angles.shape != (n,):
            raise InvalidValueError(
                f"a posture needs a frame (7,) and {n} angles, not {base.shape} and {angles.shape}"
            )
        data = encode(Datagram(self.stream, self.sequence, time_s, base, angles, last), self._code)
        self.sequence += 1
        return data

    def send(self, base: FloatArray, angles: FloatArray, time_s: float, last: bool = False) -> None:
        """Send a posture: base frame (7,), angles of the upper joints (n,) [rad], the time [s]."""
        self.send_bytes(self.datagram(base, angles, time_s, last))

    def send_bytes(self, data: bytes) -> None:
        """Send one datagram; a full or closed way out loses it."""
        try:
            self._socket.sendto(data, (self.host, self.port))
        except (BlockingIOError, ConnectionError):
            return

    def close(self) -> None:
        """Close the socket."""
        self._socket.close()

    def __enter__(self) -> Self:
        """Return the sender itself."""
        return self

    def __exit__(self, *error: object) -> None:
        """Close the socket."""
        self.close()


def open_socket() -> socket.socket:
    """Return a UDP socket that never waits."""
    found = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
    found.setblocking(False)
    return found
