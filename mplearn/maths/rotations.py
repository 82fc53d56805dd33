"""Conversions of many rotations at once, with any leading shape.

Quaternions are (w, x, y, z), as MuJoCo has them; matrices turn column vectors, ``v' = R v``;
angles are radians. scipy does the work where it can; `rotation_kernels` has what compiled loops
need, one rotation at a time.
"""

from __future__ import annotations

from itertools import pairwise
from typing import TYPE_CHECKING

import numpy as np

from ..errors import InvalidValueError
from ..recording import FloatArray
from .compiling import njit
from .rotation_kernels import quaternion_matrix

if TYPE_CHECKING:
    from scipy.spatial.transform import Rotation


def quaternion_to_matrix(quaternions: FloatArray) -> FloatArray:
    """Return the rotation matrices of quaternions.

    Args:
        quaternions: (w, x, y, z), of any length but zero, shape (..., 4).

    Returns:
        Shape (..., 3, 3).

    Example:
        >>> half_turn_about_z = np.array([0.0, 0.0, 0.0, 1.0])
        >>> quaternion_to_matrix(half_turn_about_z) @ [1.0, 2.0, 3.0]
        array([-1., -2.,  3.])
    """
    quaternions = np.asarray(quaternions, dtype=np.float64)
    flat = np.ascontiguousarray(quaternions.reshape(-1, 4))
    return np.asarray(_matrices(flat)).reshape(*quaternions.shape[:-1], 3, 3)


def matrix_to_quaternion(matrices: FloatArray) -> FloatArray:
    """Return the unit quaternions (w, x, y, z) of rotation matrices.

    Of the two that each has, the one is returned whose largest component is positive.

    Args:
        matrices: Shape (..., 3, 3).

    Returns:
        Shape (..., 4).

    Example:
        >>> quarter_turn_about_x = np.array([[1.0, 0, 0], [0, 0, -1], [0, 1, 0]])
        >>> matrix_to_quaternion(quarter_turn_about_x).round(4)
        array([0.7071, 0.7071, 0.    , 0.    ])
    """
    from scipy.spatial.transform import Rotation

    matrices = np.asarray(matrices, dtype=np.float64)
    flat = Rotation.from_matrix(matrices.reshape(-1, 3, 3)).as_quat(scalar_first=True)
    return np.asarray(flat).reshape(*matrices.shape[:-2], 4)


def euler_to_matrix(order: str, angles: FloatArray) -> FloatArray:
    """Return the rotation matrices of Euler angles.

    Args:
        order: One to three axes, each other than the one before: ``"ZXY"`` turns about the axes as
            they are turned by then (intrinsic), so that ``R = R_z R_x R_y``; ``"zxy"`` about the
            fixed ones (extrinsic), so that ``R = R_y R_x R_z``.
        angles: An angle for each axis, in their order [rad], shape (..., len(order)).

    Returns:
        Shape (..., 3, 3).

    Raises:
        InvalidValueError: There is no such order, or it has another number of angles.

    Example:
        >>> euler_to_matrix("ZX", np.radians([90.0, 90.0])).round().astype(int)
        array([[0, 0, 1],
               [1, 0, 0],
               [0, 1, 0]])
        >>> euler_to_matrix("zx", np.radians([90.0, 90.0])).round().astype(int)
        array([[ 0, -1,  0],
               [ 0,  0, -1],
               [ 1,  0,  0]])
    """
    angles, rotation = _euler(order, angles)
    return np.asarray(rotation.as_matrix()).reshape(*angles.shape[:-1], 3, 3)


def euler_to_quaternion(order: str, angles: FloatArray) -> FloatArray:
    """Return the unit quaternions (w, x, y, z) of Euler angles.

    Args:
        order: See `euler_to_matrix`.
        angles: An angle for each axis, in their order [rad], shape (..., len(order)).

    Returns:
        Shape (..., 4).

    Raises:
        InvalidValueError: There is no such order, or it has another number of angles.

    Example:
        >>> euler_to_quaternion("Z", np.array([[0.0], [np.pi / 2]])).round(4)
        array([[1.    , 0.    , 0.    , 0.    ],
               [0.7071, 0.    , 0.    , 0.7071]])
    """
    angles, rotation = _euler(order, angles)
    return np.asarray(rotation.as_quat(scalar_first=True)).reshape(*angles.shape[:-1], 4)


