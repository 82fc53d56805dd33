"""Kills a learner with a store at random moments: ``python -m benchmarks.killing [TIMES]``.

Each time it goes on from what the last one left, and that must be, bit for bit, what a run without
end would know there; nothing that was said to be written may be missing. Some are killed inside a
checkpoint or a migration, none after the end of the stream, which has none. Linux and macOS only:
processes are forked.
"""

import argparse
import os
import signal
import sqlite3
import struct
import tempfile
import time
from collections import Counter
from pathlib import Path

import numpy as np
import psutil

from mplearn import LearnerConfig, MotionLearner
from mplearn.errors import InvalidValueError
from mplearn.recording import FloatArray
from mplearn.store import Freeze, LifelongLearner, Merge, Note, Rename, schema, writer
from mplearn.store.store import Store

CHANNELS, RATE_HZ = ("a", "b", "c", "d"), 50.0
CHUNK = round(RATE_HZ)
PER_KILL_S = 60.0  # of stream: more than is learned before a kill


def stream(seconds: float, seed: int = 0, n_motions: int = 4) -> FloatArray:
    """Return frames, shape (T, 4), in which some motions come again and again."""
    rng = np.random.default_rng(seed)
    shapes = np.random.default_rng(7).normal(size=(n_motions, 2, 4))
    parts: list[FloatArray] = []
    n = 0
    while n < seconds * RATE_HZ:
        length = int(rng.integers(40, 60))
        t = np.linspace(0, 1, length)[:, None]
        one, two = shapes[rng.integers(n_motions)] * rng.normal(1.0, 0.03, size=(2, 1))
        parts += [one * np.sin(np.pi * t) ** 2 + two * np.sin(2 * np.pi * t) ** 2]
        parts += [np.zeros((int(rng.integers(15, 30)), 4))]
        n += length + len(parts[-1])
    frames = np.concatenate(parts)[: int(seconds * RATE_HZ)]
    return np.asarray(frames + 0.002 * rng.normal(size=frames.shape))


def learner() -> MotionLearner:
    return MotionLearner(LearnerConfig(CHANNELS, RATE_HZ))


def step(life: LifelongLearner, frames: FloatArray, at_once: int) -> None:
    """Do what comes next: what that is follows from what was done."""
    at = life.n_frames
    asked = at // (8 * CHUNK)
    if at % (8 * CHUNK) == 0 and life.number <= asked:
        act(life, asked)
        return
    at_once = min(at_once, CHUNK - at % CHUNK)
    part = frames[at : at + at_once]
    life.learn_many(part, (at + np.arange(len(part))) / RATE_HZ)


def act(life: LifelongLearner, asked: int) -> None:
    """Ask for something; where it cannot be, a note is written."""
    ids = life.learner.tree.leaves
    one, two = (ids[asked % len(ids)], ids[(asked + 1) % len(ids)]) if ids else (0, 0)
    commands = (Rename(one, f"name {asked}"), Merge(one, two), Freeze(one), Note("so far"))
    try:
        if asked % 3 == 2:
            life.execute(Note("before"), when=float(asked)) if not life.entries() else None
            number = max(e.number for e in life.entries() if e.command.kind != "undo")
            life.undo(by="Ben", number=number, when=float(asked))
        else:
            life.execute(commands[asked % len(commands)], by="Anna", when=float(asked))
    except (InvalidValueError, KeyError):
        life.execute(Note(f"not possible {asked}"), when=float(asked))


def live(path: Path, frames: FloatArray, told: int, seed: int) -> None:
    """Learn until killed; tell how much is written for certain."""
    rng = np.random.default_rng(seed)
    if dies_in_checkpoint(seed):
        _die_in_checkpoint(int(rng.integers(1, 6)), written=bool(rng.integers(2)))
    with LifelongLearner.open(path, learner, checkpoint_s=2) as life:
        while life.n_frames < len(frames):
            step(life, frames, int(rng.integers(1, 80)))
            if rng.random() < 0.02:
                assert isinstance(life.store, Store)
                life.store.flush()
                written = life.n_frames - life.n_frames % CHUNK
                os.write(told, struct.pack("qq", written, life.number))


def dies_in_checkpoint(seed: int) -> bool:
    """Say whether who learns is killed inside a checkpoint, not at a moment of its time."""
    return seed % 5 == 3


def _die_in_checkpoint(after: int, *, written: bool) -> None:
    """Be killed inside a checkpoint, after some: before or after it is written, uncommitted."""
    left = [after]
    write = writer.write_checkpoint

    def dying(*args: object) -> None:
        left[0] -= 1
        if written or left[0] > 0:
            write(*args)  # type: ignore[arg-type]
        if left[0] <= 0:
            os.kill(os.getpid(), signal.SIGKILL)

    writer.write_checkpoint = dying


