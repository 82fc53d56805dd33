"""A bad way between two computers, for trying out what the link survives."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from mplearn.errors import InvalidValueError
from mplearn.recording import FloatArray
from mplearn_envs.robot import Robot

from .sender import Sender
from .sockets import HOST, PORT


@dataclass(frozen=True)
class Disturbance:
    """Shares of the datagrams to which something happens.

    Attributes:
        lose: Never sent.
        swap: Sent after its successor.
        repeat: Sent twice.
        damage: Some bytes changed.
        intrude: Followed by something that is not ours.
    """

    lose: float = 0.0
    swap: float = 0.0
    repeat: float = 0.0
    damage: float = 0.0
    intrude: float = 0.0

    def __post_init__(self) -> None:
        for name, share in vars(self).items():
            if not 0.0 <= share <= 1.0:
                raise InvalidValueError(f"{name} is a share in [0, 1], not {share}")


class DisturbedSender(Sender):
    """A sender whose datagrams suffer.

    Args:
        robot: The robot.
        disturbance: What happens how often.
        rng: Source of randomness.
        host: See `Sender`.
        port: See `Sender`.
        key: See `Sender`.

    Attributes:
        done: How many suffered what.
    """

    def __init__(
        self,
        robot: Robot,
        disturbance: Disturbance,
        rng: np.random.Generator,
        host: str = HOST,
        port: int = PORT,
        *,
        key: bytes | None = None,
    ) -> None:
        super().__init__(robot, host, port, key=key)
        self.disturbance, self.rng = disturbance, rng
        self.done = dict.fromkeys(vars(disturbance), 0)
        self._waiting: bytes | None = None

    def send(self, base: FloatArray, angles: FloatArray, time_s: float, last: bool = False) -> None:
        """Send a posture, or not; see `Sender.send`. The last one of a stream is spared."""
        data = self.datagram(base, angles, time_s, last)
        chance = dict(zip(vars(self.disturbance), self.rng.random(5), strict=True))
        fate = {
            name: not last and chance[name] < share
            for name, share in vars(self.disturbance).items()
        }
        waiting, self._waiting = self._waiting, None
        if fate["lose"]:
            self.done["lose"] += 1
        elif fate["damage"]:
            self.done["damage"] += 1
            self.send_bytes(self._damaged(data))
        elif fate["swap"] and waiting is None:
            self.done["swap"] += 1
            self._waiting = data
        else:
            self.send_bytes(data)
            if fate["repeat"]:
                self.done["repeat"] += 1
                self.send_bytes(data)
        if waiting is not None:
            self.send_bytes(waiting)
        if fate["intrude"]:
            self.done["intrude"] += 1
            self.send_bytes(self.rng.bytes(int(self.rng.integers(0, 400))))

    def _damaged(self, data: bytes) -> bytes:
        changed = bytearray(data)
        place = int(self.rng.integers(4, len(changed)))
        changed[place] ^= int(self.rng.integers(1, 256))
        return bytes(changed)
