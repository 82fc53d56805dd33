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

    Example:
        >>> from mplearn.hmm import fit
        >>> wave = np.sin(np.linspace(0.0, 3.0, 40))[:, None]
        >>> hidden = wave.copy()
        >>> hidden[10:14] = np.nan
        >>> bool(np.abs(gaps_filled(hidden, fit([wave], 5)) - wave).max() < 0.02)
        True
    """
    filled = bridge_gaps(frames)
    unseen = np.isnan(filled).any(axis=0)
    if unseen.any():
        filled[:, unseen] = stretch(hmm.means[:, unseen], len(frames))
    return filled
