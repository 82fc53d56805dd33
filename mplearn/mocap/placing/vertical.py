"""Which axis points up, from the motion itself: gravity keeps feet on a floor, and heads above.

Each of the six directions of the axes earns evidence [nat]; the names of the points are one kind of
it, and hints only:

* posture: the parts that sit higher on a body (`part_names.HEIGHTS`) lie farther along it;
* floor: the lowest points stay at one level, and most laboratories put zero there, unless it is in
  the hips; where the file says which way is up, and most of the body lies on that floor, it is
  believed;
* contact: what is lowest stands still more often than what is highest;
* stature: a person is mostly taller than wide.

People lie, hang, swim and stand on their hands. So posture alone settles nothing: it is believed
where the file, its format or the floor agrees, and nothing speaks for somebody who lies.
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
_BENT = 0.4  # of that, where the body is bent
_TELLING = 2.0
_LEANING = 3.0  # nat: who is bent, and yet more upright than not
_LEVEL_SPREAD = 0.05  # of the stature: names closer than this in height tell little
_MOST = 0.8  # of the points: so many names tell what there is
_STANDS = frozenset(("toe", "heel", "ankle"))
_FLOOR = 3.0  # a wall through the origin looks like one as well
_FLOOR_M = (-0.06, 0.13)  # height of the lowest points of a standing foot
_FLAT_M, _STEADY_M = (0.3, 0.4), 0.04  # how high who lies is, or on the side; how steady the level
_JUST_M, _RESTLESS_M = 0.07, 0.12  # height of the lowest points of who lies, and how it varies
_LYING_M = (0.06, 0.45)  # height of the middle of who lies, or on the side
_AT_ZERO_M = 0.02  # so close to where all is counted from is there
_FLOOR_LIFT_M = 0.25  # jumps are rare and low
_STEADY, _CONTACT, _TALL = 2.0, 1.0, 1.5  # nat, at most
_ROUGH_M = 0.01  # as level as the lowest points of a foot are
_ROUGH_M_S = 0.02
_TO_CHANGE = 2.0  # nat, by which another axis must win
_ALONG = 0.85  # of a standing body's length that lies along an axis, at least
_STRAIGHT = 0.5  # cosine between a standing body's legs, or trunk, and the axis, at least
_IN_DOUBT = 1.0
_UPWARD = (DIRECTIONS.index("y"), DIRECTIONS.index("z"))  # in nearly all files
_OF_CAMERAS = (DIRECTIONS.index("y"), DIRECTIONS.index("-y"))


@dataclass(frozen=True)
class Vertical:
    """The axis that points up, as far as that can be found out.

    Attributes:
        up: One of `DIRECTIONS`.
        contradicts: Whether it is another than the one declared.
        doubtful: Whether the evidence does not settle it.
        inverted: Whether head and feet would have changed places, and no floor says so.
        evidence: What speaks for each direction, length 6 [nat].
    """

    up: str
    contradicts: bool
    doubtful: bool
    inverted: bool
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
        return Vertical(declared, False, True, False, (0.0,) * 6)
    posture, straight = _posture(first, seen, names)
    # who sits, crawls or bows has the feet ahead of the head, not only below
    evidence = (1.0 if straight else _BENT) * posture
    evidence[start] += _SAYS_SO if says_so else _USUAL
    ground = _Ground.unseen()
    parts = [part for part in (place_of(name).part for name in names) if part]
    # what is lowest of an arm tells nothing; among points whose names say nothing there may be feet
    if len(parts) < _MOST * len(names) or not _STANDS.isdisjoint(parts):
        ground = _Ground.of(first, seen, names)
        evidence += ground.evidence + _by_contact(first, after, seen, rate_hz)
        evidence += _by_stature(first, seen)
    stands = int(np.argmax(posture)) if straight else None
    up = _likeliest(evidence, start, stands, ground, says_so=says_so)
    if stands is not None:
        sure = up == stands and (ground.agrees(up) if up == start else ground.overrules(up, start))
    else:
        likely = up == start or (up in _UPWARD and not posture.any())
        ahead = float(evidence[up] - np.delete(evidence, up).max())
        leans = up == start and bool(posture[up] >= _LEANING) and ground.agrees(up)
        sure = likely and ahead >= _IN_DOUBT and (leans or ground.is_only(up))
    upright = up == start == stands and bool(ground.at_zero[up])
    sure = sure and (says_so or not ground.may_be_lain_on(up, upright=upright))
    inverted = bool(posture[up ^ 1] >= _TELLING) and not ground.at_zero[up]
    return Vertical(DIRECTIONS[up], up != start, not sure, inverted, tuple(map(float, evidence)))


@dataclass(frozen=True, eq=False)
class _Ground:
    """What the lowest points along each direction say of a floor.

    Attributes:
        at_zero: Whether they are where most laboratories put zero, as feet or who lies, shape (6,).
        lain_on: Whether somebody might lie there, shape (6,).
        over: Whether the body is on one side of zero, and as far from it as who lies, shape (6,).
        level: Whether who moves goes along it rather than up or down, shape (6,).
        rests: Whether most points stay close above one level, shape (6,).
        from_hips: Whether points are counted from the hips: then no floor is at zero.
        evidence: What they speak for, shape (6,) [nat].
    """

    at_zero: BoolArray
    lain_on: BoolArray
    over: BoolArray
    level: BoolArray
    rests: BoolArray
    from_hips: bool
    evidence: FloatArray

    @classmethod
    def unseen(cls) -> _Ground:
        """Return what is known where no feet are."""
        no = np.zeros(6, dtype=np.bool_)
        return cls(no, no, no, ~no, no, False, np.zeros(6))

    @classmethod
    def of(cls, points: FloatArray, seen: BoolArray, names: tuple[str, ...]) -> _Ground:
        """Look for it under points, shape (t, M, 3) [m]."""
        lowest = _lowest(points, seen)
        least, low, high = np.percentile(lowest, [5, 10, 90], axis=0)
        from_hips = _from_hips(points, names)
        low_lifts = high <= least + _FLOOR_LIFT_M
        floor = low_lifts & (not from_hips)
        at_zero = floor & (least >= _FLOOR_M[0]) & (least <= _FLOOR_M[1])
        along = np.stack([points, -points], axis=-1).reshape(*points.shape[:2], 6)
        above = np.where(seen[..., None], along - lowest[:, None], np.inf)
        flat, wide = ((above < far).sum(axis=(0, 1)) > 0.5 * seen.sum() for far in _FLAT_M)
        rests = flat & (high - least < _STEADY_M)
        lain_on = at_zero & wide & (least <= _JUST_M) & (high <= least + _RESTLESS_M)
        middle = np.nanmedian(np.where(seen[..., None], along, np.nan), axis=(0, 1))
        over = at_zero & (least >= 0.0) & (middle >= _LYING_M[0]) & (middle <= _LYING_M[1])
        rises_m = high - least
        farthest = rises_m.reshape(3, 2).max(axis=1)
        level = low_lifts | (np.repeat(farthest, 2) < farthest.max())
        range_m = high - low + _ROUGH_M
        steadiness = np.clip(np.log(np.median(range_m) / range_m), -_STEADY, _STEADY)
        evidence = np.where(at_zero, _FLOOR, 0.0) + steadiness
        return cls(at_zero, lain_on, over, level, rests, from_hips, evidence)

    def agrees(self, up: int) -> bool:
        """Whether nothing speaks against one who is upright along the direction that is usual."""
        if self.at_zero[up] or self.from_hips:
            return True
        return bool(self.level[up]) and not (self._is_elsewhere(up) or self.lain_on.any())

    def overrules(self, up: int, start: int) -> bool:
        """Whether who is upright along a direction stands on a floor, and lies on none."""
        if self.at_zero[start] or self._is_elsewhere(up):
            return False
        # as cameras see people, with x to the side, no floor is needed
        return bool(self.at_zero[up]) or (self.from_hips and up in _OF_CAMERAS and up != start ^ 1)

    def is_only(self, up: int) -> bool:
        """Whether a floor is at zero of a direction, and nobody might lie on another."""
        return bool(self.at_zero[up]) and not self._is_elsewhere(up)

    def may_be_lain_on(self, up: int, *, upright: bool) -> bool:
        """Whether somebody might lie on a floor at zero of another direction that is usually up.

        Who stands upright on the usual floor does so only if all of the body is above the other.
        """
        lain_on = self.over if upright else self.lain_on
        return any(lain_on[k] for k in _UPWARD if k != up)

    def _is_elsewhere(self, up: int) -> bool:
        """Whether a floor is at zero of another direction: one likely, or one to lie on."""
        elsewhere = self.at_zero & self.rests
        likely = [*_UPWARD, up ^ 1]
        elsewhere[likely] = self.at_zero[likely]
        elsewhere[up] = False
        return bool(elsewhere.any())


def _likeliest(
    evidence: FloatArray, start: int, stands: int | None, ground: _Ground, *, says_so: bool
) -> int:
    """Return the direction that is up: the declared one, unless another is clearly so."""
    best = int(np.argmax(evidence))
    if best == start or evidence[best] - evidence[start] < _TO_CHANGE:
        return start
    if says_so and ground.at_zero[start] and ground.rests[start]:
        return start  # someone who lies, with the feet at a wall, or stands with the back to one
    if ground.at_zero[best]:
        return best
    # lying down, or standing on the hands, names say one thing and the floor another
    if ground.at_zero[start] or (says_so and stands is None):
        return start
    lain_on = np.flatnonzero(ground.at_zero & ground.rests)
    if len(lain_on) == 1 and stands is None:
        return int(lain_on[0])  # who lies about anyhow, on the only floor that there is
    return best


def _signed(along: FloatArray) -> FloatArray:
    """Return values for x, y, z as values for the six directions."""
    return np.stack([along, -along], axis=-1).reshape(*along.shape[:-1], 6)


def _posture(
    points: FloatArray, seen: BoolArray, names: tuple[str, ...]
) -> tuple[FloatArray, bool]:
    """Return what the names of points speak for, shape (6,), and whether the body is straight."""
    levels = np.array([HEIGHTS.get(place_of(name).part, np.nan) for name in names])
    ways, trust = _way_up(points, seen, levels)
    if not len(ways):
        return np.zeros(6), False
    along = ways.mean(axis=0)
    # what hangs head down is not held against a direction: people stand on their hands
    evidence = _NAMES * trust * np.maximum(_signed(along), 0.0)
    straight = evidence.max() >= max(_TELLING, _ALONG * float(np.linalg.norm(evidence)))
    for half in (levels <= HEIGHTS["pelvis"], levels >= HEIGHTS["pelvis"]):
        ways, _ = _way_up(points, seen, np.where(half, levels, np.nan))
        if len(ways):
            part = _signed(ways.mean(axis=0))
            straight &= bool(
                part[evidence.argmax()] > _STRAIGHT * np.linalg.norm(ways.mean(axis=0))
            )
    return evidence, bool(straight)


def _way_up(points: FloatArray, seen: BoolArray, levels: FloatArray) -> tuple[FloatArray, float]:
    """Return where the body points up by levels that are known, (t, 3), and how sure that is."""
    known = ~np.isnan(levels)
    if known.sum() < 2:
        return np.empty((0, 3)), 0.0
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
        return np.empty((0, 3)), 0.0
    trust = min(1.0, float(np.median(spread[usable])) / _LEVEL_SPREAD)
    return upward[usable] / size[usable, None], trust


def _lowest(points: FloatArray, seen: BoolArray) -> FloatArray:
    """Return how far along each direction the lowest point is, shape (t, 6)."""
    low = np.where(seen[..., None], points, np.inf).min(axis=1)
    high = np.where(seen[..., None], points, -np.inf).max(axis=1)
    return np.stack([low, -high], axis=-1).reshape(len(points), 6)


def _from_hips(points: FloatArray, names: tuple[str, ...]) -> bool:
    """Whether points are counted from the middle of the hips, as MediaPipe's: no floor is there."""
    hips = [i for i, name in enumerate(names) if place_of(name).part == "pelvis"]
    away = np.linalg.norm(points[:, hips].mean(axis=1), axis=1) if hips else np.empty(0)
    away = away[~np.isnan(away)]
    return bool(len(away) and np.percentile(away, 95) < _AT_ZERO_M)


