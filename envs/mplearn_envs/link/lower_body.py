"""The lower body's computer: balances under the upper body that the datagrams tell of."""

from __future__ import annotations

from typing import Literal, TypeAlias

import numpy as np

from mplearn.errors import InvalidValueError
from mplearn.recording import FloatArray
from mplearn_envs.control import StandingController, reference_robot, rest_reference
from mplearn_envs.control.controller import tracked_columns
from mplearn_envs.robot import Robot

from .datagram import base_coordinates
from .receiver import Receiver

Phase: TypeAlias = Literal["waiting", "following", "holding", "settling"]


class LowerBody:
    """Balances, one call a control period; survives whatever the link does.

    Where no newer posture comes for ``hold_s``, the last one is held; after ``settle_s`` the robot
    goes back to standing, slowly. When postures come again it follows them again, within the
    velocity limits of the robot: never a jump, never a command outside the joints' limits.

    Args:
        robot: The robot.
        receiver: Brings the postures.
        period_s: Control period [s].
        hold_s: Silence after which the link counts as broken [s].
        settle_s: Silence after which the robot goes back to standing [s].
        settle_share: Share of the velocity limits that it takes for that.

    Attributes:
        phase: "waiting" for the first posture, "following", "holding" or "settling".
        spent_s: Time spent in each phase [s].
    """

    def __init__(
        self,
        robot: Robot,
        receiver: Receiver,
        period_s: float = 0.004,
        *,
        hold_s: float = 0.05,
        settle_s: float = 0.5,
        settle_share: float = 0.15,
    ) -> None:
        if not 0 < hold_s <= settle_s:
            raise InvalidValueError(f"0 < hold_s <= settle_s is needed, not {hold_s}, {settle_s}")
        if not 0 < settle_share <= 1:
            raise InvalidValueError(f"settle_share must lie in (0, 1], not {settle_share}")
        self.robot, self.receiver, self.period_s = robot, receiver, period_s
        self.hold_s, self.settle_s, self.settle_share = hold_s, settle_s, settle_share
        self.controller = StandingController(robot, period_s)
        self.phase: Phase = "waiting"
        self.spent_s: dict[Phase, float] = dict.fromkeys(
            ("waiting", "following", "holding", "settling"), 0.0
        )
        self._columns = tracked_columns(robot)
        self._rest = rest_reference(robot).target
        self._settling_step = settle_share * reference_robot(robot).velocity * period_s
        self._wanted = self._rest.copy()
        self._heard_s = -np.inf

    def update(self, now_s: float) -> FloatArray:
        """Read the link and return servo commands for all joints, shape (n,) [rad].

        Args:
            now_s: The time on this machine's clock [s].
        """
        datagram = self.receiver.receive(now_s)
        if datagram is not None:
            self._wanted = np.concatenate((base_coordinates(datagram.base), datagram.angles))
            self._heard_s = now_s
        silence_s = now_s - self._heard_s
        if self._heard_s == -np.inf:
            self.phase = "waiting"
        elif silence_s <= self.hold_s:
            self.phase = "following"
        elif silence_s <= self.settle_s:
            self.phase = "holding"
        else:
            self.phase = "settling"
            way = self._rest - self._wanted
            self._wanted = self._wanted + np.clip(way, -self._settling_step, self._settling_step)
        self.spent_s[self.phase] += self.period_s
        frame = np.zeros(len(self.robot.channels))
        frame[self._columns] = self._wanted
        return self.controller.update(frame)
