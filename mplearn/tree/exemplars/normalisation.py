"""Segments as they are compared: normalised in time, weighted, partly centred."""

from __future__ import annotations

from collections.abc import Sequence
from functools import lru_cache

import numpy as np

from ...maths.resampling import interpolate_each, interpolate_linearly
from ...recording import FloatArray
from ..config import NormalisationConfig


def normalised(frames: FloatArray, config: NormalisationConfig) -> FloatArray:
    """Return a segment (T, D) as it is compared: its points (P, D), partly centred."""
    return centred(points_of(frames, config), config)


def weights(config: NormalisationConfig) -> FloatArray:
    """Return the weight of each point, shape (P,), rising over the ramp; 1 at most."""
    passed = np.arange(config.n_points) / (config.n_points - 1) * (1 - config.head)
    if config.ramp == 0:
        return np.ones(config.n_points)
    return np.asarray(np.clip((passed + 0.01) / config.ramp, 0.0, 1.0))


def points_of(frames: FloatArray, config: NormalisationConfig) -> FloatArray:
    """Return the P points of a segment (T, D) that are compared, not yet centred."""
    return interpolate_linearly(frames, _passed(config) * (len(frames) - 1))


def points_of_each(segments: Sequence[FloatArray], config: NormalisationConfig) -> FloatArray:
    """Return those of many segments, stacked, shape (n, P, D), which is quicker."""
    return interpolate_each(segments, _passed(config))


@lru_cache(maxsize=32)
def _passed(config: NormalisationConfig) -> FloatArray:
    """Return which share of a segment has passed at each of its points, shape (P,)."""
    return np.linspace(config.head, 1, config.n_points)


def centred(points: FloatArray, config: NormalisationConfig) -> FloatArray:
    """Return the points of a segment (P, D), or of many (n, P, D), less a share of their mean."""
    if points.ndim == 2:
        return np.asarray(points - config.centring * mean_posture(points, config))
    return np.asarray(points - config.centring * mean_postures(points, config)[:, None])


def mean_posture(points: FloatArray, config: NormalisationConfig) -> FloatArray:
    """Return the weighted mean of points (P, D) where they are seen, shape (D,)."""
    if np.isnan(points.sum()):
        weight = np.where(np.isnan(points), 0.0, weights(config)[:, None])
        points = np.nan_to_num(points)
        total = weight.sum(axis=0)
    else:
        weight, total = _all_weights(config, points.shape[1], points.flags.c_contiguous)
    return np.asarray((weight * points).sum(axis=0) / np.maximum(total, 1e-12))


def mean_postures(points: FloatArray, config: NormalisationConfig) -> FloatArray:
    """Return that of many segments, (n, P, D) to (n, D), each as `mean_posture` has it."""
    weight, total = _all_weights(config, points.shape[2], points[:1].flags.c_contiguous)
    postures = (weight * points).sum(axis=1) / np.maximum(total, 1e-12)
    for k in np.flatnonzero(np.isnan(postures).any(axis=1)).tolist():  # points are missing
        postures[k] = mean_posture(points[k], config)
    return np.asarray(postures)


@lru_cache(maxsize=32)
def _all_weights(
    config: NormalisationConfig, n_channels: int, by_rows: bool
) -> tuple[FloatArray, FloatArray]:
    """Return the weights of points that are all seen, (P, D), and their sums, (D,), as above.

    Sums depend in their last bit on how values lie in memory: one point after the other or one
    channel after the other.
    """
    column = weights(config)[:, None] * np.ones(n_channels)
    weight = np.array(column, order="C" if by_rows else "F")
    return weight, weight.sum(axis=0)
