"""How a motion stands: feet wide apart, one before the other, a heel raised.

Features hold no place on the floor, so feet are seen relative to each other. What a robot with
rigid soles cannot do as a person did is shown as nearly as it can: feet less far apart where no
step reaches so far, the trunk farther ahead where ankles do not bend so far, as one squats who has
no chair behind him.
"""

from __future__ import annotations

from itertools import product
from typing import NamedTuple

import numpy as np

from mplearn.maths.compiling import njit
from mplearn.maths.easing import smooth_step
from mplearn.maths.plane import turn_in_plane, wrap_angle
from mplearn.maths.yaw_roll_pitch import roll_pitch_matrix
from mplearn.recording import FloatArray, IntArray
from mplearn_envs.mechanics.heels import raised_foot
from mplearn_envs.mechanics.kinematics import MassTree, forward
from mplearn_envs.mechanics.reference import (
    N_BASE,
    ReferenceRobot,
    reference_robot,
    rest_reference,
    sole_middles,
)
from mplearn_envs.mechanics.velocity_ik import settle
from mplearn_envs.robot import Robot

from .footwork import take_posture
from .stride import left_from_right

OWN_M, OWN_RAD = 0.12, 0.45  # feet so near to their places side by side stand there
HIGHEST_RAD = 1.0  # a heel is raised no farther: a sole on end has no yaw
_FLAT_RAD = (0.15, 0.4)  # soles tilted by less are measured so, and flat; by more, as they are
_STAGGERED_M = 0.25  # heels are raised where the feet are so far from side by side
_LEVEL = 0.8  # cosine of the tilt of a sole whose yaw is known
_REACHED = 1e-3  # [m, rad]
_ITERATIONS, _PARTS = 12, 8
_LEANS, _HEELS = (0.0, 0.2, 0.4), (0.0, 0.4, 0.7, 1.0)  # of who steps there [rad]
_HEEL_M, _LEAN_M = 0.05, 0.1  # as much lower the base may be to spare these [m/rad]
_MORE_HEEL, _MORE_LEAN = (0.0, 0.3, 0.6, 0.9), (0.0, 0.1, 0.2, 0.3, 0.45, 0.6, -0.15, -0.3)  # [rad]
_MORE_HEIGHT = (0.0, 0.05, 0.1, 0.15)  # [m]
_PRICES = np.array([0.3, 1.0, 8.0])  # of the three
_EVERY_S, _SMOOTH_S = 0.08, 0.3


class Stance(NamedTuple):
    """How a motion stands before a foot leaves the ground.

    Attributes:
        place: The left foot in the right one's frame: x, y [m] and yaw [rad], shape (3,).
        heel: By how much each heel is raised, the toes staying where they are, shape (T, 2) [rad].
    """

    place: FloatArray
    heel: FloatArray


class Approach(NamedTuple):
    """How a robot steps into a stance, and out of it: one foot carries, the weight over it.

    Attributes:
        side: Which foot steps, 0 left, 1 right.
        heel: By how much its heel is raised where it lands [rad].
        lean: Pitch of the base [rad].
    """

    side: int
    heel: float
    lean: float

    @property
    def heels(self) -> FloatArray:
        """By how much each heel is raised, shape (2,) [rad]."""
        return np.array([self.heel, 0.0] if self.side == 0 else [0.0, self.heel])


def astray(ref: ReferenceRobot, place: FloatArray) -> tuple[float, float]:
    """Return how far the left foot is from its place beside the right one [m], and turned [rad]."""
    off = place - left_from_right(ref.ground)
    return float(np.hypot(off[0], off[1])), float(abs(wrap_angle(off[2])))


