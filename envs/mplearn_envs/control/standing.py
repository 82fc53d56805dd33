"""Controllers: a stream of wanted postures in, servo commands out, one call a control period."""

from __future__ import annotations

from abc import ABC, abstractmethod

import numpy as np

from mplearn.errors import FrameError
from mplearn.recording import FloatArray
from mplearn_envs.mechanics.gravity import standing_commands
from mplearn_envs.mechanics.reference import (
    Reference,
    reference_robot,
    rest_reference,
    tracked_columns,
)
from mplearn_envs.mechanics.servos import servo_commands
from mplearn_envs.robot import Robot

from .balance import BalanceController
from .upper_body import UpperBodyTracker


class Controller(ABC):
    """What every controller is; none needs an environment.

    Example:
        >>> import numpy as np
        >>> from mplearn_envs.control import StandingController
        >>> from mplearn_envs.robot import humanoid
        >>> controller: Controller = StandingController(humanoid())
        >>> controller.update(np.zeros(len(humanoid().channels))).shape
        (30,)
    """

    @abstractmethod
    def reset(self) -> None:
        """Start afresh with the robot standing at rest."""

    @abstractmethod
    def update(self, frame: FloatArray) -> FloatArray:
        """Take the wanted posture of now and return servo commands, shape (n,) [rad].

        Args:
            frame: Values of the robot's channels, shape (3 + n,) [m, rad].

        Raises:
            FrameError: The frame has the wrong width or is not finite.
        """


class StandingController(Controller):
    """Tracks the upper body and balances with the legs, both feet down ([Kulic2012], figure 8).

    This follows a live stream with no knowledge of what comes; for motions that are known ahead the
    `Planner` does the same without lag.

    Args:
        robot: The robot.
        period_s: Control period [s].

    Example:
        >>> import numpy as np
        >>> from mplearn_envs.robot import humanoid
        >>> robot = humanoid()
        >>> controller = StandingController(robot, period_s=0.004)
        >>> upright = np.zeros(len(robot.channels))  # the robot's features: standing, arms hanging
        >>> controller.update(upright).shape
        (30,)
    """

    def __init__(self, robot: Robot, period_s: float = 0.004) -> None:
        self.robot = robot
        self.period_s = period_s
        ref = reference_robot(robot)
        self._tracker = UpperBodyTracker(ref.limits, ref.velocity, period_s)
        self._balance = BalanceController(robot)
        self._columns = tracked_columns(robot)
        self.reset()

    def reset(self) -> None:
        """Start afresh with the robot standing at rest."""
        self._reference = rest_reference(self.robot)

    @property
    def reference(self) -> Reference:
        """Where the reference robot is."""
        return self._reference

    def update(self, frame: FloatArray) -> FloatArray:
        """Take the wanted posture of now and return servo commands; see `Controller.update`."""
        frame = np.asarray(frame, dtype=np.float64)
        if frame.shape != (len(self.robot.channels),):
            raise FrameError(f"a frame needs {len(self.robot.channels)} values, not {frame.shape}")
        before = self._reference
        target = self._tracker.update(before.target, frame[self._columns])
        after = self._balance.update(before, target, self.period_s)
        self._reference = after
        rate = (after.q - before.q)[7:] / self.period_s
        held = standing_commands(self.robot, after.q)
        return np.asarray(servo_commands(self.robot, held[None], rate[None])[0])
