"""From planned channels to postures: where the base is, and the legs that keep the feet in place.

The feet are given in space, so a foot that stands cannot slide or sink. The base is as high as the
legs reach; each leg's six joints follow in closed form, the hip's three axes and the ankle's two
meeting in a point each [Kajita2014, section 2.5.2].
"""

from __future__ import annotations

import numpy as np

from mplearn.body import Body
from mplearn.errors import BodyError
from mplearn.maths.easing import smooth_step
from mplearn.maths.rotations import euler_to_matrix, euler_to_quaternion
from mplearn.recording import FloatArray

from .channels import INDEX, UPPER_JOINTS

# how far a leg stretches: a standing leg to nearly straight; a lifted one stays softer and is
# limited softly, so that its knee does not snap (leg lengths; full effect when lifted this far)
_STANDING_REACH, _LIFTED_REACH = 0.9995, 0.975
_STANDING_SOFTNESS, _LIFTED_SOFTNESS = 0.0002, 0.020
_LIFTED = 0.10
_LEVEL_SOFTNESS, _RELIEF = 0.003, 0.12

LEG = ("hip_yaw", "hip_roll", "hip_pitch", "knee", "ankle_pitch", "ankle_roll")


class Stance:
    """Solves postures of one body from planned channels.

    Args:
        body: The human body.

    Attributes:
        body: The body.
        leg_m: Length of a stretched leg, hip to ankle [m].
        upper_limits: Limits of the upper body's joints, shape (26, 2), as `UPPER_JOINTS` [rad].
    """

    def __init__(self, body: Body) -> None:
        self.body = body
        tree = body.tree
        position, _ = tree.forward(body.rest)
        at = {name: position[i] for i, name in enumerate(tree.body_names)}
        thigh, shank = at["shank_l"] - at["thigh_l"], at["foot_l"] - at["shank_l"]
        if np.abs(np.concatenate((thigh[:2], shank[:2]))).max() > 1e-9:
            raise BodyError(f"the legs of {body.name!r} must hang straight down at rest")
        self._thigh_m, self._shank_m = float(-thigh[2]), float(-shank[2])
        self.leg_m = self._thigh_m + self._shank_m
        self._ankles = np.array([at["foot_l"], at["foot_r"]])
        self._hips = np.array([at["thigh_l"], at["thigh_r"]]) - at["pelvis"]
        self._upper = [7 + body.joint_names.index(joint) for joint in UPPER_JOINTS]
        self._legs = [
            [7 + body.joint_names.index(f"{joint}_{side}") for joint in LEG] for side in "lr"
        ]
        self._limits = np.vstack((np.full((7, 2), (-np.inf, np.inf)), body.joint_limits))
        self.upper_limits: FloatArray = self._limits[self._upper]

    def solve(self, plan: FloatArray) -> FloatArray:
        """Return the postures, shape (T, 7 + n), of planned channels, shape (T, C)."""
        n = len(plan)
        q = np.zeros((n, self.body.nq))
        q[:, self._upper] = plan[:, : len(UPPER_JOINTS)]
        angles = plan[:, [INDEX[f"pelvis_{angle}"] for angle in ("yaw", "pitch", "roll")]]
        pelvis = euler_to_matrix("ZYX", angles)
        feet = [self._foot(plan, side) for side in range(2)]
        hips = np.einsum("tij,sj->tsi", pelvis, self._hips)  # (T, 2, 3) relative to the pelvis
        base = self._base(plan, hips, feet)
        q[:, :3] = base
        q[:, 3:7] = euler_to_quaternion("ZYX", angles)
        for side, (ankle, rotation) in enumerate(feet):
            lifted = plan[:, INDEX[f"foot_z_{'lr'[side]}"]]
            q[:, self._legs[side]] = self._leg(
                base + hips[:, side], pelvis, ankle, rotation, lifted
            )
        # only a lifted leg, or sway and drift on top of a motion at its limit, can come this far
        return np.clip(q, self._limits[:, 0], self._limits[:, 1])

    def _foot(self, plan: FloatArray, side: int) -> tuple[FloatArray, FloatArray]:
        """Return an ankle's positions (T, 3) and the foot's orientations (T, 3, 3)."""
        letter = "lr"[side]
        shift = plan[:, [INDEX[f"foot_{axis}_{letter}"] for axis in "xyz"]] * self.leg_m
        angles = plan[:, [INDEX[f"foot_{angle}_{letter}"] for angle in ("yaw", "pitch")]]
        return self._ankles[side] + shift, euler_to_matrix("ZY", angles)

    def _base(
        self, plan: FloatArray, hips: FloatArray, feet: list[tuple[FloatArray, FloatArray]]
    ) -> FloatArray:
        """Return the base's positions (T, 3): as high as both legs allow with their feet down."""
        middle = self._ankles.mean(axis=0)
        base = np.empty((len(plan), 3))
        for axis, name in enumerate(("pelvis_x", "pelvis_y")):
            base[:, axis] = middle[axis] + plan[:, INDEX[name]] * self.leg_m
        base[:, :2] -= hips.mean(axis=1)[:, :2]
        length = self.leg_m * (1.0 - plan[:, INDEX["crouch"]])
        heights = np.empty((len(plan), 2))
        for side in range(2):
            lifted = plan[:, INDEX[f"foot_z_{'lr'[side]}"]]
            # a lifted foot counts where it was, as it will come down there, and the less the higher
            across = base[:, 1] + hips[:, side, 1] - feet[side][0][:, 1]
            along = base[:, 0] + hips[:, side, 0] - self._ankles[side, 0]
            drop = np.sqrt(length**2 - along**2 - across**2)
            height = self._ankles[side, 2] + _RELIEF * lifted * self.leg_m
            heights[:, side] = height + drop - hips[:, side, 2]
        softness = _LEVEL_SOFTNESS * self.leg_m
        base[:, 2] = -softness * np.logaddexp(*(-heights.T / softness)) + softness * np.log(2.0)
        return base

    def _leg(
        self,
        hip: FloatArray,
        pelvis: FloatArray,
        ankle: FloatArray,
        foot: FloatArray,
        lifted: FloatArray,
    ) -> FloatArray:
        """Return a leg's joint angles, shape (T, 6), in the order of `LEG`."""
        thigh, shank = self._thigh_m, self._shank_m
        back = np.einsum("tji,tj->ti", foot, hip - ankle)  # ankle to hip, in the foot's frame
        share = np.clip(lifted / _LIFTED, 0.0, 1.0)
        share = smooth_step(share)
        reach = self.leg_m * (_STANDING_REACH + share * (_LIFTED_REACH - _STANDING_REACH))
        soft = self.leg_m * (_STANDING_SOFTNESS + share * (_LIFTED_SOFTNESS - _STANDING_SOFTNESS))
        length = np.linalg.norm(back, axis=1)
        length = length - soft * np.logaddexp(0.0, (length - reach) / soft)
        cosine = (thigh**2 + shank**2 - length**2) / (2.0 * thigh * shank)
        knee = np.pi - np.arccos(np.clip(cosine, -1.0, 1.0))
        lean = np.arcsin(np.clip(thigh * np.sin(knee) / length, -1.0, 1.0))
        ankle_roll = np.arctan2(back[:, 1], back[:, 2])
        ankle_pitch = -np.arctan2(back[:, 0], np.hypot(back[:, 1], back[:, 2])) - lean
        rest = np.einsum("tji,tjk->tik", pelvis, foot)
        ankle = np.stack((ankle_roll, knee + ankle_pitch), axis=1)
        rest = rest @ euler_to_matrix("XY", -ankle)
        hip_yaw = np.arctan2(-rest[:, 0, 1], rest[:, 1, 1])
        across = -rest[:, 0, 1] * np.sin(hip_yaw) + rest[:, 1, 1] * np.cos(hip_yaw)
        hip_roll = np.arctan2(rest[:, 2, 1], across)
        hip_pitch = np.arctan2(-rest[:, 2, 0], rest[:, 2, 2])
        return np.stack((hip_yaw, hip_roll, hip_pitch, knee, ankle_pitch, ankle_roll), axis=1)
