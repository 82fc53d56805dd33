"""What a motion does with its feet: which one leaves the ground, when, how high, where it lands.

All of it is read from the motion itself, by the robot's forward kinematics ([Kulic2012] 4.2.1 names
this as the way beyond both feet on the ground). Features hold no place on the floor, so feet are
seen relative to each other: the lower one stands.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from mplearn.maths.compiling import njit
from mplearn.maths.plane import turn_in_plane, wrap_angle
from mplearn.maths.yaw_roll_pitch import yaw_roll_pitch_quaternion
from mplearn.recording import BoolArray, FloatArray, IntArray
from mplearn_envs.mechanics.kinematics import MassTree, forward
from mplearn_envs.mechanics.reference import reference_robot
from mplearn_envs.robot import Robot
from mplearn_envs.robot.feet import DOWN_M, LIFT_M

CLEAR_M = 0.015  # a foot on its way clears the ground by this
MOVING_M_S = 0.15  # a foot that still moves over the ground so fast has not landed
_LONGEST_S = 0.4  # for which a foot may skim the ground before it lifts or after it lands
_TILT_RAD = 0.13  # so much the base's tilt may be wrong, which raises a foot that is far away,
_NEAR_M = 0.12  # if it is farther than this from its place beside the other
_SOFT_M = 0.02  # lifts begin and end smoothly: below about this they are made lower


class Lift(NamedTuple):
    """One foot in the air.

    Attributes:
        side: Which foot, 0 left, 1 right.
        start: Frame in which it leaves the ground; -1 if it is up from the beginning.
        end: Frame in which it is down again; the number of frames if it stays up.
    """

    side: int
    start: int
    end: int


class Footwork(NamedTuple):
    """A motion's feet.

    Attributes:
        legs: Angles of the legs' hinges, shape (T, n_legs) [rad].
        rise: Height of each sole's lowest corner above the ground, 0 where it stands, (T, 2) [m];
            how a foot gets there from the ground, and back, is planned (`plan_rise`).
        left_from_right: The left foot in the right one's frame: x, y [m] and yaw [rad], (T, 3).
        lifts: What leaves the ground, in order of time.
        free: Whether a foot that is high follows its leg's motion; otherwise it goes from place to
            place.
    """

    legs: FloatArray
    rise: FloatArray
    left_from_right: FloatArray
    lifts: tuple[Lift, ...]
    free: bool = True

    def up_at(self, end: bool) -> int:
        """Return the side of the foot that is up at the start (or the end); -1 for none."""
        for lift in self.lifts:
            if (lift.end == len(self.rise)) if end else (lift.start < 0):
                return lift.side
        return -1


def read_footwork(robot: Robot, frames: FloatArray, rate_hz: float) -> Footwork:
    """Read the footwork of a motion.

    Args:
        robot: The robot.
        frames: Values of its channels, shape (T, 3 + n) [m, rad].
        rate_hz: Frames per second [1/s].
    """
    ref = reference_robot(robot)
    heights, relative = _feet(ref.tree, ref.stance.feet, ref.corners, np.ascontiguousarray(frames))
    gap = heights - heights.min(axis=1, keepdims=True)
    moving = np.zeros(len(frames))
    if len(frames) > 1:
        moving = np.linalg.norm(np.gradient(relative[:, :2], axis=0), axis=1) * rate_hz
    skims = moving > MOVING_M_S
    longest = round(_LONGEST_S * rate_hz)
    beside = ref.ground[0, :2] - ref.ground[1, :2]
    apart = np.linalg.norm(relative[:, :2] - beside, axis=1)
    sure = gap - _TILT_RAD * np.maximum(apart - _NEAR_M, 0.0)[:, None]
    lifts = _lifts(gap, sure, skims, longest)
    rise = np.zeros_like(gap)
    for side, start, end in lifts:
        inside = slice(max(start, 0), end + 1)
        over = np.maximum(gap[inside, side] - DOWN_M, 0.0)
        rise[inside, side] = over**2 / (over + _SOFT_M) + CLEAR_M
    legs = np.ascontiguousarray(frames[:, 3 + robot.leg_joints])
    return Footwork(legs, rise, relative, tuple(lifts))


def read_flight(robot: Robot, frames: FloatArray) -> float:
    """Return how high both soles are at once, at most, while the base is above its standing height.

    Where it is not, what the features have in the air is the squat of someone who stands [m].

    Args:
        robot: The robot.
        frames: Values of the robot's channels, shape (T, 3 + n) [m, rad].
    """
    high = frames[frames[:, 0] > reference_robot(robot).standing_height + LIFT_M]
    return max(0.0, float(sole_heights(robot, high).min(axis=1).max())) if len(high) else 0.0


def sole_heights(robot: Robot, frames: FloatArray) -> FloatArray:
    """Return the height of each sole's lowest corner along a motion, shape (T, 2) [m].

    Args:
        robot: The robot.
        frames: Values of the robot's channels, shape (T, 3 + n) [m, rad].
    """
    ref = reference_robot(robot)
    return _feet(ref.tree, ref.stance.feet, ref.corners, np.ascontiguousarray(frames))[0]


def _lifts(gap: FloatArray, sure: FloatArray, skims: BoolArray, longest: int) -> list[Lift]:
    """Return when each foot is off the ground, with hysteresis, in order of time.

    Args:
        gap: Heights of the soles over the lower one, shape (T, 2) [m].
        sure: Of these, what is more than an error of the base's tilt, same shape [m].
        skims: Whether a foot moves over the ground, shape (T,).
        longest: Frames for which it may do so before it lifts or after it lands.
    """
    found = []
    n_frames = len(gap)
    for side in range(2):
        off = (gap[:, side] > DOWN_M).astype(np.int8)
        for start, end in np.flatnonzero(np.diff(off, prepend=0, append=0)).reshape(-1, 2).tolist():
            if sure[start:end, side].max() > LIFT_M:
                found.append((start, end, side))
    found.sort()
    out: list[Lift] = []
    for i, (start, end, side) in enumerate(found):
        earliest = max(out[-1].end if out else 0, start - longest)
        latest = min(found[i + 1][0] if i + 1 < len(found) else n_frames, end + longest)
        up_before, up_after = start == 0, end == n_frames
        while start > earliest and skims[start - 1]:
            start -= 1
        while end < latest and skims[end]:
            end += 1
        out.append(
            Lift(side, -1 if up_before else start, n_frames if up_after else min(end, n_frames - 1))
        )
    return out


@njit(cache=True)
def take_posture(q: FloatArray, frame: FloatArray) -> None:
    """Write the posture of a frame into a configuration; where it is and its yaw stay nought.

    Args:
        q: Configuration, shape (7 + J,): position [m], quaternion, joints [rad]; changed.
        frame: Height [m], roll and pitch of the base and joints, shape (3 + J,) [rad].
    """
    q[2] = frame[0]
    q[3], q[4], q[5], q[6] = yaw_roll_pitch_quaternion(0.0, frame[1], frame[2])
    q[7:] = frame[3:]


@njit(cache=True)
def _feet(
    tree: MassTree, feet: IntArray, corners: FloatArray, frames: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Return the soles' heights (T, 2) and where the left foot is, seen from the right (T, 3)."""
    heights, relative = np.full((frames.shape[0], 2), np.inf), np.empty((frames.shape[0], 3))
    q = np.zeros(4 + frames.shape[1])
    for t in range(frames.shape[0]):
        take_posture(q, frames[t])
        pose = forward(tree, q)
        for side in range(2):
            foot = feet[side]
            for corner in range(corners.shape[1]):
                z = pose.position[foot, 2]
                for i in range(3):
                    z += pose.rotation[foot, 2, i] * corners[side, corner, i]
                heights[t, side] = min(heights[t, side], z)
        left, right = pose.rotation[feet[0]], pose.rotation[feet[1]]
        yaw = np.arctan2(right[1, 0], right[0, 0])
        step = pose.position[feet[0]] - pose.position[feet[1]]
        relative[t, 0], relative[t, 1] = turn_in_plane(step[0], step[1], -yaw)
        relative[t, 2] = wrap_angle(np.arctan2(left[1, 0], left[0, 0]) - yaw)
    return heights, relative
