"""What drives joints: gains and limits of those that are driven alike, and the humanoid's.

[Kulic2012] (4.2) gives its degrees of freedom only. Assumed here: position servos on every joint
with the gains and torque limits below, rotor inertias as in the body's model, and velocity limits
of a strong human-sized machine. Gains follow one rule: stiff against gravity (an ankle must exceed
m g h = 460 N m/rad by far) and about critically damped. Other robots' follow from these.
"""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class JointGroup:
    """Joints that are driven alike.

    Attributes:
        names: The joints' names.
        stiffness: Gain of the position servo, ``kp`` [N m/rad].
        damping: Its velocity gain, ``kv`` [N m s/rad].
        torque: Torque limit [N m].
        velocity: Velocity limit [rad/s].

    Example:
        >>> knees = JointGroup(("knee_l", "knee_r"), 9000.0, 208.0, 300.0, 6.0)
        >>> knees.torque
        300.0
    """

    names: tuple[str, ...]
    stiffness: float
    damping: float
    torque: float
    velocity: float


def _both(*names: str) -> tuple[str, ...]:
    return tuple(f"{name}_{side}" for side in "lr" for name in names)


HUMANOID_DRIVES = (
    JointGroup(("waist_yaw",), 9000.0, 208.0, 200.0, 4.0),
    JointGroup(("neck_yaw", "neck_pitch", "neck_roll"), 450.0, 10.0, 20.0, 6.0),
    JointGroup(_both("shoulder_pitch", "shoulder_roll", "shoulder_yaw"), 1800.0, 42.0, 80.0, 8.0),
    JointGroup(_both("elbow"), 1200.0, 28.0, 60.0, 8.0),
    JointGroup(_both("wrist_yaw", "wrist_pitch", "wrist_roll"), 300.0, 7.0, 20.0, 8.0),
    JointGroup(_both("hip_yaw", "hip_roll", "hip_pitch"), 9000.0, 208.0, 250.0, 6.0),
    JointGroup(_both("knee"), 9000.0, 208.0, 300.0, 6.0),
    JointGroup(_both("ankle_pitch", "ankle_roll"), 7500.0, 139.0, 180.0, 6.0),
)
HUMANOID_BASE_VELOCITY = (0.6, 1.5, 2.0)  # of base height [m/s], roll and pitch [rad/s]
