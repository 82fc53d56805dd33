"""Shards, merged, against one pass over the same takes: ``python -m benchmarks.one_pass FOLDER``.

The demonstrator makes the recordings of a corpus (`benchmarks.corpus`). They are learned in shards
that are merged, and by one learner, one take after the other as ``mplearn learn FOLDER`` does; the
library of each then recognises takes of the same people that nobody has learned.
"""

import argparse
import shutil
import time
from collections.abc import Iterator, Sequence
from pathlib import Path

from mplearn.anatomy import recognise
from mplearn.corpus import Reading, learn_corpus
from mplearn.demonstrator import demonstrate
from mplearn.evaluation.experiments.shards import Asked, ask
from mplearn.learner import MotionLearner
from mplearn.mocap import find_takes
from mplearn.recording import Recording

from .corpus import make, scripts

_BLOCK = 128  # frames


def run(argv: Sequence[str] | None = None) -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("folder", type=Path)
    parser.add_argument("--people", type=int, default=8)
    parser.add_argument("--takes", type=int, default=16, help="that each person is learned from")
    parser.add_argument("--asked", type=int, default=4, help="more takes, recognised")
    parser.add_argument("--kinds", type=int, default=20)
    parser.add_argument("--motions", type=int, default=10)
    parser.add_argument("--rate-hz", type=float, default=50.0)
    args = parser.parse_args(argv)
    takes, into = args.folder / "takes", args.folder / "shards"
    make(takes, args.people, args.takes, args.kinds, args.motions, args.rate_hz)
    shutil.rmtree(into, ignore_errors=True)
    began = time.process_time()
    merged = learn_corpus(takes, into, jobs=0).learner
    in_shards_s = time.process_time() - began
    assert merged is not None
    began = time.process_time()
    whole = in_one_pass(takes, merged)
    one_pass_s = time.process_time() - began
    asked = [recognise(each).apply(each) for each in unseen(args)]
    for name, learner, took_s in (
        ("one pass", whole, one_pass_s),
        ("shards, merged", merged, in_shards_s),
    ):
        say(name, learner, ask(learner.snapshot(), asked), took_s)


def in_one_pass(takes: Path, like: MotionLearner) -> MotionLearner:
    """Learn all takes of a folder one after the other, by another's rules."""
    learner, reading = MotionLearner(like.config), Reading()
    for take in find_takes(takes).takes:
        for recording in reading.streams(take, like.config):
            for _ in learner.learn_recording(recording, _BLOCK):
                pass
    return learner


def unseen(args: argparse.Namespace) -> Iterator[Recording]:
    """Yield labelled takes of the same people that come after those that were learned."""
    more = scripts(args.people, args.takes + args.asked, args.kinds, args.motions)
    for person, who, take, script in more:
        if take >= args.takes:
            seed = 1000 * who + take
            yield demonstrate(script, seed, person=person, rate_hz=args.rate_hz).recording


def say(name: str, learner: MotionLearner, asked: Asked, took_s: float) -> None:
    print(
        f"{name}: {asked.primitives} primitives of {len(learner.tree.people)} people, "
        f"{len(asked.classes)} classes of {asked.n_classes}, false positives "
        f"{asked.false_positive:.1%}, false negatives {asked.false_negative:.1%}, coverage "
        f"{asked.coverage:.1%} of {asked.n_motions} motions; {took_s:.0f} s of processor",
        flush=True,
    )


if __name__ == "__main__":
    run()
