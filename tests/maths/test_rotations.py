"""Conversions of rotations against scipy, MuJoCo and products of elementary rotations."""

import itertools

import mujoco
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from mplearn.errors import InvalidValueError
from mplearn.maths.rotations import (
    axis_angle_to_matrix,
    euler_to_matrix,
    euler_to_quaternion,
    matrix_to_quaternion,
    quaternion_to_matrix,
    rotation_vector_to_matrix,
)

ORDERS = [
    order
    for n in (1, 2, 3)
    for order in map("".join, itertools.product("xyz", repeat=n))
    if all(a != b for a, b in itertools.pairwise(order))
]
components = st.floats(-10, 10, allow_subnormal=False)
quaternions = st.tuples(*4 * [components]).filter(lambda q: np.linalg.norm(q) > 1e-3)


@settings(deadline=None)
@given(quaternions)
def test_a_quaternion_turns_like_scipys_and_mujocos(quaternion):
    matrix = quaternion_to_matrix(np.array(quaternion))
    theirs = Rotation.from_quat(quaternion, scalar_first=True).as_matrix()
    np.testing.assert_allclose(matrix, theirs, atol=1e-14)
    unit, flat = np.array(quaternion) / np.linalg.norm(quaternion), np.empty(9)
    mujoco.mju_quat2Mat(flat, unit)
    np.testing.assert_allclose(matrix.ravel(), flat, atol=1e-14)


@settings(deadline=None)
@given(quaternions)
def test_a_quaternion_comes_back_from_its_matrix(quaternion):
    unit = np.array(quaternion) / np.linalg.norm(quaternion)
    back = matrix_to_quaternion(quaternion_to_matrix(unit))
    np.testing.assert_allclose(back, unit * np.sign(back @ unit), atol=1e-12)
    assert back[np.abs(back).argmax()] > 0
    theirs = np.empty(4)
    mujoco.mju_mat2Quat(theirs, quaternion_to_matrix(unit).ravel())
    assert np.abs(back @ theirs) == pytest.approx(1.0, abs=1e-12)


@pytest.mark.parametrize("order", ORDERS)
def test_euler_angles_are_products_of_turns_about_axes(order):
    angles = np.random.default_rng(0).uniform(-4, 4, size=(2, 5, len(order)))
    turns = [
        axis_angle_to_matrix(np.eye(3)["xyz".index(axis)], angles[..., i])
        for i, axis in enumerate(order)
    ]
    moving, fixed = np.eye(3), np.eye(3)
    for turn in turns:
        moving, fixed = moving @ turn, turn @ fixed
    np.testing.assert_allclose(euler_to_matrix(order.upper(), angles), moving, atol=1e-14)
    np.testing.assert_allclose(euler_to_matrix(order, angles), fixed, atol=1e-14)
    by_quaternion = quaternion_to_matrix(euler_to_quaternion(order.upper(), angles))
    np.testing.assert_allclose(by_quaternion, moving, atol=1e-14)


@pytest.mark.parametrize("order", ["", "XX", "XyZ", "XYZX", "abc"])
def test_a_wrong_order_is_named(order):
    with pytest.raises(InvalidValueError, match=f"not '{order}'"):
        euler_to_matrix(order, np.zeros(len(order)))


def test_a_wrong_number_of_angles_is_named():
    with pytest.raises(InvalidValueError, match=r"\(\.\.\., 3\), not \(3, 2\)"):
        euler_to_matrix("XYZ", np.zeros((3, 2)))
    with pytest.raises(InvalidValueError, match=r"not \(\)"):
        euler_to_quaternion("X", np.array(0.0))


@settings(deadline=None)
@given(quaternions, st.floats(-10, 10))
def test_a_turn_about_an_axis_is_a_rotation_vector(quaternion, angle):
    axis = Rotation.from_quat(quaternion).apply([1.0, 0.0, 0.0])
    theirs = Rotation.from_rotvec(angle * axis).as_matrix()
    np.testing.assert_allclose(axis_angle_to_matrix(axis, np.array(angle)), theirs, atol=1e-14)
    np.testing.assert_allclose(rotation_vector_to_matrix(angle * axis), theirs, atol=1e-14)


@pytest.mark.parametrize("lead", [(), (0,), (7,), (2, 3, 1)])
def test_leading_shapes_are_kept(lead):
    some = np.random.default_rng(0).normal(size=(*lead, 4))
    matrices = quaternion_to_matrix(some)
    assert matrices.shape == (*lead, 3, 3)
    assert matrix_to_quaternion(matrices).shape == (*lead, 4)
    assert euler_to_matrix("ZXY", some[..., :3]).shape == (*lead, 3, 3)
    assert euler_to_quaternion("zx", some[..., :2]).shape == (*lead, 4)
    assert rotation_vector_to_matrix(some[..., :3]).shape == (*lead, 3, 3)
    assert axis_angle_to_matrix(np.eye(3)[0], some[..., 0]).shape == (*lead, 3, 3)
