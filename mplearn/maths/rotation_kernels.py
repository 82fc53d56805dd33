"""Rotations inside compiled loops, one at a time; conventions as in `rotations`."""

from __future__ import annotations

import numpy as np

from ..recording import FloatArray
from .compiling import njit


@njit(cache=True)
def quaternion_matrix(q: FloatArray) -> FloatArray:
    """Return the rotation matrix (3, 3) of a quaternion (w, x, y, z), which need not be normal.

    Example:
        >>> quaternion_matrix(np.array([2.0, 0.0, 0.0, 0.0]))
        array([[1., 0., 0.],
               [0., 1., 0.],
               [0., 0., 1.]])
    """
    norm = np.sqrt(q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3])
    w, x, y, z = q[0] / norm, q[1] / norm, q[2] / norm, q[3] / norm
    m = np.empty((3, 3))
    m[0, 0] = 1 - 2 * (y * y + z * z)
    m[0, 1] = 2 * (x * y - w * z)
    m[0, 2] = 2 * (x * z + w * y)
    m[1, 0] = 2 * (x * y + w * z)
    m[1, 1] = 1 - 2 * (x * x + z * z)
    m[1, 2] = 2 * (y * z - w * x)
    m[2, 0] = 2 * (x * z - w * y)
    m[2, 1] = 2 * (y * z + w * x)
    m[2, 2] = 1 - 2 * (x * x + y * y)
    return m


@njit(cache=True)
def turn_in_place(matrix: FloatArray, axis: FloatArray, angle: float) -> None:
    """Turn a rotation matrix (3, 3), in place, about a unit axis (3,) of its own frame.

    Example:
        >>> matrix = np.eye(3)
        >>> turn_in_place(matrix, np.array([0.0, 0.0, 1.0]), np.pi / 2)
        >>> matrix.round().astype(int)
        array([[ 0, -1,  0],
               [ 1,  0,  0],
               [ 0,  0,  1]])
    """
    s, c = np.sin(angle), np.cos(angle)
    x, y, z = axis[0], axis[1], axis[2]
    v = 1.0 - c
    r00, r01, r02 = c + x * x * v, x * y * v - z * s, x * z * v + y * s
    r10, r11, r12 = y * x * v + z * s, c + y * y * v, y * z * v - x * s
    r20, r21, r22 = z * x * v - y * s, z * y * v + x * s, c + z * z * v
    for i in range(3):
        a, b, d = matrix[i, 0], matrix[i, 1], matrix[i, 2]
        matrix[i, 0] = a * r00 + b * r10 + d * r20
        matrix[i, 1] = a * r01 + b * r11 + d * r21
        matrix[i, 2] = a * r02 + b * r12 + d * r22


@njit(cache=True)
def turn_about_vertical(yaw: float, matrix: FloatArray) -> FloatArray:
    """Return R_z(yaw) R, an orientation (3, 3) turned about the world's vertical by yaw [rad].

    Example:
        >>> turn_about_vertical(np.pi, np.eye(3)).round().astype(int)
        array([[-1,  0,  0],
               [ 0, -1,  0],
               [ 0,  0,  1]])
    """
    c, s = np.cos(yaw), np.sin(yaw)
    out = matrix.copy()
    for i in range(3):
        out[0, i] = c * matrix[0, i] - s * matrix[1, i]
        out[1, i] = s * matrix[0, i] + c * matrix[1, i]
    return out


@njit(cache=True)
def turn_by_vector(vector: FloatArray, matrix: FloatArray) -> FloatArray:
    """Return exp([v]) R, an orientation (3, 3) turned by a rotation vector of the world (3,) [rad].

    Rodrigues' formula.

    Example:
        >>> turn_by_vector(np.array([0.0, 0.0, np.pi]), np.eye(3)).round().astype(int)
        array([[-1,  0,  0],
               [ 0, -1,  0],
               [ 0,  0,  1]])
    """
    angle = np.sqrt(vector[0] ** 2 + vector[1] ** 2 + vector[2] ** 2)
    if angle < 1e-12:
        return matrix.copy()
    axis = vector / angle
    c, s = np.cos(angle), np.sin(angle)
    out = np.empty((3, 3))
    for j in range(3):
        along = 0.0
        for i in range(3):
            along += axis[i] * matrix[i, j]
        for i in range(3):
            a, b = (i + 1) % 3, (i + 2) % 3
            across = axis[a] * matrix[b, j] - axis[b] * matrix[a, j]
            out[i, j] = c * matrix[i, j] + s * across + (1.0 - c) * along * axis[i]
    return out


@njit(cache=True)
def rotation_error(wanted: FloatArray, actual: FloatArray) -> FloatArray:
    """Return the rotation vector (3,) [rad], world frame, that turns ``actual`` into ``wanted``.

    Args:
        wanted: Rotation matrix, shape (3, 3).
        actual: The same; less than half a turn away.

    Example:
        >>> rotation_error(np.diag([-1.0, -1.0, 1.0]), np.eye(3) @ np.diag([-1.0, -1.0, 1.0]))
        array([0., 0., 0.])
    """
    r = np.empty((3, 3))  # wanted actual^T; at this size BLAS costs more than the product
    for i in range(3):
        for j in range(3):
            r[i, j] = (
                wanted[i, 0] * actual[j, 0]
                + wanted[i, 1] * actual[j, 1]
                + wanted[i, 2] * actual[j, 2]
            )
    sine = np.array([r[2, 1] - r[1, 2], r[0, 2] - r[2, 0], r[1, 0] - r[0, 1]]) * 0.5
    s = np.sqrt(sine[0] ** 2 + sine[1] ** 2 + sine[2] ** 2)
    cosine = 0.5 * (r[0, 0] + r[1, 1] + r[2, 2] - 1.0)
    if s < 1e-9:
        return sine
    sine *= np.arctan2(s, cosine) / s
    return sine


@njit(cache=True)
def nearest_rotation(matrix: FloatArray) -> FloatArray:
    """Return the rotation R, shape (3, 3), that is most like a matrix: tr(R' M) is largest.

    Of ``M = sum target source'`` it carries the source points onto the target's best [Kabsch1976].

    Example:
        >>> nearest_rotation(np.diag([3.0, 2.0, 1.0])).round().astype(int)
        array([[1, 0, 0],
               [0, 1, 0],
               [0, 0, 1]])
    """
    left, _, right = np.linalg.svd(matrix)
    out = np.empty((3, 3))
    handed = np.linalg.det(left) * np.linalg.det(right)
    for i in range(3):
        for j in range(3):
            out[i, j] = left[i, 0] * right[0, j] + left[i, 1] * right[1, j]
            out[i, j] += handed * left[i, 2] * right[2, j]
    return out
