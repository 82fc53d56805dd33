"""Where along a chain of joints the hip, the knee and the ankle are: by what people are like.

A chain from the trunk outwards may hold more joints than a limb has: twists, helpers. Of all ways
to name its joints the most likely one is taken, given how long the parts of a limb are relative to
each other ([DrillisContini1966], as in `mplearn.body.models.human_model`) and that a bone does not
bend.
"""

from __future__ import annotations

from itertools import combinations
from typing import NamedTuple

import numpy as np

from ..recording import BoolArray, FloatArray

BENT = 0.03  # how much of its length a bone may seem to lose by bending
STRAIGHT_DEG, STIFF = 2.0, 3.0  # a joint that bends less is hardly a knee or a wrist: what it costs
HELD = 0.1  # a joint that bends by less than this share of what another one does is held
AT_ROOT = 4.0  # what it costs that both limbs begin at one point, as in a matchstick man
SKIPPED, MOST_SKIPPED = 0.5, 3  # what a joint between ankle and ball costs, and how many there are
STRANGE = 12.0  # what a limb costs that no person has


class LimbLaw(NamedTuple):
    """What a limb's parts are like, relative to its upper bone: logarithm of mean, deviation."""

    inner: tuple[float, float]  # from the trunk's joint to the limb's first
    lower: tuple[float, float]  # shank or forearm
    outer: tuple[float, float]  # foot to the ball, hand to the knuckles
    cosine: tuple[float, float]  # between the lower bone and what follows it, usually


LEG = LimbLaw((np.log(0.25), 0.6), (0.0, 0.14), (np.log(0.34), 0.45), (0.35, 0.3))
ARM = LimbLaw((np.log(0.55), 0.7), (np.log(0.80), 0.14), (np.log(0.40), 0.5), (0.95, 0.25))


class Limb(NamedTuple):
    """Places on a chain: first, middle and last joint, and what it costs to believe it."""

    places: tuple[int, int, int]
    cost: float


def fit_limb(chain: FloatArray, law: LimbLaw, fans: BoolArray) -> Limb:
    """Find a limb's three joints on a chain.

    Args:
        chain: Where its joints are, the trunk's first, shape (T, n, 3) [m], n >= 3.
        law: What the limb is like.
        fans: At which joints three or more bones go on, as fingers do, shape (n,): no wrist or
            ankle lies beyond such a joint.

    Returns:
        The likeliest places, and minus the logarithm of its likelihood.
    """
    n = chain.shape[1]
    bones = np.median(np.linalg.norm(np.diff(chain, axis=1), axis=2), axis=0)  # (n - 1,)
    stiff, held = _never_bends(chain)
    along = np.concatenate(([0.0], np.cumsum(bones)))
    best = Limb((0, 1, 2), np.inf)
    for first, middle, last in combinations(range(n), 3):
        cost = _cost(chain, along, (first, middle, last), law)
        cost += AT_ROOT if first == 0 and n > 3 else 0.0
        cost += STIFF * float((stiff | held)[middle] + stiff[last])
        cost += STRANGE * float(fans[middle + 1 : last].any())
        if cost < best.cost:
            best = Limb((first, middle, last), cost)
    return best


def _never_bends(chain: FloatArray) -> tuple[BoolArray, BoolArray]:
    """Return which joints of a chain are straight in every frame, and which as bent as in all.

    Each of shape (n,), false for its ends; none is held where all are.
    """
    bones = np.diff(chain, axis=1)
    bones /= np.maximum(np.linalg.norm(bones, axis=2, keepdims=True), 1e-9)
    cosines = (bones[:, :-1] * bones[:, 1:]).sum(axis=2)  # (T, n - 2)
    stiff, held = np.zeros((2, chain.shape[1]), dtype=np.bool_)
    stiff[1:-1] = cosines.min(axis=0) > np.cos(np.radians(STRAIGHT_DEG))
    bends = np.ptp(np.arccos(np.clip(cosines, -1.0, 1.0)), axis=0)
    held[1:-1] = (bends < HELD * bends.max()) & (bends.max() > np.radians(STRAIGHT_DEG))
    return stiff, held


def _cost(
    chain: FloatArray, along: FloatArray, places: tuple[int, int, int], law: LimbLaw
) -> float:
    first, middle, last = places
    upper, lower = along[middle] - along[first], along[last] - along[middle]
    inner = along[first]
    cost = _penalty(np.log(lower / upper), law.lower)
    cost += _penalty(np.log(max(inner, 0.02 * upper) / upper), law.inner) if first else 0.5
    for a, b in ((first, middle), (middle, last)):
        straight = np.linalg.norm(chain[:, b] - chain[:, a], axis=1).min()
        cost += 0.5 * ((1.0 - straight / (along[b] - along[a])) / BENT) ** 2 if b > a + 1 else 0.0
    if last + 1 < len(along):
        # the ball and the knuckles may lie behind joints of the foot's and the hand's own bones
        bone = chain[:, last] - chain[:, middle]
        cost += min(
            _penalty(np.log((along[k] - along[last]) / upper), law.outer)
            + _penalty(_cosine(bone, chain[:, k] - chain[:, last]), law.cosine)
            + SKIPPED * (k - last - 1)
            for k in range(last + 1, min(last + 1 + MOST_SKIPPED, len(along)))
        )
    else:
        cost += 1.0
    return min(float(cost), 4 * STRANGE)


def _cosine(a: FloatArray, b: FloatArray) -> float:
    """Return the usual cosine between vectors, shapes (T, 3)."""
    lengths = np.linalg.norm(a, axis=1) * np.linalg.norm(b, axis=1)
    return float(np.median((a * b).sum(axis=1) / np.maximum(lengths, 1e-9)))


def _penalty(value: float, law: tuple[float, float]) -> float:
    return 0.5 * ((value - law[0]) / law[1]) ** 2
