"""The tree that joints hang in, from the joints alone: bones keep their lengths.

Tables of joints' places do not say which bones join them. Where all of them hang together by bones
that do not stretch, while most pairs come nearer and go apart, that tree is the skeleton: the
shortest of those that span the joints. Markers on skin do not hang together so; where somebody
hardly moves all of them seem to, and how much two vary grows with how far they are apart, while
bones vary far less than anything else. Names tell left from right: no bone joins the two (feet that
stand keep their distance as well as bones do), and limbs part from the middle.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from ..recording import BoolArray, FloatArray, IntArray, Recording, Skeleton, marker_channels
from .name_hints import sides_of

FEWEST, MOST = 12, 200  # joints of a person, as tables have them
FEWEST_FRAMES, SOME_FRAMES = 30, 120  # of a recording are looked at
ALL = 0.9  # of the points hang together; the rest is held in a hand
STRETCH, STRETCH_M = 0.005, 0.002  # by which a bone may vary: of its length, and [m]
PARTING = 1.5  # how much longer a bone counts that leads from the middle to one side
MOVING = 0.5  # of the pairs of joints are no bones, and vary
CLEARLY, CLEARLY_M = 10.0, 0.0005  # times as much as any bone, which varies by so much anyway [m]
SEEN = 0.5  # of the frames in which a joint is seen, at least
MANY_FRAMES = 480  # are looked at where there is noise
NOISY, NOISE_M = 1.25, 0.01  # times by which noise looks smaller, and how large it is at most [m]
STILL = 0.2  # of what a bone may vary from its least to its greatest length: standard deviation


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
    joints = np.flatnonzero(np.isfinite(recording.markers).all(axis=2).mean(axis=0) >= SEEN)
    points = recording.markers[:, joints]
    known = np.flatnonzero(np.isfinite(points).all(axis=(1, 2)))
    if not FEWEST <= len(joints) <= MOST or len(known) < FEWEST_FRAMES:
        return None
    names = tuple(recording.marker_names[i] for i in joints)
    sides = np.array(sides_of(names))
    for measure in (_exactly, _but_for_noise):
        found = _tree(measure(points, known), sides)
        if found is not None:
            break
    else:
        return None
    order, parents = found
    names = tuple(names[i] for i in order)
    at = points[known[0], order]
    offsets = np.array([at[k] - (at[p] if p >= 0 else 0.0) for k, p in enumerate(parents)])
    return replace(
        recording,
        frames=points[:, order].reshape(len(points), -1),
        channels=marker_channels(names),
        skeleton=Skeleton(names, tuple(parents), offsets),
    )


class _Pairs(NamedTuple):
    """What is known of every two points, shape (N, N).

    Attributes:
        length: Their median distance [m].
        rigid: Whether a bone may join them.
        moves: By how much they come nearer and go apart, squared [m^2]; without noise it is
            negative by chance.
        of_bones: What that is for some bones.
    """

    length: FloatArray
    rigid: BoolArray
    moves: FloatArray
    of_bones: Callable[[FloatArray], float]


def _exactly(points: FloatArray, known: IntArray) -> _Pairs:
    """Return which points keep their distance in the frames that are looked at."""
    some = points[known[:: -(-len(known) // SOME_FRAMES)]]
    apart = [_apart(some, joint) for joint in range(points.shape[1])]
    length, varies = (np.array([of(x, axis=0) for x in apart]) for of in (np.median, np.ptp))
    return _Pairs(length, varies <= STRETCH * length + STRETCH_M, varies**2, np.max)


def _but_for_noise(points: FloatArray, known: IntArray) -> _Pairs:
    """Return which points keep their distance but for noise, which changes from frame to frame."""
    inner = known[(known > 0) & (known < len(points) - 1)][:: -(-len(known) // MANY_FRAMES)]
    here, beside = points[inner], (points[inner - 1], points[inner + 1])
    found = []
    for joint in range(points.shape[1]):
        apart = _apart(here, joint)
        jumps = apart - 0.5 * (_apart(beside[0], joint) + _apart(beside[1], joint))
        jumps = jumps[np.isfinite(jumps).all(axis=1)]
        noise = (jumps**2).sum(axis=0) / (1.5 * max(1, len(jumps)))
        found.append((np.median(apart, axis=0), apart.var(axis=0), noise))
    length, spread, noise = np.array(found).swapaxes(0, 1)
    usual = STILL * (STRETCH * length + STRETCH_M)
    rigid = (spread <= NOISY**2 * noise + usual**2) & (noise <= NOISE_M**2)
    return _Pairs(length, rigid, spread - noise, np.mean)


def _apart(points: FloatArray, joint: int) -> FloatArray:
    """Return how far all points are from one, shape (t, N, 3) to (t, N)."""
    return np.asarray(np.linalg.norm(points - points[:, joint, None], axis=2))


def _tree(pairs: _Pairs, sides: IntArray) -> tuple[list[int], list[int]] | None:
    """Return the joints that hang together by bones, and the place of each one's parent.

    None where they do not, hardly move, or do not move clearly more than bones.

    Args:
        pairs: What is known of every two joints.
        sides: 1, -1 or 0: on which side each is by its name, shape (N,).
    """
    if pairs.rigid.mean() > 1.0 - MOVING:
        return None
    may_join = pairs.rigid & (sides[:, None] * sides != -1)
    parting = np.where(np.abs(sides[:, None]) != np.abs(sides), PARTING, 1.0)
    order, parents = _shortest_tree(np.where(may_join, parting * pairs.length, np.inf))
    if len(order) < max(FEWEST, ALL * len(sides)):
        return None
    bones = pairs.of_bones(pairs.moves[order[1:], [order[p] for p in parents[1:]]])
    usual = np.sqrt(np.median(np.maximum(pairs.moves, 0.0)))
    clear = usual >= CLEARLY * max(np.sqrt(max(bones, 0.0)), CLEARLY_M)
    return (order, parents) if clear else None


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
