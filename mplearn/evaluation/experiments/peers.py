"""The graph of primitives beside the posture motion graph, fed the same stream [Kulic2012, 4.2]."""

from __future__ import annotations

import time

from ...baselines import PostureGraph
from ...body import keypoints_of, robot_body
from ...demonstrator import paper_session
from ...learner import LearnerConfig, MotionLearner
from ...recording import FloatArray
from ...state import State, checkpoint
from ..observing import observe
from ..table import Table

PAPER = (
    ("primitives, the paper's", "100 Hz", "17", "-", "-", "-", "-"),
    ("postures, the paper's", "50 Hz", "1306", "-", "-", "-", "-"),
)


def peers_table(seed: int = 101) -> Table:
    """Learn a session like the paper's by both ways, at its full and at half its frame rate.

    Args:
        seed: Seed of the session.
    """
    recording = paper_session(seed).recording
    features = observe(recording)
    _learned(features.frames[:2500], features.channels, features.rate_hz)  # compiles the kernels
    rows = list(PAPER)
    for step in (1, 2):
        frames, rate_hz = features.frames[::step], features.rate_hz / step
        name = f"{rate_hz:g} Hz"
        markers = keypoints_of(frames, robot_body())
        begin = time.process_time()
        learner = _learned(frames, features.channels, rate_hz)
        took_s = time.process_time() - begin
        held = _n_bytes(learner.state())
        graph_bytes = _n_bytes(learner.graph.state())
        cells = (str(len(learner.graph)), str(learner.graph.n_edges), _kib(graph_bytes))
        rows.append(("primitives", name, *cells, _kib(held), f"{took_s:.1f} s"))
        begin = time.process_time()
        postures = PostureGraph.build(markers, rate_hz)
        took_s = time.process_time() - begin
        needed = postures.n_bytes + 2 * markers.nbytes
        cells = (str(len(postures.leaves)), str(len(postures.edges)), _kib(postures.n_bytes))
        rows.append(("postures", name, *cells, _kib(needed), f"{took_s:.1f} s"))
    return Table(
        f"Graph of primitives and graph of postures: paper_session({seed})",
        ("graph", "rate", "nodes", "edges", "graph's memory", "memory to learn it", "time"),
        tuple(rows),
        "Both are given the same features of the same stream. Primitives are learned on-line, "
        "frame by frame: segmentation, tree and graph; what the learner holds at the end is its "
        "memory. The posture graph [Yamane2009] is built off-line from the positions and "
        "velocities of key points, which it must all hold. Its nodes are the leaves, its graph's "
        "memory that of tree, means and transitions. The smallest node holds 32 frames: the paper "
        "does not give its value, and this one leads to about its number of nodes.",
    )


def _learned(frames: FloatArray, channels: tuple[str, ...], rate_hz: float) -> MotionLearner:
    learner = MotionLearner(LearnerConfig(channels, rate_hz))
    learner.learn_many(frames)
    learner.end_stream()
    return learner


def _n_bytes(state: State) -> int:
    """Return the size of a state, each exemplar counted once [bytes]."""
    kept = checkpoint(state)
    return len(kept.document) + sum(map(len, kept.new.values()))


def _kib(n_bytes: int) -> str:
    return f"{n_bytes / 1024:,.0f} KiB"
