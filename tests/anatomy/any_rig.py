"""Skeletons drawn at random, and how far what is recognised in them is from the truth."""

import numpy as np
from rigs import NAMES, Rig

from mplearn.body.models.body import Body
from mplearn.maths.rotation_kernels import nearest_rotation
from mplearn.recording import Recording

JOINTS = {
    f"{joint}_{side}": f"{part}_{side}"
    for side in "lr"
    for joint, part in (
        *(("hip", "thigh"), ("knee", "shank"), ("ankle", "foot")),
        *(("shoulder", "upper_arm"), ("elbow", "forearm"), ("wrist", "hand")),
    )
}
UPRIGHT = 0.95  # cosine between verticals


def drawn(rng: np.random.Generator) -> Rig:
    """Return a skeleton drawn at random."""
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


def nearness(rig: Rig) -> float:
    """Return how near joints must be, as a share of the stature.

    A spine of one joint, or that shares out its bends, or an arm without a clavicle, is another
    body's.
    """
    return 0.12 if rig.bends or rig.spine == 1 or "clavicle" in rig.without else 0.01


def misplaced(places: Recording, body: Body, postures: np.ndarray) -> tuple[float, float]:
    """Return how far a joint is off at most, as a share of the stature, and the least uprightness.

    What was recognised is turned to the truth by a rotation, never by a mirror.
    """
    columns = [places.marker_names.index(name) for name in JOINTS]
    bodies = [body.tree.body(part) for part in JOINTS.values()]
    worst, upright = 0.0, 1.0
    for found, q in zip(places.markers[::10, columns], postures[::10], strict=True):
        wanted = body.tree.forward(q)[0][bodies]
        a, b = found - found.mean(axis=0), wanted - wanted.mean(axis=0)
        turn = nearest_rotation(a.T @ b)
        off = float(np.linalg.norm(a - b @ turn.T, axis=1).max())
        worst, upright = max(worst, off / body.height_m), min(upright, float(turn[2, 2]))
    return worst, upright
