"""The humanoid of the experiments: the body that `mplearn.body.models.robot` draws, driven.

Hands and toes hold their rest shape rigidly: the eight joints "were not used during these
experiments" ([Kulic2012], 4.2).
"""

from __future__ import annotations

from functools import cache
from math import radians

from .compiling import read_model
from .description import Robot
from .drives import HUMANOID_BASE_VELOCITY, HUMANOID_DRIVES
from .roles import ROLES

LEG = ("hip_yaw", "hip_roll", "hip_pitch", "knee", "ankle_pitch", "ankle_roll")


@cache
def humanoid() -> Robot:
    """Return the human-sized robot with 30 driven joints (1.65 m, 63 kg).

    Example:
        >>> robot = humanoid()
        >>> len(robot.joint_names), robot.legs[0][3]
        (30, 'knee_l')
    """
    return Robot(
        name="robot",
        xml=read_model("humanoid"),
        groups=HUMANOID_DRIVES,
        legs=(tuple(f"{n}_l" for n in LEG), tuple(f"{n}_r" for n in LEG)),
        knees=("knee_l", "knee_r"),
        thighs=("thigh_l", "thigh_r"),
        feet=("foot_l", "foot_r"),
        stance_knee_rad=radians(30.0),
        guard_knee_rad=radians(12.0),
        base_velocity=HUMANOID_BASE_VELOCITY,
        segments=tuple((role, role) for role in ROLES),
    )
