"""Sizes of the segments and places of the markers, given the postures: linear least squares."""

from __future__ import annotations

import numpy as np

from mplearn.recording import FloatArray, IntArray

from .body import Body
from .human import PROPORTIONS

SIZE_SIGMA = 0.08  # of a segment's length, relative to the person's overall size
PLACE_SIGMA_M = 0.02  # of a marker's place on its segment
MARKER_SIGMA_M = 0.005
NARROWEST, WIDEST = 0.7, 1.4  # bounds on a segment's length relative to the overall size


def fit_sizes(
    body: Body,
    size: float,
    bodies: IntArray,
    template: FloatArray,
    postures: FloatArray,
    frames: FloatArray,
) -> tuple[FloatArray, FloatArray]:
    """Fit the sizes and places that explain the markers best, near what people are like.

    A marker's position is linear in them once the bodies' orientations are known:
    ``base + sum R_parent (offset * factor) + R_body (template * factor + shift)``. Unknown are the
    groups of factors (`PROPORTIONS`, left and right alike, and one for all else), the shifts, and
    the base's position in each frame.

    Args:
        body: The body.
        size: The person's overall size relative to the body.
        bodies: Body of each marker, shape (M,).
        template: Expected place of each marker on the body, shape (M, 3) [m].
        postures: Posture in each frame, shape (K, 7 + n).
        frames: Measured positions, shape (K, M, 3) [m]; NaN where missing.

    Returns:
        Factors on the body's sizes, shape (B, 3), and the markers' places, shape (M, 3) [m].
    """
    tree = body.tree
    groups = _groups(body)
    n_groups, n_markers, n_frames = groups.max() + 1, len(bodies), len(frames)
    n_unknowns = n_groups + 3 * n_markers + 3 * n_frames
    rows, values = [], []
    for k, (q, frame) in enumerate(zip(postures, frames, strict=True)):
        mats = tree.forward(q)[1]
        reach = np.zeros((len(tree.parent), 3, n_groups))  # body origins, per unit of each group
        for b in range(1, len(tree.parent)):
            p = tree.parent[b]
            reach[b] = reach[p] + _per_group(mats[p], size * tree.offset[b], groups[p], n_groups)
        for m in np.flatnonzero(np.isfinite(frame).all(axis=1)):
            b = bodies[m]
            row = np.zeros((3, n_unknowns))
            row[:, :n_groups] = reach[b] + _per_group(
                mats[b], size * template[m], groups[b], n_groups
            )
            row[:, n_groups + 3 * m : n_groups + 3 * m + 3] = mats[b]
            at = n_groups + 3 * n_markers + 3 * k
            row[:, at : at + 3] = np.eye(3)
            rows.append(row)
            values.append(frame[m])
    design = np.concatenate(rows) / MARKER_SIGMA_M
    target = np.concatenate(values) / MARKER_SIGMA_M
    prior_sigma = np.concatenate(
        (np.full(n_groups, SIZE_SIGMA), np.full(3 * n_markers, PLACE_SIGMA_M))
    )
    precision = np.zeros(n_unknowns)
    precision[: len(prior_sigma)] = prior_sigma**-2
    expected = np.zeros(n_unknowns)
    expected[:n_groups] = 1.0
    solution = expected + np.linalg.solve(
        design.T @ design + np.diag(precision), design.T @ (target - design @ expected)
    )
    factors = size * np.clip(solution[:n_groups], NARROWEST, WIDEST)[groups]
    shifts = solution[n_groups : n_groups + 3 * n_markers].reshape(n_markers, 3)
    return factors, template * factors[bodies] + shifts


def _groups(body: Body) -> IntArray:
    """Return the group of each body's size along each axis, shape (B, 3); 0 is all else."""
    groups = np.zeros(body.tree.offset.shape, dtype=np.int64)
    for group, (names, axes) in enumerate(PROPORTIONS.values(), start=1):
        for name in names:
            if name in body.tree.body_names:
                groups[body.tree.body(name), np.flatnonzero(axes)] = group
    return groups


def _per_group(mat: FloatArray, vector: FloatArray, groups: IntArray, n: int) -> FloatArray:
    """Return how a vector (3,) in a body's frame moves with each group's factor, shape (3, n)."""
    out = np.zeros((3, n))
    for axis in range(3):
        out[:, groups[axis]] += mat[:, axis] * vector[axis]
    return out