def die_in_migration(path: Path) -> None:
    """Be killed while an old file is brought to this version."""

    def dying(*_: object) -> bytes:
        os.kill(os.getpid(), signal.SIGKILL)
        return b""

    schema.digest = dying
    LifelongLearner.open(path)


def made_old(path: Path) -> None:
    """Turn a store into one of the first version."""
    connection = sqlite3.connect(path)
    for table in ("log", "checkpoint"):
        connection.execute(f"ALTER TABLE {table} DROP COLUMN digest")
    connection.execute("PRAGMA user_version = 1")
    connection.commit()
    connection.close()


def forked(do: object, *args: object, killed_after_s: float | None = None) -> str:
    """Do something in a process of its own, which is killed after some processor time of its.

    Returns:
        How it ended: "killed"; "killed inside", by itself; or "ended".
    """
    killed = False
    pid = os.fork()
    if pid == 0:
        try:
            do(*args)  # type: ignore[operator]
        except BaseException as error:
            print(f"{type(error).__name__}: {error}", flush=True)
        os._exit(0)
    if killed_after_s is not None:
        process = psutil.Process(pid)
        while process.status() != psutil.STATUS_ZOMBIE:
            if sum(process.cpu_times()[:2]) >= killed_after_s:
                os.kill(pid, signal.SIGKILL)
                killed = True
                break
            time.sleep(0.004)
    _, status = os.waitpid(pid, 0)
    if not os.WIFSIGNALED(status):
        return "ended"
    return "killed" if killed else "killed inside"


def run(times: int, folder: Path, seed: int = 1) -> tuple[int, Counter[str]]:
    """Kill so many times, at moments drawn by a seed.

    Returns:
        How many frames were learned, and how many processes were killed where.
    """
    path, rng = folder / "life.db", np.random.default_rng(seed)
    frames = stream(60 + PER_KILL_S * times, seed)
    where: Counter[str] = Counter()
    whole = LifelongLearner(learner())
    whole.learn_many(frames[:CHUNK], np.arange(CHUNK) / RATE_HZ)  # what is compiled, is by now
    whole = LifelongLearner(learner())
    for k in range(times):
        told, tell = os.pipe()
        after_s, life_seed = float(rng.exponential(0.5)) + 0.02, k + 1000 * seed
        inside = dies_in_checkpoint(life_seed)
        ended = forked(
            *(live, path, frames, tell, life_seed), killed_after_s=None if inside else after_s
        )
        os.close(tell)
        said = b""
        while more := os.read(told, 1 << 16):
            said += more
        os.close(told)
        where["in a checkpoint" if ended == "killed inside" else ended] += 1
        if k % 25 == 10:
            with LifelongLearner.open(path):
                pass
            made_old(path)
            if forked(die_in_migration, path) == "killed inside":
                where["in a migration"] += 1
        with LifelongLearner.open(path, learner) as life:
            pairs = list(struct.iter_unpack("qq", said))
            if pairs:
                lost = life.n_frames < pairs[-1][0] or life.number < pairs[-1][1]
                assert not lost, f"written {pairs[-1]}, found {life.n_frames, life.number}"
            target = life.n_frames, life.number
            while (whole.n_frames, whole.number) != target:
                assert whole.n_frames <= target[0], f"no run ever was at {target}"
                step(whole, frames, CHUNK)
            assert life.state() == whole.state(), f"another state after kill {k}, at {target}"
            assert life.n_frames % CHUNK == 0
        if k % 20 == 19:
            told_where = ", ".join(f"{n} {what}" for what, n in where.items())
            stream_s = whole.n_frames / RATE_HZ
            print(f"{k + 1} kills, {stream_s:.0f} s of stream: {told_where}", flush=True)
    return whole.n_frames, where


def main() -> None:
    parser = argparse.ArgumentParser(prog="python -m benchmarks.killing", description=__doc__)
    parser.add_argument("times", type=int, nargs="?", default=200)
    parser.add_argument("--seed", type=int, default=1, help="of the moments and the stream")
    args = parser.parse_args()
    times = args.times
    with tempfile.TemporaryDirectory() as folder:
        start = time.perf_counter()
        n, where = run(times, Path(folder), args.seed)
        took = time.perf_counter() - start
    print(
        f"killed {times} times in {took:.0f} s and {n / RATE_HZ:.0f} s of stream, "
        f"{where['in a checkpoint']} of them in a checkpoint, {where['ended']} after its end, and "
        f"{where['in a migration']} times more in a migration: each time the state was, bit for "
        "bit, that of a run without end, and nothing written was lost"
    )


if __name__ == "__main__":
    main()
