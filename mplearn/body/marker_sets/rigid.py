"""Distances between markers on one segment of the body: what a person cannot change by moving."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Annotated, NamedTuple

import numpy as np

from mplearn.recording import FloatArray, IntArray
from mplearn.state import Array

from ...maths.compiling import njit
from .marker_set import find_marker_set

FIRM = {"head": 0.003, "hand_l": 0.004, "hand_r": 0.004, "foot_l": 0.004, "foot_r": 0.004}
SOFT = 0.008  # how much skin and straps give elsewhere [m]


def rigid_pairs(marker_names: Sequence[str]) -> tuple[IntArray, FloatArray]:
    """Return the pairs of markers that sit on one segment, and how much their distance varies.

    Args:
        marker_names: Names of the markers, of a known set.

    Returns:
        Places of the two markers, shape (K, 2); usual variation with posture, shape (K,) [m].

    Raises:
        BodyError: The markers belong to no known set.
    """
    markers = find_marker_set(marker_names)
    known = [i for i, knows in enumerate(markers.knows(marker_names)) if knows]
    bodies = markers.select([marker_names[i] for i in known]).bodies
    pairs = [
        (known[i], known[j]) for j in range(len(known)) for i in range(j) if bodies[i] == bodies[j]
    ]
    firm = dict(zip(known, bodies, strict=True))
    give = [FIRM.get(firm[i], SOFT) for i, _ in pairs]
    return np.array(pairs, dtype=np.int64).reshape(-1, 2), np.array(give)


def usual_distances(marker_names: Sequence[str], pairs: IntArray) -> FloatArray:
    """Return the distances of pairs of markers on one segment, on the human of 1.75 m, (K,) [m]."""
    markers = find_marker_set(marker_names)
    known = [i for i, knows in enumerate(markers.knows(marker_names)) if knows]
    places = np.full((len(marker_names), 3), np.nan)
    places[known] = markers.select([marker_names[i] for i in known]).offsets
    return np.asarray(np.linalg.norm(places[pairs[:, 0]] - places[pairs[:, 1]], axis=1))


@njit(cache=True)
def distances_of(markers: FloatArray, pairs: IntArray) -> FloatArray:
    """Return the distances of pairs of markers, (M, 3) and (K, 2) to (K,) [m]; NaN if unseen."""
    out = np.empty(len(pairs))
    for k in range(len(pairs)):
        total = 0.0
        for axis in range(3):
            total += (markers[pairs[k, 0], axis] - markers[pairs[k, 1], axis]) ** 2
        out[k] = np.sqrt(total)
    return out


@njit(cache=True)
def middle_of(rows: FloatArray) -> FloatArray:
    """Return the median of each column, shape (k, K) to (K,), of what is seen; NaN for nothing."""
    out = np.full(rows.shape[1], np.nan)
    seen = np.empty(len(rows))
    for j in range(rows.shape[1]):
        n = 0
        for i in range(len(rows)):
            if rows[i, j] == rows[i, j]:
                seen[n] = rows[i, j]
                n += 1
        if n:
            ordered = np.sort(seen[:n])
            out[j] = 0.5 * (ordered[(n - 1) // 2] + ordered[n // 2])
    return out


class Memory(NamedTuple):
    """What was seen lately, for kernels, which change it in place.

    Attributes:
        near: Short running mean of each distance, shape (K,) [m]; NaN where there is none.
        last: Each distance as last seen, shape (K,) [m]; NaN where never.
        steps: Running variance of its change from one frame to the next, shape (K,) [m^2].
        spread: Running variance about the running mean, shape (K,) [m^2].
        places: Each marker as last seen, shape (M, 3) [m]; NaN where never.
        unseen: Frames since then, shape (M,).
        total: Sum of each distance over the current block of time, shape (K,) [m].
        seen: How often it was seen in the block, shape (K,).
        counts: Frames without a body in sight; frames of the block; shape (2,).
    """

    near: Annotated[FloatArray, Array("k", low=0.0, nan=True)]
    last: Annotated[FloatArray, Array("k", low=0.0, nan=True)]
    steps: Annotated[FloatArray, Array("k", low=0.0)]
    spread: Annotated[FloatArray, Array("k", low=0.0)]
    places: Annotated[FloatArray, Array("m", 3, nan=True)]
    unseen: Annotated[IntArray, Array("m", low=0)]
    total: Annotated[FloatArray, Array("k", low=0.0)]
    seen: Annotated[IntArray, Array("k", low=0)]
    counts: Annotated[IntArray, Array(2, low=0)]

    @classmethod
    def empty(cls, n_markers: int, n_pairs: int) -> Memory:
        """Return the memory of nothing."""
        return cls(
            near=np.full(n_pairs, np.nan),
            last=np.full(n_pairs, np.nan),
            steps=np.full(n_pairs, (4 * NOISE) ** 2),
            spread=np.full(n_pairs, (4 * NOISE) ** 2),
            places=np.full((n_markers, 3), np.nan),
            unseen=np.zeros(n_markers, dtype=np.int64),
            total=np.zeros(n_pairs),
            seen=np.zeros(n_pairs, dtype=np.int64),
            counts=np.zeros(2, dtype=np.int64),
        )

    def copied(self) -> Memory:
        """Return a copy."""
        return self._replace(**{name: each.copy() for name, each in self._asdict().items()})

    def forget_distances(self) -> None:
        """Let the next frame's distances be what they are."""
        self.near[:] = np.nan

    def begin_block(self) -> None:
        """Begin another block of time."""
        self.total[:], self.seen[:], self.counts[BLOCK] = 0.0, 0, 0


