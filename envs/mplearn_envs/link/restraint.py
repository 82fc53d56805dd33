"""How much of a stranger's posture is followed: as fast and as far as the robot keeps standing."""

from __future__ import annotations

from collections import deque

import numpy as np

from mplearn.maths.yaw_roll_pitch import roll_pitch_matrix
from mplearn.recording import FloatArray
from mplearn_envs.mechanics import reference_robot, rest_reference
from mplearn_envs.mechanics.balanced_momentum import balanced_momentum
from mplearn_envs.mechanics.reference import N_BASE, soles
from mplearn_envs.mechanics.servos import Bounds, approach
from mplearn_envs.mechanics.support import GRAVITY
from mplearn_envs.mechanics.velocity_ik import settle
from mplearn_envs.robot import Robot

VELOCITY_SHARE = 0.6  # of the robot's velocity limits that is followed
RISE_S = 0.1  # in which a tracked coordinate may reach its velocity limit
BRAKE_S = 0.3  # in which all of it together must be able to come to rest
_SMOOTHING_S = 0.02  # over which the limited motion is averaged: no jerks
_ZMP_SHARE = 0.3  # of the way to the soles' edge that the zero-moment point may go
_TWIST_SHARE = 0.15  # of the soles' size: moment about the vertical per weight that friction takes
_LIFT_SHARE = 0.3  # of the weight that may be added or taken away
_LEG_SHARE = 0.8  # of their velocity limits that the legs may need
_WAY = (1 / 3, 2 / 3, 1.0)  # where on the way to rest the posture must balance, too
_LEAP = 0.2  # most that a leg's angle may differ from one of these to the next [rad]
_KNEE_SHARE = 0.5  # of the guard against straight knees that must be left
_MISS = 3e-4  # how far feet, COG and base may miss in a posture that balances [m, rad]
_NEAR = 1e-4  # how near one tries to come: at a straight knee 1 mm is 0.1 rad
_ITERATIONS = 10
_SHARE_A_SECOND = 2.0  # how fast what is followed of a posture may grow back


