"""Whether a person in landmarks faces where feet, knees, face and pelvis say, or is mirrored."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from ..errors import BodyError
from ..mocap.options import option
from ..recording import FloatArray

# from what lies behind to what lies ahead of it
_AHEAD = (
    *((f"heel_back_{s}", toe) for s in "lr" for toe in (f"toe_tip_{s}", f"metatarsal2_{s}")),
    *((f"heel_back_{s}", f"ball_{s}") for s in "lr"),
    *((f"ankle_{s}", toe) for s in "lr" for toe in (f"toe_tip_{s}", f"ball_{s}")),
    *((f"ankle_outer_{s}", f"metatarsal2_{s}") for s in "lr"),
    *((f"iliac_back_{s}", f"iliac_front_{s}") for s in "lr"),
    *(("sacrum", f"iliac_front_{s}") for s in "lr"),
    *((f"ear_{s}", "nose") for s in "lr"),
    *(("c7", "jugular_notch"), ("t10", "xiphoid"), ("head_rear", "head_front")),
)
_ACROSS = ("hip", "iliac_front", "iliac_back", "trochanter", "acromion", "shoulder", "knee_outer")
_TRUNK = (("hip", "iliac_front"), ("shoulder", "acromion"))  # below, above
UPRIGHT = 0.7  # cosine between trunk and vertical; who lies prone has toes that point backwards
BENT = 0.05  # how far a knee is ahead of hip and ankle where it tells: of the leg
MIRRORED = -0.3  # mean cosine between ahead by the sides' names and ahead by the landmarks


class MirroredError(BodyError):
    """Left and right are exchanged: one axis is turned round, or names are."""


def check_facing(name: str, at: Mapping[str, FloatArray]) -> None:
    """Refuse a person whose left and right are exchanged.

    Args:
        name: What the recording is called.
        at: Where each landmark is in some frames, shape (T, 3) [m], z up; NaN where missing.

    Raises:
        MirroredError: Feet, knees, face and pelvis point backwards if left is where the names say.
    """
    at = _while_upright(at)
    across = [
        at[f"{place}_l"] - at[f"{place}_r"]
        for place in _ACROSS
        if f"{place}_l" in at and f"{place}_r" in at
    ]
    ways = [at[ahead] - at[behind] for behind, ahead in _AHEAD if {behind, ahead} <= at.keys()]
    ways += [
        _knee_ahead(*(at[f"{joint}_{s}"] for joint in ("hip", "knee", "ankle")))
        for s in "lr"
        if {f"hip_{s}", f"knee_{s}", f"ankle_{s}"} <= at.keys()
    ]
    if not across or not ways:
        return
    left = across[0] * (1.0, 1.0, 0.0)
    forward = np.cross(left, (0.0, 0.0, 1.0))
    cosines = []
    for way in ways:
        level = way * (1.0, 1.0, 0.0)
        lengths = np.linalg.norm(level, axis=1) * np.linalg.norm(forward, axis=1)
        each = (level * forward).sum(axis=1) / np.maximum(lengths, 1e-9)
        each = each[np.isfinite(each)]
        if len(each):
            cosines.append(float(np.median(each)))
    if cosines and np.mean(cosines) < MIRRORED:
        raise MirroredError(
            f"{name!r} is mirrored: with left and right as the labels say, feet, knees and face "
            f"point backwards; are the axes left-handed ({option('mirrored')}), or are the labels "
            f"exchanged? {option('names')} says which marker sits where"
        )


def _while_upright(at: Mapping[str, FloatArray]) -> Mapping[str, FloatArray]:
    """Return where landmarks are in the frames in which the trunk stands, where that is known."""
    ends = []
    for places in _TRUNK:
        sides = [at[f"{place}_{s}"] for place in places for s in "lr" if f"{place}_{s}" in at]
        if not sides:
            return at
        ends.append(np.mean(sides, axis=0))
    trunk = ends[1] - ends[0]
    fallen = trunk[:, 2] < UPRIGHT * np.linalg.norm(trunk, axis=1)
    return {place: points[~fallen] for place, points in at.items()}


def _knee_ahead(hip: FloatArray, knee: FloatArray, ankle: FloatArray) -> FloatArray:
    """Return the way from between hip and ankle to the knee, NaN while the leg is straight."""
    ahead = knee - 0.5 * (hip + ankle)
    leg = np.linalg.norm(knee - hip, axis=1) + np.linalg.norm(ankle - knee, axis=1)
    bent = np.linalg.norm(ahead, axis=1) > BENT * leg
    found: FloatArray = np.where(bent[:, None], ahead, np.nan)
    return found
