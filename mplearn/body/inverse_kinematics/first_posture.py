"""The first posture of all: the trunk by a rigid fit, the limbs from several starts."""

from __future__ import annotations

import numpy as np

from mplearn.errors import BodyError
from mplearn.maths.rigid_fit import fit_similarity
from mplearn.maths.rotations import matrix_to_quaternion
from mplearn.option_names import option
from mplearn.recording import FloatArray, IntArray

from ..kinematics.tree import KinematicTree
from .follower import Follower
from .gauss_newton import Markers, Moves, Search, solve_frame


class TooFewMarkersError(BodyError):
    """Not enough markers are in sight yet to fit a body to them.

    Example:
        >>> import numpy as np
        >>> from mplearn.body import InverseKinematics, marker_set, robot_body
        >>> markers = marker_set("plug_in_gait39")
        >>> ik = InverseKinematics(robot_body(), list(markers.names))
        >>> try:
        ...     ik.calibrate(np.full((50, len(markers.names), 3), np.nan))  # nobody stands there
        ... except TooFewMarkersError as error:
        ...     print("wait until more of them are seen")
        wait until more of them are seen
    """


TRUNK = ("pelvis", "abdomen", "chest", "clavicle_l", "clavicle_r", "head")
LEAST_UPRIGHT = 0.35  # cosine of the trunk's lean
SMALLEST, LARGEST = 0.35, 1.6  # size relative to the body
MARKER_SIGMA_M = 0.01
SEARCH = Search(outlier_m=0.15, max_iterations=40, tolerance=1e-4, widening=10.0)

# where limbs may be in the first frame [deg], for the left; about x and z the right is mirrored
ARM_STARTS: tuple[dict[str, float], ...] = (
    {},
    {"elbow": -90},
    {"shoulder_pitch": -85},
    {"shoulder_pitch": -60, "elbow": -100},
    {"shoulder_roll": 80},
    {"shoulder_roll": 80, "elbow": -90},
    {"shoulder_roll": 80, "elbow": -90, "shoulder_yaw": -80},
    {"shoulder_pitch": -170},
    {"shoulder_pitch": -150, "elbow": -90},
)
LEG_STARTS: tuple[dict[str, float], ...] = (
    {},
    {"hip_pitch": -80, "knee": 85},
    {"hip_pitch": -110, "knee": 125, "ankle_pitch": -25},
    {"hip_pitch": -60, "knee": 20},
    {"hip_roll": 40},
    {"knee": 80},
)


def place_trunk(
    follower: Follower, bodies: IntArray, template: FloatArray, frame: FloatArray
) -> tuple[float, FloatArray]:
    """Fit the upright body's trunk to the markers: one size, one rotation, one shift.

    Args:
        follower: The body as the solver sees it.
        bodies: Body of each marker, shape (M,).
        template: Place of each marker in its body's frame, shape (M, 3) [m].
        frame: Measured positions, shape (M, 3) [m]; NaN where missing.

    Returns:
        The person's size relative to the body, and the upright posture there, shape (7 + n,).

    Raises:
        BodyError: Too few trunk markers, or they are not upright, mirrored, or of a strange size.
    """
    trunk = [i for i, name in enumerate(follower.tree.body_names) if name in TRUNK]
    rows = np.flatnonzero(np.isin(bodies, trunk) & np.isfinite(frame).all(axis=1))
    if len(rows) < 4:
        raise TooFewMarkersError(
            f"calibration needs 4 markers on pelvis, chest and head in sight, not {len(rows)}"
        )
    expected = follower.tree.points(follower.tree.rest, bodies[rows], template[rows])
    measured = frame[rows]
    fit = fit_similarity(expected, measured)
    if fit.mirrored > 0.02:
        raise BodyError(
            "the markers are mirrored: left and right names are swapped, or an axis points the "
            "other way"
        )
    if not SMALLEST < fit.size < LARGEST:
        raise BodyError(
            f"the trunk is {fit.size:.3g} times as large as {follower.body.name!r}'s; "
            f"{SMALLEST} to {LARGEST} are people, in metres"
        )
    up = fit.rotation[2, 2]
    if up < LEAST_UPRIGHT:
        lean = np.degrees(np.arccos(np.clip(up, -1, 1)))
        raise BodyError(
            f"the trunk leans {lean:.0f} deg from upright in the first frames: calibrate on a "
            f"standing person, with z up ({option('up_axis')} says which axis of the file is)"
        )
    q = follower.tree.rest
    q[:3] = fit.apply(q[:3])
    q[3:7] = matrix_to_quaternion(fit.rotation)
    return fit.size, q


