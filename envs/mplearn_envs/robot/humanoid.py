"""The humanoid of the experiments: what drives the body that `mplearn.body.robot` draws.

[Kulic2012] (4.2) gives its degrees of freedom only. Assumed here: position servos on every joint
with the gains and torque limits below, rotor inertias as in the body's model, and velocity limits
of a strong human-sized machine. Gains follow one rule: stiff against gravity (an ankle must exceed
m g h = 460 N m/rad by far) and about critically damped. Hands and toes hold their rest shape
rigidly: the eight joints "were not used during these experiments".
"""

from __future__ import annotations

from functools import cache
from math import radians

from .description import ROLES, JointGroup, Robot, read_model


def _both(*names: str) -> tuple[str, ...]:
    return tuple(f"{name}_{side}" for side in "lr" for name in names)


GROUPS = (
    JointGroup(("waist_yaw",), 9000.0, 208.0, 200.0, 4.0),
    JointGroup(("neck_yaw", "neck_pitch", "neck_roll"), 450.0, 10.0, 20.0, 6.0),
    JointGroup(_both("shoulder_pitch", "shoulder_roll", "shoulder_yaw"), 1800.0, 42.0, 80.0, 8.0),
    JointGroup(_both("elbow"), 1200.0, 28.0, 60.0, 8.0),
    JointGroup(_both("wrist_yaw", "wrist_pitch", "wrist_roll"), 300.0, 7.0, 20.0, 8.0),
    JointGroup(_both("hip_yaw", "hip_roll", "hip_pitch"), 9000.0, 208.0, 250.0, 6.0),
    JointGroup(_both("knee"), 9000.0, 208.0, 300.0, 6.0),
    JointGroup(_both("ankle_pitch", "ankle_roll"), 7500.0, 139.0, 180.0, 6.0),
)
LEG = ("hip_yaw", "hip_roll", "hip_pitch", "knee", "ankle_pitch", "ankle_roll")


@cache
def humanoid() -> Robot:
    """Return the human-sized robot with 30 driven joints (1.65 m, 63 kg)."""
    return Robot(
        name="robot",
        xml=read_model("humanoid"),
        groups=GROUPS,
        legs=(tuple(f"{n}_l" for n in LEG), tuple(f"{n}_r" for n in LEG)),
        knees=("knee_l", "knee_r"),
        thighs=("thigh_l", "thigh_r"),
        feet=("foot_l", "foot_r"),
        stance_knee_rad=radians(30.0),
        guard_knee_rad=radians(12.0),
        base_velocity=(0.6, 1.5, 2.0),
        segments=tuple((role, role) for role in ROLES),
    )
