"""The person beside the robot does the right thing, in the right place, without a jump."""

import numpy as np
import pytest

from mplearn.body import human_body
from mplearn_agents.film import accompany, captioned, middle_pictures
from mplearn_agents.walk import WalkResult, WalkStep


@pytest.fixture(scope="module")
def steps():
    return [("BAR", 40), ("BAL", 31), ("SQD", 25), ("", 5), ("SQR", 30), ("jump", 4)]


@pytest.fixture(scope="module")
def postures(demonstration, steps):
    frames = demonstration.posture.frames
    return accompany(human_body(), frames, demonstration.truth, steps)


def test_every_picture_has_a_posture(postures, steps):
    assert postures.shape == (sum(n for _, n in steps), 47)
    np.testing.assert_allclose(np.linalg.norm(postures[:, 3:7], axis=1), 1.0)


def test_the_person_performs_the_steps(postures, demonstration):
    joints = list(demonstration.posture.channels)
    shoulder, knee = joints.index("shoulder_pitch_l"), joints.index("knee_l")
    assert postures[39, shoulder] < -2.0  # arms are up after BAR
    assert abs(postures[70, shoulder]) < 0.4  # and down after BAL
    assert postures[95, knee] > 1.0  # knees are bent after SQD
    np.testing.assert_array_equal(postures[96:101], np.repeat(postures[95:96], 5, axis=0))
    assert postures[130, knee] < 0.4
    np.testing.assert_array_equal(postures[131:], np.repeat(postures[130:131], 4, axis=0))


def test_nothing_jumps_and_the_feet_stay(postures):
    assert np.abs(np.diff(postures, axis=0)).max() < 0.35
    body = human_body()
    feet = [body.tree.body(f"foot_{side}") for side in "lr"]
    for q in postures:
        places, turns = body.tree.forward(q)
        assert np.abs(places[feet, :2].mean(axis=0)).max() < 0.06
        ahead = turns[feet, :2, 0].sum(axis=0)
        assert abs(np.arctan2(ahead[1], ahead[0])) < 0.15


def test_captions_change_the_head_of_a_picture_only():
    pytest.importorskip("PIL")
    pytest.importorskip("matplotlib")
    blank = np.full((240, 320, 3), 200, dtype=np.uint8)
    written = captioned(blank, "squat down", "3 / 20")
    assert written.shape == blank.shape
    assert (written[:60, :160] != 200).any()
    assert (written[:60, 160:] != 200).any()
    np.testing.assert_array_equal(written[60:], blank[60:])


def test_the_middle_picture_of_a_step_belongs_to_it():
    well = {"illegal": False, "fallen": False}
    measured = {"tracking_rmse_rad": 0.01, "cog_deviation_m": 0.0, "zmp_margin_m": 0.1}
    step = WalkStep(1, 7, "squat", 2.0, 0.0, **well, **measured)
    hold = WalkStep(0, None, "hold", 0.5, 0.0, **well, **measured)
    step_of = np.repeat([0, 1, 2], [10, 3, 11])
    walk = WalkResult((step, hold, step), np.zeros((24, 37)), step_of, 10.0)
    middles = middle_pictures(walk)
    assert set(middles) == {0, 2}
    assert all(step_of[index] == k for k, index in middles.items())
