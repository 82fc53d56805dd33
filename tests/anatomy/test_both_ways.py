"""Primitives learned from a skeleton's file are recognised in markers of the same motions."""

import pytest
from rigs import Rig, write_rig

from mplearn.anatomy import recognise
from mplearn.body import MotionObserver, human_body
from mplearn.demonstrator import Person, demonstrate
from mplearn.learner import LearnerConfig, MotionLearner
from mplearn.mocap import Hints, open_recording

SCRIPT = ("BAR", "BAL", "SQD", "SQR", "RAR", "RAL", "BAD", "BAU") * 8


@pytest.mark.parametrize(
    "rig", [Rig(fingers=True), Rig(names="numbers", zero="A", order="YXZ", spine=5, bends=True)]
)
@pytest.mark.filterwarnings("ignore::mplearn.errors.RecordingWarning")  # an axis in doubt
def test_what_was_learned_from_bvh_is_recognised_in_markers(tmp_path, rig):
    shown = demonstrate(SCRIPT, seed=2, person=Person(), rate_hz=25.0)
    path = write_rig(tmp_path / "rig.bvh", human_body(), shown.posture.frames, 25.0, rig)
    recording = open_recording(path, positions=True, hints=Hints(joint_axes=True))
    places = recognise(recording).apply(recording)
    learner = MotionLearner(LearnerConfig(channels=places.channels, rate_hz=25.0))
    for _ in learner.learn_recording(places):
        pass
    library = learner.snapshot()
    assert len(library) >= 4
    seen = [
        MotionObserver(r.marker_names, 25.0).observe(r.frames) for r in (places, shown.recording)
    ]
    found = [
        tuple(library.recognise(f[s.start : s.end]).primitive for f in seen) for s in shown.truth
    ]
    known = [pair for pair in found if pair[0] is not None]
    assert len(known) >= 0.5 * len(found)
    assert sum(a == b for a, b in known) >= 0.98 * len(known)
