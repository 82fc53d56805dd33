"""Segments as they are compared: normalised in time, weighted, partly centred."""

from __future__ import annotations

import numpy as np

from ...maths.resampling import interpolate_linearly
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
    places = np.linspace(config.head, 1, config.n_points) * (len(frames) - 1)
    return interpolate_linearly(frames, places)


def centred(points: FloatArray, config: NormalisationConfig) -> FloatArray:
    """Return the points (P, D) less a share of their weighted mean."""
    return np.asarray(points - config.centring * mean_posture(points, config))


def mean_posture(points: FloatArray, config: NormalisationConfig) -> FloatArray:
    """Return the weighted mean of points (P, D) where they are seen, shape (D,)."""
    weight = np.where(np.isnan(points), 0.0, weights(config)[:, None])
    total = np.maximum(weight.sum(axis=0), 1e-12)
    return np.asarray((weight * np.nan_to_num(points)).sum(axis=0) / total)
