"""Whether what has been learned helps to cut what comes: boundaries with and without scaffolding.

[Kulic2009]: known primitives tell which joints are active, which changes the distance, and where a
motion ends, which changes the cost of a boundary.
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterable, Sequence

import numpy as np

from ...body import view_of
from ...hmm import MotionTracker, activity, fit
from ...recording import FloatArray, LabelledSegment, Recording, Segment
from ...segmentation import make_segmenter
from ...tree import PrimitiveTree, TreeConfig
from ..boundaries import BoundaryScore, score_boundaries
from ..observing import observe
from ..table import Table, percent

QUARTERS = 4
N_STATES = 8
EXEMPLARS = 8  # newest of a primitive, that its model at frame rate is fitted to
FLOOR = 0.4  # of the standard deviation over all motions, the smallest of a state
SLACK = 0.3  # nat a frame and channel by which a known motion may lie below its exemplars
SHARE = 0.5  # of a channel's weight that depends on what the known motion moves


def scaffolding_table(sessions: Iterable[Recording]) -> Table:
    """Segment sessions with and without what a tree has learned so far.

    Args:
        sessions: Sessions whose labels are primitives.

    Returns:
        Boundary F1 in each quarter of the sessions, as learning proceeds.
    """
    scores: dict[str, list[list[BoundaryScore]]] = defaultdict(
        lambda: [[] for _ in range(QUARTERS)]
    )
    for session in sessions:
        features = observe(session)
        frames = view_of(features.channels).see(features.frames)
        for kind, hints in (("without", False), ("with", True)):
            segments = segment_and_learn(frames, session.rate_hz, hints=hints)
            for q in range(QUARTERS):
                part = _quarter(session.labels, q, len(frames))
                scores[kind][q].append(score_boundaries(segments, part, session.rate_hz))
    rows = []
    for kind, quarters in scores.items():
        pooled = [BoundaryScore.pooled(quarter) for quarter in quarters]
        whole = BoundaryScore.pooled(pooled)
        soon = float((whole.delays_s <= 0.2).mean())
        cells = [f"{score.f1:.4f}" for score in (*pooled, whole)]
        rows.append((kind, *cells, f"{1000 * whole.median_delay_s:.0f} ms", percent(soon)))
    return Table(
        title="Boundaries with and without what has been learned",
        columns=(
            "scaffolding",
            *(f"F1, quarter {q + 1}" for q in range(QUARTERS)),
            "F1",
            "median delay",
            "decided within 0.2 s",
        ),
        rows=tuple(rows),
        note=(
            "Sessions made of people's takes, each learned from nothing in one presentation by a "
            "tree; with scaffolding, the segmenter is told in every frame which channels move in "
            "the known primitive that explains the motion so far, and how surely it is in its last "
            "state. Matched one to one within 0.25 s."
        ),
    )


def segment_and_learn(frames: FloatArray, rate_hz: float, *, hints: bool) -> list[Segment]:
    """Segment a stream, shape (T, D), and learn a tree from it; give hints from it, or do not."""
    segmenter = make_segmenter("kohlmorgen-lemm", frames.shape[1], rate_hz)
    known = KnownMotions(frames.shape[1], rate_hz)
    segments: list[Segment] = []
    for t, frame in enumerate(frames):
        closed = segmenter.update(frame)
        segments += closed
        if not hints:
            continue
        for segment in closed:
            if not segment.still:
                known.learn(frames[segment.start : segment.end])
        if closed:
            known.restart(frames[closed[-1].end : t])
        segmenter.scaffold(*known.hint(frame))
    return segments + segmenter.flush()


class KnownMotions:
    """What a tree has learned, as hints for a segmenter.

    Args:
        n_channels: Width D of a frame.
        rate_hz: Frames per second [1/s].
    """

    def __init__(self, n_channels: int, rate_hz: float) -> None:
        self._tree = PrimitiveTree(TreeConfig(), n_channels, rate_hz)
        self._motions: list[FloatArray] = []
        self._tracker: MotionTracker | None = None
        self._weights = np.ones((0, n_channels))
        self._limits = np.ones(0)

    def learn(self, frames: FloatArray) -> None:
        """Insert a motion, shape (T, D), into the tree; model its primitives where they changed."""
        placement = self._tree.insert(frames)
        self._motions.append(frames)
        if placement.born or placement.splits or placement.merges:
            self._model()

    def restart(self, frames: FloatArray) -> None:
        """Begin another motion, of which these frames have been seen, shape (T, D)."""
        if self._tracker is not None:
            self._tracker.restart()
            for frame in frames:
                self._tracker.update(frame)

    def hint(self, frame: FloatArray) -> tuple[FloatArray | None, float]:
        """Take the next frame of the motion; return weights and ending for `Segmenter.scaffold`."""
        if self._tracker is None:
            return None, 0.5
        self._tracker.update(frame)
        likelihoods = self._tracker.log_likelihoods / self._tracker.n_frames
        best = int(likelihoods.argmax())
        if likelihoods[best] < self._limits[best] or self._tracker.n_frames < N_STATES:
            return None, 0.5
        return self._weights[best], float(self._tracker.endings[best])

    def _model(self) -> None:
        spread = np.concatenate(self._motions[-200:]).std(axis=0)
        floor = (FLOOR * spread) ** 2 + 1e-8
        models, limits = [], []
        for leaf in self._tree.leaves:
            members = self._tree.node(leaf).members[-EXEMPLARS:]
            own = [self._motions[i] for i in members if len(self._motions[i]) >= N_STATES]
            if own:
                model = fit(own, N_STATES, n_steps=2, variance_floor=floor)
                models.append(model)
                limits.append(min(model.score(s, complete=False) / len(s) for s in own))
        self._tracker = MotionTracker(models) if models else None
        self._limits = np.array(limits) - SLACK * len(floor)
        self._weights = np.array([1.0 - SHARE + SHARE * activity(model) for model in models])


def _quarter(labels: Sequence[LabelledSegment], q: int, n_frames: int) -> list[LabelledSegment]:
    return [s for s in labels if q * n_frames <= QUARTERS * s.start < (q + 1) * n_frames]
