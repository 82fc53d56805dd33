"""The rigid motion that carries points onto others with the least squared distance."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ..recording import FloatArray
from .rotation_kernels import nearest_rotation


class RigidFit(NamedTuple):
    """A rotation, then a translation: ``x -> R x + t``.

    Attributes:
        rotation: Shape (3, 3).
        translation: Shape (3,), in the points' unit.
    """

    rotation: FloatArray
    translation: FloatArray

    def apply(self, points: FloatArray) -> FloatArray:
        """Return points moved, shape (..., 3)."""
        return np.asarray(points @ self.rotation.T + self.translation)


class SimilarityFit(NamedTuple):
    """A rotation, a size and a translation: ``x -> size R x + t``.

    Attributes:
        rotation: Shape (3, 3).
        size: Length after per length before.
        translation: Shape (3,), in the points' unit.
        mirrored: How much better a reflection fits, as a share of the points' spread; 0 where the
            rotation fits better.
    """

    rotation: FloatArray
    size: float
    translation: FloatArray
    mirrored: float

    def apply(self, points: FloatArray) -> FloatArray:
        """Return points moved, shape (..., 3)."""
        return np.asarray(self.size * (points @ self.rotation.T) + self.translation)


def fit_rigid(source: FloatArray, target: FloatArray) -> RigidFit:
    """Return the rotation and translation that carry points onto others [Kabsch1976].

    Args:
        source: Points, shape (N, 3).
        target: Where each shall come, shape (N, 3).

    Example:
        >>> corners = np.array([[0.0, 0, 0], [1, 0, 0], [0, 2, 0]])
        >>> lifted = corners + [0, 0, 3]
        >>> fit_rigid(corners, lifted).translation.round(12) + 0.0
        array([0., 0., 3.])
    """
    before, after = source.mean(axis=0), target.mean(axis=0)
    rotation = nearest_rotation((target - after).T @ (source - before))
    return RigidFit(rotation, after - rotation @ before)


def fit_similarity(source: FloatArray, target: FloatArray) -> SimilarityFit:
    """Return the rotation, size and translation that carry points onto others [Umeyama1991].

    Args:
        source: Points, shape (N, 3).
        target: Where each shall come, shape (N, 3).

    Example:
        >>> corners = np.array([[0.0, 0, 0], [1, 0, 0], [0, 2, 0]])
        >>> round(fit_similarity(corners, 1.5 * corners).size, 12)
        1.5
    """
    before, after = source.mean(axis=0), target.mean(axis=0)
    a, b = source - before, target - after
    rotation, spread = nearest_rotation(b.T @ a), float((a**2).sum())
    size = float(((a @ rotation.T) * b).sum() / spread)
    mirrored = 0.0
    if np.linalg.det(b.T @ a) < 0:
        mirrored = float(np.linalg.svd(b.T @ a, compute_uv=False)[2]) / spread
    return SimilarityFit(rotation, size, after - size * rotation @ before, mirrored)


def fit_upright(source: FloatArray, target: FloatArray) -> RigidFit:
    """Return the turn about the vertical and the shift on the floor that carry points onto others.

    Args:
        source: Points, shape (N, 3), z up.
        target: Where each shall come, shape (N, 3); heights do not count.

    Example:
        >>> fit = fit_upright(np.eye(3), np.array([[0.0, 1, 5], [-1, 0, 5], [0, 0, 5]]))
        >>> fit.rotation.round().astype(int)
        array([[ 0, -1,  0],
               [ 1,  0,  0],
               [ 0,  0,  1]])
    """
    before, after = source[:, :2].mean(axis=0), target[:, :2].mean(axis=0)
    a, b = source[:, :2] - before, target[:, :2] - after
    yaw = np.arctan2((a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0]).sum(), (a * b).sum())
    c, s = np.cos(yaw), np.sin(yaw)
    rotation = np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])
    return RigidFit(rotation, np.array([*after, 0.0]) - rotation @ np.array([*before, 0.0]))
