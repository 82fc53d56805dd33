"""Whose body is in which skeleton: ``python -m benchmarks.skeletons [N] [--seed S]``.

Our own human body is animated, written as skeletons of other names, zero poses, scales, axes,
proportions, spines and orders of rotations, in every format, read and recognised. Prints how many
were recognised, how many wrongly (sides, mirrored, upside down, another joint), and how far key
points and joint angles are from the truth; and how many motions that were learned from a BVH file
are recognised in a C3D file of them.
"""

from __future__ import annotations

import argparse
import sys
import tempfile
import warnings
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from rich.console import Console
from rich.table import Table

from mplearn.anatomy import recognise
from mplearn.body import MotionObserver, human_body
from mplearn.demonstrator import Person, demonstrate
from mplearn.errors import MPLearnError
from mplearn.learner import LearnerConfig, MotionLearner
from mplearn.mocap import Hints, open_recording
from mplearn.recording import Recording

sys.path.insert(0, str(Path(__file__).parents[1] / "tests"))
sys.path.insert(0, str(Path(__file__).parents[1] / "tests" / "anatomy"))
sys.path.insert(0, str(Path(__file__).parents[1] / "tests" / "mocap"))

from any_rig import UPRIGHT, drawn, misplaced, nearness
from known_person import RATE_HZ, SCRIPT, Truth
from mocap_writers import write_c3d
from other_formats import limbs_of, write_amc_of, write_mvnx_of, write_smpl_of
from rigs import RIGS, Rig, write_rig

MOTIONS = ("BAR", "BAL", "SQD", "SQR", "RAR", "RAL", "BAD", "BAU") * 8
LENGTHS = ("thigh", "forearm", "trunk")


@dataclass
class Row:
    """What was found of skeletons of one kind."""

    files: int = 0
    wrong: int = 0
    refused: list[str] = field(default_factory=list)
    points_mm: list[float] = field(default_factory=list)
    angles_deg: list[float] = field(default_factory=list)


def main() -> None:
    parser = argparse.ArgumentParser(prog="python -m benchmarks.skeletons", description=__doc__)
    parser.add_argument("number", nargs="?", type=int, default=100, help="skeletons drawn")
    parser.add_argument("--seed", type=int, default=0)
    args = parser.parse_args()
    warnings.simplefilter("ignore")
    rng = np.random.default_rng(args.seed)
    person = Person.random(rng)
    shown = demonstrate(SCRIPT, seed=args.seed, person=person, rate_hz=RATE_HZ)
    own = human_body(person.height_m, person.proportions)
    postures = shown.posture.frames
    rows: dict[str, Row] = {}
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        truth = Truth(own, postures, shown.recording)
        for rig in RIGS:
            row = rows.setdefault("BVH, one thing changed", Row())
            _add(row, truth, _bvh(folder, truth, rig), nearness(rig))
        for _ in range(args.number):
            longer = {name: float(rng.uniform(0.85, 1.18)) for name in LENGTHS}
            body = human_body(float(rng.uniform(1.0, 2.0)), longer)
            start = int(rng.integers(0, len(postures) - 100))
            drawn_truth = Truth(body, postures[start : start + 100], shown.recording)
            rig = drawn(rng)
            row = rows.setdefault("BVH, all drawn at random", Row())
            _add(row, drawn_truth, _bvh(folder, drawn_truth, rig), nearness(rig))
        limbs = limbs_of(own, postures)
        writers: dict[str, Callable[[], Path]] = {
            "AMC": lambda: write_amc_of(folder / "a.amc", limbs),
            "MVNX": lambda: write_mvnx_of(folder / "a.mvnx", limbs, RATE_HZ),
            "SMPL": lambda: write_smpl_of(folder / "a.npz", limbs, RATE_HZ),
        }
        for format, write in writers.items():  # poses of SMPL have no lengths of bones
            _add(rows.setdefault(format, Row()), truth, write(), 0.12 if format == "SMPL" else 0.01)
        known, same = _both_ways(folder)
    _print(rows)
    print(f"learned from BVH, recognised in C3D: {same} of {known} ({100 * same / known:.1f} %)")


def _bvh(folder: Path, truth: Truth, rig: Rig) -> Path:
    return write_rig(folder / "rig.bvh", truth.body, truth.postures, RATE_HZ, rig)


def _opened(path: Path) -> Recording:
    rate_hz = RATE_HZ if path.suffix == ".amc" else None  # which the format cannot say
    return open_recording(path, positions=True, hints=Hints(joint_axes=True, rate_hz=rate_hz))


def _add(row: Row, truth: Truth, path: Path, near: float) -> None:
    row.files += 1
    try:
        recording = _opened(path)
        places = recognise(recording).apply(recording)
        angles, points = truth.errors(places)
    except MPLearnError as error:
        row.refused.append(str(error))
        return
    worst, upright = misplaced(places, truth.body, truth.postures)
    row.wrong += worst > near or upright < UPRIGHT
    row.points_mm.append(float(np.median(points)))
    row.angles_deg.append(float(np.median(angles)))


def _both_ways(folder: Path) -> tuple[int, int]:
    """Return how many motions are recognised in C3D, and how many as what they are in BVH."""
    shown = demonstrate(MOTIONS, seed=2, person=Person(), rate_hz=RATE_HZ)
    path = write_rig(folder / "b.bvh", human_body(), shown.posture.frames, RATE_HZ, Rig(spine=5))
    skeleton = _opened(path)
    places = recognise(skeleton).apply(skeleton)
    learner = MotionLearner(LearnerConfig(channels=places.channels, rate_hz=RATE_HZ))
    for _ in learner.learn_recording(places):
        pass
    library = learner.snapshot()
    names = list(shown.recording.marker_names)
    markers = open_recording(
        write_c3d(folder / "b.c3d", shown.recording.markers, names=names, rate_hz=RATE_HZ)
    )
    seen = [MotionObserver(r.marker_names, RATE_HZ).observe(r.frames) for r in (places, markers)]
    found = [
        tuple(library.recognise(each[s.start : s.end]).primitive for each in seen)
        for s in shown.truth
    ]
    known = [pair for pair in found if pair[0] is not None]
    return len(known), sum(a == b for a, b in known)


def _print(rows: dict[str, Row]) -> None:
    columns = ("skeletons", "files", "recognised", "wrong")
    table = Table(*columns, "key points, median (worst)", "joint angles, median (worst)")
    for name, row in rows.items():
        figures = [
            f"{np.median(each):.1f} {unit} ({np.max(each):.1f})" if each else "-"
            for each, unit in ((row.points_mm, "mm"), (row.angles_deg, "deg"))
        ]
        recognised = row.files - len(row.refused)
        table.add_row(name, str(row.files), str(recognised), str(row.wrong), *figures)
    console = Console(width=120)
    console.print(table)
    for name, row in rows.items():
        for problem in row.refused:
            console.print(f"{name}: {problem}", markup=False)


if __name__ == "__main__":
    main()
