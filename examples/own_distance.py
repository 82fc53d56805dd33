"""Tell motions apart by a measure of one's own; tree, recognition and rejection go by it.

python examples/own_distance.py
"""

from dataclasses import replace

import numpy as np

from mplearn import LearnerConfig, MotionLearner
from mplearn.demonstrator import demonstrate
from mplearn.recording import FloatArray, IntArray
from mplearn.tree import Distance, Exemplar, TreeConfig, register_distance


class PointOffset(Distance):
    """Mean squared difference of the time-normalised points, whatever the models say."""

    def divergence(
        self, exemplar: Exemplar, others: Exemplar, rows: IntArray, weights: FloatArray
    ) -> FloatArray:
        offsets = others.columns[rows] - exemplar.columns  # (k, D, P)
        return np.asarray((offsets**2 * weights).sum(axis=(1, 2)) / weights.sum())


register_distance("point offset", PointOffset)

recording = demonstrate(["BAD", "BAU", "SQD", "SQR"] * 5, seed=1).recording
for name in ("likelihood", "monte_carlo", "point offset"):
    tree = replace(TreeConfig(), distance=name)
    learner = MotionLearner(LearnerConfig(recording.channels, recording.rate_hz, tree=tree))
    learner.learn_many(recording.frames)
    learner.end_stream()
    library = learner.snapshot()
    shown = sum(primitive.n_exemplars for primitive in library.primitives)
    print(f"{name}: {len(library)} primitives of {shown} demonstrations")
