"""Motions followed frame by frame, against the forward variable of the whole."""

import numpy as np
import pytest

from mplearn.errors import FrameError, ModelError
from mplearn.hmm import LeftRightHMM, MotionTracker, activity


def random_model(rng, n_states, n_channels=3):
    stay = np.append(rng.uniform(0.2, 0.95, n_states - 1), 1.0)
    shape = (n_states, n_channels)
    return LeftRightHMM(rng.normal(0, 1, shape), rng.uniform(0.05, 1.0, shape), np.log(stay))


def test_tracking_is_the_forward_variable_frame_by_frame():
    rng = np.random.default_rng(0)
    models = [random_model(rng, n) for n in (4, 1, 6)]
    frames = rng.normal(0, 1, (15, 3))
    frames[rng.random(frames.shape) < 0.1] = np.nan
    tracker = MotionTracker(models)
    for _ in range(2):  # the second motion as if there had been no first
        for t, frame in enumerate(frames):
            tracker.update(frame)
            for m, model in enumerate(models):
                alpha = model.forward(frames[: t + 1])[-1]
                np.testing.assert_allclose(tracker.alpha[m, : model.n_states], alpha, atol=1e-9)
                assert (tracker.alpha[m, model.n_states :] == -np.inf).all()
                total = model.score(frames[: t + 1], complete=False)
                assert tracker.log_likelihoods[m] == pytest.approx(total, abs=1e-9)
                end = model.posteriors(frames[: t + 1], complete=False)[-1, -1]
                assert tracker.endings[m] == pytest.approx(end, abs=1e-9)
        tracker.restart()
        assert tracker.n_frames == 0


def test_the_end_is_seen_when_it_comes():
    means = np.arange(5.0)[:, None]
    model = LeftRightHMM(means, np.full((5, 1), 0.05), np.log([0.9, 0.9, 0.9, 0.9, 1.0]))
    tracker = MotionTracker([model])
    seen = []
    for value in np.repeat(means[:, 0], 10):
        tracker.update(np.array([value]))
        seen.append(tracker.endings[0])
    assert max(seen[:38]) < 0.01
    assert min(seen[42:]) > 0.99


def test_channels_that_move_count():
    still_and_moving = np.column_stack([np.zeros(4), np.arange(4.0), 2 * np.arange(4.0)])
    model = LeftRightHMM(still_and_moving, np.ones((4, 3)), np.log([0.5, 0.5, 0.5, 1.0]))
    np.testing.assert_allclose(activity(model), [0.0, 0.6, 2.4])
    resting = LeftRightHMM(np.ones((2, 3)), np.ones((2, 3)), np.log([0.5, 1.0]))
    np.testing.assert_array_equal(activity(resting), np.ones(3))


def test_wrong_frames_and_models_are_named():
    rng = np.random.default_rng(1)
    with pytest.raises(ModelError, match="channels"):
        MotionTracker([random_model(rng, 2, 3), random_model(rng, 2, 4)])
    with pytest.raises(FrameError, match=r"\(3,\)"):
        MotionTracker([random_model(rng, 2)]).update(np.zeros(4))