def read_stance(
    robot: Robot, frames: FloatArray, until: int, lifted: tuple[tuple[int, int, int], ...] = ()
) -> Stance:
    """Read how a motion stands.

    Args:
        robot: The robot.
        frames: Values of its channels, shape (T, 3 + n) [m, rad].
        until: Frame before which both feet stand, 1 or more.
        lifted: Side, first frame and last (excluded) in which a foot is in the air.
    """
    ref = reference_robot(robot)
    front, back = _sole_ends(ref.tree, ref.stance.feet, ref.corners, np.ascontiguousarray(frames))
    length = float(np.ptp(ref.corners[0, :, 0]))
    ahead = front - back
    level = np.hypot(ahead[..., 0], ahead[..., 1]) / length
    yaw = np.arctan2(ahead[..., 1], ahead[..., 0])
    turn = np.empty(2)
    for side in range(2):
        known = yaw[:until, side][level[:until, side] > _LEVEL]
        seen = known if len(known) else yaw[:until, side]
        turn[side] = np.arctan2(np.median(np.sin(seen)), np.median(np.cos(seen)))
    toes = np.median(front[:until, :, :2], axis=0)
    edge = ref.corners[:, :2, :2].mean(axis=1)
    ankle = toes - np.stack(turn_in_plane(edge[:, 0], edge[:, 1], turn), axis=-1)
    apart = ankle[0] - ankle[1]
    x, y = turn_in_plane(apart[0], apart[1], -turn[1])
    place = np.array((x, y, wrap_angle(turn[0] - turn[1])))
    heel = np.zeros((len(frames), 2))
    if astray(ref, place)[0] > _STAGGERED_M:
        tilt = np.arcsin(np.clip((back - front)[..., 2] / length, 0.0, 1.0))
        low, high = _FLAT_RAD
        heel = tilt * smooth_step(np.clip((tilt - low) / (high - low), 0.0, 1.0))
        heel = np.minimum(heel, HIGHEST_RAD)
        heel -= heel.min(axis=1, keepdims=True)  # nobody balances on both edges
        for side, first, last in lifted:
            heel[max(first, 0) : last, side] = 0.0
    return Stance(place, heel)


def approaches(robot: Robot, place: FloatArray) -> list[Approach]:
    """Return how a robot may step into a stance, standing still meanwhile, the best way first.

    The foot that lands behind may step with its heel raised, which brings it farther. The best is
    the one that leaves the base highest, for legs then have most to spare.

    Args:
        robot: The robot.
        place: The left foot in the right one's frame, shape (3,).
    """
    ref, tracked = reference_robot(robot), rest_reference(robot).target.copy()
    ahead = _ahead(place)
    behind = int(ahead > 0.0)
    if abs(ahead) > _STAGGERED_M:
        ways = [Approach(behind, heel, lean) for lean in _LEANS for heel in _HEELS]
    else:
        ways = [Approach(side, 0.0, lean) for lean in _LEANS for side in (behind, 1 - behind)]
    found = []
    for way in ways:
        tracked[2] = way.lean
        q, worst = stand(ref, place, way.heels, tracked, float(way.side))
        if worst < _REACHED:
            found.append((float(q[2]) - _HEEL_M * way.heel - _LEAN_M * way.lean, way))
    return [way for _, way in sorted(found, reverse=True)]


def balanced(
    robot: Robot, tracked: FloatArray, rate_hz: float, stance: Stance, until: int
) -> tuple[FloatArray, Stance]:
    """Return a motion's tracked coordinates, and its heels, such that it is balanced, at rest.

    Where ankles do not bend so far that the weight comes over the soles, the heel of the foot
    behind is raised, the trunk leans farther ahead, and where that does not suffice the base stays
    higher. What is reached is not changed.

    Args:
        robot: The robot.
        tracked: Tracked coordinates, shape (T, U) [m, rad].
        rate_hz: Frames per second [1/s].
        stance: How it stands.
        until: Frame before which both feet stand; the others are left as they are.
    """
    ref = reference_robot(robot)
    within = np.clip(tracked, *ref.limits.T)
    ahead = _ahead(stance.place)
    behind = int(ahead > 0.0)
    remedies = _remedies(staggered=abs(ahead) > _STAGGERED_M)
    every = max(1, round(_EVERY_S * rate_hz))
    at = np.unique(np.append(np.arange(0, until, every), until - 1))
    added = np.zeros((len(at), 3))  # heel, lean, height
    guess: FloatArray | None = None
    for i, t in enumerate(at):
        for remedy in remedies:
            frame, heel = within[t].copy(), stance.heel[t].copy()
            heel[behind] = min(heel[behind] + remedy[0], HIGHEST_RAD)
            frame[2] = min(within[t, 2] + remedy[1], ref.limits[2, 1])
            frame[0] = within[t, 0] + remedy[2]
            q, worst = stand(ref, stance.place, heel, frame, 0.5, guess)
            if worst > _REACHED and guess is not None:
                q, worst = stand(ref, stance.place, heel, frame, 0.5)
            if worst < _REACHED:
                added[i], guess = remedy, q
                break
        else:
            return tracked, stance
    if not added.any():
        return tracked, stance
    frames, width = np.arange(len(tracked)), round(_SMOOTH_S * rate_hz)
    more = [_smoothed(np.interp(frames, at, column), width) for column in added.T]
    out, raised = within.copy(), stance.heel.copy()
    raised[:, behind] = np.minimum(raised[:, behind] + more[0], HIGHEST_RAD)
    out[:, 2] += more[1]
    out[:, 0] += more[2]
    return np.clip(out, *ref.limits.T), stance._replace(heel=raised)