class Restraint:
    """Follows wanted postures no faster than the limits allow, no farther than the robot balances.

    What throws a robot is the change of its momentum: it moves the zero-moment point, twists the
    feet and takes the weight off them. So each period the velocities change by no more than such
    that this stays within bounds, all in the same proportion, and they are never so large that
    braking within the same bounds would take longer than `BRAKE_S`.

    The next posture, the one in which it could come to rest from there, and what lies between must
    be some that the legs balance, the knees bent, each found from the one before: legs that balance
    the end alone can be others than those that get there. First it moves towards what is wanted;
    where that fails, with the base going back towards standing while the arms go on; where that
    fails, it brakes, towards the last posture of rest that was found.

    Args:
        robot: The robot.
        period_s: Control period [s].

    Attributes:
        fastest: Velocity limits of the tracked coordinates, shape (U,) [m/s, rad/s].
        strongest: Acceleration limits, shape (U,) [m/s^2, rad/s^2].
        bounds: Largest change of the angular momentum about the COG [N m] and of the vertical
            momentum [N], shape (4,).
        share: Which share of the wanted base's way from standing is followed, in [0, 1].
    """

    def __init__(self, robot: Robot, period_s: float) -> None:
        self._robot = reference_robot(robot)
        self.period_s = period_s
        self.fastest = VELOCITY_SHARE * self._robot.velocity
        self.strongest = self._robot.velocity / RISE_S
        self.bounds = _bounds(robot)
        self.share = 1.0
        self._q = self._robot.rest
        legs = robot.leg_joints
        self._leg_step = _LEG_SHARE * robot.per_joint("velocity")[legs] * period_s
        self._knees = np.array([7 + robot.joint_names.index(name) for name in robot.knees])
        self._least_knee = _KNEE_SHARE * robot.guard_knee_rad
        self._rest = rest_reference(robot).target
        self._wanted: FloatArray | None = self._rest
        self._stop = self._here = self._rest
        self._velocity = np.zeros_like(self._rest)
        self._momentum = np.zeros(4)
        self._brake_s = 0.0
        self._recent = deque([self._rest], maxlen=max(1, round(_SMOOTHING_S / period_s)))

    @property
    def position(self) -> FloatArray:
        """Where the limited motion is before it is averaged, shape (U,) [m, rad]."""
        return self._here

    @property
    def velocity(self) -> FloatArray:
        """Its velocity, shape (U,) [m/s, rad/s]."""
        return self._velocity

    @property
    def stop(self) -> FloatArray:
        """Where it comes to rest if it brakes now, shape (U,) [m, rad]."""
        return self._stop

    def update(self, wanted: FloatArray) -> FloatArray:
        """Return what to do instead of a wanted posture, one period on; both of shape (U,)."""
        wanted = self._part(wanted, self.share)
        before = wanted if self._wanted is None else self._wanted
        rate = (wanted - before) / self.period_s
        self._wanted = wanted
        free = self._move(wanted, rate)
        change = _SHARE_A_SECOND * self.period_s
        self.share = min(1.0, self.share + change) if free else max(0.0, self.share - change)
        if not free and not self._move(self._part(wanted, 0.0), np.zeros_like(rate)):
            self._brake()
        return self._averaged()

    def brake(self) -> FloatArray:
        """Brake for a period, all in proportion, towards `stop`; return what to do, shape (U,)."""
        self._wanted = None
        self._brake()
        return self._averaged()

    def _averaged(self) -> FloatArray:
        self._recent.append(self._here)
        return np.asarray(np.mean(self._recent, axis=0))

    def _brake(self) -> None:
        left = max(0.0, 1.0 - self.period_s / max(self._brake_s, self.period_s))
        self._here = self._stop - left * left * (self._stop - self._here)
        self._velocity = left * self._velocity
        self._momentum = left * self._momentum
        self._brake_s = left * self._brake_s
        self._q, _ = self._settled(self._here, self._q)

    def _move(self, wanted: FloatArray, rate: FloatArray) -> bool:
        """Move one period towards a posture, if the robot can come to rest balanced from there."""
        velocity, momentum = self._allowed(self._wish(wanted, rate))
        here = self._here + self.period_s * velocity
        brake_s = self._braking(velocity, momentum)
        stop = here + 0.5 * brake_s * velocity
        if (stop != np.clip(stop, *self._robot.limits.T)).any():
            return False
        q = self._balanced(here, self._q, self._leg_step)
        if q is None or not self._can_rest(q, here, stop):
            return False
        self._q = q
        self._here, self._velocity, self._momentum = here, velocity, momentum
        self._stop, self._brake_s = stop, brake_s
        return True

    def _wish(self, wanted: FloatArray, rate: FloatArray) -> FloatArray:
        """Return the velocity within each coordinate's own limits that leads to a posture."""
        bounds = Bounds(self._robot.limits, self.fastest, self.strongest)
        _, velocity = approach(
            wanted, rate, self._here, self._velocity, bounds, self.period_s, self._brake_s
        )
        return velocity

    def _allowed(self, wish: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return as much of a wished velocity as the momentum's bounds allow, and its momentum."""
        now, wished = self._momentum_of(self._velocity), self._momentum_of(wish)
        longest = float(np.max(np.abs(wished) / self.bounds))
        if longest > BRAKE_S:
            wish, wished = wish * (BRAKE_S / longest), wished * (BRAKE_S / longest)
        most = self.bounds * self.period_s
        turned = now - self._momentum  # by the posture's change alone
        change = wished - now
        with np.errstate(divide="ignore", invalid="ignore"):
            room = np.where(change == 0.0, 1.0, (np.sign(change) * most - turned) / change)
        share = float(np.clip(room.min(), 0.0, 1.0))
        return self._velocity + share * (wish - self._velocity), now + share * change

    def _momentum_of(self, velocity: FloatArray) -> FloatArray:
        robot = self._robot
        roll = float(self._here[1])
        return np.asarray(
            balanced_momentum(
                robot.tree, robot.inertia, robot.stance, robot.upper, self._q, roll, velocity
            )
        )

    def _braking(self, velocity: FloatArray, momentum: FloatArray) -> float:
        """Return how long it takes to come to rest within all bounds [s]."""
        each = np.max(np.abs(velocity) / self.strongest)
        return float(max(each, np.max(np.abs(momentum) / self.bounds)))

    def _part(self, wanted: FloatArray, share: float) -> FloatArray:
        out = wanted.copy()
        out[:N_BASE] = self._rest[:N_BASE] + share * (wanted - self._rest)[:N_BASE]
        return out

    def _can_rest(self, q: FloatArray, here: FloatArray, stop: FloatArray) -> bool:
        """Return whether legs that balance ``here`` do so on the whole way to ``stop``."""
        on_way: FloatArray | None = q
        for share in _WAY:
            if on_way is not None:
                on_way = self._balanced(here + share * (stop - here), on_way, _LEAP)
        return on_way is not None

    def _balanced(
        self, target: FloatArray, near: FloatArray, step: FloatArray | float
    ) -> FloatArray | None:
        """Look for legs that balance a posture, no farther from others than a step."""
        q, miss = self._settled(target, near)
        moved = np.abs(q - near)[7 + self._robot.stance.leg_joints]
        knees = q[self._knees]
        straighter = (knees < self._least_knee) & (knees <= near[self._knees])
        return None if miss > _MISS or straighter.any() or (moved > step).any() else q

    def _settled(self, target: FloatArray, near: FloatArray) -> tuple[FloatArray, float]:
        robot = self._robot
        height = float(target[0]) + robot.stance_height - robot.standing_height
        turn = roll_pitch_matrix(target[1], target[2])
        q = near.copy()
        q[7 + robot.upper] = target[N_BASE:]
        q, miss = settle(robot.tree, robot.stance, q, height, turn, _NEAR, _ITERATIONS)
        return q, float(miss)


def _bounds(robot: Robot) -> FloatArray:
    """Return the bounds of a robot that stands; see `Restraint.bounds`."""
    reference = reference_robot(robot)
    weight = GRAVITY * float(reference.tree.mass.sum())
    corners = soles(robot, reference.rest)[..., :2].reshape(-1, 2) - reference.stance.cog
    ahead, aside = np.minimum(corners.max(axis=0), -corners.min(axis=0))
    size = float(np.linalg.norm(corners, axis=1).mean())
    return weight * np.array(
        [_ZMP_SHARE * aside, _ZMP_SHARE * ahead, _TWIST_SHARE * size, _LIFT_SHARE]
    )
