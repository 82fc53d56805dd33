"""Euler angles as a path, against scipy's rotations."""

from __future__ import annotations

from itertools import permutations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from mplearn.errors import InvalidValueError
from mplearn.maths.continuous_euler import continuous_euler

ORDERS = ["".join(order) for order in permutations("XYZ")]


def off(order: str, angles: np.ndarray, truth: Rotation) -> np.ndarray:
    """Angles [rad] between the rotations of Euler angles and the true ones."""
    return np.asarray((Rotation.from_euler(order, angles) * truth.inv()).magnitude())


def smooth_rotations(seed: int, n: int = 400, size: float = 0.6) -> Rotation:
    """A wandering rotation, at most a few degrees a frame."""
    rng = np.random.default_rng(seed)
    steps = rng.normal(size=(n, 3))
    for _ in range(3):
        steps = np.apply_along_axis(np.convolve, 0, steps, np.ones(15) / 15, "same")
    steps *= size / np.abs(steps).max() * 0.15
    rotation, path = Rotation.random(random_state=seed), []
    for step in steps:
        rotation = rotation * Rotation.from_rotvec(step)
        path.append(rotation)
    return Rotation.concatenate(path)


@settings(max_examples=60, deadline=None)
@given(order=st.sampled_from(ORDERS), seed=st.integers(0, 10_000))
def test_it_is_the_same_rotation(order: str, seed: int) -> None:
    truth = smooth_rotations(seed)
    files = truth.as_euler(order)
    got = continuous_euler(order, files)
    away = np.abs(np.pi / 2 - np.abs(files[:, 1])) > np.radians(6.001)
    assert off(order, got, truth)[away] == pytest.approx(0.0, abs=1e-9)
    assert np.degrees(off(order, got, truth).max()) < 3.0


@settings(max_examples=60, deadline=None)
@given(order=st.sampled_from(ORDERS), seed=st.integers(0, 10_000))
def test_it_does_not_depend_on_which_equivalent_the_file_holds(order: str, seed: int) -> None:
    truth = smooth_rotations(seed, 100)
    files = truth.as_euler(order)
    rng = np.random.default_rng(seed)
    flipped = files.copy()
    which = rng.random(len(files)) < 0.5
    flipped[which] = np.stack([files[:, 0] + np.pi, np.pi - files[:, 1], files[:, 2] + np.pi], 1)[
        which
    ]
    flipped += 2 * np.pi * rng.integers(-3, 4, flipped.shape)
    assert continuous_euler(order, flipped) == pytest.approx(
        continuous_euler(order, files), abs=1e-6
    )


@settings(max_examples=60, deadline=None)
@given(order=st.sampled_from(ORDERS), seed=st.integers(0, 10_000))
def test_steps_are_bounded_by_how_fast_the_joint_turns(order: str, seed: int) -> None:
    truth = smooth_rotations(seed)
    got = continuous_euler(order, truth.as_euler(order))
    turned = (truth[1:] * truth[:-1].inv()).magnitude()
    lock = np.maximum(np.abs(np.cos(got[:, 1])), np.sin(np.radians(3.0)))
    lock = np.minimum(lock[1:], lock[:-1])
    # the Jacobian of Euler angles, at most 2 / cos b, and the share of a leap that is taken
    assert (np.abs(np.diff(got, axis=0)).max(axis=1) < 4.0 * turned / lock + 1e-9).mean() > 0.99


@pytest.mark.parametrize("order", ORDERS)
@pytest.mark.parametrize("side", [-90.0, 90.0, 89.999, 90.001])
def test_a_joint_that_rests_at_gimbal_lock_rests(order: str, side: float) -> None:
    t = np.arange(500.0)
    parity = 1.0 if order in ("XYZ", "YZX", "ZXY") else -1.0
    turn = 100.0 * t
    files = np.radians(
        np.stack([turn, np.full_like(t, side), 30.0 - parity * np.sign(side) * turn], 1)
    )
    truth = Rotation.from_euler(order, files)
    assert (truth * truth[0].inv()).magnitude().max() < 0.001  # so it rests
    got = continuous_euler(order, files)
    assert np.degrees(np.ptp(got, axis=0)).max() < 0.1
    assert np.degrees(off(order, got, truth).max()) < 0.01


@pytest.mark.parametrize("order", ORDERS)
@pytest.mark.parametrize("off_deg", [0.3, 2.0, 5.0])
def test_a_joint_that_rests_near_gimbal_lock_does_not_creep(order: str, off_deg: float) -> None:
    angles = np.tile(np.radians([40.0, 90.0 - off_deg, -20.0]), (100, 1))
    got = continuous_euler(order, angles)
    assert np.ptp(got, axis=0).max() < 1e-9
    assert off(order, got, Rotation.from_euler(order, angles)).max() < 1e-7


@pytest.mark.parametrize("order", ORDERS)
@pytest.mark.parametrize("noise_deg", [0.01, 0.1, 0.5])
def test_noise_at_gimbal_lock_makes_nothing_drift(order: str, noise_deg: float) -> None:
    rng = np.random.default_rng(5)
    noise = Rotation.from_rotvec(np.radians(rng.normal(0.0, noise_deg, (3000, 3))))
    truth = noise * Rotation.from_euler(order, [0.4, np.pi / 2, -0.7])
    got = continuous_euler(order, truth.as_euler(order))
    assert np.degrees(np.ptp(got, axis=0)).max() < 60.0
    assert np.degrees(np.median(off(order, got, truth))) < 1.0


def test_unknown_angles_stay_unknown_and_cost_nothing_else() -> None:
    files = np.radians(np.linspace([0.0, 0.0, 0.0], [700.0, 60.0, -400.0], 200))
    wrapped = (files + np.pi) % (2 * np.pi) - np.pi
    wrapped[50:53, 1] = np.nan
    got = continuous_euler("YXZ", wrapped)
    assert np.isnan(got[50:53]).all()
    assert np.delete(got, range(50, 53), 0) == pytest.approx(np.delete(files, range(50, 53), 0))
    pair = continuous_euler("YX", wrapped[:, :2])
    assert pair[:, 0] == pytest.approx(files[:, 0])
    assert np.isnan(pair[50:53, 1]).all()
    assert np.delete(pair, range(50, 53), 0)[:, 1] == pytest.approx(
        np.delete(files, range(50, 53), 0)[:, 1]
    )


def test_orders() -> None:
    for order, width in [("XX", 2), ("ZXZ", 3), ("", 0), ("xyz", 3), ("XYZ", 2)]:
        with pytest.raises(InvalidValueError, match="order"):
            continuous_euler(order, np.zeros((4, width)))
