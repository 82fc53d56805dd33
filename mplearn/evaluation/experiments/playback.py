"""A recording played again and again: what is recognised in each pass, and after a bad frame."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import replace
from types import MappingProxyType

import numpy as np

from ...errors import MPLearnError
from ...learner import (
    Event,
    FramesLost,
    LearnerConfig,
    MotionLearner,
    PersonChanged,
    SegmentClosed,
    learnable_rate,
)
from ...mocap import resample
from ...recording import FloatArray, IntArray, Recording
from ..hearing import BLOCK_FRAMES
from ..table import Table, percent

PASS_S = 60.0
"""Length of a pass: the beginning of a take [s]."""

BAD_AT_S = 1.0  # from the beginning of the second pass


def _zeros(frames: FloatArray, _: np.random.Generator) -> FloatArray:
    return np.zeros_like(frames)


def _millimetres(frames: FloatArray, _: np.random.Generator) -> FloatArray:
    return 1000.0 * frames


def _far(frames: FloatArray, _: np.random.Generator) -> FloatArray:
    return np.full_like(frames, 1e6)


def _noise(frames: FloatArray, rng: np.random.Generator) -> FloatArray:
    return frames + rng.normal(0.0, 0.2, frames.shape)


def _larger(frames: FloatArray, _: np.random.Generator) -> FloatArray:
    return 1.3 * frames


BAD_FRAMES: Mapping[str, Callable[[FloatArray, np.random.Generator], FloatArray]] = (
    MappingProxyType(
        {
            "of zeros": _zeros,
            "in millimetres": _millimetres,
            "at 1000 km": _far,
            "with 20 cm of noise": _noise,
            "1.3 times as large": _larger,
        }
    )
)
"""What one bad frame of markers [m] may look like, by name."""


def loop_table(takes: Iterable[Recording], passes: int = 3) -> Table:
    """Play the first minute of each take in a loop, as one stream, and learn it from nothing.

    Args:
        takes: Takes, labelled or not.
        passes: How often each is played.

    Example:
        >>> from mplearn.demonstrator import demonstrate
        >>> take = demonstrate(["BAR", "BAL"] * 4, seed=1, rate_hz=50.0).recording
        >>> table = loop_table([take], passes=2)
        >>> table.columns[:3], len(table.rows)
        (('take', 'pass', 'primitives'), 1)
    """
    rows, left_out = [], []
    for take in map(_first_pass, takes):
        stream = replace(take, frames=np.tile(take.frames, (passes, 1)), labels=())
        try:
            learner = _learner(take)
            events = list(_learned(learner, stream))
        except MPLearnError as error:  # the others can be played nevertheless
            left_out.append(f"{take.name} ({error})")
            continue
        moving, recognised = _frames_by_pass(events, len(take), passes)
        shares = [percent(r / m if m else np.nan) for r, m in zip(recognised, moving, strict=True)]
        rows.append((take.name, f"{take.duration_s:.0f} s", str(len(learner.tree.leaves)), *shares))
    note = (
        "The first minute of each take, played again and again as one stream: the person jumps "
        "back where a pass ends. Share of the moving time that was recognised as it came, as "
        "whatever; a segment belongs to the pass in which its middle lies."
    )
    return Table(
        "A minute played in a loop",
        ("take", "pass", "primitives", *(f"recognised, pass {i + 1}" for i in range(passes))),
        tuple(rows),
        f"{note} Left out: {'; '.join(left_out)}." if left_out else note,
    )


def glitch_table(takes: Iterable[Recording]) -> Table:
    """Learn the first minute of each take, then the same again with one bad frame near its start.

    Args:
        takes: Takes of markers, labelled or not.

    Example:
        >>> from mplearn.demonstrator import demonstrate
        >>> take = demonstrate(["BAR", "BAL"] * 4, seed=1, rate_hz=50.0).recording
        >>> table = glitch_table([take])
        >>> table.columns[:3], len(table.rows)
        (('take', 'bad frame', 'recognised'), 6)
    """
    rows, left_out = [], []
    for take in map(_first_pass, takes):
        try:
            learner = _learner(take)
            for _ in _learned(learner, take):
                pass
            state = learner.state()
            reference = _second(MotionLearner.from_state(state), take, len(take))
            rows.append((take.name, "none", *_cells(reference, reference)))
            for name, spoil in BAD_FRAMES.items():
                at = min(round(BAD_AT_S * take.rate_hz), len(take) - 1)
                frames = take.frames.copy()
                frames[at : at + 1] = spoil(frames[at : at + 1], np.random.default_rng(0))
                spoilt = replace(take, frames=frames)
                second = _second(MotionLearner.from_state(state), spoilt, len(take))
                rows.append((take.name, name, *_cells(second, reference)))
        except MPLearnError as error:  # the others can be spoilt nevertheless
            left_out.append(f"{take.name} ({error})")
    note = (
        "The first minute of each take is learned from nothing, then the same minute again as a "
        "stream of its own, in which one frame, a second after its start, is bad. Recognised: "
        "share of that pass that was recognised as it came, pauses included in the pass. Kept: "
        "that time as a share of what is recognised without a bad frame; of the same primitive: "
        "share of the frames recognised then that are recognised as the same primitive. Persons: "
        "changes of the person. Primitives: more or fewer at the end than without a bad frame."
    )
    return Table(
        "Recognition in the minute after one bad frame",
        (
            "take",
            "bad frame",
            "recognised",
            "kept",
            "of the same primitive",
            "stretches lost",
            "frames lost",
            "persons",
            "primitives",
        ),
        tuple(rows),
        f"{note} Left out: {'; '.join(left_out)}." if left_out else note,
    )


class _Second:
    """What became of a second pass: the primitive of each frame, 0 for none, and what was lost."""

    def __init__(self, n_frames: int) -> None:
        self.primitives: IntArray = np.zeros(n_frames, dtype=np.int64)
        self.lost: list[int] = []
        self.n_people = 0
        self.n_primitives = 0


def _second(learner: MotionLearner, take: Recording, n_frames: int) -> _Second:
    second = _Second(n_frames)
    start = learner.n_frames
    for event in _learned(learner, take):
        match event:
            case SegmentClosed(segment, placement) if placement is not None:
                if placement.recognised:
                    part = slice(segment.start - start, segment.end - start)
                    second.primitives[part] = placement.node_id
            case FramesLost(first, end):
                second.lost.append(end - first)
            case PersonChanged():
                second.n_people += 1
    second.n_primitives = len(learner.tree.leaves)
    return second


def _cells(second: _Second, reference: _Second) -> tuple[str, ...]:
    known = reference.primitives > 0
    recognised = second.primitives > 0
    n = int(known.sum())
    return (
        percent(float(recognised.mean())),
        percent(int(recognised.sum()) / n if n else np.nan),
        percent(int((second.primitives == reference.primitives)[known].sum()) / n if n else np.nan),
        str(len(second.lost)),
        str(sum(second.lost)),
        f"{second.n_people:+d}",
        f"{second.n_primitives - reference.n_primitives:+d}",
    )


def _first_pass(take: Recording) -> Recording:
    take = resample(take, learnable_rate(take.rate_hz))
    return replace(take, frames=take.frames[: round(PASS_S * take.rate_hz)], labels=())


def _learner(take: Recording) -> MotionLearner:
    return MotionLearner(LearnerConfig(take.channels, take.rate_hz))


def _learned(learner: MotionLearner, take: Recording) -> Iterator[Event]:
    for events in learner.learn_recording(take, BLOCK_FRAMES):
        yield from events


def _frames_by_pass(
    events: Iterable[Event], n_frames: int, passes: int
) -> tuple[IntArray, IntArray]:
    """Return how many frames moved and were recognised in each pass, shape (passes,) each."""
    moving, recognised = np.zeros((2, passes), dtype=np.int64)
    for event in events:
        if isinstance(event, SegmentClosed) and event.placement is not None:
            at = min((event.segment.start + event.segment.end) // 2 // n_frames, passes - 1)
            moving[at] += event.segment.length_frames
            recognised[at] += event.segment.length_frames * event.placement.recognised
    return moving, recognised
