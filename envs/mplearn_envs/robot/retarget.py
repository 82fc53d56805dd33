"""Motions of one body on another: by the orientations of the segments that both have.

Joints of the same name mean different things on different robots: axes come in another order and
stand at other angles, and a waist has one hinge or three. What bodies share are segments. So the
robot's hinges are found by the inverse kinematics of `mplearn.body`, frame after frame, between
the joints' limits, such that each segment is turned, from its upright posture, as the source's is
from its own. Lengths do not matter: both bodies are shrunk to a point, and three markers a segment
show where its axes go. A segment that the robot lacks is left out, and those below it make up for
it as far as they can.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from mplearn.body import human_body, posture_of, robot_body
from mplearn.body.inverse_kinematics.gauss_newton import Markers, Moves, Search, solve_frame
from mplearn.body.kinematics.tree import KinematicTree
from mplearn.errors import RobotError
from mplearn.recording import FloatArray, IntArray

from .description import Robot
from .feet import SOLES
from .roles import ROLES

if TYPE_CHECKING:
    from mplearn.body import Body

_REST = 1e-3  # weight of a joint's distance from zero, relative to a segment's orientation
_HOLD = 1e-2  # weight of its distance from the last frame: no leaps past singular postures
_ITERATIONS = 8
_TOLERANCE_RAD = 1e-4


class Retargeting:
    """Turns features of a body into values of a robot's channels.

    Args:
        channels: Names of the features (see `mplearn.body.feature_channels`).
        body: Name of the body they belong to, "robot" or "human"; "" where only the names tell.
        robot: Who shall perform.

    Attributes:
        missing: Segments of the source, by role, that the robot lacks; how they turn is ignored.
        still: Hinges of the robot that move none of the source's segments; they stay at zero.

    Raises:
        RobotError: The features belong to no known body.

    Example:
        >>> from mplearn_envs.robot import humanoid
        >>> robot = humanoid()
        >>> retargeting = Retargeting(robot.channels, "robot", robot)
        >>> retargeting(np.zeros((5, 33))).shape
        (5, 33)
    """

    def __init__(self, channels: Sequence[str], body: str, robot: Robot) -> None:
        self.channels, self.robot = tuple(channels), robot
        self.missing: tuple[str, ...] = ()
        self.still: tuple[str, ...] = ()
        self._same = body in ("", robot.name) and set(robot.channels) <= set(channels)
        if self._same:
            self._columns = [self.channels.index(name) for name in robot.channels]
            return
        self._source = _source(self.channels, body, robot)
        names = (*robot.channels[:3], *self._source.driven_names)
        self._columns = [self.channels.index(name) for name in names]
        own, tree = self._source.tree, KinematicTree.from_model(robot.model())
        bodies = dict(robot.segments)
        roles = [role for role in ROLES if role in own.body_names and role != "pelvis"]
        shared = [role for role in roles if role in bodies]
        self.missing = tuple(role for role in roles if role not in bodies)
        self._from = np.array([own.body(role) for role in shared], dtype=np.int64)
        to = np.array([tree.body(bodies[role]) for role in shared], dtype=np.int64)
        moving = {b for each in to for b in _way_up(tree, int(each))}
        free = np.array([int(b) in moving for b in tree.joint_body], dtype=np.bool_)
        self.still = tuple(n for n, f in zip(tree.joint_names, free, strict=True) if not f)
        self._free = np.concatenate((np.zeros(6, dtype=np.bool_), free))
        zero = np.zeros_like(tree.offset)
        self._point = replace(tree, offset=zero, anchor=np.zeros_like(tree.anchor))
        self._markers = np.repeat(to, 3)
        self._offsets = _turns(tree)[to].reshape(-1, 3)  # the rows: what points along x, y, z
        feet = [shared.index(f"foot_{side}") for side in "lr"]
        self._leg_ratio = _leg_m(tree, to[feet]) / _leg_m(own, self._from[feet])
        self._heights = float(own.offset[0, 2]), standing_height(robot)

    def __call__(self, frames: FloatArray) -> FloatArray:
        """Return values of the robot's channels, shape (T, 3 + n), for features (T, D).

        Raises:
            RobotError: The features have another width, or are not finite.
        """
        frames = np.asarray(frames, dtype=np.float64)
        if frames.ndim != 2 or frames.shape[1] != len(self.channels):
            raise RobotError(
                f"motions to be retargeted have shape (T, {len(self.channels)}), not {frames.shape}"
            )
        if not np.isfinite(frames).all():
            raise RobotError("a motion to be retargeted must be finite")
        own = np.ascontiguousarray(frames[:, self._columns])
        if self._same:
            return own
        base = own[:, :3].copy()
        base[:, 0] = self._heights[1] + self._leg_ratio * (own[:, 0] - self._heights[0])
        return np.hstack((base, self._angles(own)))

    def _angles(self, features: FloatArray) -> FloatArray:
        postures = posture_of(features, body=self._source)
        postures[:, 3:7] = (1.0, 0.0, 0.0, 0.0)  # both bases upright
        rest = _turns(self._source.tree)[self._from]
        linkage, limits = self._point.linkage, self._point.limits
        n, n_markers = len(limits), len(self._markers)
        q = np.concatenate(([0.0, 0.0, 0.0, 1.0], np.zeros(3 + n)))
        rest_weight, residuals = np.full(n, _REST), np.empty(n_markers)
        markers = Markers(self._markers, self._offsets, np.ones(n_markers))
        out = np.empty((len(postures), n))
        for t, posture in enumerate(postures):
            turned = self._source.tree.forward(posture)[1][self._from] @ rest.transpose(0, 2, 1)
            low, high = np.zeros(6 + n), np.zeros(6 + n)
            low[6:], high[6:] = limits[:, 0] - q[7:], limits[:, 1] - q[7:]
            solve_frame(
                q,
                np.full(6 + n, 1.0 / _HOLD),
                np.ascontiguousarray(turned.transpose(0, 2, 1)).reshape(-1, 3),  # the columns
                markers,
                linkage,
                Moves(low, high, self._free, rest_weight),
                Search(np.inf, _ITERATIONS if t else 10 * _ITERATIONS, _TOLERANCE_RAD),
                residuals,
            )
            out[t] = q[7:]
        return out


def standing_height(robot: Robot) -> float:
    """Return the height of the base above the soles with all hinges at zero [m]."""
    import mujoco

    model = robot.model()
    data = mujoco.MjData(model)
    mujoco.mj_kinematics(model, data)
    soles = [model.geom(name).id for name in SOLES]
    return float(data.xpos[1, 2] - (data.geom_xpos[soles, 2] - model.geom_size[soles, 2]).min())


def _source(channels: tuple[str, ...], body: str, robot: Robot) -> Body:
    for candidate in (robot_body(), human_body()):
        known = {*robot.channels[:3], *candidate.driven_names} <= set(channels)
        if known and body in ("", candidate.name):
            return candidate
    raise RobotError(
        f"motions of body {body!r} with channels {channels[:4]}... cannot be retargeted to "
        f"{robot.name!r}; those of 'robot' and 'human' can, in their features"
    )


def _turns(tree: KinematicTree) -> FloatArray:
    """Return the bodies' orientations with all hinges at zero, shape (B, 3, 3)."""
    return tree.forward(np.concatenate(([0.0, 0.0, 0.0, 1.0], np.zeros(tree.n_dofs - 3))))[1]


def _way_up(tree: KinematicTree, body: int) -> list[int]:
    """Return a body and all above it, without the base."""
    found = []
    while body > 0:
        found.append(body)
        body = int(tree.parent[body])
    return found


def _leg_m(tree: KinematicTree, feet: IntArray) -> float:
    """Return the height of the hips above the ankles, upright [m]."""
    places = tree.forward(np.concatenate(([0.0, 0.0, 0.0, 1.0], np.zeros(tree.n_dofs - 3))))[0]
    hips = [_way_up(tree, int(foot))[-1] for foot in feet]
    return float((places[hips, 2] - places[feet, 2]).mean())
