"""Skeletons drawn at random: nearly all are recognised, and none is taken for what it is not."""

import numpy as np
import pytest
from rigs import NAMES, Rig, write_rig

from mplearn.anatomy import recognise
from mplearn.body import human_body
from mplearn.errors import MPLearnError
from mplearn.maths.rotation_kernels import nearest_rotation
from mplearn.mocap import Hints, open_recording

N_RIGS = 40
JOINTS = {
    f"{joint}_{side}": f"{part}_{side}"
    for side in "lr"
    for joint, part in (
        *(("hip", "thigh"), ("knee", "shank"), ("ankle", "foot")),
        *(("shoulder", "upper_arm"), ("elbow", "forearm"), ("wrist", "hand")),
    )
}


def drawn(rng: np.random.Generator) -> Rig:
    return Rig(
        names=str(rng.choice(list(NAMES))),
        zero=str(rng.choice(["hang", "T", "A", "lying", "sitting", "odd", "bones"])),
        order=str(rng.choice(["XYZ", "XZY", "YXZ", "YZX", "ZXY", "ZYX"])),
        spine=int(rng.integers(2, 8)),
        bends=bool(rng.integers(2)),
        without=tuple(part for part in ("clavicle", "toes", "ends") if rng.random() < 0.25),
        fingers=bool(rng.integers(2)),
        metacarpals=bool(rng.integers(2)),
        twists=bool(rng.random() < 0.3),
        helpers=bool(rng.random() < 0.3),
        face=bool(rng.random() < 0.4),
        prop=bool(rng.random() < 0.2),
        unit_m=float(rng.choice([0.01, 1.0, 0.001])),
        up=str(rng.choice(["y", "z"])),
        yaw=float(rng.uniform(-3, 3)),
        reverse=bool(rng.integers(2)),
    )


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
        columns = [places.marker_names.index(name) for name in JOINTS]
        bodies = [body.tree.body(part) for part in JOINTS.values()]
        # a spine that shares out its bends, or an arm without a clavicle, is another body's
        near = 0.12 if rig.bends or "clavicle" in rig.without else 0.01
        for found, q in zip(places.markers[::10, columns], postures[::10], strict=True):
            wanted = body.tree.forward(q)[0][bodies]
            a, b = found - found.mean(axis=0), wanted - wanted.mean(axis=0)
            turn = nearest_rotation(a.T @ b)  # a rotation, never a mirror
            assert np.linalg.norm(a - b @ turn.T, axis=1).max() < near * body.height_m, str(rig)
            assert turn[2, 2] > 0.95, str(rig)
    assert len(refused) <= 0.05 * N_RIGS, refused
