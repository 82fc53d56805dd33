"""A long life with a store, accelerated: ``python -m benchmarks.life --hours 168 --out life.png``.

The demonstrator's motions come again and again, each time a little different, with new ones now and
then in the first tenth and none after it: from there on nothing may grow. As people do, he rests
between: with ``--busy 0.03``, the default, he moves half a minute in a quarter of an hour, day and
night; with ``--busy 1`` without a pause. ``--rate`` is that of the stream, 20 Hz where not said:
the slowest that can be learned. Prints, and plots over the stream: memory, size of the file, time a
frame, time of a checkpoint, and for how long the stream was ever held up by a checkpoint or by a
snapshot for readers (processor time).
"""

from __future__ import annotations

import argparse
import gc
import os
import tempfile
import time
from array import array
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from rich.console import Console
from rich.table import Table

from mplearn import LearnerConfig, MotionLearner
from mplearn.demonstrator import demonstrate
from mplearn.evaluation.observing import observe
from mplearn.recording import FloatArray
from mplearn.store import LifelongLearner, info
from mplearn.store.store import Store

_BLOCK = 10  # frames that come at once: 100 ms


@dataclass
class Figures:
    """What was measured at times of the stream [h]."""

    at_h: list[float] = field(default_factory=list)
    memory_mb: list[float] = field(default_factory=list)
    file_mb: list[float] = field(default_factory=list)
    frame_us: list[float] = field(default_factory=list)
    checkpoint_ms: list[float] = field(default_factory=list)
    held_up_ms: array[float] = field(default_factory=lambda: array("f"))  # of each chunk
    snapshot_ms: list[float] = field(default_factory=list)
    primitives: list[int] = field(default_factory=list)


def motions(n: int = 40, rate_hz: float = 100.0) -> tuple[list[FloatArray], tuple[str, ...], float]:
    """Return n performances of half a minute, in which four primitives come, channels and rate.

    No two repetitions are alike, as a person's are not: few that came again and again to the bit
    would be told apart, and each become a primitive.
    """
    script = ["BAR", "BAL", "BAD", "BAU"] * 6
    shown = [observe(demonstrate(script, seed=seed).recording) for seed in range(n)]
    step = max(1, round(shown[0].rate_hz / rate_hz))
    return [each.frames[::step] for each in shown], shown[0].channels, shown[0].rate_hz / step


def scene(frames: FloatArray, rng: np.random.Generator, kind: int) -> FloatArray:
    """Return the motions as somebody else would make them: a kind is a pattern of joints.

    All begin and end in the posture that the motions begin in, as people stand between motions: a
    leap from one kind to the next would be a motion of its own, and there are many such.
    """
    own = np.random.default_rng(kind)
    stands = frames[0]
    size = own.uniform(0.6, 1.3, frames.shape[1]) * np.where(
        own.random(frames.shape[1]) < 0.2, -1, 1
    )
    varied = size * rng.normal(1.0, 0.02)
    out = stands + (frames - stands) * varied
    n = len(out) // 50
    fade = np.linspace(0.0, 1.0, n)[:, None]
    out[-n:] = (1.0 - fade) * out[-n:] + fade * stands
    return np.asarray(out + 1e-3 * rng.normal(size=frames.shape))


def rest(frames: FloatArray, busy: float, rate_hz: float, rng: np.random.Generator) -> int:
    """Return for how many frames somebody rests after such a motion, a whole number of seconds."""
    mean_s = len(frames) / rate_hz * (1.0 / busy - 1.0)
    return round(mean_s * rng.uniform(0.5, 1.5)) * round(rate_hz)


