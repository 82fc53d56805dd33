"""The chain, stage by stage and as a whole: how many times faster than real time on one core."""

import time
from collections.abc import Callable

import numpy as np

from mplearn import LearnerConfig, MotionLearner
from mplearn.body import InverseKinematics, robot_body, view_of
from mplearn.body.observer.observer import BLOCK_FRAMES
from mplearn.demonstrator import paper_session
from mplearn.evaluation import observe
from mplearn.learner import SegmentClosed
from mplearn.mocap import GapTracker
from mplearn.recording import Recording
from mplearn.segmentation import make_segmenter
from mplearn.tree import PrimitiveTree, TreeConfig

MINUTES = 4.0


def timed(function: Callable[[], object]) -> float:
    begin = time.process_time()
    function()
    return time.process_time() - begin


def blocks(frames: np.ndarray) -> list[np.ndarray]:
    """Return frames in the blocks that a learner passes on."""
    return [frames[start : start + BLOCK_FRAMES] for start in range(0, len(frames), BLOCK_FRAMES)]


def rows() -> list[tuple[str, str, str, str]]:
    recording = paper_session(7).recording
    warm, recording = (
        recording.sliced(0, 2000),
        recording.sliced(0, round(MINUTES * 60 * recording.rate_hz)),
    )
    config = LearnerConfig(recording.channels, recording.rate_hz)
    MotionLearner(config).learn_many(warm.frames)
    learner = MotionLearner(config)
    events = []
    whole = timed(lambda: events.extend(learner.learn_many(recording.frames)))

    features = observe(recording)
    view = view_of(features.channels)
    seen = view.see(features.frames)
    markers = recording.markers
    gaps = GapTracker(markers.shape[1], recording.rate_hz)
    ik = InverseKinematics(robot_body(), recording.marker_names, rate_hz=recording.rate_hz)
    ik.calibrate(markers[:60])
    tree = PrimitiveTree(TreeConfig(), seen.shape[1], recording.rate_hz)
    segments = [
        event.segment
        for event in events
        if isinstance(event, SegmentClosed) and not event.segment.still
    ]
    stages = {
        "gap tracking": lambda: [gaps.update_many(each) for each in blocks(markers)],
        "inverse kinematics, without gaps": lambda: [ik.update_many(x) for x in blocks(markers)],
        "view": lambda: [view.see(each) for each in blocks(features.frames)],
        "tree": lambda: [tree.insert(seen[s.start : s.end]) for s in segments],
    }
    for name in ("kohlmorgen-lemm", "zero-velocity"):
        segmenter = make_segmenter(name, seen.shape[1], recording.rate_hz)
        stages[f"segmentation, {name}"] = lambda s=segmenter: s.segment(seen)
    took = {name: timed(function) for name, function in stages.items()}
    took["from features on: view, segmentation, tree, graph"] = timed(
        lambda: MotionLearner(LearnerConfig(features.channels, features.rate_hz)).learn_many(
            features.frames
        )
    )
    took["the whole chain, from markers"] = whole
    live, noisy = MotionLearner(config), MotionLearner(config)
    ends: list[float] = []  # what frames take in which a segment ends

    def one_by_one() -> None:
        for frame in recording.frames:
            said = []
            frame_s = timed(lambda f=frame, s=said: s.extend(live.learn_one(f)))
            if said:
                ends.append(frame_s)

    took["the same, a frame at a time"] = timed(one_by_one)
    shaken = recording.frames + np.random.default_rng(0).normal(0, 0.01, recording.frames.shape)
    took["the same, with 1 cm of white noise"] = timed(lambda: noisy.learn_many(shaken))
    frame_s, segment_s = _slowest(features)
    n = len(recording)
    table = [
        (name, f"{1e6 * each / n:.0f} us a frame", "real time", f"{n / 100 / each:.0f} x")
        for name, each in took.items()
    ]
    return [
        *table,
        (
            "slowest frame, from features on",
            f"{1e3 * frame_s:.2f} ms",
            "sampling interval",
            "10 ms",
        ),
        ("slowest segment", f"{1e3 * segment_s:.1f} ms", "sampling interval", "10 ms"),
        (
            f"a frame of markers in which a segment ends, of {len(ends)}",
            f"p99 {1e3 * np.percentile(ends, 99):.1f} ms",
            f"median {1e3 * np.median(ends):.1f} ms, at most",
            f"{1e3 * max(ends):.1f} ms",
        ),
    ]


def _slowest(features: Recording) -> tuple[float, float]:
    """Return how long the slowest frame took in which no segment ended, and in which one did [s].

    The processor's time, of one run from nothing; kernels are compiled.
    """
    learner = MotionLearner(LearnerConfig(features.channels, features.rate_hz))
    slowest = [0.0, 0.0]
    for frame in features.frames:
        events = []
        took = timed(lambda f=frame, e=events: e.extend(learner.learn_one(f)))
        slowest[bool(events)] = max(slowest[bool(events)], took)
    return slowest[0], slowest[1]
