"""Steps from the stance in which a robot is into the one in which a motion begins."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from mplearn.maths.easing import minimum_jerk
from mplearn.maths.plane import turn_in_plane, wrap_angle
from mplearn.recording import FloatArray
from mplearn_envs.lru_cache import LRUCache
from mplearn_envs.mechanics.reference import (
    N_BASE,
    Reference,
    reference_robot,
    rest_reference,
)
from mplearn_envs.robot import Robot

from .footwork import Footwork, Lift
from .plan import Motion, Plan
from .stance import OWN_RAD, Approach, Stance, approaches
from .stride import SAME_PLACE_M, left_from_right

_RATE_HZ, _FRAMES = 100.0, 211  # of a step
_LEAVES, _LANDS = 45, 100  # frames at which its foot leaves the ground, and lands
_RISES = 80  # frames in which the trunk is upright again
_RESTS_S = 1.25  # in which the weight comes to rest between the feet
_FAR_M = 0.3  # feet so far from side by side are brought there before they go elsewhere
_ALIKE_M = 0.2  # stances so near to each other are tried for each other before one steps
_LIFT_M = 0.05
_SHARES = (1.0, 0.9, 0.8, 0.7, 0.6, 0.5, 0.4)  # of the way to where a foot shall land
_DECIMALS, _KNOWN = 3, 256
_EXACT = 1e-5  # feet so near to their places are there [m, rad]


class Restance:
    """Finds steps from one stance into another.

    Args:
        robot: The robot.
        plan: Returns the plan of a step, and whether the robot reaches what is wanted, and stands.
    """

    def __init__(
        self, robot: Robot, plan: Callable[[Reference, Motion], tuple[Plan, bool]]
    ) -> None:
        self.robot = robot
        self._plan = plan
        self._reference = reference_robot(robot)
        self._rest = rest_reference(robot)
        self._beside = left_from_right(self._reference.ground)
        self._ways = LRUCache(_KNOWN)

    def way(self, place: FloatArray) -> Approach | None:
        """Return how the robot steps into a stance, and back; None where it cannot.

        Args:
            place: The left foot in the right one's frame: x, y [m] and yaw [rad], shape (3,).
        """
        place = np.round(place, _DECIMALS) + 0.0
        key = place.tobytes()
        known: tuple[Approach | None] | None = self._ways.get(key)
        if known is None:
            ways = approaches(self.robot, place)
            known = (next((way for way in ways if self._works(place, way)), None),)
            self._ways.put(key, known)
        return known[0]

    def within_reach(self, stance: Stance) -> Stance:
        """Return the stance nearest to one into which the robot can step."""
        half = 0.5 * stance.place[2]
        off = np.array(turn_in_plane(stance.place[0], stance.place[1], -half)) - self._beside[:2]
        for share in _SHARES:
            between = self._beside[:2] + share * off  # as both feet together point
            x, y = turn_in_plane(between[0], between[1], half)
            place = np.array((x, y, stance.place[2]))
            if self.way(place) is not None:
                return stance._replace(place=place)
        return stance._replace(place=self._beside, heel=np.zeros_like(stance.heel))

    def into(self, start: Reference, motion: Motion) -> list[Motion]:
        """Return the motions that bring the robot into the stance of another; none where it is.

        Args:
            start: Where the reference robot is.
            motion: What follows.
        """
        footwork, wanted = motion.footwork, motion.stance
        if wanted is None or (footwork is not None and footwork.up_at(False) >= 0):
            return []
        here = left_from_right(start.ground)
        apart = _apart(here, wanted.place)
        walks = footwork is not None and bool(footwork.lifts)
        if _near(apart) or (walks and apart[0] < _FAR_M):  # who walks need not stand first
            return []
        upper = self._upper(motion)
        out, here = self._gathered(start, upper)
        if not _near(_apart(here, wanted.place)):
            arrives = self.way(wanted.place)
            if arrives is not None:
                out.append(self._step(here, wanted.place, arrives, upper))
        return out

    def alike(self, start: Reference, motion: Motion) -> bool:
        """Return whether the robot stands apart nearly as a motion does.

        One stance of a person is shown a little nearer or farther by the motion into it and by the
        one out of it (`within_reach`); nobody steps together and out again between these.

        Args:
            start: Where the reference robot is.
            motion: What follows.
        """
        if motion.stance is None:
            return False
        here, there = left_from_right(start.ground), motion.stance.place
        far = min(_apart(place, self._beside)[0] for place in (here, there)) > _FAR_M
        off_m, turned = _apart(here, there)
        return far and off_m < _ALIKE_M and turned < OWN_RAD

    def together(self, start: Reference, motion: Motion) -> list[Motion]:
        """Return what helps where a motion cannot begin at once; none where nothing does.

        For one of a foot that is up from the beginning, the feet are brought beside each other. For
        one with a heel raised, the robot stands up first, that heel raised.

        Args:
            start: Where the reference robot is.
            motion: What follows.
        """
        begins_up = -1 if motion.footwork is None else motion.footwork.up_at(False)
        if begins_up < 0 and start.lifted < 0 and motion.stance is not None:
            heel = np.maximum(start.heel, motion.stance.heel[0])
            here = left_from_right(start.ground)
            return [_still(here, heel, self._upper(motion))] if heel.any() else []
        far = _apart(left_from_right(start.ground), self._beside)[0] > _FAR_M
        if begins_up < 0 or start.lifted == begins_up or not far:
            return []
        return self._gathered(start, self._upper(motion))[0]

    def lowered(self, start: Reference) -> Motion:
        """Return the motion that lowers a foot, where it left the ground or beside the other."""
        return _still(self._beside, start.heel, self._rest.target)

    def home(self, start: Reference, side: int) -> list[Motion]:
        """Return the motions after which the robot stands at rest, as it did at first.

        Args:
            start: Where the reference robot is, both feet down.
            side: Which foot is put beside the other at last, 0 left, 1 right.
        """
        upper = self._rest.target
        out, here = self._gathered(start, upper)
        if max(_apart(here, self._beside)) > _EXACT:
            out.append(self._step(here, self._beside, Approach(side, 0.0, 0.0), upper))
        out.append(_still(self._beside, np.zeros(2), upper, _RESTS_S))
        return out

    def _upper(self, motion: Motion) -> FloatArray:
        """Return tracked coordinates of who stands upright, arms as where a motion begins, (U,)."""
        out = np.array(np.clip(motion.frames[0], *self._reference.limits.T))
        out[:N_BASE] = self._rest.target[:N_BASE]
        return out

    def _gathered(self, start: Reference, upper: FloatArray) -> tuple[list[Motion], FloatArray]:
        """Return what makes the robot upright, feet not far apart, and how they stand then."""
        here = left_from_right(start.ground)
        leaves = self.way(here) if _apart(here, self._beside)[0] > _FAR_M else None
        first = leaves or Approach(0, 0.0, 0.0)
        out: list[Motion] = []
        heel = start.heel
        if start.lifted >= 0:  # it is lowered first
            out.append(_still(here, start.heel, upper))
        elif not _upright(start, upper, first.lean):
            heel = first.heels
            out.append(_still(here, heel, _leaning(upper, first.lean)))
        if leaves is None:
            return out, here
        out.append(self._step_back(here, leaves, upper, heel))
        return out, self._beside

    def _works(self, place: FloatArray, way: Approach) -> bool:
        """Return whether the robot can step there from beside, and back."""
        upper = self._rest.target
        plan, sound = self._plan(self._rest, self._step(self._beside, place, way, upper))
        if not sound:
            return False
        back = self._step_back(place, way, upper, plan.end.heel)
        return self._plan(plan.end, back)[1]

    def _step_back(
        self, here: FloatArray, way: Approach, upper: FloatArray, heel: FloatArray
    ) -> Motion:
        """Return the step out of a stance, heels raised as they are until the weight has gone."""
        step = self._step(self._beside, here, way, upper)
        frame = np.arange(_FRAMES)
        passed = minimum_jerk(np.clip((frame - _LEAVES) / (_LANDS - _LEAVES), 0.0, 1.0))[:, None]
        late = minimum_jerk(np.clip(4.0 * frame / _LEAVES - 3.0, 0.0, 1.0))[:, None]
        rises = minimum_jerk(np.clip((frame - _LANDS) / _RISES, 0.0, 1.0))
        frames = step.frames.copy()
        frames[:, 2] = way.lean * (1.0 - rises)
        raised = (heel + late * (way.heels - heel)) * (1.0 - passed)
        assert step.footwork is not None
        footwork = step.footwork._replace(left_from_right=here + (self._beside - here) * passed)
        return step._replace(frames=frames, footwork=footwork, stance=Stance(here, raised))

    def _step(
        self, here: FloatArray, there: FloatArray, way: Approach, upper: FloatArray
    ) -> Motion:
        """Return one step, the trunk leaning and the heel raised where the foot lands."""
        frame = np.arange(_FRAMES)
        passed = minimum_jerk(np.clip((frame - _LEAVES) / (_LANDS - _LEAVES), 0.0, 1.0))
        leans = minimum_jerk(np.clip(frame / _LEAVES, 0.0, 1.0))
        frames = np.tile(upper, (_FRAMES, 1))
        frames[:, 2] = way.lean * leans
        place = here + (there - here) * passed[:, None]
        rise = np.zeros((_FRAMES, 2))
        rise[_LEAVES : _LANDS + 1, way.side] = _LIFT_M
        legs = np.tile(self._rest.swing[:-2], (_FRAMES, 1))
        lifts = (Lift(way.side, _LEAVES, _LANDS),)
        footwork = Footwork(legs, rise, place, lifts, free=False)
        stance = Stance(here, passed[:, None] * way.heels)
        return Motion(frames, _RATE_HZ, footwork, stance=stance)


def _still(
    place: FloatArray, heel: FloatArray, target: FloatArray, lasts_s: float = 1.0 / _RATE_HZ
) -> Motion:
    stance = Stance(place, np.stack((heel, heel)))
    return Motion(np.stack((target, target)), 1.0 / lasts_s, stance=stance)


def _apart(here: FloatArray, there: FloatArray) -> tuple[float, float]:
    off = here - there
    return float(np.hypot(off[0], off[1])), float(abs(wrap_angle(off[2])))


def _near(apart: tuple[float, float]) -> bool:
    return apart[0] < SAME_PLACE_M and apart[1] < OWN_RAD


def _upright(start: Reference, upper: FloatArray, lean: float) -> bool:
    """Return whether the base is where it shall be while a foot steps."""
    off = np.abs(start.target[:N_BASE] - _leaning(upper, lean)[:N_BASE])
    return bool(off.max() < 0.05)


def _leaning(upper: FloatArray, lean: float) -> FloatArray:
    out = upper.copy()
    out[2] = lean
    return out
