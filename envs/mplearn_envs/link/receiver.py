"""The receiving end of the link: the new postures, and what went wrong on the way."""

from __future__ import annotations

import time
from collections import OrderedDict, deque
from dataclasses import dataclass

import numpy as np

from mplearn.closing import Closing
from mplearn.errors import InvalidValueError
from mplearn_envs.robot import Robot

from .datagram import Datagram, DatagramError, checked_key, decode, robot_code
from .sockets import HOST, PORT, open_socket

_MOST_A_CALL = 256  # datagrams read in one call: a flood must not keep the controller waiting
_LARGEST = 65_536
_REMEMBERED = 1000  # skipped numbers that may still come


@dataclass
class LinkCounts:
    """How many datagrams did what.

    Attributes:
        used: Newer than all before: their posture was taken.
        late: Of those, came with more than the allowed delay.
        lost: Numbers that never came, or not undamaged.
        reordered: Came after a newer one; not used.
        duplicate: Came again; not used.
        malformed: Were damaged; not used.
        foreign: Were something else, for another robot, from another sender, or without proof that
            the sender shares the key; not used.
        stale: Were keyed, but sent at another time than now, or of a stream that was left: they are
            replayed, or the wall clocks disagree; not used.

    Example:
        >>> counts = LinkCounts(used=990, lost=10)
        >>> f"{counts.lost / (counts.used + counts.lost):.0%} lost"
        '1% lost'
    """

    used: int = 0
    late: int = 0
    lost: int = 0
    reordered: int = 0
    duplicate: int = 0
    malformed: int = 0
    foreign: int = 0
    stale: int = 0


class Receiver(Closing):
    """Receives postures of the upper body; a context manager, as it holds a socket.

    It follows one sender's stream, the first that it hears. Another one is foreign to it until the
    stream has ended or been silent for ``patience_s``. Delays are measured against the smallest one
    of the stream, for the two clocks have no common zero.

    Args:
        robot: The robot.
        host: Address of IPv4 or IPv6 to listen at; only this machine is heard by default, all that
            reach it by "0.0.0.0" or "::".
        port: UDP port; 0 takes any free one (see ``port``).
        late_s: Delay beyond which a datagram counts as late [s].
        patience_s: Silence after which another stream may take over [s].
        key: What the sender must share, 16 bytes or more. Then nobody else is followed, and nothing
            that is replayed: both wall clocks must agree within ``fresh_s``.
        fresh_s: See there [s].

    Attributes:
        port: The port that is listened at.
        counts: What came of the datagrams.

    Raises:
        LinkError: Nobody can listen there.

    Example:
        >>> import numpy as np
        >>> from mplearn_envs.link import Sender
        >>> from mplearn_envs.mechanics import rest_reference
        >>> from mplearn_envs.robot import humanoid
        >>> robot = humanoid()
        >>> with Receiver(robot, port=0) as receiver, Sender(robot, port=receiver.port) as sender:
        ...     data = sender.datagram(rest_reference(robot).q[:7], np.zeros(18), time_s=0.0)
        ...     taken = receiver.take(data, now_s=0.0)
        >>> taken.sequence, receiver.counts.used
        (0, 1)
    """

    def __init__(
        self,
        robot: Robot,
        host: str = HOST,
        port: int = PORT,
        *,
        late_s: float = 0.02,
        patience_s: float = 1.0,
        key: bytes | None = None,
        fresh_s: float = 30.0,
    ) -> None:
        if not (late_s > 0 and patience_s > 0 and fresh_s > 0):
            raise InvalidValueError(
                "late_s, patience_s and fresh_s must be positive, "
                f"not {late_s}, {patience_s} and {fresh_s}"
            )
        self.robot, self.host = robot, host
        self.late_s, self.patience_s = late_s, patience_s
        self.fresh_s = fresh_s
        self.counts = LinkCounts()
        self._key = checked_key(key)
        self._left: deque[int] = deque(maxlen=_REMEMBERED)
        self._code = robot_code([robot.joint_names[i] for i in robot.upper_joints])
        self._stream: int | None = None
        self._newest = -1
        self._ended = False
        self._missing: OrderedDict[int, None] = OrderedDict()
        self._smallest_delay_s = np.inf
        self._heard_s = 0.0
        self._socket, _ = open_socket(host, port, listen=True)
        self.port: int = self._socket.getsockname()[1]

    def receive(self, now_s: float) -> list[Datagram]:
        """Read what has come and return the postures that are newer than all before, in order.

        Args:
            now_s: The time on this machine's clock [s].
        """
        newer = []
        for _ in range(_MOST_A_CALL):
            try:
                data, _ = self._socket.recvfrom(_LARGEST)
            except (BlockingIOError, ConnectionError):
                break
            datagram = self.take(data, now_s)
            if datagram is not None:
                newer.append(datagram)
        return newer

    def take(self, data: bytes, now_s: float) -> Datagram | None:
        """Judge one datagram; return it where it is the newest of the stream, else count it."""
        counts = self.counts
        try:
            datagram = decode(data, self._code, len(self.robot.upper_joints), self._key)
        except DatagramError as error:
            if error.fault == "foreign":
                counts.foreign += 1
            else:
                counts.malformed += 1
            return None
        if self._is_stale(datagram):
            counts.stale += 1
            return None
        if datagram.stream != self._stream:
            silent = self._ended or now_s - self._heard_s > self.patience_s
            if self._stream is not None and not silent:
                counts.foreign += 1
                return None
            if self._stream is not None:
                self._left.append(self._stream)
            self._stream, self._newest = datagram.stream, datagram.sequence - 1
            self._missing.clear()
            self._smallest_delay_s = np.inf
        self._heard_s = now_s
        if datagram.sequence <= self._newest:
            self._count_old(datagram.sequence)
            return None
        self._count_skipped(datagram.sequence)
        self._newest, self._ended = datagram.sequence, datagram.last
        delay_s = now_s - datagram.time_s
        self._smallest_delay_s = min(self._smallest_delay_s, delay_s)
        counts.used += 1
        counts.late += int(delay_s - self._smallest_delay_s > self.late_s)
        return datagram

    def _is_stale(self, datagram: Datagram) -> bool:
        """Tell whether a keyed datagram may have been recorded and sent again."""
        if datagram.sent_s is None:
            return False
        return not abs(time.time() - datagram.sent_s) <= self.fresh_s or (
            datagram.stream in self._left
        )

    def _count_old(self, sequence: int) -> None:
        if sequence in self._missing:
            del self._missing[sequence]
            self.counts.lost -= 1
            self.counts.reordered += 1
        else:
            self.counts.duplicate += 1

    def _count_skipped(self, sequence: int) -> None:
        self.counts.lost += sequence - self._newest - 1
        for number in range(max(self._newest + 1, sequence - _REMEMBERED), sequence):
            self._missing[number] = None
        while len(self._missing) > _REMEMBERED:
            self._missing.popitem(last=False)

    def close(self) -> None:
        """Close the socket."""
        self._socket.close()
