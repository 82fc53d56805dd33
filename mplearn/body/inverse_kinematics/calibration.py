"""Fitting a body to a person: sizes of the segments, places of the markers, the floor.

Half a second of any motion is enough. Postures (given the sizes) and sizes with marker places
(given the postures) are estimated in turn; with the bodies' orientations known, the second is
linear least squares. Priors keep what the markers do not tell at its anthropometric value. The
paper scaled the markers' heights to the robot's ([Kulic2012], 4.2); here the robot's links take
the person's lengths instead, so that the angles need no compromise, and the base is scaled by the
ratio of the legs.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Annotated, NamedTuple

import numpy as np

from mplearn.errors import BodyError
from mplearn.recording import FloatArray
from mplearn.state import Array, Range

from ..kinematics.tree import KinematicTree
from ..marker_sets.marker_set import MarkerSet
from ..models.human import human_body
from .first_posture import TooFewMarkersError, first_posture, place_trunk, settle
from .follower import Follower
from .follower import follower as make_follower
from .sizes import Expected, fit_sizes, match_sizes

# how far markers may be from their usual places, round after round [m]: the sizes must explain what
# they can before the places may take up the rest, or a bent knee passes for misplaced markers
PLACE_SIGMAS_M = (*[0.001] * 6, 0.003, 0.01, 0.02)
SIZE_SIGMA, FIXED_SIGMA = 0.08, 1e-4  # of a segment's length, relative to the overall size
JOINT_SIGMA_M = 0.002  # the same for a point that lies at a joint: no skin is between
# points at so many joints measure most segments: sizes need little assumed, and many rounds until
# they and the postures agree
MANY_JOINTS, MEASURED_SIGMA = 8, 0.3
JOINT_PLACE_SIGMAS_M = (*[0.001] * 24, 0.003, 0.01)
SETTLED = 3e-4  # change of all sizes in a round below which the next would change nothing
FRAMES = 12  # postures that the fit takes from the stretch it is given
WORST_FIT_M = 0.06  # root mean square distance above which the markers are not this body's


@dataclass(frozen=True, eq=False)
class Calibration:
    """A body fitted to a person.

    Attributes:
        factors: Size of each body relative to the given body's, shape (B, 3).
        offsets: Place of each marker in its body's frame, shape (M, 3) [m].
        scale: Size of the given body relative to the person: ratio of the hips' heights.
        floor_m: Height of the floor in the recording [m].
        height_m: Estimated stature of the person [m].
        residual_m: Root mean square distance of the markers from their places in the fit [m].
        posture: Posture in the first frame, in the person's size, shape (7 + n,).

    Example:
        >>> from mplearn.body import InverseKinematics, robot_body
        >>> from mplearn.demonstrator import Person, demonstrate
        >>> take = demonstrate(["BAR"], seed=1, person=Person(height_m=1.6)).recording
        >>> ik = InverseKinematics(robot_body(), take.marker_names, rate_hz=take.rate_hz)
        >>> found = ik.calibrate(take.markers[:80])
        >>> abs(found.height_m - 1.6) < 0.05, found.offsets.shape
        (True, (34, 3))
    """

    factors: Annotated[FloatArray, Array("b", 3, low=1e-3, high=1e3)]
    offsets: Annotated[FloatArray, Array("m", 3, low=-1e3, high=1e3)]
    scale: Annotated[float, Range(1e-3, 1e3)]
    floor_m: Annotated[float, Range(-1e6, 1e6)]
    height_m: Annotated[float, Range(0.0, 1e3)]
    residual_m: Annotated[float, Range(0.0, 1e3)]
    posture: Annotated[FloatArray, Array("q", low=-1e6, high=1e6)]


def fit(follower: Follower, markers: MarkerSet, frames: FloatArray) -> Calibration:
    """Fit a body to a person's markers: the human body first, then, if it is another, that one.

    The human body, with its spine and clavicles, measures the person; the robot's links then take
    those lengths, and only the markers' places are fitted again.

    Args:
        follower: The body as the solver sees it.
        markers: The markers, in the frames' order.
        frames: Measured positions, shape (T, M, 3) [m]; NaN where missing.

    Raises:
        BodyError: The markers do not look like a person in metres, upright, z up.
    """
    chosen = _choose(frames, markers.names)
    person = follower if follower.is_human else make_follower(human_body())
    bodies, template = markers.attach(person.tree)
    size, start = place_trunk(person, bodies, template, chosen[0])
    sizes = np.full_like(person.tree.offset, size)
    joints = markers.at_joints()
    firm = np.where(joints, JOINT_SIGMA_M, np.inf)
    measured_all = joints.sum() >= MANY_JOINTS
    sigma = MEASURED_SIGMA if measured_all else SIZE_SIGMA
    rounds = JOINT_PLACE_SIGMAS_M if measured_all else PLACE_SIGMAS_M
    places_m = [np.minimum(place_sigma_m, firm) for place_sigma_m in rounds]
    settled = SETTLED if measured_all else 0.0
    expected = Expected(sizes, sigma, bodies, template)
    found = _alternate(person, expected, places_m, settled, start, chosen)
    if person is not follower:
        measured = person.tree.scaled(found.factors)
        sizes = match_sizes(follower.tree, measured)
        placed = replace(markers, offsets=found.offsets)
        bodies, template = placed.attach(follower.tree.scaled(sizes), measured)
        start = follower.tree.rest
        start[:7] = found.postures[0, :7]
        expected = Expected(sizes, FIXED_SIGMA, bodies, template / sizes[bodies])
        places_m = [np.full(len(bodies), place_sigma_m) for place_sigma_m in PLACE_SIGMAS_M]
        found = _alternate(follower, expected, places_m, settled, start, chosen)
    rms = float(np.sqrt(np.nanmean(found.residuals**2)))
    if rms > WORST_FIT_M:
        mean = np.nan_to_num(np.nanmean(found.residuals, axis=0))
        worst = [markers.names[i] for i in np.argsort(-mean)[:4]]
        raise BodyError(
            f"the markers lie {1000 * rms:.0f} mm from where they belong on {follower.body.name!r} "
            f"({1000 * WORST_FIT_M:.0f} mm allowed), farthest {worst}: are they mirrored, swapped, "
            f"or of another set?"
        )
    tree = follower.tree.scaled(found.factors)
    standing = tree.rest
    return Calibration(
        factors=found.factors,
        offsets=found.offsets,
        scale=float(follower.tree.offset[0, 2] / standing[2]),
        floor_m=_floor(tree, found.postures),
        height_m=float(tree.site_positions(standing)[tree.site_names.index("head_top"), 2]),
        residual_m=rms,
        posture=found.postures[0],
    )


class _Fit(NamedTuple):
    factors: FloatArray  # (B, 3)
    offsets: FloatArray  # (M, 3)
    postures: FloatArray  # (K, 7 + n)
    residuals: FloatArray  # (K, M)


def _alternate(
    follower: Follower,
    expected: Expected,
    places_m: Sequence[FloatArray],
    settled_below: float,
    start: FloatArray,
    frames: FloatArray,
) -> _Fit:
    """Estimate postures, and sizes with places, in turn."""
    factors, bodies, offsets = expected.size, expected.bodies, expected.offsets
    tree = follower.tree.scaled(factors)
    last = first_posture(follower, tree, bodies, offsets, start, frames[0])
    postures = np.empty((len(frames), len(last)))
    for k in range(len(frames)):  # from one to the next, so that no limb loses its way
        postures[k] = last
        settle(follower, tree, bodies, offsets, postures[k : k + 1], frames[k : k + 1])
        last = postures[k]
    settled = False
    for k, place_sigma_m in enumerate(places_m):
        if settled and np.array_equal(place_sigma_m, places_m[k - 1]):
            continue  # nothing would change any more
        before = factors
        factors, offsets = fit_sizes(follower.tree, expected, postures, frames, place_sigma_m)
        settled = bool(np.abs(factors - before).max() < settled_below)
        tree = follower.tree.scaled(factors)
        residuals = settle(follower, tree, bodies, offsets, postures, frames)
    return _Fit(factors, offsets, postures, residuals)


def _choose(frames: FloatArray, names: Sequence[str]) -> FloatArray:
    """Return up to `FRAMES` frames, spread over the stretch, in which most markers are seen."""
    if np.isinf(frames).any():
        raise BodyError("the markers hold infinite values; a missing marker is NaN")
    seen = np.isfinite(frames).all(axis=2)
    if not seen.any():
        raise TooFewMarkersError(
            f"none of the {len(names)} markers is seen in any of {len(frames)} frames"
        )
    ever = np.atleast_1d(seen.any(axis=0))
    good = np.flatnonzero(seen.sum(axis=1) >= 0.8 * ever.sum())
    if ever.mean() < 0.6 or not len(good):
        unseen = [names[int(i)] for i in np.flatnonzero(~ever)]
        raise TooFewMarkersError(
            f"too few markers to calibrate: in the best of {len(frames)} frames "
            f"{seen.sum(axis=1).max()} of {len(names)} are seen; never seen: {unseen[:8]}"
        )
    extent = float(np.max(np.nanmax(frames[good[0]], axis=0) - np.nanmin(frames[good[0]], axis=0)))
    if not 0.5 < extent < 3.5:
        hint = "; are they in millimetres?" if extent > 100 else ""
        raise BodyError(f"the markers span {extent:.3g} m; a person spans 0.5 to 3.5 m{hint}")
    picks = np.unique(np.linspace(0, len(good) - 1, FRAMES).round().astype(np.int64))
    return frames[good[picks]]


def _floor(tree: KinematicTree, postures: FloatArray) -> float:
    """Return the height at which the lower foot's sole usually is [m]."""
    feet = [
        [
            i
            for i, site in enumerate(tree.site_names)
            if site.startswith("sole_") and site[-1] == side
        ]
        for side in "lr"
    ]
    heights = np.array([tree.site_positions(q)[:, 2] for q in postures])
    lower = np.min([heights[:, foot].mean(axis=1) for foot in feet], axis=0)
    return float(np.median(lower))
