"""Sizes of the segments and places of the markers, given the postures: linear least squares."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from mplearn.recording import FloatArray, IntArray

from ...maths.compiling import njit
from ...maths.solvers import cholesky, cholesky_solve
from ..kinematics.tree import KinematicTree
from ..models.human import PROPORTIONS

MARKER_SIGMA_M = 0.005
SHORTEST_M = 0.03  # a link shorter than this along an axis says nothing about its body's size
NARROWEST, WIDEST = 0.7, 1.4  # bounds on a segment's length relative to the overall size


class Expected(NamedTuple):
    """What a person's body and markers are expected to be like.

    Attributes:
        size: Size of each body relative to the tree's, shape (B, 3).
        size_sigma: Standard deviation of a segment's size, relative to what is expected.
        bodies: Body of each marker, shape (M,).
        template: Place of each marker on the body of the tree's size, shape (M, 3) [m].
    """

    size: FloatArray
    size_sigma: float
    bodies: IntArray
    template: FloatArray

    @property
    def offsets(self) -> FloatArray:
        """Place of each marker on the body of that size, shape (M, 3) [m]."""
        return np.asarray(self.template * self.size[self.bodies])


class _Links(NamedTuple):
    parent: IntArray  # (B,)
    offset: FloatArray  # (B, 3) [m]
    groups: IntArray  # (B, 3)


class _Equations(NamedTuple):
    normal: FloatArray  # (U, U)
    gradient: FloatArray  # (U,)


def fit_sizes(
    tree: KinematicTree,
    expected: Expected,
    postures: FloatArray,
    frames: FloatArray,
    place_sigma_m: FloatArray,
) -> tuple[FloatArray, FloatArray]:
    """Fit the sizes and places that explain the markers best, near what people are like.

    A marker's position is linear in them once the bodies' orientations are known:
    ``base + sum R_parent (offset * factor) + R_body (template * factor + shift)``. Unknown are the
    groups of factors (`PROPORTIONS`, left and right alike, and one for all else), the shifts, and
    the base's position in each frame.

    Args:
        tree: The body, in its own size.
        expected: What sizes and places are expected.
        postures: Posture in each frame, shape (K, 7 + n).
        frames: Measured positions, shape (K, M, 3) [m]; NaN where missing.
        place_sigma_m: Standard deviation of each marker's place on its segment, shape (M,) [m].

    Returns:
        Factors on the body's sizes, shape (B, 3), and the markers' places, shape (M, 3) [m].
    """
    groups = _groups(tree)
    n_groups, n_markers, n_frames = int(groups.max()) + 1, len(expected.bodies), len(frames)
    n_unknowns = n_groups + 3 * n_markers + 3 * n_frames
    first = np.zeros(n_unknowns)
    first[:n_groups] = 1.0
    normal, gradient = np.zeros((n_unknowns, n_unknowns)), np.zeros(n_unknowns)
    normal[range(n_groups), range(n_groups)] = (expected.size_sigma / MARKER_SIGMA_M) ** -2.0
    shifted = range(n_groups, n_groups + 3 * n_markers)
    normal[shifted, shifted] = np.repeat(place_sigma_m / MARKER_SIGMA_M, 3) ** -2.0
    mats = np.array([tree.forward(q)[1] for q in postures])
    links = _Links(tree.linkage.parent, tree.linkage.offset, groups)
    _add_markers(mats, links, expected, frames, _Equations(normal, gradient))
    cholesky(normal)  # LAPACK's depends on the number of threads, which spin afterwards
    cholesky_solve(normal, gradient)
    solution = first + gradient
    factors = expected.size * np.clip(solution[:n_groups], NARROWEST, WIDEST)[groups]
    shifts = solution[n_groups : n_groups + 3 * n_markers].reshape(n_markers, 3)
    return factors, expected.template * factors[expected.bodies] + shifts


def match_sizes(tree: KinematicTree, person: KinematicTree) -> FloatArray:
    """Return the factors, shape (B, 3), that give a tree's links the lengths of a person's.

    Bodies are matched by name. What has no length to match (the hands, an axis along which nothing
    hangs) takes the ratio of the hips' heights.
    """
    origins = _origins(person)
    factors = np.full_like(tree.offset, person.offset[0, 2] / tree.offset[0, 2])
    longest = np.full_like(tree.offset, SHORTEST_M)
    for child, name in enumerate(tree.body_names):
        parent = tree.parent[child]
        if parent < 0 or name not in person.body_names:
            continue
        above = tree.body_names[parent]
        if above not in person.body_names:
            continue
        length = np.abs(tree.offset[child])
        wanted = np.abs(origins[person.body(name)] - origins[person.body(above)])
        for axis in np.flatnonzero((length > longest[parent]) & (wanted > SHORTEST_M)):
            factors[parent, axis] = wanted[axis] / length[axis]
            longest[parent, axis] = length[axis]
    return factors


def _origins(tree: KinematicTree) -> FloatArray:
    """Return the bodies' origins in the upright posture, shape (B, 3) [m]."""
    return tree.forward(tree.rest)[0]


def _groups(tree: KinematicTree) -> IntArray:
    """Return the group of each body's size along each axis, shape (B, 3); 0 is all else."""
    groups = np.zeros(tree.offset.shape, dtype=np.int64)
    for group, (names, axes) in enumerate(PROPORTIONS.values(), start=1):
        for name in names:
            if name in tree.body_names:
                groups[tree.body(name), np.flatnonzero(axes)] = group
    return groups


@njit(cache=True)
def _add_markers(
    mats: FloatArray, links: _Links, expected: Expected, frames: FloatArray, equations: _Equations
) -> None:
    """Add what the seen markers say, linearised at factors of one, to the normal equations."""
    parent, offset, groups = links.parent, links.offset, links.groups
    size, bodies, template = expected.size, expected.bodies, expected.template
    normal, gradient = equations.normal, equations.gradient
    n_groups, n_markers = groups.max() + 1, len(bodies)
    reach = np.zeros((len(parent), 3, n_groups))  # body origins, per unit of each group
    block, unknowns = np.zeros((3, n_groups + 6)), np.arange(n_groups + 6)
    for k in range(len(frames)):
        for b in range(1, len(parent)):
            p = parent[b]
            reach[b] = reach[p]
            for i in range(3):
                for axis in range(3):
                    reach[b, i, groups[p, axis]] += (
                        mats[k, p, i, axis] * size[p, axis] * offset[b, axis]
                    )
        for m in range(n_markers):
            if np.isnan(frames[k, m]).any():
                continue
            b = bodies[m]
            block[:] = 0.0
            for i in range(3):
                block[i, n_groups + 3 + i] = 1.0
                unknowns[n_groups + i] = n_groups + 3 * m + i
                unknowns[n_groups + 3 + i] = n_groups + 3 * (n_markers + k) + i
                block[i, :n_groups] = reach[b, i]
                for axis in range(3):
                    block[i, n_groups + axis] = mats[k, b, i, axis]
                    block[i, groups[b, axis]] += (
                        mats[k, b, i, axis] * size[b, axis] * template[m, axis]
                    )
            for i in range(3):
                error = frames[k, m, i] - block[i, :n_groups].sum()
                for u in range(len(unknowns)):
                    gradient[unknowns[u]] += block[i, u] * error
                    for v in range(len(unknowns)):
                        normal[unknowns[u], unknowns[v]] += block[i, u] * block[i, v]
