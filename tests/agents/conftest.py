"""A small library, cut from a demonstration by its own truth: no learner is needed to make it."""

from itertools import pairwise

import numpy as np
import pytest

SCRIPT = ["BAR", "BAL", "SQD", "SQR", "RAR", "RAL", "BAR", "BAL", "RAR", "RAL"] * 2
SCRIPT[12:14] = ["LKR", "LKT"]  # a foot leaves the floor, which the robot must not


@pytest.fixture(scope="session")
def demonstration():
    from mplearn.demonstrator import demonstrate

    return demonstrate(SCRIPT, 3, rate_hz=50.0)


@pytest.fixture(scope="session")
def library(demonstration):
    from mplearn.body import MotionObserver
    from mplearn.graph import TransitionGraph
    from mplearn.hmm import fit
    from mplearn.library import Primitive, PrimitiveLibrary, TreeNode

    recording, truth = demonstration.recording, demonstration.truth
    observer = MotionObserver(recording.marker_names, recording.rate_hz)
    frames = np.concatenate([observer.update(frame) for frame in recording.frames])
    ids = {label: 10 + k for k, label in enumerate(dict.fromkeys(SCRIPT))}
    graph = TransitionGraph()
    for id in ids.values():
        graph.add_node(id)
    for before, after in pairwise(truth):
        length_s = (after.end - after.start) / recording.rate_hz
        graph.observe(ids[before.label], ids[after.label], length_s)
    cuts = {label: [frames[s.start : s.end] for s in truth if s.label == label] for label in ids}
    return PrimitiveLibrary(
        primitives=tuple(
            Primitive.from_exemplars(ids[label], fit(cut, 6), cut, 50.0, name=label, parent=1)
            for label, cut in cuts.items()
        ),
        graph=graph,
        channels=observer.channels,
        rate_hz=50.0,
        body="robot",
        tree=(
            TreeNode(1, None, len(truth)),
            *(TreeNode(ids[label], 1, len(cut)) for label, cut in cuts.items()),
        ),
    )


@pytest.fixture
def library_file(library, tmp_path):
    return library.save(tmp_path / "small.mplearn")