class Rules(NamedTuple):
    """How frames are held against the memory, for kernels.

    Attributes:
        quick: Share of the running means that a frame renews.
        slow: Share of the variances that it renews.
        reach_m: How far a marker comes in a frame at most [m].
        absent_frames: Frames without a body in sight after which it may be anybody.
        block_frames: Frames of a block of time.
    """

    quick: float
    slow: float
    reach_m: float
    absent_frames: float
    block_frames: float


@njit(cache=True)
def follow_steadily(
    frames: FloatArray, pairs: IntArray, memory: Memory, rules: Rules
) -> tuple[int, int]:
    """Hold frames against the memory, and take them up, until one is in doubt.

    A frame is in doubt where most of the distances have changed, where most markers are farther
    from where they were than anybody moves, or where nobody was in sight for long.

    Args:
        frames: Markers, shape (T, M, 3) [m]; NaN where unseen.
        pairs: Pairs of markers, shape (K, 2).
        memory: What was seen lately; changed in place.
        rules: How frames are held against it.

    Returns:
        How many frames were taken up; `STEADY` if these are all, `IN_DOUBT` if the next one is in
        doubt, `FULL` if the block of time is full with the last of them.
    """
    for t in range(len(frames)):
        seen = distances_of(frames[t], pairs)
        visible = 0
        for k in range(len(seen)):
            visible += seen[k] == seen[k]
        if 3 * visible < len(seen):
            memory.counts[ABSENT] += 1
            for m in range(len(memory.unseen)):
                memory.unseen[m] += 1
            continue
        if memory.counts[ABSENT] > rules.absent_frames:
            memory.near[:] = np.nan
            return t, IN_DOUBT
        if 2 * _share_off(seen, memory) > 1 or jumped(frames[t], memory, rules.reach_m, 0):
            return t, IN_DOUBT
        _take_up(seen, frames[t], memory, rules)
        memory.counts[ABSENT] = 0
        memory.counts[BLOCK] += 1
        if memory.counts[BLOCK] >= rules.block_frames:
            return t + 1, FULL
    return len(frames), STEADY


@njit(cache=True)
def goes_on(
    frame: FloatArray, pairs: IntArray, memory: Memory, rules: Rules, later: int, share: float
) -> bool:
    """Return whether a frame goes on from the memory: few distances have changed, and no jump.

    Args:
        frame: Markers, shape (M, 3) [m].
        pairs: Pairs of markers, shape (K, 2).
        memory: What was seen lately.
        rules: How frames are held against it.
        later: Frames since then.
        share: Of the distances that may have changed.
    """
    seen = distances_of(frame, pairs)
    known = len(seen) == 0
    for k in range(len(seen)):
        known |= seen[k] - memory.near[k] == seen[k] - memory.near[k]
    if not known or _share_off(seen, memory) > share:
        return False
    return not jumped(frame, memory, rules.reach_m, later)


@njit(cache=True)
def _share_off(seen: FloatArray, memory: Memory) -> float:
    off, known = 0, 0
    for k in range(len(seen)):
        if not (np.isnan(seen[k]) or np.isnan(memory.near[k])):
            known += 1
            off += (seen[k] - memory.near[k]) ** 2 > FAR**2 * memory.spread[k]
    return off / max(known, 1)


@njit(cache=True)
def jumped(frame: FloatArray, memory: Memory, reach_m: float, later: int) -> bool:
    """Return whether most markers, of three or more, are out of reach from where they were."""
    far, known = 0, 0
    for m in range(len(frame)):
        way = 0.0
        for axis in range(3):
            way += (frame[m, axis] - memory.places[m, axis]) ** 2
        if way == way:
            known += 1
            reach = reach_m * (memory.unseen[m] + later + 1) + SHAKE
            far += way > reach * reach
    return known >= 3 and 2 * far > known


@njit(cache=True)
def _take_up(seen: FloatArray, frame: FloatArray, memory: Memory, rules: Rules) -> None:
    last, near, steps, spread = memory.last, memory.near, memory.steps, memory.spread
    slow = rules.slow
    for k in range(len(seen)):
        if np.isnan(seen[k]):
            continue
        memory.total[k] += seen[k]
        memory.seen[k] += 1
        if np.isnan(near[k]):
            near[k] = last[k] = seen[k]
            continue
        step, deviation = seen[k] - last[k], seen[k] - near[k]
        steps[k] += slow * (min(step**2, 16 * steps[k]) - steps[k])
        spread[k] += slow * (min(deviation**2, 16 * spread[k]) - spread[k])
        steps[k], spread[k] = max(steps[k], NOISE**2), max(spread[k], NOISE**2)
        near[k] += rules.quick * deviation
        last[k] = seen[k]
    for m in range(len(frame)):
        if frame[m, 0] != frame[m, 0] or frame[m, 1] != frame[m, 1] or frame[m, 2] != frame[m, 2]:
            memory.unseen[m] += 1
            continue
        memory.places[m] = frame[m]
        memory.unseen[m] = 0


STEADY, IN_DOUBT, FULL = 0, 1, 2
ABSENT, BLOCK = 0, 1  # in `Memory.counts`
FAR = 2.0  # standard deviations
NOISE = 0.0005  # smallest of them [m]
SHAKE = 0.02  # how far apart two measurements of a resting marker can lie [m]
