"""Walks out to every format and back: ``python -m benchmarks.exporting --walks 100``.

Each walk is performed, written, read by its readers' conventions and held against what was meant
by forward kinematics. Then one thing is made wrong with a walk, in every way and format that there
is, and the check must say which. Prints a row for each format.
"""

from __future__ import annotations

import argparse
import sys
import tempfile
import time
from pathlib import Path

import numpy as np
from rich.console import Console
from rich.table import Table

from mplearn_envs.export import RobotModel, check, export, formats, perform
from mplearn_envs.robot import make_robot

_TESTS = Path(__file__).parents[1] / "tests" / "envs" / "export"
_HINGES = (  # what formats that hold bodies alone, and no hinges' angles, cannot have
    "degrees", "centimetres", "quaternion order", "joints breadth first", "two joints swapped",
    "one joint backward", "inches", "one joint in degrees",
)  # fmt: skip


def main() -> None:
    """Write, read, and print."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.exporting", description=__doc__)
    parser.add_argument("--walks", type=int, default=100)
    parser.add_argument("--primitives", type=int, default=8, help="in a walk")
    parser.add_argument("--robot", default="humanoid")
    parser.add_argument("--only", default="", help="this format alone")
    args = parser.parse_args()
    robot = make_robot(args.robot)
    model = RobotModel.of(robot)
    began = time.perf_counter()
    walks = perform(None, robot, walk=args.primitives, clips=args.walks, speed=1.0).motions
    seconds = sum(walk.duration_s for walk in walks)
    took = time.perf_counter() - began
    print(f"{len(walks)} walks of {robot.name}, {seconds:.0f} s of motion, planned in {took:.1f} s")
    table = Table(
        "format", "worst [m]", "worst [deg]", "written [s]", "checked [s]", "faults found"
    )
    for name, format in formats().items():
        if args.only not in ("", name):
            continue
        with tempfile.TemporaryDirectory() as folder:
            began = time.perf_counter()
            place = Path(folder) / f"walks{format.suffix if format.many else ''}"
            paths = export(walks, model, format, place)
            written = time.perf_counter() - began
            verdicts = [verdict for path in paths for verdict in check(path, model)]
            checked = time.perf_counter() - began - written
        assert len(verdicts) == len(walks)
        places = max(verdict.misfit.position_m for verdict in verdicts)
        turns = max(float(np.degrees(verdict.misfit.angle_rad)) for verdict in verdicts)
        found, n = _faults(name, walks[0], model)
        row = (f"{places:.1e}", f"{turns:.1e}", f"{written:.1f}", f"{checked:.1f}")
        table.add_row(name, *row, f"{found} of {n}")
    Console(width=110).print(table)


def _faults(name: str, walk: object, model: RobotModel) -> tuple[int, int]:
    """Return how many faults were found, of how many."""
    sys.path.insert(0, str(_TESTS))
    import export_world as world

    found = n = 0
    for fault, (corrupt, kind) in world.OF_MOTIONS.items():
        if name in ("bvh", "gltf") and fault in _HINGES:
            continue
        with tempfile.TemporaryDirectory() as folder:
            path = world.written(Path(folder), walk, model, name, corrupt)
            found += _is(check(path, model)[0], kind)
            n += 1
    if name == "mjlab":
        for change, kind in world.of_arrays(model).values():
            with tempfile.TemporaryDirectory() as folder:
                path = world.written(Path(folder), walk, model, name)
                world.change_arrays(path, change)
                found += _is(check(path, model)[0], kind)
                n += 1
    return found, n


def _is(verdict: object, kind: str) -> bool:
    return [fault.kind for fault in verdict.faults] == [kind] and not verdict.problems  # type: ignore[attr-defined]


if __name__ == "__main__":
    main()
