"""A vocabulary that grows: the slowest frame, snapshots, the file and memory, to 5,000 primitives.

One run takes minutes: ``python -m benchmarks growing``.
"""

from __future__ import annotations

import time

import numpy as np

from mplearn import LearnerConfig, MotionLearner
from mplearn.state import checkpoint
from mplearn_agents.learning.pauses import short_pauses

from .live import _resident_mb
from .states import _CHANNELS, _RATE_HZ, Teacher, one_more, teach

_STAGES = (300, 1_000, 5_000)
_AT_ONCE, _TIMES = 20, 3  # motions that are shown together, and how often
_FRAME_MS, _SNAPSHOT_MS = "5 ms", "50 ms"  # what is wanted


def rows() -> list[tuple[str, str, str, str]]:
    """Return what it costs to learn on, and to keep what is known, at some numbers of motions.

    Processor time; a frame in which a segment ends costs the segment, every other one its part of
    what is done a little at a time. Garbage is collected as in a process that follows a stream.
    """
    teacher = Teacher(_STAGES[-1])
    channels = tuple(f"joint_{i}" for i in range(_CHANNELS))
    learner = MotionLearner(LearnerConfig(channels, _RATE_HZ))
    _show(learner, Teacher(_AT_ONCE), 0, _AT_ONCE)  # compiles
    with short_pauses():
        return _stages(teacher, MotionLearner(LearnerConfig(channels, _RATE_HZ)))


def _stages(teacher: Teacher, learner: MotionLearner) -> list[tuple[str, str, str, str]]:
    table = []
    for before, stage in zip((0, *_STAGES[:-1]), _STAGES, strict=True):
        segments, frames = [], []
        for first in range(before, stage, _AT_ONCE):
            closing, passing = _show(learner, teacher, first, min(first + _AT_ONCE, stage))
            segments += closing
            frames += passing
        title = f"{len(learner.tree.leaves)} primitives: "
        late = segments[-len(segments) // 5 :]
        table += [
            (
                title + "slowest segment",
                _ms(max(segments)),
                f"of {len(segments)}; p99 {_ms(np.percentile(segments, 99))}, "
                f"median of the last {_ms(np.median(late))}",
                _FRAME_MS,
            ),
            (title + "slowest frame between", _ms(max(frames)), "", _FRAME_MS),
        ]
        table += _kept(learner, title)
        more = one_more(learner, teacher, stage)
        table += [(f"{title}one more, {what}", took, "", "") for what, took in more.items()]
    return table


def _show(
    learner: MotionLearner, teacher: Teacher, first: int, end: int
) -> tuple[list[float], list[float]]:
    """Show some motions; return how long segments took, and the slowest frame of each [s]."""
    segments, frames = [], []
    for _ in range(_TIMES):
        for motion in range(first, end):
            shown, slowest = teacher.perform(motion), 0.0
            for _ in shown:
                begin = time.process_time()
                learner._form_next()
                learner.tree.pass_time()
                slowest = max(slowest, time.process_time() - begin)
            begin = time.process_time()
            teach(learner, shown)
            segments.append(time.process_time() - begin)
            frames.append(slowest)
    return segments, frames


def _kept(learner: MotionLearner, title: str) -> list[tuple[str, str, str, str]]:
    """Return what a snapshot costs and the parts it is prepared in, a state, and what they hold."""
    parts, ready = [], False
    while not ready:
        begin = time.process_time()
        ready = learner.prepare_snapshot()
        parts.append(time.process_time() - begin)
    begin = time.process_time()
    learner.snapshot()
    snapshot_s = time.process_time() - begin
    begin = time.process_time()
    state = learner.state()
    state_s = time.process_time() - begin
    kept = checkpoint(state)
    n_bytes = len(kept.document) + sum(map(len, kept.new.values()))
    return [
        (
            title + "snapshot",
            _ms(snapshot_s),
            f"prepared in {len(parts)} parts of {_ms(max(parts))} at most",
            _SNAPSHOT_MS,
        ),
        (title + "state", _ms(state_s), "", _SNAPSHOT_MS),
        (title + "kept", f"{n_bytes / 1e6:.0f} MB", f"{_resident_mb():.0f} MB of memory", ""),
    ]


def _ms(seconds: float) -> str:
    return f"{1e3 * seconds:.1f} ms"
