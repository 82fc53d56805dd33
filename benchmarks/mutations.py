"""Reads many mutated files of every format: ``python -m benchmarks.mutations [N] [--seed S]``.

Prints, for each format, how many were read and refused, the slowest and the largest; anything but a
recording or an error of ours ends it, as do more than 10 s of the processor or 300 MB for one file.
"""

from __future__ import annotations

import argparse
import shutil
import signal
import sys
import tempfile
import time
import tracemalloc
import warnings
from pathlib import Path
from types import FrameType

import numpy as np
from rich.console import Console
from rich.table import Table

from mplearn.errors import MPLearnError
from mplearn.mocap import open_recording

sys.path.insert(0, str(Path(__file__).parents[1] / "tests"))
sys.path.insert(0, str(Path(__file__).parents[1] / "tests" / "mocap"))

from mocap_writers import WRITERS, write
from mutations import mutated

LONGEST_S = 10
MOST_BYTES = 300e6
MEASURED = 20  # one file in so many is read with its memory traced, which is slow


def main() -> None:
    parser = argparse.ArgumentParser(prog="python -m benchmarks.mutations", description=__doc__)
    parser.add_argument("number", nargs="?", type=int, default=100_000)
    parser.add_argument("--seed", type=int, default=0)
    args = parser.parse_args()
    warnings.simplefilter("ignore")
    signal.signal(signal.SIGPROF, _too_long)
    folder = Path(tempfile.mkdtemp())
    table = Table("format", "files", "read", "refused", "slowest", "largest")
    try:
        valid = {format: _valid(folder / str(i), format) for i, format in enumerate(WRITERS)}
        for format in WRITERS:
            table.add_row(format, *_of_one_format(args, format, valid))
            print(f"{format} done", file=sys.stderr, flush=True)
    finally:
        shutil.rmtree(folder)
    Console(width=110).print(table)


def _valid(folder: Path, format: str) -> Path:
    folder.mkdir()
    return write(folder, format)


def _of_one_format(
    args: argparse.Namespace, format: str, valid: dict[str, Path]
) -> tuple[str, ...]:
    path, rng = valid[format], np.random.default_rng((args.seed, sorted(valid).index(format)))
    contents = {each: file.read_bytes() for each, file in valid.items()}
    others = list(contents.values())
    whole = contents[format]
    number = args.number // len(valid)
    for positions in (False, True):
        open_recording(path, positions=positions)  # compiles what is compiled when first used
    read, slowest_s, largest = 0, 0.0, 0
    for i in range(number):
        path.write_bytes(mutated(rng, whole, others[int(rng.integers(len(others)))]))
        if i % MEASURED == 0:
            tracemalloc.start()
        begin = time.process_time()
        signal.setitimer(signal.ITIMER_PROF, LONGEST_S)
        try:
            open_recording(path, positions=bool(i % 2))
            read += 1
        except MPLearnError:
            pass
        except BaseException:
            kept = Path(f"mutated-{i}{''.join(path.suffixes)}")
            shutil.copy(path, kept)
            print(f"{format}: file {i} is kept as {kept}", file=sys.stderr)
            raise
        finally:
            signal.setitimer(signal.ITIMER_PROF, 0)
        slowest_s = max(slowest_s, time.process_time() - begin)
        if i % MEASURED == 0:
            largest = max(largest, tracemalloc.get_traced_memory()[1])
            tracemalloc.stop()
            if largest > max(MOST_BYTES, 10 * path.stat().st_size):
                raise SystemExit(f"{format}: file {i} takes {largest / 1e6:.0f} MB")
    path.write_bytes(whole)
    return (
        f"{number}", f"{read}", f"{number - read}", f"{slowest_s:.2f} s", f"{largest / 1e6:.1f} MB"
    )  # fmt: skip


def _too_long(signum: int, frame: FrameType | None) -> None:
    raise TimeoutError(f"reading takes longer than {LONGEST_S} s")


if __name__ == "__main__":
    main()
