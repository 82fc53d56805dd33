"""Skeletons drawn at random: nearly all are recognised, and none is taken for what it is not."""

import numpy as np
import pytest
from any_rig import UPRIGHT, drawn, misplaced, nearness
from rigs import write_rig

from mplearn.anatomy import recognise
from mplearn.body import human_body
from mplearn.errors import MPLearnError
from mplearn.mocap import Hints, open_recording

N_RIGS = 40


@pytest.mark.filterwarnings("ignore::mplearn.errors.RecordingWarning")  # an axis in doubt
def test_of_skeletons_drawn_at_random_none_is_taken_for_what_it_is_not(tmp_path, truth):
    rng = np.random.default_rng(11)
    refused = []
    for _ in range(N_RIGS):
        longer = {name: float(rng.uniform(0.85, 1.18)) for name in ("thigh", "forearm", "trunk")}
        body = human_body(float(rng.uniform(1.0, 2.0)), longer)
        start = int(rng.integers(0, len(truth.postures) - 60))
        postures = truth.postures[start : start + 50]
        rig = drawn(rng)
        path = write_rig(tmp_path / "rig.bvh", body, postures, 25.0, rig)
        try:
            recording = open_recording(path, positions=True, hints=Hints(joint_axes=True))
            places = recognise(recording).apply(recording)
        except MPLearnError as error:
            refused.append(f"{rig}: {error}")
            continue
        worst, upright = misplaced(places, body, postures)
        assert worst < nearness(rig), str(rig)
        assert upright > UPRIGHT, str(rig)
    assert len(refused) <= 0.05 * N_RIGS, refused
