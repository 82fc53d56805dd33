"""Points of a picture that are taken for points in space: what tells them."""

from __future__ import annotations

import numpy as np

from ...recording import FloatArray
from ..findings import Findings
from .columns import MEDIAPIPE_POSE

_LARGE = 20.0  # pixels; no person in metres is


def warn_of_pictures(points: FloatArray, names: tuple[str, ...], findings: Findings) -> None:
    """Warn of landmarks in a picture: MediaPipe gives shares of its width and height too.

    Args:
        points: Shape (T, M, 3) [the file's unit]; NaN where missing.
        names: Of the M points.
        findings: Where to tell it.
    """
    if len(set(names) & set(MEDIAPIPE_POSE)) < len(MEDIAPIPE_POSE) // 2:
        return
    flat = points[..., :2]
    known = flat[~np.isnan(flat)]
    if len(known) and known.min() > -0.2 and np.mean(known < 1.2) > 0.99:
        findings.warn(
            "these look like landmarks in a picture (shares of its width and height), whose depth "
            "and size mean little: world landmarks [m] are needed"
        )


def hold_scores(points: FloatArray) -> bool:
    """Return whether the third number of each point, shape (T, M, 3), says how sure it is.

    So it is where the others are pixels and it varies between 0 and 1, as estimators write it.

    Example:
        >>> hold_scores(np.array([[[310.0, 95.0, 0.93], [333.0, 140.0, 0.71]]]))
        True
    """
    known = points[~np.isnan(points).any(axis=2)]
    if not len(known):
        return False
    third = known[:, 2]
    within = third.min() >= 0.0 and third.max() <= 1.0 and np.ptp(third) > 0.0
    return bool(within and np.ptp(known[:, :2], axis=0).max() > _LARGE)
