"""Which axis points up, from the motion itself: gravity keeps feet on a floor, and heads above.

Each of the six directions of the axes earns evidence [nat]; the names of the points are one kind of
it, and hints only:

* names: the parts that sit higher on a body (`part_names.HEIGHTS`) lie farther along it;
* floor: the lowest points stay at one level, and most laboratories put zero there, unless it is in
  the hips; where the file says which way is up, and most of the body lies on that floor, it is
  believed;
* contact: what is lowest stands still more often than what is highest;
* stature: a person is mostly taller than wide.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ...recording import BoolArray, FloatArray
from ..reader import DIRECTIONS
from .part_names import HEIGHTS, place_of

_LOOK = 300  # frames that are looked at
_FEW = 3  # points; fewer tell nothing
_SAYS_SO = 3.0  # nat: the file itself names the axis
_USUAL = 1.5  # nat: its format does
_NAMES = 5.0
_TELLING = 2.0
_LEVEL_SPREAD = 0.05  # of the stature: names closer than this in height tell little
_MOST = 0.8  # of the points: so many names tell what there is
_STANDS = frozenset(("toe", "heel", "ankle"))
_FLOOR = 3.0  # a wall through the origin looks like one as well
_FLOOR_M = (-0.06, 0.13)  # height of the lowest points of a standing foot
_FLAT_M, _STEADY_M = 0.3, 0.04  # how high who lies is, and how steady the level
_AT_ZERO_M = 0.02  # so close to where all is counted from is there
_FLOOR_LIFT_M = 0.25  # jumps are rare and low
_STEADY, _CONTACT, _TALL = 2.0, 1.0, 1.5  # nat, at most
_ROUGH_M = 0.01  # as level as the lowest points of a foot are
_ROUGH_M_S = 0.02
_TO_CHANGE = 2.0  # nat, by which another axis must win
_ALONG = 0.85  # of a standing body's length that lies along an axis, at least
_IN_DOUBT = 1.0


@dataclass(frozen=True)
class Vertical:
    """The axis that points up, as far as that can be found out.

    Attributes:
        up: One of `DIRECTIONS`.
        contradicts: Whether it is another than the one declared.
        doubtful: Whether the evidence does not settle it.
        evidence: What speaks for each direction, length 6 [nat].
    """

    up: str
    contradicts: bool
    doubtful: bool
    evidence: tuple[float, ...]


def find_vertical(
    points: FloatArray,
    names: tuple[str, ...],
    rate_hz: float,
    declared: str,
    *,
    says_so: bool = False,
) -> Vertical:
    """Return which of the axes of points points up.

    Args:
        points: Markers or joint centres [m], shape (T, M, 3); NaN where missing.
        names: Their names, length M; hints.
        rate_hz: Frames per second [1/s].
        declared: The direction that the file, or its format, says: one of `DIRECTIONS`.
        says_so: Whether the file itself says it, not only its format.
    """
    start = DIRECTIONS.index(declared)
    step = max(1, (len(points) - 1) // _LOOK)
    first = points[:-1:step] if len(points) > 1 else points
    after = points[1::step] if len(points) > 1 else points
    seen = np.asarray(~np.isnan(first).any(axis=2))
    enough = seen.sum(axis=1) >= min(_FEW, points.shape[1])
    first, after, seen = first[enough], after[enough], seen[enough]
    if points.shape[1] < _FEW or len(first) == 0:
        return Vertical(declared, False, True, (0.0,) * 6)
    prior = np.zeros(6)
    prior[start] = _SAYS_SO if says_so else _USUAL
    named = _by_names(first, seen, names)
    floor = np.zeros(6)
    evidence = prior + named
    parts = [part for part in (place_of(name).part for name in names) if part]
    # what is lowest of an arm tells nothing; among points whose names say nothing there may be feet
    if len(parts) < _MOST * len(names) or not _STANDS.isdisjoint(parts):
        floor = np.zeros(6) if _from_hips(first, names) else _by_floor(first, seen)
        evidence += floor + _by_motion(first, after, seen, rate_hz) + _by_stature(first, seen)
    best = int(np.argmax(evidence))
    if says_so and best != start and floor[start] > 0 and _rests_on(first, seen)[start]:
        # someone who lies, with the feet at a wall, or stands with the back to one
        return Vertical(declared, False, True, tuple(map(float, evidence)))
    margin = float(np.min(evidence[best] - np.delete(evidence, best)))
    # lying down, or standing on the hands, names say one thing and the floor another
    floor_elsewhere = floor.max() > 0 and floor[best] == 0
    slanted = floor[best] == 0 and bool(named.max() < _ALONG * np.linalg.norm(named))
    if best != start and (
        evidence[best] - evidence[start] < _TO_CHANGE
        or (slanted and says_so)
        or ((floor_elsewhere or slanted) and floor[start] > 0)
    ):
        return Vertical(declared, False, True, tuple(map(float, evidence)))
    lies_on = np.flatnonzero((floor > 0) & _rests_on(first, seen))
    if floor_elsewhere and slanted and len(lies_on) == 1 and named[lies_on[0]] < _TELLING:
        best = int(lies_on[0])  # who lies about anyhow, on the only floor that there is
        return Vertical(DIRECTIONS[best], best != start, True, tuple(map(float, evidence)))
    told = named[best] >= _TELLING or floor[best] > 0
    doubtful = margin < _IN_DOUBT or not told or floor_elsewhere or (slanted and best != start)
    return Vertical(DIRECTIONS[best], best != start, bool(doubtful), tuple(map(float, evidence)))


def _signed(along: FloatArray) -> FloatArray:
    """Return values for x, y, z as values for the six directions."""
    return np.stack([along, -along], axis=-1).reshape(*along.shape[:-1], 6)


def _by_names(points: FloatArray, seen: BoolArray, names: tuple[str, ...]) -> FloatArray:
    levels = np.array([HEIGHTS.get(place_of(name).part, np.nan) for name in names])
    known = ~np.isnan(levels)
    if known.sum() < 2:
        return np.zeros(6)
    seen, at = seen[:, known], points[:, known]
    weight = seen / np.maximum(seen.sum(axis=1, keepdims=True), 1)
    level = levels[known] - (weight * levels[known]).sum(axis=1, keepdims=True)  # (t, K)
    middle = np.where(seen[..., None], at, 0.0)
    middle = middle - (weight[..., None] * middle).sum(axis=1, keepdims=True)
    upward = (weight[..., None] * level[..., None] * np.where(seen[..., None], middle, 0.0)).sum(1)
    size = np.linalg.norm(upward, axis=1)
    spread = np.sqrt((weight * level**2).sum(axis=1))
    usable = (size > 0) & (spread > 0)
    if not usable.any():
        return np.zeros(6)
    along = (upward[usable] / size[usable, None]).mean(axis=0)
    trust = min(1.0, float(np.median(spread[usable])) / _LEVEL_SPREAD)
    # what hangs head down is not held against a direction: people stand on their hands
    return _NAMES * trust * np.maximum(_signed(along), 0.0)


def _lowest(points: FloatArray, seen: BoolArray) -> FloatArray:
    """Return how far along each direction the lowest point is, shape (t, 6)."""
    low = np.where(seen[..., None], points, np.inf).min(axis=1)
    high = np.where(seen[..., None], points, -np.inf).max(axis=1)
    return np.stack([low, -high], axis=-1).reshape(len(points), 6)


def _by_floor(points: FloatArray, seen: BoolArray) -> FloatArray:
    lowest = _lowest(points, seen)
    floor, lifted = np.percentile(lowest, [5, 90], axis=0)
    there = (floor >= _FLOOR_M[0]) & (floor <= _FLOOR_M[1]) & (lifted <= floor + _FLOOR_LIFT_M)
    return np.where(there, _FLOOR, 0.0)


def _from_hips(points: FloatArray, names: tuple[str, ...]) -> bool:
    """Whether points are counted from the middle of the hips, as MediaPipe's: no floor is there."""
    hips = [i for i, name in enumerate(names) if place_of(name).part == "pelvis"]
    away = np.linalg.norm(points[:, hips].mean(axis=1), axis=1) if hips else np.empty(0)
    away = away[~np.isnan(away)]
    return bool(len(away) and np.percentile(away, 95) < _AT_ZERO_M)


