"""A corpus from beginning to end: ``python -m benchmarks.corpus FOLDER [--people 40 --takes 250]``.

The demonstrator makes the recordings (once). They are learned by one worker and by several, killed
and taken up again on the way, and recognised with what was learned; the libraries must be the same,
byte by byte. 40 people with 250 takes each of 60 kinds of motion are 10,000 recordings.
"""

import argparse
import shutil
import subprocess
import sys
import time
from collections import Counter, defaultdict
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from mplearn.corpus import Corpus, Progress, learn_corpus, recognise_corpus
from mplearn.demonstrator import PRIMITIVES, Person, demonstrate, drawn_sequencing, markov_walk
from mplearn.recording import Recording
from mplearn.tables import SegmentTable


def write_csv(recording: Recording, path: Path) -> None:
    """Write markers as a table; a missing measurement is empty."""
    path.parent.mkdir(parents=True, exist_ok=True)
    times = np.arange(len(recording)) / recording.rate_hz
    rows = np.column_stack([times, recording.frames])
    head = ",".join(["time_s", *recording.channels])
    lines = (",".join("" if x != x else f"{x:.4f}" for x in row) for row in rows)
    new = path.with_suffix(".new")
    new.write_text("\n".join([head, *lines, ""]), encoding="utf-8")
    new.replace(path)


def make(folder: Path, people: int, takes: int, kinds: int, motions: int, rate_hz: float) -> None:
    """Make the recordings that are not there yet."""
    for person, who, take, script in scripts(people, takes, kinds, motions):
        path = folder / person.name / f"take-{take:04d}.csv"
        if not path.exists():
            shown = demonstrate(script, seed=1000 * who + take, person=person, rate_hz=rate_hz)
            write_csv(replace(shown.recording, name=path.stem), path)


def scripts(
    people: int, takes: int, kinds: int, motions: int
) -> Iterator[tuple[Person, int, int, list[str]]]:
    """Yield who performs which take, and what it shows."""
    names = round_of(kinds)
    for who in range(people):
        rng = np.random.default_rng((7, who))
        person = Person.random(rng, f"person-{who:02d}")
        order = drawn_sequencing(np.random.default_rng(3), names, person=rng)
        for take in range(takes):
            walk = markov_walk(np.random.default_rng((who, take)), order)
            script = [name for name, _ in zip(walk, range(motions), strict=False)]
            yield person, who, take, script


def round_of(kinds: int) -> list[str]:
    """Return so many primitives, or one less, of which each leads back: there is a round."""
    ways = {(each.start, each.end): name for name, each in PRIMITIVES.items()}
    chosen: list[str] = []
    reached = {"stand"}
    for _ in range(3):  # from what can be reached, outwards
        for (start, end), name in ways.items():
            back = ways.get((end, start))
            if start in reached and back and name not in chosen and len(chosen) + 2 <= kinds:
                chosen += [name, back]
                reached.add(end)
    return chosen


def run(argv: Sequence[str] | None = None) -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("folder", type=Path)
    parser.add_argument("--people", type=int, default=40)
    parser.add_argument("--takes", type=int, default=250)
    parser.add_argument("--kinds", type=int, default=60)
    parser.add_argument("--motions", type=int, default=8)
    parser.add_argument("--rate-hz", type=float, default=50.0)
    parser.add_argument("--jobs", type=int, nargs="+", default=[1, 2])
    parser.add_argument("--kills", type=int, default=3)
    args = parser.parse_args(argv)
    takes = args.folder / "takes"
    began = time.perf_counter()
    make(takes, args.people, args.takes, args.kinds, args.motions, args.rate_hz)
    n = args.people * args.takes
    print(f"{n} recordings, made in {time.perf_counter() - began:.0f} s", flush=True)
    libraries, took = set(), {}
    for jobs in args.jobs:
        into = args.folder / f"learned-by-{jobs}"
        shutil.rmtree(into, ignore_errors=True)
        began = time.perf_counter()
        corpus = learn_corpus(takes, into, jobs=jobs, show=Said())
        took[jobs] = time.perf_counter() - began
        libraries.add(saved(corpus, args.folder))
        say(corpus, jobs, took[jobs])
    first = args.jobs[0]
    for jobs in args.jobs[1:]:
        print(f"{jobs} workers are {took[first] / took[jobs]:.2f} x {first}")
    if args.kills:
        libraries.add(killed(args.folder, args.kills, args.jobs[-1], took[args.jobs[-1]]))
    print(f"the same library each time: {len(libraries) == 1}")
    began = time.perf_counter()
    found = recognise_corpus(args.folder / "library.mplearn", takes, jobs=args.jobs[-1])
    known = sum(row.primitive is not None for row in found.table)
    took_s = time.perf_counter() - began
    print(
        f"recognised: {known} of {len(found.table)} segments in {found.n_takes} takes, "
        f"{found.n_takes / took_s:.2f} takes a second"
    )
    shown = scripts(args.people, args.takes, args.kinds, args.motions)
    say_right(found.table, {f"{who.name}/take-{k:04d}": script for who, _, k, script in shown})


