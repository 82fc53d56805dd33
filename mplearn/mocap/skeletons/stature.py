"""The unit of length of a skeleton, from the person's size, whatever the joints are called."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from ...option_names import option
from ...recording import FloatArray
from ..files import bad_file
from ..findings import Findings
from ..placing.hanging import near, trees_of
from ..placing.size import Unit, likeliest_unit
from ..reader import Hints

_USUAL_M = 1.6  # between the joints of a person that are farthest apart: crown to toe, or hands
_PEOPLE = (0.45, 1.44)  # against that: from a child who sits to a giant who reaches up
_LOOK = 100  # frames
_RIGID = 0.1  # of its length, by which a bone may vary
_HEIGHT_M = (0.05, 3.0)  # of the pelvis, lying to leaping
_LONG = 0.2  # of the longest chain, from which on one is a limb or a trunk


def unit_of_skeleton(
    points: FloatArray, parents: Sequence[int], declared_m: float, *, says_so: bool = True
) -> Unit | None:
    """Return the unit of length in which a skeleton is a person's.

    Args:
        points: Where its joints are, in the file's unit, shape (T, J, 3); NaN where missing.
        parents: Index of each joint's parent, length J, parents first; -1 for a root.
        declared_m: The unit that the file, or its format, says [m].
        says_so: Whether the file itself says it, not only its format.

    Returns:
        The unit; None where the skeleton has no trunk with limbs at both ends, as people have.
    """
    some = points[:: max(1, len(points) // _LOOK)]
    some = some[~np.isnan(some).any(axis=(1, 2))]
    if not len(some):
        return None
    joints, parents_in, bones = _largest_rigid_part(some, parents)
    if not _has_trunk_and_limbs(parents_in, bones):
        return None
    body = some[:, joints]
    apart = np.array([np.linalg.norm(p[:, None] - p[None], axis=2).max() for p in body])
    extent = float(np.median(apart))
    if not 0 < extent < np.inf:
        return Unit(declared_m, False, False)
    return likeliest_unit(_USUAL_M / extent, declared_m, _PEOPLE, says_so=says_so)


def _largest_rigid_part(
    points: FloatArray, parents: Sequence[int]
) -> tuple[list[int], list[int], FloatArray]:
    """Return the joints of the largest part whose bones keep their lengths, with its tree.

    Some files hang the body on a root that stays on the floor, or far away: that is no bone.
    """
    kept = np.array(parents)
    lengths = np.linalg.norm(points - points[:, np.maximum(kept, 0)], axis=2)  # (t, J)
    usual = np.median(lengths, axis=0)
    kept[np.ptp(lengths, axis=0) > _RIGID * usual] = -1
    kept, bones = near(kept, usual)
    joints = max(trees_of(kept).values(), key=len)
    at = {joint: index for index, joint in enumerate(joints)}
    return joints, [at.get(int(kept[joint]), -1) for joint in joints], bones[joints]


def _has_trunk_and_limbs(parents: list[int], bones: FloatArray) -> bool:
    """Whether three long chains meet in at least two joints, and not in one place."""
    n_joints = len(parents)
    below = np.zeros(n_joints)  # the longest chain below a joint
    children: list[list[int]] = [[] for _ in parents]
    for joint in range(n_joints - 1, 0, -1):
        children[parents[joint]].append(joint)
        below[parents[joint]] = max(below[parents[joint]], below[joint] + bones[joint])
    above = np.zeros(n_joints)  # the longest chain that leaves a joint towards the root
    for joint in range(n_joints):
        for child in children[joint]:
            beside = [below[c] + bones[c] for c in children[joint] if c != child]
            above[child] = bones[child] + max([above[joint], *beside])
    long = _LONG * float((below + above).max())
    meets = [
        joint
        for joint in range(n_joints)
        if sum(below[c] + bones[c] > long for c in children[joint]) + (above[joint] > long) >= 3
    ]
    # a place on the tree from the root on, so that helper joints at one place count once
    along = np.zeros(n_joints)
    for joint in range(1, n_joints):
        along[joint] = along[parents[joint]] + bones[joint]
    return len(meets) > 1 and bool(np.ptp(along[meets]) > 0.25 * long)


def unit_of_places(
    path: Path, heights: FloatArray, usual_m: float, hints: Hints, findings: Findings
) -> float:
    """Return the unit of where the pelvis is [m], by its height, where bones have lengths anyway.

    Args:
        path: The file, for messages.
        heights: Of the pelvis in the file's unit, shape (T,).
        usual_m: The unit in such files [m].
        hints: What the caller says.
        findings: Where to tell what was found.

    Raises:
        RecordingError: The caller says a unit by which the pelvis is nowhere near.
    """
    height = float(np.nanmedian(np.abs(heights))) if not np.isnan(heights).all() else 0.0
    low, high = _HEIGHT_M
    if hints.unit_m is not None:
        if height > 0 and not low / 10 <= height * hints.unit_m <= high * 10:
            raise bad_file(
                path,
                f"the pelvis is {height * hints.unit_m:.3g} m up",
                f"{low:g} to {high:g} m; is {option('unit_m')} right?",
            )
        return hints.unit_m
    for unit_m in (usual_m, 1.0, 0.01, 0.001):
        if low <= height * unit_m <= high:
            if unit_m != usual_m:
                findings.warn(f"a unit of {unit_m:g} m by the height of the pelvis")
            return unit_m
    return usual_m
