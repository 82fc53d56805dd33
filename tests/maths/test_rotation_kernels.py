"""The kernels of rotations against scipy and MuJoCo, called from Python and from compiled loops."""

import mujoco
import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from numba import njit
from scipy.spatial.transform import Rotation

from mplearn.maths.plane import turn_in_plane, wrap_angle
from mplearn.maths.quaternions import quaternion_product, quaternion_vector, vector_quaternion
from mplearn.maths.rotation_kernels import (
    nearest_rotation,
    quaternion_matrix,
    rotation_error,
    turn_about_vertical,
    turn_by_vector,
    turn_in_place,
)
from mplearn.maths.yaw_roll_pitch import (
    roll_pitch_matrix,
    roll_pitch_of,
    yaw_of,
    yaw_roll_pitch_quaternion,
)

unbounded = settings(deadline=None)
angles = st.floats(-3.0, 3.0)
vectors = st.tuples(*3 * [st.floats(-1.8, 1.8)]).map(np.array)
seeds = st.integers(0, 2**32 - 1)


def random_rotation(seed):
    return Rotation.random(rng=np.random.default_rng(seed))


@unbounded
@given(seeds)
def test_the_nearest_rotation_is_more_like_the_matrix_than_any_other(seed):
    rng = np.random.default_rng(seed)
    matrix = rng.normal(size=(3, 3))
    nearest = nearest_rotation(matrix)
    np.testing.assert_allclose(nearest @ nearest.T, np.eye(3), atol=1e-13)
    assert np.linalg.det(nearest) == pytest.approx(1.0)
    others = Rotation.random(200, rng=rng).as_matrix()
    steps = Rotation.from_rotvec(rng.normal(size=(200, 3)) * 1e-3).as_matrix() @ nearest
    likeness = np.einsum("kij,ij->k", np.concatenate((others, steps)), matrix)
    assert np.trace(nearest.T @ matrix) >= likeness.max() - 1e-12


@unbounded
@given(seeds, seeds)
def test_a_product_of_quaternions_is_scipys_and_mujocos(a, b):
    p, q = (random_rotation(seed).as_quat(scalar_first=True) for seed in (a, b))
    theirs = np.empty(4)
    mujoco.mju_mulQuat(theirs, p, q)
    np.testing.assert_allclose(quaternion_product(p, q), theirs, atol=1e-15)
    turned = (random_rotation(a) * random_rotation(b)).as_matrix()
    np.testing.assert_allclose(quaternion_matrix(np.array(theirs)), turned, atol=1e-14)


@unbounded
@given(vectors, seeds)
def test_turning_by_a_vector_is_scipys_from_rotvec(vector, seed):
    start = random_rotation(seed)
    turned = (Rotation.from_rotvec(vector) * start).as_matrix()
    np.testing.assert_allclose(turn_by_vector(vector, start.as_matrix()), turned, atol=1e-14)
    by_quaternion = Rotation.from_quat(vector_quaternion(*vector), scalar_first=True)
    np.testing.assert_allclose((by_quaternion * start).as_matrix(), turned, atol=1e-14)


@unbounded
@given(seeds)
def test_a_quaternion_is_the_vector_that_scipy_finds(seed):
    turn = random_rotation(seed)
    for q in (turn.as_quat(scalar_first=True), -turn.as_quat(scalar_first=True)):
        np.testing.assert_allclose(quaternion_vector(q), turn.as_rotvec(), atol=1e-12)


@pytest.mark.parametrize("size", [0.0, 1e-300, 1e-12, 1e-9, 1e-5])
def test_small_turns_stay_exact(size):
    vector = size * np.array([0.6, 0.0, -0.8])
    np.testing.assert_allclose(vector_quaternion(*vector), (1.0, *vector / 2), rtol=1e-9, atol=0)
    np.testing.assert_allclose(quaternion_vector((1.0, *vector / 2)), vector, rtol=1e-9, atol=0)
    there = turn_by_vector(vector, np.eye(3))
    np.testing.assert_allclose(rotation_error(there, np.eye(3)), vector, rtol=1e-3, atol=1e-12)


