"""Inverse kinematics that can go on with a person who was followed before."""

from __future__ import annotations

import numpy as np

from mplearn.errors import BodyError
from mplearn.maths.quaternions import quaternion_product
from mplearn.maths.rigid_fit import fit_rigid
from mplearn.maths.rotations import matrix_to_quaternion
from mplearn.recording import FloatArray

from .first_posture import first_posture, place_trunk, settle
from .inverse_kinematics import FollowedState, InverseKinematics

NEAR_M = 0.03  # root mean square distance of the markers at which a posture is right


class ResumingKinematics(InverseKinematics):
    """Follows one person at a time; another who comes back is followed on the body fitted before.

    Arguments and attributes are those of `InverseKinematics`.
    """

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
