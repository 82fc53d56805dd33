"""Filling the missing values of an exemplar."""

from __future__ import annotations

import numpy as np

from ..hmm import LeftRightHMM
from ..recording import FloatArray


def gaps_filled(frames: FloatArray, hmm: LeftRightHMM) -> FloatArray:
    """Return frames without NaN, shape (T, D).

    Gaps are bridged linearly in time; a channel that is missing throughout moves as the model's
    means do.
    """
    missing = np.isnan(frames)
    if not missing.any():
        return frames
    filled, t = frames.copy(), np.arange(len(frames))
    for d in np.flatnonzero(missing.any(axis=0)):
        seen = ~missing[:, d]
        if seen.any():
            filled[:, d] = np.interp(t, t[seen], frames[seen, d])
        else:
            place = np.linspace(0, hmm.n_states - 1, len(frames))
            filled[:, d] = np.interp(place, np.arange(hmm.n_states), hmm.means[:, d])
    return filled
