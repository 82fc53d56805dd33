"""The tree that joints hang in, from the joints alone: bones keep their lengths.

Tables of joints' places do not say which bones join them. Where all of them hang together by bones
that do not stretch, while most pairs come nearer and go apart, that tree is the skeleton: the
shortest of those that span the joints. Markers on skin do not hang together so; where somebody
hardly moves all of them seem to, and how much two vary grows with how far they are apart, while
bones vary far less than anything else. Names tell left from right: no bone joins the two (feet that
stand keep their distance as well as bones do), and limbs part from the middle.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ..recording import FloatArray, Recording, Skeleton, marker_channels
from .name_hints import sides_of

FEWEST, MOST = 12, 200  # joints of a person, as tables have them
FEWEST_FRAMES, SOME_FRAMES = 30, 120  # of a recording are looked at
ALL = 0.9  # of the points hang together; the rest is held in a hand
STRETCH, STRETCH_M = 0.005, 0.002  # by which a bone may vary: of its length, and [m]
PARTING = 1.5  # how much longer a bone counts that leads from the middle to one side
MOVING = 0.5  # of the pairs of joints are no bones, and vary
CLEARLY, CLEARLY_M = 10.0, 0.0005  # times as much as any bone, which varies by so much anyway [m]


def with_bones(recording: Recording) -> Recording | None:
    """Return a recording of joints with the skeleton that they hang in.

    Args:
        recording: Joints' positions [m], without a skeleton.

    Returns:
        The joints that hang together, parents first; None where they do not, or hardly move.

    Example:
        >>> from mplearn.demonstrator import demonstrate
        >>> with_bones(demonstrate(["SQD", "SQR"], seed=1).recording) is None  # markers on skin
        True
    """
    if not recording.is_markers:
        return None
    points = recording.markers
    known = points[np.isfinite(points).all(axis=(1, 2))]
    known = known[:: -(-len(known) // SOME_FRAMES) or 1]
    n_points = points.shape[1]
    if not FEWEST <= n_points <= MOST or len(known) < FEWEST_FRAMES:
        return None
    along = known.transpose(2, 0, 1)  # (3, t, N)
    apart = np.sqrt(sum((x[:, :, None] - x[:, None]) ** 2 for x in along))  # (t, N, N)
    length, varies = np.median(apart, axis=0), np.ptp(apart, axis=0)
    rigid = varies <= STRETCH * length + STRETCH_M
    if rigid.mean() > 1.0 - MOVING:
        return None
    sides = np.array(sides_of(recording.marker_names))
    rigid &= sides[:, None] * sides != -1
    parting = np.where(np.abs(sides[:, None]) != np.abs(sides), PARTING, 1.0)
    order, parents = _shortest_tree(np.where(rigid, parting * length, np.inf))
    if len(order) < max(FEWEST, ALL * n_points):
        return None
    bones = varies[order[1:], [order[p] for p in parents[1:]]]
    if np.median(varies) < CLEARLY * max(bones.max(), CLEARLY_M):
        return None
    names = tuple(recording.marker_names[i] for i in order)
    at = known[0, order]
    offsets = np.array([at[k] - (at[p] if p >= 0 else 0.0) for k, p in enumerate(parents)])
    return replace(
        recording,
        frames=points[:, order].reshape(len(points), -1),
        channels=marker_channels(names),
        skeleton=Skeleton(names, tuple(parents), offsets),
    )


def _shortest_tree(lengths: FloatArray) -> tuple[list[int], list[int]]:
    """Return the joints that bones join to the best connected one, and the place of each's parent.

    Args:
        lengths: Of the bones, shape (N, N) [m]; infinite where there is none.
    """
    start = int(np.isfinite(lengths).sum(axis=1).argmax())
    order, parents = [start], [-1]
    best, nearest = lengths[start].copy(), np.zeros(len(lengths), dtype=np.int64)
    best[start] = np.inf
    while np.isfinite(best).any():
        joint = int(best.argmin())
        order.append(joint)
        parents.append(int(nearest[joint]))
        closer = lengths[joint] < best
        best[closer], nearest[closer] = lengths[joint][closer], len(order) - 1
        best[order] = np.inf
    return order, parents