def matrix_to_euler(order: str, matrices: FloatArray) -> FloatArray:
    """Return Euler angles of rotation matrices, the middle one within a right angle of zero.

    Each rotation by itself: near gimbal lock, where the middle angle is +-pi/2, those of a motion
    leap (see `continuous_euler`).

    Args:
        order: Three different axes, as ``"ZXY"``, intrinsic: ``R = R_z R_x R_y``.
        matrices: Shape (..., 3, 3).

    Returns:
        Shape (..., 3) [rad].

    Raises:
        InvalidValueError: There is no such order.

    Example:
        >>> matrix_to_euler("ZXY", euler_to_matrix("ZXY", np.array([0.1, -0.2, 0.3]))).round(4)
        array([ 0.1, -0.2,  0.3])
    """
    if sorted(order) != ["X", "Y", "Z"]:
        raise InvalidValueError(f"an order is three different of X, Y, Z, not {order!r}")
    i, j, k = ("XYZ".index(axis) for axis in order)
    handed = 1.0 if (j - i) % 3 == 1 else -1.0
    m = np.asarray(matrices, dtype=np.float64)
    first = np.arctan2(-handed * m[..., j, k], m[..., k, k])
    # from the first angle on, so that all three make the rotation again even at gimbal lock
    sine, cosine = np.sin(first), np.cos(first)
    middle = np.arctan2(handed * m[..., i, k], cosine * m[..., k, k] - handed * sine * m[..., j, k])
    last = np.arctan2(
        handed * (cosine * m[..., j, i] + handed * sine * m[..., k, i]),
        cosine * m[..., j, j] + handed * sine * m[..., k, j],
    )
    return np.stack([first, middle, last], axis=-1)


def rotation_vector_to_matrix(vectors: FloatArray) -> FloatArray:
    """Return the rotation matrices of rotation vectors.

    Args:
        vectors: Axis times angle [rad], shape (..., 3).

    Returns:
        Shape (..., 3, 3).

    Example:
        >>> rotation_vector_to_matrix(np.array([0.0, 0.0, np.pi / 2])).round().astype(int)
        array([[ 0, -1,  0],
               [ 1,  0,  0],
               [ 0,  0,  1]])
    """
    angles = np.linalg.norm(vectors, axis=-1, keepdims=True)
    share = 0.5 * np.sinc(angles / (2 * np.pi))  # sin(angle / 2) / angle, whole at zero
    return quaternion_to_matrix(np.concatenate([np.cos(angles / 2), vectors * share], axis=-1))


def axis_angle_to_matrix(axis: FloatArray, angles: FloatArray) -> FloatArray:
    """Return the rotation matrices about one axis (Rodrigues' formula).

    Args:
        axis: Unit vector, shape (3,).
        angles: Shape (...) [rad].

    Returns:
        Shape (..., 3, 3).

    Example:
        >>> z = np.array([0.0, 0.0, 1.0])
        >>> axis_angle_to_matrix(z, np.array([0.0, np.pi / 2])).shape
        (2, 3, 3)
    """
    x, y, z = axis
    cross = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    angles = np.asarray(angles, dtype=np.float64)[..., None, None]
    return np.asarray(np.eye(3) + np.sin(angles) * cross + (1.0 - np.cos(angles)) * (cross @ cross))


@njit(cache=True)
def _matrices(quaternions: FloatArray) -> FloatArray:
    out = np.empty((len(quaternions), 3, 3))
    for i in range(len(quaternions)):
        out[i] = quaternion_matrix(quaternions[i])
    return out


def _euler(order: str, angles: FloatArray) -> tuple[FloatArray, Rotation]:
    from scipy.spatial.transform import Rotation

    axes = order.lower()
    if not (
        1 <= len(order) <= 3
        and set(axes) <= set("xyz")
        and order in (axes, order.upper())
        and all(a != b for a, b in pairwise(axes))
    ):
        raise InvalidValueError(
            f"an order is one to three of XYZ, or of xyz, each other than the one before, "
            f"not {order!r}"
        )
    angles = np.asarray(angles, dtype=np.float64)
    if angles.shape[-1:] != (len(order),):
        raise InvalidValueError(
            f"order {order!r} needs angles of shape (..., {len(order)}), not {angles.shape}"
        )
    return angles, Rotation.from_euler(order, angles.reshape(-1, len(order)))
