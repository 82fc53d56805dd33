"""What a tree has learned, given to the segmenter as hints."""

from collections import Counter

import numpy as np
import pytest

from mplearn.evaluation.boundaries import score_boundaries
from mplearn.evaluation.experiments.scaffolding import segment_and_learn
from mplearn.recording import LabelledSegment, Recording
from mplearn.segmentation import make_segmenter


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


def strokes(*between):
    """Frames of strokes along a line; between them the speed is down to a share, or rests."""
    stroke = np.sin(np.pi * np.arange(80) / 80) ** 2
    speed = stroke
    for share, pause in between:
        if pause:
            speed = np.concatenate([speed, np.zeros(pause), stroke])
        else:
            joint = np.concatenate([speed[-40:], stroke[:40]])
            speed = np.concatenate([speed[:-40], np.maximum(joint, share), stroke[40:]])
    return np.cumsum([*speed, *np.zeros(100)])[:, None] / 100 * np.array([[1.0, -0.5, 0.3]])


@pytest.mark.parametrize(("name", "share"), [("kohlmorgen-lemm", 0.3), ("zero-velocity", 0.35)])
def test_a_known_end_makes_a_shallow_dip_a_boundary_and_says_so(name, share):
    causes = {}
    for ending in (0.0, 0.5, 1.0):
        segmenter = make_segmenter(name, 3, 100.0)
        segmenter.scaffold(None, ending)
        frames = strokes((0.0, 0), (share, 0), (0.0, 0))
        causes[ending] = Counter(s.cause for frame in frames for s in segmenter.update(frame))
    assert causes[0.0] == causes[0.5]
    assert causes[1.0] == causes[0.5] + Counter(["known"])


@pytest.mark.parametrize("name", ["kohlmorgen-lemm", "zero-velocity"])
def test_a_pause_stays_one_whatever_is_known(name):
    frames = strokes((0.0, 50), (0.0, 35), (0.0, 40))
    frames += np.random.default_rng(0).normal(0, 2e-4, frames.shape)
    pauses = []
    for ending in (0.5, 1.0):
        segmenter = make_segmenter(name, 3, 100.0)
        segmenter.scaffold(None, ending)
        found = [s for frame in frames for s in segmenter.update(frame)]
        pauses.append([(s.start, s.end) for s in found if s.still])
    assert len(pauses[0]) >= 2
    assert pauses[0] == pauses[1]


def test_hints_from_what_was_learned_do_not_cost_boundaries_and_repeat():
    frames, labels = repeated_motions(12, 60.0, seed=1)
    shown = Recording(frames, 60.0, tuple("abcdefgh"))
    plain = segment_and_learn(shown, hints=False)
    told = segment_and_learn(shown, hints=True)
    assert told == segment_and_learn(shown, hints=True)
    assert told != plain  # the hints reach the segmenter
    late = [label for label in labels if label.start > len(frames) // 2]
    scores = [score_boundaries(segments, late, 60.0).f1 for segments in (plain, told)]
    assert scores[1] >= scores[0]
    assert scores[1] >= 0.95
