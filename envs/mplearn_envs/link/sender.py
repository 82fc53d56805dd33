"""The sending end of the link."""

from __future__ import annotations

import secrets
import time

from mplearn.closing import Closing
from mplearn.errors import InvalidValueError
from mplearn.recording import FloatArray
from mplearn_envs.robot import Robot

from .datagram import Datagram, checked_key, encode, robot_code
from .sockets import HOST, PORT, open_socket


class Sender(Closing):
    """Sends postures of the upper body; a context manager, as it holds a socket.

    Nobody answers, so nothing here waits: what cannot be sent is lost.

    Args:
        robot: The robot.
        host: Where the lower body's computer is, a name or an address of IPv4 or IPv6; this machine
            by default.
        port: Its UDP port, 1 to 65535.
        stream: Number of the stream; drawn at random where not given.
        key: What the lower body's computer must share to take the postures, 16 bytes or more.

    Attributes:
        unsent: How many datagrams the system refused to send.

    Raises:
        LinkError: No such host, or nothing can be sent there.

    Example:
        >>> import numpy as np
        >>> from mplearn_envs.link import Receiver
        >>> from mplearn_envs.mechanics import rest_reference
        >>> from mplearn_envs.robot import humanoid
        >>> robot = humanoid()
        >>> with Receiver(robot, port=0) as receiver, Sender(robot, port=receiver.port) as sender:
        ...     sender.send(rest_reference(robot).q[:7], np.zeros(18), time_s=0.0)
        >>> sender.unsent
        0
    """

    def __init__(
        self,
        robot: Robot,
        host: str = HOST,
        port: int = PORT,
        *,
        stream: int | None = None,
        key: bytes | None = None,
    ) -> None:
        self.robot, self.host, self.port = robot, host, port
        self.stream = secrets.randbits(32) if stream is None else stream
        self.sequence = 0
        self.unsent = 0
        self._key = checked_key(key)
        self._code = robot_code([robot.joint_names[i] for i in robot.upper_joints])
        self._socket, self._to = open_socket(host, port)

    def datagram(
        self, base: FloatArray, angles: FloatArray, time_s: float, last: bool = False
    ) -> bytes:
        """Return the next datagram of the stream without sending it."""
        n = len(self.robot.upper_joints)
        if base.shape != (7,) or angles.shape != (n,):
            raise InvalidValueError(
                f"a posture needs a frame (7,) and {n} angles, not {base.shape} and {angles.shape}"
            )
        told = Datagram(self.stream, self.sequence, time_s, base, angles, last, time.time())
        self.sequence += 1
        return encode(told, self._code, self._key)

    def send(self, base: FloatArray, angles: FloatArray, time_s: float, last: bool = False) -> None:
        """Send a posture: base frame (7,), angles of the upper joints (n,) [rad], the time [s]."""
        self.send_bytes(self.datagram(base, angles, time_s, last))

    def send_bytes(self, data: bytes) -> None:
        """Send one datagram; a full or closed way out loses it."""
        try:
            self._socket.sendto(data, self._to)
        except OSError:
            self.unsent += 1

    def close(self) -> None:
        """Close the socket."""
        self._socket.close()
