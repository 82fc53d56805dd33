"""Mirror images and parts: what the maps do, and what they find."""

import sys
from pathlib import Path

import numpy as np
import pytest

sys.path.insert(0, str(Path(__file__).parent))
from motions import RATE_HZ, Motions

from mplearn.body import feature_channels, keypoints_of
from mplearn.body.views.keypoints import keypoint_channels
from mplearn.errors import InvalidValueError, UnknownPrimitiveError
from mplearn.tree import MirrorMap, PrimitiveTree, TreeConfig, related


def test_a_mirrored_posture_has_mirrored_key_points():
    features = np.random.default_rng(0).uniform(-0.6, 0.6, (20, len(feature_channels())))
    mirror = MirrorMap.of(feature_channels())
    points = keypoints_of(features)
    expected = MirrorMap.of(keypoint_channels()).apply(points)
    np.testing.assert_allclose(keypoints_of(mirror.apply(features)), expected, atol=1e-12)
    np.testing.assert_array_equal(mirror.apply(mirror.apply(features)), features)


def test_bad_mirrors_are_named():
    with pytest.raises(InvalidValueError, match="elbow_r"):
        MirrorMap.of(("elbow_l", "neck"))
    with pytest.raises(InvalidValueError, match="once"):
        MirrorMap((0, 0), (1, 1))
    with pytest.raises(InvalidValueError, match="2 channels"):
        MirrorMap((1, 0), (1, 1)).apply(np.zeros((4, 3)))


def learned(motions, n_motions, n_rounds=7):
    tree = PrimitiveTree(TreeConfig(), 6, RATE_HZ)
    home = {}
    for _ in range(n_rounds):
        for motion in range(n_motions):
            placement = tree.insert(motions.perform(motion))
            home[motion] = placement.node_id
    assert len(tree.leaves) == n_motions
    return tree, home


def test_left_and_right_are_related_and_nothing_else_is():
    names = ("hip_l.x", "hip_l.y", "hip_r.x", "hip_r.y", "face.x", "face.y")
    mirror = MirrorMap.of(names)
    motions = Motions(6, 6, 3)
    motions.keys[1] = mirror.apply(motions.keys[0])
    motions.keys[5] = 0.5 * (motions.keys[5] + mirror.apply(motions.keys[5]))  # its own image
    tree, home = learned(motions, 6)
    images = {m: [r.primitive for r in related(tree, home[m], mirror=mirror)] for m in home}
    assert images == {0: [home[1]], 1: [home[0]], 2: [], 3: [], 4: [], 5: [home[5]]}


def test_the_same_arms_over_other_legs_are_related():
    motions = Motions(5, 6, 4)
    motions.keys[1, :, :3] = motions.keys[0, :, :3]  # channels 0 to 2 alike, the others not
    motions.keys[2, :, :3] = 0.0  # at rest there
    tree, home = learned(motions, 5)
    assert [r.primitive for r in related(tree, home[0], channels=(0, 1, 2))] == [home[1]]
    assert related(tree, home[0], channels=(3, 4, 5)) == ()
    assert related(tree, home[2], channels=(0, 1, 2)) == ()
    with pytest.raises(InvalidValueError, match="channels"):
        related(tree, home[0], channels=(7,))
    with pytest.raises(InvalidValueError, match="mirror"):
        related(tree, home[0])
    with pytest.raises(UnknownPrimitiveError, match="99"):
        related(tree, 99, channels=(0,))
