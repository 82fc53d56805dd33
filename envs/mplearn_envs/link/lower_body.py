"""The lower body's computer: balances under the upper body that the datagrams tell of."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Literal, TypeAlias

import numpy as np

from mplearn.errors import InvalidValueError
from mplearn.generation.joins import drawn_from
from mplearn.recording import FloatArray
from mplearn_envs.control import StandingController
from mplearn_envs.mechanics import reference_robot, rest_reference
from mplearn_envs.mechanics.gravity import standing_commands
from mplearn_envs.mechanics.reference import tracked_columns
from mplearn_envs.robot import Robot

from .command_limiter import CommandLimiter
from .datagram import base_coordinates
from .playback import Playback
from .receiver import Receiver
from .restraint import Restraint

Phase: TypeAlias = Literal["waiting", "following", "holding", "settling"]


class LowerBody:
    """Balances, one call a control period; survives whatever the link does.

    Postures are followed as `Playback` plays them, evenly, however they come. Where no newer one
    comes for ``hold_s``, the robot comes to rest and stays; after ``settle_s`` it goes back to
    standing. When postures come again it follows them again. All these pass into each other within
    ``fade_s``. A sender is not trusted: `Restraint` follows it no faster and no farther than the
    robot keeps standing, and `CommandLimiter` lets no command pass that is outside the limits of
    position, velocity and acceleration.

    Args:
        robot: The robot.
        receiver: Brings the postures.
        period_s: Control period [s].
        hold_s: Silence after which the link counts as broken [s].
        settle_s: Silence after which the robot goes back to standing [s].
        fade_s: How long it takes to join a stream, or to go back to standing [s].

    Attributes:
        phase: "waiting" for the first posture, "following", "holding" or "settling".
        spent_s: Time spent in each phase [s].
        restraint: How much of what comes is followed.
        limiter: The commands' limits.

    Example:
        >>> from mplearn_envs.link import Receiver
        >>> from mplearn_envs.robot import humanoid
        >>> with Receiver(humanoid(), port=0) as receiver:
        ...     lower = LowerBody(humanoid(), receiver)
        ...     commands = lower.update(now_s=0.0)  # nobody sends: it stands
        >>> commands.shape, lower.phase
        ((30,), 'waiting')
    """

    def __init__(
        self,
        robot: Robot,
        receiver: Receiver,
        period_s: float = 0.004,
        *,
        hold_s: float = 0.05,
        settle_s: float = 0.5,
        fade_s: float = 2.0,
    ) -> None:
        if not 0 < hold_s <= settle_s:
            raise InvalidValueError(f"0 < hold_s <= settle_s is needed, not {hold_s}, {settle_s}")
        if not period_s < fade_s < np.inf:
            raise InvalidValueError(f"fade_s must be longer than a period, not {fade_s}")
        self.robot, self.receiver, self.period_s = robot, receiver, period_s
        self.hold_s, self.settle_s, self.fade_s = hold_s, settle_s, fade_s
        self.controller = StandingController(robot, period_s)
        self.phase: Phase = "waiting"
        self.spent_s: dict[Phase, float] = dict.fromkeys(
            ("waiting", "following", "holding", "settling"), 0.0
        )
        self._columns = tracked_columns(robot)
        self._rest = rest_reference(robot).target
        self._limits = reference_robot(robot).limits
        self.restraint = Restraint(robot, period_s)
        held = standing_commands(robot, reference_robot(robot).rest)
        self.limiter = CommandLimiter(robot, period_s, held)
        self._playback = Playback(period_s)
        self._plays = False
        self._fade: Iterator[FloatArray] = iter(())
        self._heard_s = -np.inf

    def update(self, now_s: float) -> FloatArray:
        """Read the link and return servo commands for all joints, shape (n,) [rad].

        Args:
            now_s: The time on this machine's clock [s].
        """
        anew = self._listen(now_s)
        silence_s = now_s - self._heard_s
        if self._heard_s == -np.inf:
            self.phase = "waiting"
        elif silence_s <= self.hold_s:
            self.phase = "following"
        elif silence_s <= self.settle_s:
            self.phase = "holding"
        else:
            self.phase = "settling"
        self.spent_s[self.phase] += self.period_s
        plays = self.phase in ("following", "holding")
        source = self._playback.advance() if plays else self._rest
        if anew or plays != self._plays:
            self._fade = self._fading(source)
        self._plays = plays
        frame = np.zeros(len(self.robot.channels))
        wanted = source + next(self._fade, 0.0)
        if self.phase == "holding":  # braking passes the last posture; no motion back to it
            frame[self._columns] = self.restraint.brake()
        else:
            frame[self._columns] = self.restraint.update(wanted)
        return self.limiter.update(self.controller.update(frame))

    def _listen(self, now_s: float) -> bool:
        """Take what has come; returns whether it does not follow what came before."""
        anew = False
        for datagram in self.receiver.receive(now_s):
            posture = np.concatenate((base_coordinates(datagram.base), datagram.angles))
            posture = np.clip(posture, self._limits[:, 0], self._limits[:, 1])
            anew |= self._playback.add(datagram.stream, datagram.time_s, posture)
            self._heard_s = now_s
        return anew

    def _fading(self, source: FloatArray) -> Iterator[FloatArray]:
        """Return what to add to a source, period by period, to pass into it without a jump."""
        here, velocity = self.restraint.position, self.restraint.velocity
        off = here + self.period_s * velocity - source
        n = 1 + round(self.fade_s / self.period_s)
        still = np.zeros((n, len(source)))
        return iter(drawn_from(still, off, velocity, 1.0 / self.period_s, self.fade_s))
