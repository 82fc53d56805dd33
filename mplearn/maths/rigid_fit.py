"""The rigid motion that carries points onto others with the least squared distance."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ..recording import FloatArray


class RigidFit(NamedTuple):
    """A rotation, then a translation, of one set of points or of several: ``x -> R x + t``.

    Attributes:
        rotation: Shape (..., 3, 3).
        translation: Shape (..., 3), in the points' unit.
    """

    rotation: FloatArray
    translation: FloatArray

    def apply(self, points: FloatArray) -> FloatArray:
        """Return points moved, shape (..., N, 3)."""
        turned = points @ np.swapaxes(self.rotation, -1, -2)
        return np.asarray(turned + self.translation[..., None, :])


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


def fit_rigid(
    source: FloatArray, target: FloatArray, weights: FloatArray | None = None
) -> RigidFit:
    """Return the rotation and translation that carry points onto others [Kabsch1976].

    Args:
        source: Points, shape (..., N, 3).
        target: Where each shall come, shape (..., N, 3).
        weights: Of the squared distances, shape (..., N), positive together; all one by default. A
            point without weight may be anywhere, or NaN.

    Example:
        >>> corners = np.array([[0.0, 0, 0], [1, 0, 0], [0, 2, 0]])
        >>> lifted = corners + [0, 0, 3]
        >>> fit_rigid(corners, lifted).translation.round(12) + 0.0
        array([0., 0., 3.])
    """
    if weights is None:
        weights = np.ones(np.broadcast_shapes(source.shape, target.shape)[:-1])
    weights = (weights / weights.sum(axis=-1, keepdims=True))[..., None]
    source, target = (np.where(weights > 0, points, 0.0) for points in (source, target))
    before = (weights * source).sum(axis=-2, keepdims=True)
    after = (weights * target).sum(axis=-2, keepdims=True)
    rotation, _ = _kabsch(weights * (target - after), source - before)
    turned = before @ np.swapaxes(rotation, -1, -2)
    return RigidFit(rotation, (after - turned)[..., 0, :])


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
    rotation, singular = _kabsch(b, a)
    spread = float((a**2).sum())
    size = float(singular.sum() / spread)
    mirrored = max(-float(singular[2]) / spread, 0.0)
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


def _kabsch(target: FloatArray, source: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return rotations, and the singular values, the last negative where a reflection fits better.

    Args:
        target: Centred points, shape (..., N, 3).
        source: The same.
    """
    left, singular, right = np.linalg.svd(np.swapaxes(target, -1, -2) @ source)
    handed = np.sign(np.linalg.det(left @ right))[..., None]
    left[..., 2] *= handed
    singular[..., 2] *= handed[..., 0]
    return np.asarray(left @ right), np.asarray(singular)
