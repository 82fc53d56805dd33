"""On-line inverse kinematics: one frame of markers in, one posture out.

[Kulic2012] computes joint angles on-line from 34 markers ([Yamane2003]). Here each frame is a few
damped Gauss-Newton steps from the last posture (`gauss_newton`), on a body whose segments and
marker places were fitted to the person (`calibration`). The angles are the body's own, robot or
human, without a detour.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Annotated

import numpy as np

from mplearn.errors import BodyError, FrameError, InvalidValueError
from mplearn.maths.quaternions import quaternion_product
from mplearn.maths.rigid_fit import fit_rigid
from mplearn.maths.rotations import matrix_to_quaternion
from mplearn.recording import FloatArray
from mplearn.state import Array, SharedState, require, validated

from ..marker_sets.marker_set import MarkerSet, find_marker_set
from ..models.body import Body
from .calibration import Calibration, fit
from .first_posture import first_posture, place_trunk, settle
from .follower import follower
from .following import FEWEST_MARKERS as FEWEST_MARKERS
from .following import WIDENING, Followed, FollowRules, Joints, follow_frames
from .gauss_newton import Markers, Search

HALF_WITHIN = 1.2  # standard deviations of noise, of three markers on a body that fits them best
NEAR_M = 0.03  # root mean square distance of the markers at which a posture is right


@dataclass(frozen=True)
class IKConfig:
    """What the solver assumes about markers and people.

    Attributes:
        marker_sigma_m: Standard deviation of a marker about its place on the segment, skin
            movement and model error included [m].
        outlier_m: Distance at which a marker loses half of its weight [m]; infinite for none.
        joint_drift: Growth of a joint's uncertainty, [rad / sqrt(s)]: how freely it may move.
        base_drift: The same for the base's position [m / sqrt(s)].
        joint_speed: Fastest joint [rad/s]; nothing turns faster, whatever the markers do.
        base_speed: Fastest base [m/s].
        most_uncertain: Bound on the uncertainty of a joint [rad] or the base [m].
        max_iterations: Gauss-Newton steps a frame.
        tolerance: Change below which a frame is solved [rad, m].
        rough_tolerance: The same where markers move against others on their segment as by noise of
            `marker_sigma_m` and more, which does a hundred times that to the angles.

    Example:
        >>> IKConfig(marker_sigma_m=0.02).outlier_m  # of markers on loose clothes
        0.06
    """

    marker_sigma_m: float = 0.01
    outlier_m: float = 0.06
    joint_drift: float = 1.5
    base_drift: float = 1.5
    joint_speed: float = 17.0
    base_speed: float = 10.0
    most_uncertain: float = 0.7
    max_iterations: int = 6
    tolerance: float = 1e-3
    rough_tolerance: float = 0.03

    def __post_init__(self) -> None:
        for name, value in vars(self).items():
            if not value > 0:
                raise InvalidValueError(f"{name} must be positive, not {value}")


@dataclass(frozen=True, eq=False)
class FollowedState(SharedState):
    """A person who is followed.

    Attributes:
        calibration: The fit to the person.
        posture: Last posture, in the person's size, shape (7 + n,).
        variance: Its uncertainty, squared, shape (6 + n,).
        fresh: Whether no frame was solved since the fit.
    """

    calibration: Calibration
    posture: Annotated[FloatArray, Array("q", low=-1e6, high=1e6)]
    variance: Annotated[FloatArray, Array("v", low=0.0)]
    fresh: bool

    def check(self) -> None:
        """Check that postures have an orientation."""
        for place, posture in (
            ("posture", self.posture),
            ("calibration.posture", self.calibration.posture),
        ):
            turn = float(np.linalg.norm(posture[3:7]))
            require(abs(turn - 1.0) < 1e-3, place, f"must hold a unit quaternion, not of {turn:g}")


class InverseKinematics:
    """Follows a person's markers with a body.

    Args:
        body: The body whose angles are wanted.
        marker_names: Names of the M markers of every frame; names that the set does not know are
            ignored.
        rate_hz: Frames per second [1/s].
        config: Assumptions of the solver.
        markers: Where the markers sit; found by their names where not given.

    Attributes:
        calibration: The fit to the person; None before `calibrate`.
        q: The last posture, shape (7 + n,), in the given body's own size.
        residual_m: Distance of each marker from its place in the last frame, shape (M,) [m], in the
            person's size; NaN where a marker was missing.
        iterations: Gauss-Newton steps of the last frame; 0 where the posture was held.

    Raises:
        BodyError: The markers belong to no known set, or do not fit the body.

    Example:
        >>> from mplearn.body import robot_body
        >>> from mplearn.demonstrator import demonstrate
        >>> take = demonstrate(["BAR", "BAL"], seed=1).recording
        >>> ik = InverseKinematics(robot_body(), take.marker_names, rate_hz=take.rate_hz)
        >>> markers = take.markers  # (T, M, 3)
        >>> calibration = ik.calibrate(markers[:80])
        >>> postures = ik.update_many(markers)
        >>> len(postures) == len(take), bool(np.nanmedian(ik.residual_m) < 0.02)
        (True, True)
    """

    def __init__(
        self,
        body: Body,
        marker_names: Sequence[str],
        *,
        rate_hz: float = 100.0,
        config: IKConfig | None = None,
        markers: MarkerSet | None = None,
    ) -> None:
        if not (np.isfinite(rate_hz) and rate_hz > 0):
            raise InvalidValueError(f"rate_hz must be positive and finite, not {rate_hz}")
        self.body = body
        self.marker_names = tuple(marker_names)
        self.rate_hz = float(rate_hz)
        self.config = config or IKConfig()
        self.markers = markers or find_marker_set(self.marker_names)
        known = np.array(self.markers.knows(self.marker_names))
        if not known.any():
            raise BodyError(f"marker set {self.markers.name!r} has none of {self.marker_names[:6]}")
        self._used = np.flatnonzero(known)
        selected = self.markers.select([self.marker_names[i] for i in self._used])
        self._follower = follower(body)
        self._free = self._follower.free.copy()
        self._rest_weight = self._follower.rest_weight.copy()
        self._selected = selected
        self._bodies, _ = selected.attach(self._follower.tree)
        n = len(self._follower.tree.joint_names)
        self._drift = np.array([self.config.base_drift] * 3 + [self.config.joint_drift] * (3 + n))
        reach = np.array([self.config.base_speed] * 3 + [self.config.joint_speed] * (3 + n))
        self._rules = FollowRules(
            reach=reach / self.rate_hz,
            drift=self._drift**2 / self.rate_hz,
            most_uncertain=self.config.most_uncertain**2,
            search=Search(
                self.config.outlier_m,
                self.config.max_iterations,
                self.config.tolerance,
                WIDENING,
                noise_m=HALF_WITHIN * self.config.marker_sigma_m,
                rough_tolerance=self.config.rough_tolerance,
            ),
        )
        self._weights = np.full(len(self._used), self.config.marker_sigma_m**-2)
        self.calibration: Calibration | None = None
        self.iterations = 0
        self.residual_m = np.full(len(self.marker_names), np.nan)
        self.q = body.rest

    def calibrate(self, markers: FloatArray) -> Calibration:
        """Fit segments, marker places, the floor and the first posture to a stretch of any motion.

        Args:
            markers: About half a second to a second, shape (T, M, 3) [m]; NaN where missing.

        Raises:
            BodyError: The markers do not look like this body's, with the reason.
        """
        frames = np.asarray(markers, dtype=np.float64)
        if frames.ndim != 3 or frames.shape[1:] != (len(self.marker_names), 3) or not len(frames):
            raise FrameError(
                f"markers must have shape (T, {len(self.marker_names)}, 3), not {frames.shape}"
            )
        self._start(fit(self._follower, self._selected, frames[:, self._used]))
        assert self.calibration is not None
        return self.calibration

    def _start(self, calibration: Calibration) -> None:
        """Take over a fit, and begin at its posture without knowing it well."""
        self.calibration = calibration
        self._tree = self._follower.tree.scaled(calibration.factors)
        self._posture = calibration.posture.copy()
        self._variance = np.full(self._tree.n_dofs, self.config.most_uncertain**2)
        self._fresh = np.ones(1, dtype=np.bool_)
        self._limits = np.concatenate((np.tile((-np.inf, np.inf), (6, 1)), self._tree.limits))
        self.q = self._on_body()

    def update(self, markers: FloatArray) -> FloatArray:
        """Take one frame and return the posture, shape (7 + n,): never NaN, never a jump.

        With too few markers in sight the posture is held, and `uncertainty` grows. Markers that
        are too far from the others to be on one person count as missing: one that flies off, or
        all of them if they come in millimetres.

        Args:
            markers: Positions, shape (M, 3) [m]; NaN where missing.

        Raises:
            BodyError: `calibrate` was not called.
            FrameError: The frame has another shape, or holds infinite values.
        """
        frame = np.asarray(markers, dtype=np.float64)
        if frame.shape != (len(self.marker_names), 3):
            raise FrameError(
                f"a frame must have shape ({len(self.marker_names)}, 3), not {frame.shape}"
            )
        return np.asarray(self.update_many(frame[None])[0])

    def update_many(self, frames: FloatArray) -> FloatArray:
        """Take many frames, (T, M, 3) to (T, 7 + n): bit-identical to `update` in a loop.

        Raises:
            BodyError: `calibrate` was not called.
            FrameError: The frames have another shape, or hold infinite values.
        """
        if self.calibration is None:
            raise BodyError("calibrate before the first update: the person's size is not known")
        frames = np.asarray(frames, dtype=np.float64)
        if frames.ndim != 3 or frames.shape[1:] != (len(self.marker_names), 3) or not len(frames):
            raise FrameError(
                f"frames must have shape (T, {len(self.marker_names)}, 3), not {frames.shape}"
            )
        if np.isinf(frames).any():
            raise FrameError("a frame holds infinite values; a missing marker is NaN")
        residuals = np.empty(len(self._used))
        postures, self.iterations = follow_frames(
            np.ascontiguousarray(frames[:, self._used]),
            Followed(self._posture, self._variance, self._fresh),
            Markers(self._bodies, self.calibration.offsets, self._weights),
            self._tree.linkage,
            Joints(self._limits, self._free, self._rest_weight),
            self._rules,
            residuals,
        )
        self.residual_m = np.full(len(self.marker_names), np.nan)
        self.residual_m[self._used] = residuals
        q: FloatArray = postures[:, self._follower.own]
        q[:, 2] -= self.calibration.floor_m
        q[:, :3] *= self.calibration.scale
        self.q = q[-1]
        return q

    def _on_body(self) -> FloatArray:
        """Return the posture in the body's own size, standing where the person's floor is."""
        assert self.calibration is not None
        q = self._posture[self._follower.own]
        q[2] -= self.calibration.floor_m
        q[:3] *= self.calibration.scale
        return q

    @property
    def uncertainty(self) -> FloatArray:
        """Standard deviation of base position [m], base rotation and hinges [rad], shape (6 + n,).

        It stays small while the markers determine a joint, and grows while they do not.
        """
        own = self._follower.own
        sigma: FloatArray = np.sqrt(self._variance[np.concatenate((np.arange(6), own[7:] - 1))])
        return sigma

    def resume(self, state: FollowedState, markers: FloatArray) -> None:
        """Go on with the person whose state this was, wherever he or she is now.

        The posture is found from where the person was last, moved rigidly onto the markers; where
        that does not fit, from the upright trunk, like a first posture.

        Args:
            state: What `state` returned when the person was last seen.
            markers: One frame in which most markers are seen, shape (M, 3) [m].
        """
        self.load_state(state)
        assert self.calibration is not None
        frame = np.ascontiguousarray(np.asarray(markers, dtype=np.float64)[self._used])
        body = self._follower, self._tree, self._bodies, self.calibration.offsets
        found = self._moved(frame)
        error = _error(settle(*body, found[None], frame[None]))
        if error > NEAR_M:
            try:
                _, template = self._selected.attach(self._follower.tree)
                _, upright = place_trunk(self._follower, self._bodies, template, frame)
                other = first_posture(*body, upright, frame)
            except BodyError:
                other = found.copy()
            if _error(settle(*body, other[None], frame[None])) < error:
                found = other
        self._start(self.calibration)
        self._posture = found
        self.q = self._on_body()

    def state(self) -> FollowedState | None:
        """Return what `load_state` needs to resume bit for bit; None before `calibrate`."""
        if self.calibration is None:
            return None
        return FollowedState(
            self.calibration, self._posture.copy(), self._variance.copy(), bool(self._fresh[0])
        )

    def load_state(self, state: FollowedState | None) -> None:
        """Resume from what `state` returned.

        Raises:
            StateError: The state is damaged, or of another body or other markers.
        """
        if state is None:
            self.calibration = None
            return
        self.check_fits(state)
        self._start(state.calibration)
        self._posture, self._variance = state.posture.copy(), state.variance.copy()
        self._fresh[0] = state.fresh
        self.q = self._on_body()

    def check_fits(self, state: FollowedState) -> None:
        """Check that a state is of this body and of these markers.

        Raises:
            StateError: It is not, or is damaged.
        """
        validated(state)
        tree = self._follower.tree
        for place, array, wanted in (
            ("calibration.factors", state.calibration.factors, tree.offset.shape),
            ("calibration.offsets", state.calibration.offsets, (len(self._used), 3)),
            ("calibration.posture", state.calibration.posture, tree.rest.shape),
            ("posture", state.posture, tree.rest.shape),
            ("variance", state.variance, self._drift.shape),
        ):
            require(array.shape == wanted, place, f"must have shape {wanted}, not {array.shape}")

    def _moved(self, frame: FloatArray) -> FloatArray:
        """Return the last posture, moved rigidly onto a frame [Kabsch1976]."""
        assert self.calibration is not None
        q = self._posture.copy()
        seen = np.isfinite(frame).all(axis=1)
        if seen.sum() < 3:
            return q
        then = self._tree.points(q, self._bodies, self.calibration.offsets)[seen]
        fit = fit_rigid(then, frame[seen])
        q[:3] = fit.apply(q[:3])
        q[3:7] = quaternion_product(matrix_to_quaternion(fit.rotation), q[3:7])
        return q


def _error(residuals: FloatArray) -> float:
    seen = residuals[np.isfinite(residuals)]
    return float(np.sqrt((seen**2).mean())) if len(seen) else np.inf