def say_right(table: SegmentTable, shown: Mapping[str, list[str]]) -> None:
    """Say how well a table knows what takes show, of those that are cut into as many motions."""
    found: defaultdict[str, list[int | None]] = defaultdict(list)
    for row in table:
        found[row.take].append(row.primitive)
    cut = [take for take, ids in found.items() if len(ids) == len(shown[take])]
    pairs = [pair for take in cut for pair in zip(found[take], shown[take], strict=True)]
    votes: defaultdict[int, Counter[str]] = defaultdict(Counter)
    for id, kind in pairs:
        if id is not None:
            votes[id][kind] += 1
    most = [counts.most_common(1)[0] for counts in votes.values()]
    known, right = sum(counts.total() for counts in votes.values()), sum(n for _, n in most)
    print(
        f"{len(cut)} takes are cut into as many motions as they show: of {len(pairs)} motions "
        f"{known / max(1, len(pairs)):.1%} are recognised, {right / max(1, len(pairs)):.1%} as "
        f"what they are, {1 - right / max(1, known):.1%} of those recognised as another; "
        f"{len({kind for kind, _ in most})} kinds own a primitive"
    )


class Said:
    """Prints a line now and then."""

    def __init__(self) -> None:
        self.at = 0.0

    def __call__(self, progress: Progress) -> None:
        if time.monotonic() - self.at > 30:
            self.at = time.monotonic()
            print(f"  {progress.learned} of {progress.takes}", flush=True)


def saved(corpus: Corpus, folder: Path) -> bytes:
    return corpus.learner.snapshot().save(folder / "library.mplearn").read_bytes()


def say(corpus: Corpus, jobs: int, took_s: float) -> None:
    reports, n = corpus.reports, corpus.progress.learned
    times = [report.take_s for report in reports]
    tenth = [max(1, len(each) // 10) for each in times]
    first = np.mean([np.mean(each[1 : 1 + k]) for each, k in zip(times, tenth, strict=True)])
    last = np.mean([np.mean(each[-k:]) for each, k in zip(times, tenth, strict=True)])
    memory = max(report.memory_bytes for report in reports) / 2**20
    learning = np.median([report.learning_s for report in reports])
    print(
        f"{jobs} workers: {n} takes in {took_s:.0f} s ({n / took_s:.2f} a second, "
        f"{corpus.progress.watched_s / took_s:.0f} x real time), "
        f"{len(corpus.learner.tree.leaves)} primitives; a take costs {first:.2f} s at first and "
        f"{last:.2f} s at last; a worker has {memory:.0f} MB at most; merging {len(reports)} "
        f"shards took {corpus.merging_s:.1f} s, learning one {learning:.1f} s (median)",
        flush=True,
    )


def killed(folder: Path, kills: int, jobs: int, whole_s: float) -> bytes:
    """Learn all again by the command, killed on the way; return the library."""
    into, out = folder / "killed", folder / "killed.mplearn"
    shutil.rmtree(into, ignore_errors=True)
    out.unlink(missing_ok=True)
    command = [sys.executable, "-m", "mplearn_agents.cli", "learn", str(folder / "takes")]
    command += ["--jobs", str(jobs), "--shards", str(into), "--out", str(out)]
    rng = np.random.default_rng(0)
    for _ in range(kills):
        process = subprocess.Popen(command, stdout=subprocess.DEVNULL)
        time.sleep(rng.uniform(0.2, 0.9) * whole_s / kills)
        process.kill()  # its workers end by themselves
        process.wait()
        done = sum(path.read_text().count('"learned"') for path in into.glob("*.jsonl"))
        print(f"  killed with {done} takes learned", flush=True)
    subprocess.run(command, check=True, stdout=subprocess.DEVNULL)
    return out.read_bytes()


if __name__ == "__main__":
    run()
