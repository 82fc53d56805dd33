"""Motions at other times: linear interpolation, and what gaps in time are filled with."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ..errors import InvalidValueError
from ..recording import FloatArray, IntArray
from .compiling import njit

_ROUNDING = 1e-6  # of a place [frame]


def interpolate_linearly(frames: FloatArray, places: FloatArray) -> FloatArray:
    """Return frames at fractional places; beside a gap, its edge.

    Args:
        frames: Shape (T, D); NaN where missing.
        places: In frames, shape (P,), in [0, T - 1].

    Returns:
        Shape (P, D).

    Raises:
        InvalidValueError: A place lies before the first frame or behind the last one.

    Example:
        >>> interpolate_linearly(np.array([[0.0], [1.0], [3.0]]), np.array([0.5, 1.5, 2.0]))
        array([[0.5],
               [2. ],
               [3. ]])
    """
    last = len(frames) - 1
    if len(places) and not (places.min() > -_ROUNDING and places.max() < last + _ROUNDING):
        raise InvalidValueError(
            f"places must lie in [0, {last}], not {places.min()} to {places.max()}"
        )
    found = np.empty((len(places), frames.shape[1]))
    _interpolate(np.array(frames, np.float64, order="C", copy=None), places, found)
    return found


def interpolate_each(motions: Sequence[FloatArray], shares: FloatArray) -> FloatArray:
    """Return many motions, shape (T, D) each, at shares of their time, as `interpolate_linearly`.

    Args:
        motions: At least one.
        shares: Shape (P,), in [0, 1].

    Returns:
        Shape (n, P, D).

    Raises:
        InvalidValueError: A share lies outside, or a motion has no frames.

    Example:
        >>> motions = [np.array([[0.0], [1.0]]), np.array([[0.0], [4.0], [6.0]])]
        >>> interpolate_each(motions, np.array([0.0, 0.5]))[:, :, 0]
        array([[0. , 0.5],
               [0. , 4. ]])
    """
    if len(shares) and not (shares.min() >= 0.0 and shares.max() <= 1.0):
        raise InvalidValueError(f"shares must lie in [0, 1], not {shares.min()} to {shares.max()}")
    lengths = np.array([len(motion) for motion in motions])
    if not lengths.min(initial=1):
        raise InvalidValueError(f"motion {lengths.argmin()} has no frames")
    frames = np.ascontiguousarray(np.concatenate(motions), np.float64)
    return _interpolated_each(frames, lengths, shares)


@njit(cache=True)
def _interpolated_each(frames: FloatArray, lengths: IntArray, shares: FloatArray) -> FloatArray:
    found = np.empty((len(lengths), len(shares), frames.shape[1]))
    start = 0
    for k, length in enumerate(lengths):
        _interpolate(frames[start : start + length], shares * (length - 1), found[k])
        start += length
    return found


@njit(cache=True)
def _interpolate(frames: FloatArray, places: FloatArray, found: FloatArray) -> None:
    """Write frames at fractional places, shape (P, D)."""
    for p, place in enumerate(places):
        low = int(np.floor(place))
        high = min(low + 1, len(frames) - 1)
        share = place - low
        nearer = low if share < 0.5 else high
        for d in range(frames.shape[1]):
            before = frames[low, d]
            value = before + share * (frames[high, d] - before)
            found[p, d] = value if value == value else frames[nearer, d]


def stretch(frames: FloatArray, n_frames: int) -> FloatArray:
    """Return a motion, shape (T, D), in so many frames, both ends kept; see above.

    Example:
        >>> stretch(np.array([[0.0], [4.0]]), 3)
        array([[0.],
               [2.],
               [4.]])
    """
    return interpolate_linearly(frames, np.linspace(0, len(frames) - 1, n_frames))


def bridge_gaps(frames: FloatArray) -> FloatArray:
    """Return frames without gaps, which are bridged linearly in time; ends are held.

    Args:
        frames: Shape (T, D); NaN where missing. They are returned themselves where none is.

    Returns:
        Shape (T, D); channels that are missing throughout stay so.

    Example:
        >>> bridge_gaps(np.array([[1.0], [np.nan], [3.0], [np.nan]])).ravel()
        array([1., 2., 3., 3.])
    """
    missing = np.isnan(frames)
    if not missing.any():
        return frames
    filled, times = frames.copy(), np.arange(len(frames))
    for column in np.flatnonzero(missing.any(axis=0) & ~missing.all(axis=0)):
        known = ~missing[:, column]
        filled[~known, column] = np.interp(times[~known], times[known], frames[known, column])
    return filled
