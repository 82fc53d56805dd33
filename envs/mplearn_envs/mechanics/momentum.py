"""Momentum of moving postures, and the ground's reaction that follows from its change."""

from __future__ import annotations

import numpy as np

from mplearn.maths.compiling import njit
from mplearn.maths.quaternions import quaternion_product, quaternion_vector
from mplearn.recording import FloatArray, IntArray

from .kinematics import MassTree, forward, turned
from .support import GRAVITY, zero_moment_point


@njit(cache=True, nogil=True)
def momenta(
    tree: MassTree,
    inertia: FloatArray,
    bodies: IntArray,
    points: FloatArray,
    q: FloatArray,
    v: FloatArray,
) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray]:
    """Return COGs and momenta along a motion (as MuJoCo's ``mj_subtreeVel``), and some points.

    Args:
        tree: The robot.
        inertia: Rotational inertia of each body about its centre of mass, in its own frame, shape
            (B, 3, 3) [kg m^2].
        bodies: Bodies whose points are wanted, shape (N,).
        points: The points in their frames, shape (N, P, 3) [m].
        q: Postures, shape (T, 7 + J).
        v: Velocities in the layout of qvel, shape (T, 6 + J).

    Returns:
        The COGs [m], the momenta [N s] and the angular momenta about the COGs [N m s], each of
        shape (T, 3); and where the points are, shape (T, N, P, 3) [m].
    """
    n_times, linkage = q.shape[0], tree.linkage
    n_bodies, n_hinges = len(linkage.parent), len(linkage.axis)
    cog, linear, angular = np.empty((n_times, 3)), np.zeros((n_times, 3)), np.zeros((n_times, 3))
    turning, moving = np.empty((n_bodies, 3)), np.empty((n_bodies, 3))
    there = np.empty((n_times, *points.shape))
    centre, spin, momentum = np.empty(3), np.empty(3), np.empty(3)
    for t in range(n_times):
        pose = forward(tree, q[t])
        cog[t] = pose.moment[0] / pose.carried[0]
        turning[0], moving[0] = turned(pose.rotation[0], v[t, 3:6]), v[t, :3]
        hinge = 0
        for b in range(n_bodies):
            position, turn = pose.position[b], pose.rotation[b]
            if b > 0:
                parent = linkage.parent[b]
                for i in range(3):
                    turning[b, i] = turning[parent, i]
                    moving[b, i] = moving[parent, i]
                _add_cross(turning[parent], position, pose.position[parent], 1.0, moving[b])
            while hinge < n_hinges and linkage.joint_body[hinge] == b:
                rate = v[t, 6 + hinge]
                for i in range(3):
                    turning[b, i] += rate * pose.axis[hinge, i]
                _add_cross(pose.axis[hinge], position, pose.anchor[hinge], rate, moving[b])
                hinge += 1
            for i in range(3):
                centre[i], momentum[i], spin[i] = position[i], moving[b, i], 0.0
                for k in range(3):
                    centre[i] += turn[i, k] * tree.centre[b, k]
                    spin[i] += turn[k, i] * turning[b, k]
            _add_cross(turning[b], centre, position, 1.0, momentum)
            for i in range(3):
                momentum[i] *= tree.mass[b]
                linear[t, i] += momentum[i]
                inside = 0.0  # angular momentum in the body's own frame
                for k in range(3):
                    inside += inertia[b, i, k] * spin[k]
                for k in range(3):
                    angular[t, k] += turn[k, i] * inside
            _add_cross(momentum, cog[t], centre, 1.0, angular[t])
        for n in range(bodies.shape[0]):
            position, turn = pose.position[bodies[n]], pose.rotation[bodies[n]]
            for p in range(points.shape[1]):
                for i in range(3):
                    at = position[i]
                    for k in range(3):
                        at += turn[i, k] * points[n, p, k]
                    there[t, n, p, i] = at
    return cog, linear, angular, there


@njit(cache=True)
def _add_cross(
    a: FloatArray, to: FloatArray, start: FloatArray, factor: float, out: FloatArray
) -> None:
    """Add factor * a x (to - start)."""
    x, y, z = to[0] - start[0], to[1] - start[1], to[2] - start[2]
    out[0] += factor * (a[1] * z - a[2] * y)
    out[1] += factor * (a[2] * x - a[0] * z)
    out[2] += factor * (a[0] * y - a[1] * x)


@njit(cache=True, nogil=True)
def velocities(q: FloatArray, period_s: float) -> FloatArray:
    """Return the velocities of a motion by central differences, in the layout of qvel.

    Args:
        q: Postures, shape (T, 7 + J), T >= 2.
        period_s: Time between them [s].

    Returns:
        Velocities, shape (T, 6 + J); one-sided at both ends.
    """
    n_times = q.shape[0]
    out = np.empty((n_times, q.shape[1] - 1))
    for t in range(n_times):
        before, after = max(t - 1, 0), min(t + 1, n_times - 1)
        span = (after - before) * period_s
        for i in range(3):
            out[t, i] = (q[after, i] - q[before, i]) / span
        earlier = (q[before, 3], -q[before, 4], -q[before, 5], -q[before, 6])
        turn = quaternion_vector(quaternion_product(earlier, q[after, 3:7]))
        for i in range(3):
            out[t, 3 + i] = turn[i] / span
        for i in range(7, q.shape[1]):
            out[t, i - 1] = (q[after, i] - q[before, i]) / span
    return out


def ground_reaction(
    mass: float, cog: FloatArray, linear: FloatArray, angular: FloatArray, period_s: float
) -> FloatArray:
    """Return the zero-moment points that explain how the momentum changed.

    Args:
        mass: Mass of the robot [kg].
        cog: COGs, shape (K + 1, 3) [m].
        linear: Momenta, shape (K + 1, 3) [N s].
        angular: Angular momenta about the COGs, shape (K + 1, 3) [N m s].
        period_s: Time between them [s].

    Returns:
        Mean zero-moment point of each interval, shape (K, 2) [m]; NaN where nothing carries.
    """
    force = np.diff(linear, axis=0) / period_s
    force[:, 2] += mass * GRAVITY
    moment = np.diff(angular, axis=0) / period_s
    return zero_moment_point(force, moment, 0.5 * (cog[1:] + cog[:-1]))
