"""What becomes of every recording in some folders: ``python -m benchmarks.recordings FOLDER ...``.

Each take is read, recognised, learned by itself and performed, as ``mplearn inspect``, ``learn``
and ``perform`` do it. Prints a row for each format, and names what did not go to its end and why.
"""

from __future__ import annotations

import argparse
import contextlib
import io
import re
import tempfile
import time
import warnings
from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from rich.console import Console
from rich.table import Table

from mplearn.errors import MPLearnError
from mplearn.library import PrimitiveLibrary
from mplearn.mocap import Hints, open_recordings
from mplearn.mocap.registry import reader_of
from mplearn_agents.cli import main as mplearn
from mplearn_agents.recordings.inspection import inspect

STEPS = 5  # primitives that are performed of each


@dataclass
class Outcome:
    """What became of a take; ``stage`` is the last that it reached."""

    take: str
    format: str = "?"
    stage: str = "found"
    primitives: int = 0
    once: int = 0
    standing: bool = False
    falls: int = 0
    problem: str = ""


STAGES = ("found", "read", "recognised", "learned", "performed")


def main() -> None:
    parser = argparse.ArgumentParser(prog="python -m benchmarks.recordings", description=__doc__)
    parser.add_argument("folders", nargs="+", type=Path, help="recordings, or folders of them")
    parser.add_argument("--only", default="", help="takes whose names hold this")
    parser.add_argument("--each", action="store_true", help="print a line for each take, too")
    parser.add_argument("--dynamics", choices=["simulated", "kinematic"], default="simulated")
    args = parser.parse_args()
    warnings.simplefilter("ignore")
    outcomes: list[Outcome] = []
    with tempfile.TemporaryDirectory() as folder:
        for file in _files(args.folders):
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


def _outcome(file: Path, folder: Path, dynamics: str) -> Outcome:
    found = Outcome(file.name)
    library = folder / "library.mplearn"
    try:
        recordings = open_recordings(file, positions=True, hints=Hints(joint_axes=True))
        found.stage = "read"
        report = recordings[0].report
        found.format = report.format if report else "?"
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
    columns = ("format", *STAGES, "primitives", "shown once", "upper body", "fell")
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
        table.add_row(format or "all", *map(str, (*counts, *sums)))
    console = Console(width=130)
    console.print(table)
    for each in outcomes:
        if each.problem:
            console.print(f"{each.take}: {each.stage}, then: {each.problem}", markup=False)


if __name__ == "__main__":
    main()
