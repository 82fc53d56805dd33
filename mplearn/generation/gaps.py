"""Filling the missing values of an exemplar."""

from __future__ import annotations

import numpy as np

from ..hmm import LeftRightHMM
from ..maths.resampling import bridge_gaps, stretch
from ..recording import FloatArray


def gaps_filled(frames: FloatArray, hmm: LeftRightHMM) -> FloatArray:
    """Return frames without NaN, shape (T, D).

    Gaps are bridged linearly in time; a channel that is missing throughout moves as the model's
    means do.
    """
    filled = bridge_gaps(frames)
    unseen = np.isnan(filled).any(axis=0)
    if unseen.any():
        filled[:, unseen] = stretch(hmm.means[:, unseen], len(frames))
    return filled
