"""What becomes of every recording in some folders: ``python -m benchmarks.recordings FOLDER ...``.

Each take is read, recognised, learned by itself and performed, as ``mplearn inspect``, ``learn``
and ``perform`` do it. Prints a row for each format, and names what did not go to its end and why.
With ``--own N`` also N skeletons of our own body, drawn at random, and one of each other format.
"""

from __future__ import annotations

import argparse
import contextlib
import io
import re
import sys
import tempfile
import time
import warnings
from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from rich.console import Console
from rich.table import Table

from mplearn.body import human_body
from mplearn.demonstrator import Person, demonstrate
from mplearn.errors import MPLearnError
from mplearn.library import PrimitiveLibrary
from mplearn.mocap import Hints, open_recordings
from mplearn.mocap.registry import reader_of
from mplearn_agents.cli import main as mplearn
from mplearn_agents.recordings.inspection import inspect

sys.path.insert(0, str(Path(__file__).parents[1] / "tests"))
sys.path.insert(0, str(Path(__file__).parents[1] / "tests" / "anatomy"))
sys.path.insert(0, str(Path(__file__).parents[1] / "tests" / "mocap"))

from any_rig import drawn
from mocap_writers import write_c3d, write_motive, write_nexus
from other_formats import (
    limbs_of,
    write_amc_of,
    write_mot_of,
    write_mvnx_of,
    write_smpl_of,
    write_theia_of,
)
from rigs import write_rig

STEPS = 5  # primitives that are performed of each
OWN = ("BAR", "BAL", "RAR", "RAL") * 2  # what our own body does


@dataclass
class Outcome:
    """What became of a take; ``stage`` is the last that it reached."""

    take: str
    format: str = "?"
    takes: int = 0
    stage: str = "found"
    primitives: int = 0
    once: int = 0
    standing: bool = False
    falls: int = 0
    problem: str = ""


STAGES = ("found", "read", "recognised", "learned", "performed")


def main() -> None:
    parser = argparse.ArgumentParser(prog="python -m benchmarks.recordings", description=__doc__)
    parser.add_argument("folders", nargs="*", type=Path, help="recordings, or folders of them")
    parser.add_argument("--own", type=int, default=0, help="skeletons of our own that are drawn")
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--only", default="", help="takes whose names hold this")
    parser.add_argument("--each", action="store_true", help="print a line for each take, too")
    parser.add_argument("--dynamics", choices=["simulated", "kinematic"], default="simulated")
    args = parser.parse_args()
    warnings.simplefilter("ignore")
    outcomes: list[Outcome] = []
    with tempfile.TemporaryDirectory() as folder:
        own = _own(Path(folder) / "own", args.own, args.seed) if args.own else []
        for file in [*_files(args.folders), *own]:
            if args.only in file.name:
                begin = time.perf_counter()
                outcomes.append(_outcome(file, Path(folder), args.dynamics))
                if args.each:
                    print(f"{time.perf_counter() - begin:5.1f} s {outcomes[-1]}", flush=True)
    _print(outcomes)


def _files(folders: list[Path]) -> Iterator[Path]:
    """Go through the files of folders; a folder in one is a recording of several takes."""
    for folder in folders:
        for path in [folder] if folder.is_file() else sorted(folder.iterdir()):
            if path.is_dir() or reader_of(path) is not None:
                yield path


def _own(folder: Path, number: int, seed: int) -> list[Path]:
    """Write what our own body does in every format, and as skeletons drawn at random."""
    folder.mkdir()
    rng = np.random.default_rng(seed)
    person = Person.random(rng)
    shown = demonstrate(OWN, seed=seed, person=person, rate_hz=50.0)
    body, postures = human_body(person.height_m, person.proportions), shown.posture.frames
    limbs = limbs_of(body, postures)
    rigs = [write_rig(folder / f"{k}.bvh", body, postures, 50.0, drawn(rng)) for k in range(number)]
    markers, names = shown.recording.markers, list(shown.recording.marker_names)
    return [
        *rigs,
        write_amc_of(folder / "own.amc", limbs),
        write_mvnx_of(folder / "own.mvnx", limbs, 50.0),
        write_smpl_of(folder / "own.npz", limbs, 50.0),
        write_theia_of(folder / "theia.c3d", limbs, 50.0),
        write_mot_of(folder / "own.mot", limbs, 50.0),
        write_c3d(folder / "own.c3d", markers, names=names, rate_hz=50.0),
        write_motive(folder / "motive.csv", markers, names=names, rate_hz=50.0),
        write_nexus(folder / "nexus.csv", markers, names=names, rate_hz=50.0),
    ]


def _outcome(file: Path, folder: Path, dynamics: str) -> Outcome:
    found = Outcome(file.name)
    library = folder / "library.mplearn"
    try:
        recordings = open_recordings(file, positions=True, hints=Hints(joint_axes=True))
        found.stage = "read"
        report = recordings[0].report
        found.format, found.takes = report.format if report else "?", len(recordings)
        for recording in recordings:
            found.problem = inspect(recording).problem
            if found.problem:
                return found
        found.stage = "recognised"
    except MPLearnError as error:
        found.problem = str(error)
        return found
    library.unlink(missing_ok=True)
    said = _run("learn", str(file), "--out", str(library))
    if not library.exists():
        found.problem = said
        return found
    known = PrimitiveLibrary.load(library)
    found.once = sum(primitive.n_exemplars == 1 for primitive in known.primitives)
    found.primitives = len(known) - found.once
    if not len(known):
        found.problem = "nothing was learned"
        return found
    found.stage = "learned"
    said = _run("perform", str(library), "--steps", str(STEPS), "--dynamics", dynamics)
    fell = re.search(r"(\d+) falls?$", said)
    if fell is None:
        found.problem = said
        return found
    found.stage = "performed"
    found.standing = "none of the" in said
    found.falls = int(fell[1])
    return found


def _run(*arguments: str) -> str:
    """Run a command and return what it printed."""
    out, err = io.StringIO(), io.StringIO()
    with contextlib.redirect_stdout(out), contextlib.redirect_stderr(err):
        code = mplearn(arguments)
    return (err if code else out).getvalue().strip()


def _print(outcomes: list[Outcome]) -> None:
    columns = ("format", "takes", *STAGES, "primitives", "shown once", "upper body", "fell")
    table = Table(*columns, title="Recordings", title_justify="left")
    for format in (*sorted({each.format for each in outcomes}), ""):
        group = [each for each in outcomes if format in ("", each.format)]
        reached = Counter(each.stage for each in group)
        counts = [sum(reached[later] for later in STAGES[k:]) for k in range(len(STAGES))]
        sums = (
            sum(each.primitives > 0 for each in group),
            sum(each.primitives == 0 and each.once > 0 for each in group),
            sum(each.standing for each in group),
            sum(each.falls for each in group),
        )
        takes = sum(each.takes for each in group)
        table.add_row(format or "all", *map(str, (takes, *counts, *sums)))
    console = Console(width=130)
    console.print(table)
    for each in outcomes:
        if each.problem:
            console.print(f"{each.take}: {each.stage}, then: {each.problem}", markup=False)


if __name__ == "__main__":
    main()
