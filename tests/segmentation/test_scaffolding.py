"""What a tree has learned, given to the segmenter as hints."""

import numpy as np

from mplearn.evaluation.boundaries import score_boundaries
from mplearn.evaluation.experiments.scaffolding import segment_and_learn
from mplearn.recording import LabelledSegment


def repeated_motions(n_rounds, rate_hz, seed):
    """Three postures visited again and again, with channels that only sway, and where each ends."""
    rng = np.random.default_rng(seed)
    postures = np.zeros((3, 8))
    postures[1, :4], postures[2, 2:6] = 1.0, (1.0, -1.0, 0.5, 1.0)
    pieces, labels, end = [], [], 0
    for i in range(3 * n_rounds):
        a, b = postures[i % 3], postures[(i + 1) % 3]
        x = np.linspace(0, 1, round(rng.uniform(0.9, 1.2) * rate_hz))[:, None]
        pieces.append(a + (x**3 * (10 - 15 * x + 6 * x**2)) * (b - a))
        labels.append(LabelledSegment(end, end + len(x), "abc"[i % 3]))
        end += len(x)
    frames = np.concatenate(pieces)
    frames[:, 6:] += np.cumsum(rng.normal(0, 0.02, (end, 2)), axis=0)
    return frames, labels


def test_hints_from_what_was_learned_do_not_cost_boundaries_and_repeat():
    frames, labels = repeated_motions(12, 60.0, seed=1)
    plain = segment_and_learn(frames, 60.0, hints=False)
    told = segment_and_learn(frames, 60.0, hints=True)
    assert told == segment_and_learn(frames, 60.0, hints=True)
    assert told != plain  # the hints reach the segmenter
    late = [label for label in labels if label.start > len(frames) // 2]
    scores = [score_boundaries(segments, late, 60.0).f1 for segments in (plain, told)]
    assert scores[1] >= scores[0]
    assert scores[1] >= 0.95