def _by_contact(
    points: FloatArray, after: FloatArray, seen: BoolArray, rate_hz: float
) -> FloatArray:
    """Return what the steadiness of what is lowest speaks for."""
    speed = np.linalg.norm(after - points, axis=2) * rate_hz  # (t, M)
    below = np.where(seen[..., None], points, np.inf).argmin(axis=1)  # (t, 3)
    above = np.where(seen[..., None], points, -np.inf).argmax(axis=1)
    which = np.stack([below, above], axis=-1).reshape(len(points), 6)
    moving = np.take_along_axis(speed, which, axis=1)
    count = (~np.isnan(moving)).sum(axis=0)
    slowly = np.where(np.isnan(moving), 0.0, moving).sum(axis=0) / np.maximum(count, 1) + _ROUGH_M_S
    contact: FloatArray = np.clip(np.log(np.median(slowly) / slowly), -_CONTACT, _CONTACT)
    return contact if count.min() > 0 else np.zeros(6)


def _by_stature(points: FloatArray, seen: BoolArray) -> FloatArray:
    low = np.where(seen[..., None], points, np.inf).min(axis=1)
    high = np.where(seen[..., None], points, -np.inf).max(axis=1)
    extent = np.median(high - low, axis=0) + _ROUGH_M
    tall = np.log(extent) - (np.log(extent).sum() - np.log(extent)) / 2
    return np.repeat(np.clip(tall, -_TALL, _TALL), 2)
