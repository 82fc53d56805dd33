"""From motions to activities: what recurs together, found on a graph, its number not given.

An activity is coarser than a primitive: to walk, or to do knee bends, is to repeat a few motions.
A segment is described by which motions occur around it, as a profile of its likeness to all others
within a window; those whose profiles point the same way are linked. Activities are the communities
of that graph by modularity [Blondel2008], which says how many there are.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence

import numpy as np
from numpy.typing import NDArray

from ...body import view_of
from ...recording import FloatArray, LabelledSegment, Recording, Segment
from ...segmentation import make_segmenter
from ...tree import TreeConfig, form
from ...tree.bank import ExemplarBank
from ...tree.spread import ChannelSpread, pairs
from ..observing import observe
from ..partitions import Agreement, agreement
from ..table import Table

WINDOW_S = 2.0  # standard deviation of the window in which motions recur together [s]
NEAR = 0.5  # distance, over the mean one, at which two segments are not alike any more
SHARPNESS = 4  # power of the likeness of two windows
RESOLUTION = 1.0  # of modularity


def find_activities(recording: Recording, resolution: float = RESOLUTION) -> NDArray[np.int64]:
    """Return the activity of each frame, shape (T,), named by numbers.

    Args:
        recording: Markers, or features.
        resolution: Of modularity; larger values give more activities.
    """
    import networkx as nx

    features = observe(recording)
    frames = view_of(features.channels).see(features.frames)
    segments = make_segmenter("kohlmorgen-lemm", frames.shape[1], recording.rate_hz).segment(frames)
    moving = [segment for segment in segments if segment.length_frames > 1]
    kinds = likeness(frames, moving)
    middles = np.array([0.5 * (s.start + s.end) for s in moving]) / recording.rate_hz
    weights = np.exp(-0.5 * ((middles[:, None] - middles) / WINDOW_S) ** 2)
    lengths = np.array([s.length_frames for s in moving], dtype=np.float64)
    profiles = (weights * lengths) @ kinds
    profiles /= np.linalg.norm(profiles, axis=1, keepdims=True)
    graph = nx.from_numpy_array(np.triu((profiles @ profiles.T) ** SHARPNESS, 1))
    communities = nx.community.louvain_communities(graph, resolution=resolution, seed=0)
    activities = np.zeros(len(frames), np.int64)
    for number, community in enumerate(sorted(communities, key=min)):
        for i in community:
            activities[moving[i].start : moving[i].end] = number
    return activities


def likeness(frames: FloatArray, segments: Sequence[Segment]) -> FloatArray:
    """Return how alike segments are, in [0, 1], by the tree's distance; shape (n, n)."""
    config = TreeConfig()
    points = [form.points_of(frames[s.start : s.end], config.form) for s in segments]
    spread = ChannelSpread(np.zeros(frames.shape[1], np.int64))
    for each in points:
        spread.update(each)
    floor = config.variance_floor**2 * spread.variances()
    bank = ExemplarBank(config, frames.shape[1], floor)
    for number, each in enumerate(points):
        bank.add(number, bank.model(form.centred(each, config.form)))
    matrix = bank.matrix(range(len(points)))
    usual = float(pairs(matrix).mean()) if len(matrix) > 1 else 1.0
    return np.asarray(np.clip(1.0 - matrix / (NEAR * usual), 0.0, 1.0))


def true_activities(labels: Sequence[LabelledSegment], n_frames: int) -> NDArray[np.str_]:
    """Return the label of each frame, shape (T,); empty where there is none."""
    names = np.full(n_frames, "", dtype=f"<U{max(1, *(len(each.label) for each in labels))}")
    for label in labels:
        names[label.start : label.end] = label.label
    return names


def activity_table(recordings: Iterable[Recording]) -> Table:
    """Find the activities of labelled recordings and compare them with the labels."""
    rows = []
    for recording in recordings:
        truth = true_activities(recording.labels, len(recording))
        found = find_activities(recording)
        labelled = truth != ""
        rows.append(_row(recording.name, agreement(truth[labelled], found[labelled])))
    columns = ("recording", "ARI", "NMI", "covering", "change points, F1", "classes", "found")
    note = (
        "Activities, their number not given, frame by frame over the labelled stretch. Change "
        "points match within 1 % of the recording."
    )
    return Table("Activities in recordings", columns, tuple(rows), note)


def _row(name: str, result: Agreement) -> tuple[str, ...]:
    scores = (result.ari, result.nmi, result.covering, result.change_f1)
    return name, *(f"{s:.2f}" for s in scores), str(result.n_true), str(result.n_found)