def _ahead(place: FloatArray) -> float:
    """Return how far the left foot is before the right one, as both together point [m]."""
    return float(turn_in_plane(place[0], place[1], -0.5 * place[2])[0])


def _remedies(staggered: bool) -> FloatArray:
    """Return what may be added to heel [rad], lean [rad] and height [m], least change first."""
    heels = _MORE_HEEL if staggered else (0.0,)
    found = np.array(list(product(heels, _MORE_LEAN, _MORE_HEIGHT)))
    return found[np.argsort(np.abs(found) @ _PRICES, kind="stable")]


def _smoothed(values: FloatArray, width: int) -> FloatArray:
    """Return smooth values nowhere nearer to zero than these, which have one sign, shape (T,)."""
    half = max(width // 2, 1)
    edged = np.pad(values, 2 * half, mode="edge")
    seen = np.lib.stride_tricks.sliding_window_view(edged, 2 * half + 1)
    highest = np.take_along_axis(seen, np.argmax(np.abs(seen), axis=1)[:, None], axis=1)[:, 0]
    bell = np.hanning(2 * half + 3)[1:-1]
    return np.asarray(np.convolve(highest, bell / bell.sum(), mode="valid"))


def stand(
    ref: ReferenceRobot,
    place: FloatArray,
    heel: FloatArray,
    tracked: FloatArray,
    share: float,
    guess: FloatArray | None = None,
) -> tuple[FloatArray, float]:
    """Return the posture in which a robot stands in a stance, shape (7 + n,), and the error left.

    Args:
        ref: The reference robot.
        place: The left foot in the right one's frame, shape (3,).
        heel: By how much each heel is raised, shape (2,) [rad].
        tracked: Tracked coordinates, shape (U,) [m, rad].
        share: Which share of the weight the left foot carries.
        guess: A posture near it; None comes from standing upright, the feet side by side.
    """
    beside, upright = left_from_right(ref.ground), np.zeros(N_BASE)
    upright[0] = ref.standing_height
    q, worst = ref.rest.copy() if guess is None else guess.copy(), np.inf
    q[7 + ref.upper] = tracked[N_BASE:]
    for part in np.linspace(0.0, 1.0, _PARTS + 1)[1:] if guess is None else (1.0,):
        q, worst = _settle(
            ref,
            beside + part * (place - beside),
            part * heel,
            upright + part * (tracked[:N_BASE] - upright),
            0.5 + part * (share - 0.5),
            q,
        )
    return q, worst


def _settle(
    ref: ReferenceRobot,
    place: FloatArray,
    heel: FloatArray,
    base: FloatArray,
    share: float,
    q: FloatArray,
) -> tuple[FloatArray, float]:
    """Return the posture near another one that has feet, base and weight there; see `stand`."""
    x, y = turn_in_plane(place[0], place[1], -0.5 * place[2])
    ground = 0.5 * np.array([[x, y, place[2]], [-x, -y, -place[2]]])
    fixed = ref.stance
    feet = [
        raised_foot(
            ref.corners[side],
            fixed.foot_rotation[side],
            float(fixed.foot_position[side, 2]),
            ground[side],
            float(heel[side]),
        )
        for side in range(2)
    ]
    middles = sole_middles(ref, ground, heel)
    stance = fixed._replace(
        foot_position=np.array([position for position, _ in feet]),
        foot_rotation=np.array([rotation for _, rotation in feet]),
        cog=share * middles[0] + (1.0 - share) * middles[1],
    )
    height = float(base[0]) + ref.stance_height - ref.standing_height
    upright = roll_pitch_matrix(float(base[1]), float(base[2]))
    q, worst = settle(ref.tree, stance, q, height, upright, 1e-4, _ITERATIONS)
    return q, float(worst)


@njit(cache=True)
def _sole_ends(
    tree: MassTree, feet: IntArray, corners: FloatArray, frames: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Return the middles of the soles' front and back edges along a motion, (T, 2, 3) each [m]."""
    front, back = np.zeros((frames.shape[0], 2, 3)), np.zeros((frames.shape[0], 2, 3))
    q = np.zeros(4 + frames.shape[1])
    for t in range(frames.shape[0]):
        take_posture(q, frames[t])
        pose = forward(tree, q)
        for side in range(2):
            foot = feet[side]
            for corner in range(4):
                out = front if corner < 2 else back
                for i in range(3):
                    out[t, side, i] += 0.5 * pose.position[foot, i]
                    for k in range(3):
                        out[t, side, i] += (
                            0.5 * pose.rotation[foot, i, k] * corners[side, corner, k]
                        )
    return front, back