@unbounded
@given(vectors, seeds)
def test_a_rotation_error_is_the_vector_of_the_difference(vector, seed):
    actual = random_rotation(seed)
    assume(np.linalg.norm(vector) < 3.1)
    wanted = Rotation.from_rotvec(vector) * actual
    error = rotation_error(wanted.as_matrix(), actual.as_matrix())
    np.testing.assert_allclose(error, vector, atol=1e-9)


@unbounded
@given(angles, seeds, seeds)
def test_a_turn_in_place_is_about_an_axis_of_its_own(angle, a, b):
    start, axis = random_rotation(a), random_rotation(b).apply([0.0, 1.0, 0.0])
    matrix = start.as_matrix()
    turn_in_place(matrix, axis, angle)
    theirs = (start * Rotation.from_rotvec(angle * axis)).as_matrix()
    np.testing.assert_allclose(matrix, theirs, atol=1e-14)


@unbounded
@given(angles, st.floats(-1.5, 1.5), angles, seeds)
def test_yaw_roll_and_pitch_are_scipys_euler_angles(yaw, roll, pitch, seed):
    theirs = Rotation.from_euler("ZXY", [yaw, roll, pitch])
    q = yaw_roll_pitch_quaternion(yaw, roll, pitch)
    same = Rotation.from_quat(q, scalar_first=True)
    np.testing.assert_allclose(same.as_matrix(), theirs.as_matrix(), atol=1e-14)
    np.testing.assert_allclose((yaw_of(q), *roll_pitch_of(q)), (yaw, roll, pitch), atol=1e-7)
    level = roll_pitch_matrix(roll, pitch)
    np.testing.assert_allclose(turn_about_vertical(yaw, level), theirs.as_matrix(), atol=1e-14)


@unbounded
@given(st.floats(-1e3, 1e3))
def test_a_wrapped_angle_is_the_same_angle(angle):
    wrapped = wrap_angle(angle)
    assert abs(wrapped) <= np.pi
    turns = (angle - wrapped) / (2 * np.pi)
    assert turns == pytest.approx(round(turns), abs=1e-9)


@njit
def _from_a_loop(q, yaw, roll, pitch):
    out = np.empty(15)
    out[0:4] = yaw_roll_pitch_quaternion(yaw, roll, pitch)
    out[4:8] = quaternion_product(q, vector_quaternion(roll, pitch, yaw))
    out[8] = yaw_of(q)
    out[9:11] = roll_pitch_of(q)
    out[11:13] = turn_in_plane(roll, pitch, yaw)
    out[13] = wrap_angle(5.0 + yaw)
    out[14] = turn_in_plane(roll, pitch, -yaw)[0]
    return out


def test_numbers_in_kernels_and_arrays_in_python_give_the_same():
    rng = np.random.default_rng(0)
    q = Rotation.random(20, rng=rng).as_quat(scalar_first=True)
    yaw, roll, pitch = rng.uniform(-1.5, 1.5, size=(3, 20))
    loops = np.array([_from_a_loop(*each) for each in zip(q, yaw, roll, pitch, strict=True)])
    vector = np.array([vector_quaternion(*v) for v in np.stack((roll, pitch, yaw), axis=1)]).T
    arrays = (
        *yaw_roll_pitch_quaternion(yaw, roll, pitch),
        *quaternion_product(q.T, vector),
        yaw_of(q.T),
        *roll_pitch_of(q.T),
        *turn_in_plane(roll, pitch, yaw),
        wrap_angle(5.0 + yaw),
        turn_in_plane(roll, pitch, -yaw)[0],
    )
    np.testing.assert_allclose(loops, np.stack(arrays, axis=1), atol=1e-15)


def test_a_turn_in_the_plane_is_a_complex_product():
    rng = np.random.default_rng(1)
    x, y, yaw = rng.normal(size=(3, 50))
    theirs = (x + 1j * y) * np.exp(1j * yaw)
    np.testing.assert_allclose(turn_in_plane(x, y, yaw), (theirs.real, theirs.imag), atol=1e-14)
