"""Balance by steps: which foot goes where, and where the zero-moment point shall be meanwhile.

On both feet the zero-moment point is beyond the divergent component of motion (DCM), so that it
returns between the feet [Englsberger2015]. Where the DCM leaves the soles, a foot steps to where it
will be (`choose_step`), its place corrected until it lands. Then, the weight at rest, the feet step
back beside each other.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from mplearn.maths.compiling import inlined, inner_kernel, kernel
from mplearn.maths.plane import turn_in_plane, wrap_angle
from mplearn.recording import FloatArray
from mplearn_envs.mechanics.reference import ReferenceRobot
from mplearn_envs.mechanics.support import hull_margin

from .body_state import LEFT, NEITHER, RIGHT, BodyState, sole_middle
from .capture import (
    BESIDE,
    DOWN,
    Falling,
    OnItsWay,
    Reach,
    choose_step,
    landing_place,
    nearest_inside,
    support_hull,
    way_round,
)

STANDS, SHIFTS, SWINGS = 0, 1, 2
TOUCHES_M = 0.002  # so low a sole has landed
ASTRAY_M = 0.025  # feet so near to their places beside each other are there
_LEAVES_M = 0.005  # a DCM so near the edge of the soles needs a step
_INSET_M = 0.01  # where the zero-moment point may be
_LIFTS_M = 0.015  # so far inside a sole the DCM must be before the other foot is lifted
_FAR_M = 0.2  # feet so far astray are far apart
_LOST_M = 0.01  # so far outside of it a step back becomes a step that catches
_FIXED_S = 0.04  # before it lands the place is not changed any more
_RESTS_M, _RESTS_S = 0.02, 0.1  # a DCM so near to its goal for so long rests
_STOOD_S = 0.02  # so long a foot stands before the other one steps
_SHIFT_M_S = 0.5  # speed of the goal
_BACK_S = 0.45  # duration of a step back
_LATE_S = 0.15  # a foot that has not landed so late is taken to stand
_INWARDS = 0.25  # where the DCM is to be when a step back lands, from the standing foot
_DOWN_M = 0.004  # a foot aims so far into the floor
_LEAST_S = 0.03
_TURNS_S = 0.04  # in which a foot takes another direction
_TURN_M = 0.2  # a foot that is turned by 1 rad is as astray as one off by this


class StepLaw(NamedTuple):
    """What stepping goes by.

    Attributes:
        period_s: Control period [s].
        gain: How fast the DCM returns [1/s].
        reach: Where feet can land, and how soon.
        hurried: The same where one foot was in the air when the robot was pushed.
        apart: The left foot in the right one's frame, standing: x, y [m] and yaw [rad], shape (3,).
        lift_m: How high a foot is raised [m].
        decides_s: For how long after a foot was raised it may yet take another way [s].
    """

    period_s: float
    gain: float
    reach: Reach
    hurried: Reach
    apart: FloatArray
    lift_m: float
    decides_s: float


STEP = np.dtype(
    [
        ("doing", "i8"),  # `STANDS`, `SHIFTS` (the weight goes to one foot) or `SWINGS`
        ("side", "i8"),  # of the foot that steps
        ("back", "?"),  # whether it steps back, and not to catch
        ("n_steps", "i8"),  # that were taken
        ("way", "i8"),  # on which it goes, see `choose_step`
        ("crosses", "?"),  # whether it may cross the other: it was up when the robot was pushed
        ("hurries", "?"),  # whether any foot was
        ("time_s", "f8"),  # since this began
        ("lasts_s", "f8"),  # the step
        ("rested_s", "f8"),  # for how long the weight has rested
    ]
)


class StepState(NamedTuple):
    """What is remembered from one moment to the next; arrays, changed in place.

    Attributes:
        step: What is going on, shape (1,), of `STEP`.
        place: Where the foot lands: x, y [m] and yaw [rad], shape (3,).
        goal: Where the DCM shall be, on its way, shape (2,) [m].
        foot: Where the foot that steps shall be now: x, y, z [m] and yaw [rad], shape (4,).
        foot_rate: Its velocity, shape (4,).
        foot_change: Its acceleration, shape (4,).
    """

    step: Any
    place: FloatArray
    goal: FloatArray
    foot: FloatArray
    foot_rate: FloatArray
    foot_change: FloatArray


def new_step_state() -> StepState:
    """Return what is remembered at first: nothing."""
    return StepState(np.zeros(1, STEP), *(np.zeros(n) for n in (3, 2, 4, 4, 4)))


@kernel
def swinging(stepping: StepState) -> int:
    """Return the side of the foot that is on its way, -1 for none."""
    s = stepping.step[0]
    return int(s.side) if s.doing == SWINGS else -1


@inlined
def begin_stepping(
    law: StepLaw, robot: ReferenceRobot, stepping: StepState, now: BodyState, up: int
) -> None:
    """Start to balance by steps.

    Args:
        law: What stepping goes by.
        robot: The reference robot.
        stepping: What is remembered; forgotten.
        now: The moment.
        up: Side of the foot that is in the air, -1 for none.
    """
    s = stepping.step[0]
    s.doing, s.side, s.back, s.n_steps, s.way = STANDS, LEFT, False, 0, BESIDE
    s.crosses, s.hurries, s.time_s, s.lasts_s, s.rested_s = False, False, 0.0, 0.0, 0.0
    for part in (
        stepping.place,
        stepping.goal,
        stepping.foot,
        stepping.foot_rate,
    ):
        part[:] = 0.0
    stepping.goal[:] = now.dcm
    if up >= 0:
        high_m = max(now.soles[up, :, 2].min() - now.floor, 0.0)
        foot = OnItsWay(0.0, up >= 0, high_m, -now.foot_rate[up, 2])
        step = choose_step(_falling(robot, now), law.hurried, up, foot)
        _lift(robot, stepping, now, up, step.time_s, step.place)
        s.way, s.crosses, s.hurries = step.way, True, True


@kernel
def settled(law: StepLaw, stepping: StepState, feet: FloatArray, for_s: float) -> bool:
    """Return whether both feet stand beside each other and the weight has rested between them.

    Args:
        law: What stepping goes by.
        stepping: What is remembered.
        feet: Where the feet are: x, y [m] and yaw [rad], shape (2, 3).
        for_s: How long the weight must have rested [s].
    """
    s = stepping.step[0]
    rests = s.doing == STANDS and s.rested_s >= for_s
    return bool(rests and _astray(law, feet) < ASTRAY_M)


@inlined
def plan_step(
    law: StepLaw, robot: ReferenceRobot, stepping: StepState, now: BodyState
) -> tuple[float, float]:
    """Think on by one control period; return where the zero-moment point shall be [m].

    Args:
        law: What stepping goes by.
        robot: The reference robot.
        stepping: What is remembered.
        now: The moment.
    """
    s = stepping.step[0]
    s.time_s += law.period_s
    if s.doing == SWINGS:
        side, left = s.side, s.lasts_s - s.time_s
        low = now.soles[side, :, 2].min() - now.floor
        if (s.time_s > 0.6 * s.lasts_s and low < TOUCHES_M) or left < -_LATE_S:
            s.doing, s.time_s, s.rested_s = STANDS, 0.0, 0.0
            stepping.goal[:] = now.dcm
    if s.doing != SWINGS:
        hull = support_hull(robot.corners, now.feet, NEITHER, 0.0)
        landed = s.n_steps == 0 or s.doing == SHIFTS
        landed = landed or s.hurries or s.time_s > _STOOD_S
        if landed and hull_margin(hull, now.dcm[0], now.dcm[1]) < _LEAVES_M:
            reach = _reach_of(law, stepping)
            foot = OnItsWay(0.0, s.crosses, 0.0, 0.0)
            step = choose_step(_falling(robot, now), reach, NEITHER, foot)
            _lift(robot, stepping, now, step.side, step.time_s, step.place)
            s.way = step.way
    if s.doing != SWINGS:
        side = _goes_back(law, stepping, now)
        if side >= 0:
            over = support_hull(robot.corners, now.feet, side, _LIFTS_M)
            if hull_margin(over, now.dcm[0], now.dcm[1]) > 0.0:
                _lift(robot, stepping, now, side, _BACK_S, _beside(law, now.feet, side))
                s.back, s.way = True, BESIDE  # back
    if s.doing == SWINGS:
        return _on_one_foot(law, robot, stepping, now)
    return _on_both_feet(law, robot, stepping, now)


@inner_kernel
def _falling(robot: ReferenceRobot, now: BodyState) -> Falling:
    """Return how the robot stands."""
    return Falling(robot.corners, now.feet, now.dcm, now.rate)


@inner_kernel
def _reach_of(law: StepLaw, stepping: StepState) -> Reach:
    """Return where feet can land, and how soon."""
    return law.hurried if stepping.step[0].hurries else law.reach


@inner_kernel
def _goes_back(law: StepLaw, stepping: StepState, now: BodyState) -> int:
    """Return the side of the foot that steps back once the weight is over the other, -1 for none.

    After a step that caught, far aside, of who hurries, the other foot follows without rest.
    """
    s = stepping.step[0]
    if s.doing == SHIFTS:
        return int(s.side)
    caught = s.hurries and not s.back
    if caught and s.time_s > _STOOD_S and _astray(law, now.feet) > _FAR_M:
        return 1 - int(s.side)
    return -1


@inner_kernel
def _lift(
    robot: ReferenceRobot,
    stepping: StepState,
    now: BodyState,
    side: int,
    time_s: float,
    place: FloatArray,
) -> None:
    """Begin a step, one to catch."""
    s = stepping.step[0]
    s.doing, s.side, s.back = SWINGS, side, False
    s.n_steps += 1
    s.crosses = False
    s.time_s, s.lasts_s = 0.0, time_s
    stepping.place[:] = place
    stepping.foot[:3], stepping.foot[3] = (
        now.pose.position[robot.stance.feet[side]],
        now.feet[side, 2],
    )
    stepping.foot_rate[:3], stepping.foot_rate[3] = now.foot_rate[side, :3], now.foot_rate[side, 5]


@inlined
def _on_one_foot(
    law: StepLaw, robot: ReferenceRobot, stepping: StepState, now: BodyState
) -> tuple[float, float]:
    """Move the foot on; return where in the standing sole the zero-moment point shall be."""
    s = stepping.step[0]
    side = s.side
    left = max(s.lasts_s - s.time_s, 0.0)
    sole = support_hull(robot.corners, now.feet, side, 0.5 * _INSET_M)
    if s.back and hull_margin(sole, now.dcm[0], now.dcm[1]) < -_LOST_M:
        s.back = False
    if not s.back:
        if s.time_s < law.decides_s:
            high_m = stepping.foot[2] - now.floor - robot.stance.foot_position[side, 2]
            foot = OnItsWay(s.time_s, s.crosses, max(high_m, 0.0), -stepping.foot_rate[2])
            step = choose_step(_falling(robot, now), _reach_of(law, stepping), side, foot)
            s.lasts_s = s.time_s + step.time_s
            s.way, stepping.place[:] = step.way, step.place
        elif left > _FIXED_S:
            reach = _reach_of(law, stepping)
            stepping.place[:], _ = landing_place(_falling(robot, now), side, left, reach, s.way)
        x, y = now.dcm
    else:
        stepping.place[:] = _beside(law, now.feet, side)
        landing = now.feet.copy()
        landing[side] = stepping.place
        here_x, here_y = sole_middle(robot, now.feet, 1 - side)
        there_x, there_y = sole_middle(robot, landing, side)
        growth = np.exp(now.rate * max(left, 0.1))
        wanted_x = (1.0 - _INWARDS) * here_x + _INWARDS * there_x
        wanted_y = (1.0 - _INWARDS) * here_y + _INWARDS * there_y
        x = (wanted_x - growth * now.dcm[0]) / (1.0 - growth)
        y = (wanted_y - growth * now.dcm[1]) / (1.0 - growth)
    _swing(law, robot, stepping, now.floor, now.feet[1 - side])
    return nearest_inside(sole, x, y)


@inlined
def _on_both_feet(
    law: StepLaw, robot: ReferenceRobot, stepping: StepState, now: BodyState
) -> tuple[float, float]:
    """Bring the weight between the feet or over one; return the wanted zero-moment point."""
    s = stepping.step[0]
    left_x, left_y = sole_middle(robot, now.feet, LEFT)
    right_x, right_y = sole_middle(robot, now.feet, RIGHT)
    share = 0.5
    if s.doing == SHIFTS:
        share = 0.0 if s.side == LEFT else 1.0
    x = share * left_x + (1.0 - share) * right_x
    y = share * left_y + (1.0 - share) * right_y
    dx, dy = x - stepping.goal[0], y - stepping.goal[1]
    far = np.hypot(dx, dy)
    if far > 0.0:
        go = min(_SHIFT_M_S * law.period_s, far) / far
        stepping.goal[0] += go * dx
        stepping.goal[1] += go * dy
    near = np.hypot(now.dcm[0] - x, now.dcm[1] - y) < _RESTS_M
    s.rested_s = s.rested_s + law.period_s if near else 0.0
    if s.doing == STANDS and s.rested_s > _RESTS_S and _astray(law, now.feet) > ASTRAY_M:
        s.doing, s.time_s, s.rested_s = SHIFTS, 0.0, 0.0
        if not s.back:  # after a step that caught, the other foot follows
            s.side = 1 - s.side
    hull = support_hull(robot.corners, now.feet, NEITHER, _INSET_M)
    strong = 1.0 + law.gain / now.rate
    return nearest_inside(
        hull,
        stepping.goal[0] + strong * (now.dcm[0] - stepping.goal[0]),
        stepping.goal[1] + strong * (now.dcm[1] - stepping.goal[1]),
    )


@inlined
def _astray(law: StepLaw, feet: FloatArray) -> float:
    """Return how far the left foot is from its place beside the right one [m]."""
    x, y = turn_in_plane(feet[0, 0] - feet[1, 0], feet[0, 1] - feet[1, 1], -feet[1, 2])
    turn = wrap_angle(feet[0, 2] - feet[1, 2] - law.apart[2])
    return float(np.hypot(x - law.apart[0], y - law.apart[1]) + _TURN_M * abs(turn))


@inner_kernel
def _beside(law: StepLaw, feet: FloatArray, side: int) -> FloatArray:
    """Return a foot's place beside the other: x, y [m] and yaw [rad], shape (3,)."""
    x, y, turn = law.apart
    if side == 1:
        x, y = turn_in_plane(-x, -y, -turn)
        turn = -turn
    other = feet[1 - side]
    dx, dy = turn_in_plane(x, y, other[2])
    return np.array([other[0] + dx, other[1] + dy, other[2] + turn])


