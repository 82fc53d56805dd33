"""Which joints hang on their parents: not the hips in a root on the floor, nor a prop far away."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ...recording import FloatArray, IntArray

LOOSE, LOOSE_M = 0.5, 0.05  # how much a bone may stretch and still be one: of its length, and [m]
FAR = 0.75  # how long it may be: of the longest way along all the others


def hanging(points: FloatArray, parents: Sequence[int]) -> tuple[IntArray, FloatArray]:
    """Return the parents that joints hang on, -1 where on none, and how far they are from these.

    A joint hangs on none where it moves freely in its parent, or is farther from it than any bone
    of a body is long: the root of many files stays on the floor, or where all is counted from.

    Args:
        points: Where joints are in some frames, shape (T, J, 3) [m]; NaN where missing.
        parents: Index of each joint's parent, length J, parents first; -1 for a root.

    Returns:
        Parents, and lengths of the bones to them, 0 where there is none, each of shape (J,) [m].

    Example:
        >>> body = np.cumsum([[0, 0, 9.0], [0, 0, 0.4], [0, 0, 0.3], [0, 0, 0.3]], axis=0)
        >>> points = np.concatenate([np.zeros((1, 3)), body])[None]  # hips 9 m above a root
        >>> parents, lengths = hanging(points, (-1, 0, 1, 2, 3))
        >>> parents.tolist(), lengths.round(1).tolist()
        ([-1, -1, 1, 2, 3], [0.0, 0.0, 0.4, 0.3, 0.3])
    """
    kept = np.array(parents)
    bones = points - points[:, np.maximum(kept, 0)]
    bones = np.sqrt((bones * bones).sum(axis=2))  # (T, J)
    seen = ~np.isnan(bones).all(axis=0)  # what is never seen hangs where the file says
    lengths, give = np.zeros((2, len(kept)))
    low, lengths[seen], high = np.nanquantile(bones[:, seen], (0.05, 0.5, 0.95), axis=0)
    give[seen] = high - low
    kept[(kept >= 0) & (give > LOOSE * lengths + LOOSE_M)] = -1
    return near(kept, lengths)


def near(parents: IntArray, lengths: FloatArray) -> tuple[IntArray, FloatArray]:
    """Return parents, and lengths of the bones to them, but none that is too long for a body's."""
    kept, bones = parents.copy(), np.where(parents < 0, 0.0, lengths)
    for joint in np.argsort(-bones):
        others = np.where(np.arange(len(kept)) == joint, -1, kept)
        if bones[joint] <= FAR * longest_way(others, bones):
            break
        kept, bones[joint] = others, 0.0
    return kept, bones


def longest_way(parents: IntArray, lengths: FloatArray) -> float:
    """Return the length of the longest way along bones [m], where parents stand first."""
    down = np.zeros(len(parents))
    best = 0.0
    for joint in range(len(parents) - 1, 0, -1):
        parent = int(parents[joint])
        if parent >= 0:
            reach = down[joint] + lengths[joint]
            best = max(best, down[parent] + reach)
            down[parent] = max(down[parent], reach)
    return best


def trees_of(parents: IntArray) -> dict[int, list[int]]:
    """Return the joints of each tree, by its root, where parents stand first."""
    roots: list[int] = []
    found: dict[int, list[int]] = {}
    for joint, parent in enumerate(parents.tolist()):
        roots.append(joint if parent < 0 else roots[parent])
        found.setdefault(roots[joint], []).append(joint)
    return found
