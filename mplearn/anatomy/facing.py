"""Whether a person in landmarks faces where feet, knees, face and pelvis say, or is mirrored."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from ..errors import BodyError
from ..option_names import option
from ..recording import FloatArray

# from what lies behind to what lies ahead of it: of feet, of the pelvis, of chest and face
_AHEAD = (
    (
        *((f"heel_back_{s}", toe) for s in "lr" for toe in (f"toe_tip_{s}", f"metatarsal2_{s}")),
        *((f"heel_back_{s}", f"ball_{s}") for s in "lr"),
        *((f"ankle_{s}", toe) for s in "lr" for toe in (f"toe_tip_{s}", f"ball_{s}")),
        *((f"ankle_outer_{s}", f"metatarsal2_{s}") for s in "lr"),
    ),
    (
        *((f"iliac_back_{s}", f"iliac_front_{s}") for s in "lr"),
        *(("sacrum", f"iliac_front_{s}") for s in "lr"),
    ),
    (
        *((f"ear_{s}", "nose") for s in "lr"),
        *(("c7", "jugular_notch"), ("t10", "xiphoid"), ("head_rear", "head_front")),
    ),
)
_ACROSS = ("hip", "iliac_front", "iliac_back", "trochanter", "acromion", "shoulder", "knee_outer")
_TRUNK = (("hip", "iliac_front"), ("shoulder", "acromion"))  # below, above
UPRIGHT = 0.7  # cosine between trunk and vertical; who lies prone has toes that point backwards
BENT = 0.05  # how far a knee is ahead of hip and ankle at times, if it tells: of the leg
_SURE, _FEW = 4.0, 6  # standard errors that it is ahead on average; frames that say no error
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
    if not across:
        return
    left = across[0] * (1.0, 1.0, 0.0)
    forward = np.cross(left, (0.0, 0.0, 1.0))
    forward /= np.maximum(np.linalg.norm(forward, axis=1, keepdims=True), 1e-9)
    # who kneels has toes that point backwards: feet are one voice, as knees are
    voices = [
        [
            _cosine(at[ahead] - at[behind], forward)
            for behind, ahead in group
            if {behind, ahead} <= at.keys()
        ]
        for group in _AHEAD
    ]
    voices.append(
        [
            _knee_ahead(at[f"hip_{s}"], at[f"knee_{s}"], at[f"ankle_{s}"], forward)
            for s in "lr"
            if {f"hip_{s}", f"knee_{s}", f"ankle_{s}"} <= at.keys()
        ]
    )
    known = [[each for each in voice if np.isfinite(each)] for voice in voices]
    cosines = [float(np.mean(voice)) for voice in known if voice]
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


def _cosine(way: FloatArray, forward: FloatArray) -> float:
    """Return the median cosine, on the ground, between ways and unit vectors; NaN for none."""
    level = way * (1.0, 1.0, 0.0)
    each = (level * forward).sum(axis=1) / np.maximum(np.linalg.norm(level, axis=1), 1e-9)
    each = each[np.isfinite(each)]
    return float(np.median(each)) if len(each) else np.nan


def _knee_ahead(hip: FloatArray, knee: FloatArray, ankle: FloatArray, forward: FloatArray) -> float:
    """Return whether a knee bends ahead, 1, or backwards, -1; NaN where it is straight, or noisy.

    Args:
        hip: Where the hip is, shape (T, 3) [m].
        knee: Where the knee is, shape (T, 3) [m].
        ankle: Where the ankle is, shape (T, 3) [m].
        forward: Unit vectors, shape (T, 3).
    """
    leg = np.linalg.norm(knee - hip, axis=1) + np.linalg.norm(ankle - knee, axis=1)
    ahead = ((knee - 0.5 * (hip + ankle)) * forward).sum(axis=1) / np.maximum(leg, 1e-9)
    ahead = ahead[np.isfinite(ahead)]
    if len(ahead) < _FEW:
        return np.nan
    least, most = np.quantile(ahead, (0.05, 0.95))
    error = ahead.std() / np.sqrt(len(ahead))
    if max(-least, most) < BENT or abs(ahead.mean()) < _SURE * error:
        return np.nan
    return float((least + most) / (abs(least) + abs(most)))