def live(
    hours: float,
    path: Path,
    checkpoint_s: float = 30.0,
    *,
    busy: float = 1.0,
    rate_hz: float = 100.0,
) -> Figures:
    """Live for so long [h of stream], and measure a hundred times.

    Args:
        hours: How long [h].
        path: The store.
        checkpoint_s: Time of stream between checkpoints [s].
        busy: Share of the time in which somebody moves, in (0, 1].
        rate_hz: Frames per second of the stream [1/s].
    """
    performances, channels, rate_hz = motions(rate_hz=rate_hz)
    config = LearnerConfig(channels, rate_hz)
    rng = np.random.default_rng(0)
    figures = Figures()
    n_frames = round(hours * 3600 * rate_hz)
    due, n_kinds = 0.0, 1
    held: list[float] = []
    start, since = time.process_time(), 0
    with LifelongLearner.open(
        path, lambda: MotionLearner(config), checkpoint_s=checkpoint_s
    ) as life:
        assert isinstance(life.store, Store)
        append = life.store.append

        def timed(*args: object) -> None:
            begin = time.thread_time()
            append(*args)  # type: ignore[arg-type]
            held.append(time.thread_time() - begin)

        life.store.append = timed  # type: ignore[method-assign, assignment]
        while life.n_frames < n_frames:
            share = life.n_frames / n_frames
            n_kinds = max(n_kinds, min(1 + int(share * 10 * 6), 6))
            frames = performances[rng.integers(len(performances))]
            shown = scene(frames, rng, int(rng.integers(n_kinds)))
            for at in range(0, len(shown), _BLOCK):
                life.learn_many(shown[at : at + _BLOCK])
            stands = performances[0][0]
            second = round(rate_hz), len(stands)
            for _ in range(0, rest(shown, busy, rate_hz, rng), second[0]):
                life.learn_many(stands + 1e-3 * rng.normal(size=second))
            life.store.flush()  # the stream runs hundreds of times as fast as in life
            if life.n_frames >= due:
                due += n_frames / 100
                took = time.process_time() - start
                figures.snapshot_ms.append(1e3 * longest_part(life))
                gc.collect()
                figures.at_h.append(life.n_frames / rate_hz / 3600)
                figures.memory_mb.append(memory_mb())
                figures.file_mb.append(info(path).file_bytes / 1e6)
                figures.frame_us.append(1e6 * took / max(life.n_frames - since, 1))
                figures.checkpoint_ms.append(1e3 * max(life.store.figures.checkpoints_s, default=0))
                life.store.figures.checkpoints_s.clear()
                figures.held_up_ms.extend(1e3 * each for each in held)
                held.clear()
                figures.primitives.append(len(life.learner.tree.leaves))
                start, since = time.process_time(), life.n_frames
    return figures


def longest_part(life: LifelongLearner) -> float:
    """Take a snapshot, in parts; return how long the longest of them held the stream up [s]."""
    longest, ready = 0.0, False
    while not ready:
        begin = time.thread_time()
        ready = life.prepare_snapshot()
        longest = max(longest, time.thread_time() - begin)
    begin = time.thread_time()
    life.snapshot()
    return max(longest, time.thread_time() - begin)


def memory_mb() -> float:
    """Return the memory of this process that is in use [MB]."""
    with Path("/proc/self/statm").open() as file:
        return int(file.read().split()[1]) * os.sysconf("SC_PAGE_SIZE") / 1e6


def plot(figures: Figures, out: Path) -> None:
    """Draw the figures over the stream."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(10, 7), layout="constrained")
    axes = figure.subplots(2, 3).ravel()
    series = (
        ("memory of the process [MB]", figures.memory_mb),
        ("size of the file [MB]", figures.file_mb),
        ("processor time a frame [µs]", figures.frame_us),
        ("longest checkpoint, in its thread [ms]", figures.checkpoint_ms),
        ("snapshot for readers [ms]", figures.snapshot_ms),
        ("primitives", figures.primitives),
    )
    for each, (title, values) in zip(axes, series, strict=True):
        each.plot(figures.at_h, values, lw=1.2)
        each.set_ylim(0, 1.15 * max(values))
        each.set_title(title, loc="left", fontsize=10)
        each.set_xlabel("stream [h]")
        each.axvspan(0, figures.at_h[-1] / 10, alpha=0.12)
        each.spines[["top", "right"]].set_visible(False)
    figure.savefig(out, dpi=110)


def main() -> None:
    parser = argparse.ArgumentParser(prog="python -m benchmarks.life", description=__doc__)
    parser.add_argument("--hours", type=float, default=168.0, help="of stream")
    parser.add_argument("--busy", type=float, default=0.03, help="share of it in which he moves")
    parser.add_argument("--rate", type=float, default=20.0, help="frames per second of stream")
    parser.add_argument("--out", type=Path, default=Path("life.png"))
    args = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        begin = time.perf_counter()
        path = Path(folder) / "life.db"
        figures = live(args.hours, path, busy=args.busy, rate_hz=args.rate)
        took = time.perf_counter() - begin
    plot(figures, args.out)
    table = Table("what", "after a fifth", "at the end", "largest", title_justify="left")
    table.title = (
        f"{args.hours:g} h of stream at {args.rate:g} Hz, {100 * args.busy:g} % of it motion, in "
        f"{took / 60:.1f} minutes ({time.process_time() / 60:.1f} of processor)"
    )
    early = len(figures.at_h) // 5
    for name, values in (
        ("memory [MB]", figures.memory_mb),
        ("file [MB]", figures.file_mb),
        ("a frame [µs of processor time]", figures.frame_us),
        ("a checkpoint, in its thread [ms]", figures.checkpoint_ms),
        ("a snapshot for readers [ms]", figures.snapshot_ms),
        ("primitives", figures.primitives),
    ):
        table.add_row(name, *(f"{v:.1f}" for v in (values[early], values[-1], max(values))))
    console = Console(width=120, markup=False)
    console.print(table)
    p50, p99 = np.percentile(figures.held_up_ms, [50, 99])
    console.print(
        f"the stream was held up by the store {len(figures.held_up_ms)} times: "
        f"p50 {p50:.2f} ms, p99 {p99:.2f} ms, at most {max(figures.held_up_ms):.1f} ms"
    )


if __name__ == "__main__":
    main()
