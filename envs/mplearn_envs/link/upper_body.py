"""The upper body's computer: follows wanted postures within its limits and sends what it does."""

from __future__ import annotations

import numpy as np

from mplearn.errors import FrameError
from mplearn.recording import FloatArray
from mplearn_envs.control import UpperBodyTracker
from mplearn_envs.mechanics import reference_robot, rest_reference
from mplearn_envs.mechanics.reference import tracked_columns
from mplearn_envs.robot import Robot

from .datagram import base_frame
from .sender import Sender


class UpperBody:
    """Tracks the upper body and tells the lower body where it is, one call a control period.

    Args:
        robot: The robot.
        sender: Takes the postures.
        period_s: Control period [s].

    Attributes:
        target: Base height [m], roll, pitch and the upper joints' angles [rad] now, shape (U,).

    Example:
        >>> import numpy as np
        >>> from mplearn_envs.link import Receiver, Sender
        >>> from mplearn_envs.robot import humanoid
        >>> robot = humanoid()
        >>> with Receiver(robot, port=0) as receiver, Sender(robot, port=receiver.port) as sender:
        ...     upper = UpperBody(robot, sender)
        ...     angles = upper.update(np.zeros(len(robot.channels)), time_s=0.0)
        >>> angles.shape
        (18,)
    """

    def __init__(self, robot: Robot, sender: Sender, period_s: float = 0.004) -> None:
        self.robot, self.sender, self.period_s = robot, sender, period_s
        reference = reference_robot(robot)
        self._tracker = UpperBodyTracker(reference.limits, reference.velocity, period_s)
        self._columns = tracked_columns(robot)
        self.target = rest_reference(robot).target

    def update(self, frame: FloatArray, time_s: float, last: bool = False) -> FloatArray:
        """Move towards the wanted posture and send; returns the upper joints' angles [rad].

        Args:
            frame: Values of the robot's channels, shape (3 + n,) [m, rad].
            time_s: The time [s].
            last: Whether this is the last posture of all.

        Raises:
            FrameError: The frame has the wrong width or is not finite.
        """
        frame = np.asarray(frame, dtype=np.float64)
        if frame.shape != (len(self.robot.channels),):
            raise FrameError(f"a frame needs {len(self.robot.channels)} values, not {frame.shape}")
        self.target = self._tracker.update(self.target, frame[self._columns])
        height, roll, pitch = self.target[:3]
        angles = self.target[3:]
        self.sender.send(base_frame(height, roll, pitch), angles, time_s, last)
        return angles
