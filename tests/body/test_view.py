import mujoco
import numpy as np
import pytest

from mplearn.body import (
    KEYPOINTS,
    BodyView,
    PlainView,
    feature_channels,
    keypoint_channels,
    keypoints_of,
    posture_of,
    robot_body,
    view_of,
)
from mplearn.errors import BodyError


def random_features(n: int, seed: int = 3) -> np.ndarray:
    body = robot_body()
    rng = np.random.default_rng(seed)
    limits = body.joint_limits[body.driven]
    angles = rng.uniform(limits[:, 0], limits[:, 1], (n, len(limits)))
    base = rng.uniform((0.5, -0.5, -0.9), (0.9, 0.5, 0.9), (n, 3))
    return np.concatenate((base, angles), axis=1)


def test_key_points_lie_where_mujoco_says() -> None:
    body = robot_body()
    model = body.model()
    data = mujoco.MjData(model)
    features = random_features(20)
    points = keypoints_of(features)
    for row, seen in zip(posture_of(features), points, strict=True):
        data.qpos[:] = row
        mujoco.mj_kinematics(model, data)
        for i, (part, place) in enumerate(KEYPOINTS.values()):
            at = data.body(part)
            there = at.xpos + at.xmat.reshape(3, 3) @ (np.array(place) * body.height_m)
            assert seen[3 * i : 3 * i + 3] == pytest.approx(there - data.qpos[:3], abs=1e-10)
    assert np.array_equal(points[:, -1], features[:, 0])
    assert len(keypoint_channels()) == points.shape[1]


def test_features_can_be_read_back_from_the_view() -> None:
    view, features = view_of(feature_channels()), random_features(7)
    assert isinstance(view, BodyView)
    seen = view.see(features)
    assert seen.shape == (7, len(view.channels))
    assert view.read(seen) == pytest.approx(features, abs=1e-12)
    # a variance scales with the square: check against sampled variances
    assert view.read_variances(seen.var(axis=0)) == pytest.approx(features.var(axis=0))


def test_other_channels_are_seen_as_they_are() -> None:
    view = view_of(("a", "b"))
    assert isinstance(view, PlainView)
    frames = np.ones((3, 2))
    assert view.read(view.see(frames)) is frames


def test_foreign_features_are_refused() -> None:
    with pytest.raises(BodyError, match=r"\(4, 5\)"):
        keypoints_of(np.zeros((4, 5)))