def _rests_on(points: FloatArray, seen: BoolArray) -> BoolArray:
    """Return for each direction whether most points stay close above one level, shape (6,)."""
    lowest = _lowest(points, seen)
    low, high = np.percentile(lowest, [5, 90], axis=0)
    along = np.stack([points, -points], axis=-1).reshape(*points.shape[:2], 6)
    above = np.where(seen[..., None], along - lowest[:, None], np.inf) < _FLAT_M
    share = above.sum(axis=(0, 1)) / max(int(seen.sum()), 1)
    return np.asarray((high - low < _STEADY_M) & (share > 0.5))


def _by_motion(
    points: FloatArray, after: FloatArray, seen: BoolArray, rate_hz: float
) -> FloatArray:
    """Return what the steadiness of the level and of what is lowest speaks for."""
    low, high = np.percentile(_lowest(points, seen), [10, 90], axis=0)
    range_m = high - low + _ROUGH_M
    steady = np.clip(np.log(np.median(range_m) / range_m), -_STEADY, _STEADY)
    speed = np.linalg.norm(after - points, axis=2) * rate_hz  # (t, M)
    below = np.where(seen[..., None], points, np.inf).argmin(axis=1)  # (t, 3)
    above = np.where(seen[..., None], points, -np.inf).argmax(axis=1)
    which = np.stack([below, above], axis=-1).reshape(len(points), 6)
    moving = np.take_along_axis(speed, which, axis=1)
    count = (~np.isnan(moving)).sum(axis=0)
    slowly = np.where(np.isnan(moving), 0.0, moving).sum(axis=0) / np.maximum(count, 1) + _ROUGH_M_S
    contact = np.clip(np.log(np.median(slowly) / slowly), -_CONTACT, _CONTACT)
    return np.asarray(steady + contact if count.min() > 0 else steady)


def _by_stature(points: FloatArray, seen: BoolArray) -> FloatArray:
    low = np.where(seen[..., None], points, np.inf).min(axis=1)
    high = np.where(seen[..., None], points, -np.inf).max(axis=1)
    extent = np.median(high - low, axis=0) + _ROUGH_M
    tall = np.log(extent) - (np.log(extent).sum() - np.log(extent)) / 2
    return np.repeat(np.clip(tall, -_TALL, _TALL), 2)