def first_posture(
    follower: Follower,
    tree: KinematicTree,
    bodies: IntArray,
    offsets: FloatArray,
    start: FloatArray,
    frame: FloatArray,
) -> FloatArray:
    """Find one frame's posture from the trunk's place: each limb's best of several starts.

    Args:
        follower: The body as the solver sees it.
        tree: Its kinematics in the person's size.
        bodies: Body of each marker, shape (M,).
        offsets: Place of each marker, shape (M, 3) [m].
        start: The upright posture at the trunk's place, shape (7 + n,).
        frame: Measured positions, shape (M, 3) [m]; NaN where missing.
    """
    limbs = [(_below(tree, f"{part}_{s}"), s) for part in ("upper_arm", "thigh") for s in "lr"]
    n_starts = max(len(ARM_STARTS), len(LEG_STARTS))
    postures = np.tile(start, (n_starts, 1))
    for k, q in enumerate(postures):
        for side in "lr":
            for name, angle in (
                ARM_STARTS[k % len(ARM_STARTS)] | LEG_STARTS[k % len(LEG_STARTS)]
            ).items():
                mirrored = side == "r" and name.endswith(("roll", "yaw"))
                joint = f"{name}_{side}"
                if joint in tree.joint_names:
                    q[7 + tree.joint_names.index(joint)] = np.radians(-angle if mirrored else angle)
    residuals = settle(follower, tree, bodies, offsets, postures, np.tile(frame, (n_starts, 1, 1)))
    best = postures[np.argmin(np.nanmean(residuals**2, axis=1))].copy()
    for limb, _ in limbs:
        markers = np.isin(bodies, limb) & np.isfinite(frame).all(axis=1)
        hinges = np.flatnonzero(np.isin(tree.joint_body, limb))
        if markers.any() and len(hinges):
            errors = (residuals[:, markers] ** 2).sum(axis=1) / MARKER_SIGMA_M**2
            effort = (postures[:, 7 + hinges] ** 2).sum(axis=1)
            best[7 + hinges] = postures[np.argmin(errors + effort)][7 + hinges]
        else:  # nothing is known of it: it hangs, as at rest
            best[7 + hinges] = 0.0
    settle(follower, tree, bodies, offsets, best[None], frame[None])
    found: FloatArray = best
    return found


def settle(
    follower: Follower,
    tree: KinematicTree,
    bodies: IntArray,
    offsets: FloatArray,
    postures: FloatArray,
    frames: FloatArray,
) -> FloatArray:
    """Solve each frame by itself from a posture that may be far away, in place.

    Args:
        follower: See `first_posture`, as for ``tree``, ``bodies`` and ``offsets``.
        tree: See there.
        bodies: See there.
        offsets: See there.
        postures: Where to start, shape (K, 7 + n); the solutions afterwards.
        frames: Measured positions, shape (K, M, 3) [m]; NaN where missing.

    Returns:
        Distance of each marker from its place, shape (K, M) [m].
    """
    residuals = np.full(frames.shape[:2], np.nan)
    limits = np.concatenate((np.tile((-np.inf, np.inf), (6, 1)), tree.limits))
    markers = Markers(bodies, offsets, np.full(len(bodies), MARKER_SIGMA_M**-2))
    for q, frame, residual in zip(postures, frames, residuals, strict=True):
        angles = np.concatenate((np.zeros(6), q[7:]))
        low, high = limits[:, 0] - angles, limits[:, 1] - angles
        solve_frame(
            q,
            np.full(tree.n_dofs, 1.0),
            np.ascontiguousarray(frame),
            markers,
            tree.linkage,
            Moves(low, high, follower.free.copy(), follower.rest_weight.copy()),
            SEARCH,
            residual,
        )
    return residuals


def _below(tree: KinematicTree, name: str) -> list[int]:
    """Return a body and all that hangs on it."""
    found = [tree.body(name)]
    for b in range(found[0] + 1, len(tree.parent)):
        if tree.parent[b] in found:
            found.append(b)
    return found