@inlined
def _swing(
    law: StepLaw, robot: ReferenceRobot, stepping: StepState, floor: float, stands: FloatArray
) -> None:
    """Move the foot that steps on its way: up, round the other foot, and down to its place."""
    s = stepping.step[0]
    h = law.period_s
    left = max(s.lasts_s - s.time_s, _FIXED_S)
    at, rate, change = stepping.foot, stepping.foot_rate, stepping.foot_change
    via_x, via_y, far = way_round(stands, at, stepping.place, law.reach)
    for i in range(2):
        via = via_x if i == 0 else via_y
        if via_x == stepping.place[0] and via_y == stepping.place[1]:
            change[i] = _towards(at[i], rate[i], via, max(left - 0.02, _LEAST_S))
        else:
            near = np.hypot(via_x - at[0], via_y - at[1]) + 1e-9
            speed = min(far / max(left - 0.02, _LEAST_S), 1.5 * law.reach.fastest)
            change[i] = (speed * (via - at[i]) / near - rate[i]) / _TURNS_S
    half = 0.45 * s.lasts_s
    height = floor + robot.stance.foot_position[s.side, 2]
    rises = s.time_s < half and s.way != DOWN
    rises = rises and at[2] < height + law.lift_m  # a raised foot comes down
    height += law.lift_m if rises else -_DOWN_M
    until = max(half - s.time_s if rises else left, _FIXED_S)
    change[2] = _towards(at[2], rate[2], height, until)
    change[3] = _towards(0.0, rate[3], wrap_angle(stepping.place[2] - at[3]), left)
    rate += h * change
    at += h * rate


@inlined
def _towards(x: float, rate: float, goal: float, left: float) -> float:
    """Return the acceleration with which a cubic comes to rest at a goal in the time left."""
    return 6.0 * (goal - x) / (left * left) - 4.0 * rate / left
