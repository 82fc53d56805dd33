"""Where an unseen marker must be, from the markers that keep their distance to it.

Markers on one segment of the body keep their distances. How much each distance varies is followed
on-line; from it follows how much a marker says about another. The neighbours of an unseen marker,
as they lay when it was last seen, are moved onto where they are now by the best weighted rigid
motion [Kabsch1976], and the marker with them.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated

import numpy as np

from ..maths.rigid_fit import fit_rigid
from ..recording import BoolArray, FloatArray, IntArray
from ..state import Array, Count, State, require

_STEP_S = 0.1  # time between two looks at the distances
_MEMORY_S = 2.0  # over which their variances forget
_NOISE_M = 0.005  # variation of a distance that means nothing
_UNKNOWN_M = 0.05  # variation of a distance that was seen once


@dataclass(frozen=True, eq=False)
class RigidityState(State):
    """Distances between M markers, and how they vary.

    Attributes:
        mean: Mean of each distance, shape (M, M) [m].
        variance: Its variance, shape (M, M) [m^2].
        looks: How often it was seen, shape (M, M).
        frames: Frames seen.
        before: The last frame, shape (M, 3) [m].
        as_last_seen: All markers when each was last seen, shape (M, M, 3) [m].
    """

    mean: Annotated[FloatArray, Array("m", "m", low=0.0)]
    variance: Annotated[FloatArray, Array("m", "m", low=0.0)]
    looks: Annotated[IntArray, Array("m", "m", low=0)]
    frames: Count
    before: Annotated[FloatArray, Array("m", 3, nan=True)]
    as_last_seen: Annotated[FloatArray, Array("m", "m", 3, nan=True)]


class RigidNeighbours:
    """Follows the distances between markers, and predicts one marker from the others.

    Args:
        n_markers: Number M of markers.
        rate_hz: Frames per second [1/s].
    """

    def __init__(self, n_markers: int, rate_hz: float) -> None:
        self.n_markers = n_markers
        self.rate_hz = rate_hz
        self._every_frames = max(1, round(_STEP_S * rate_hz))
        self._forget = 1.0 - float(np.exp(-self._every_frames / rate_hz / _MEMORY_S))
        square = (n_markers, n_markers)
        self._mean = np.zeros(square)
        self._variance = np.zeros(square)
        self._looks: IntArray = np.zeros(square, np.int64)
        self._frames = 0
        self._before = np.full((n_markers, 3), np.nan)
        self._as_last_seen = np.full((*square, 3), np.nan)

    def update(self, positions: FloatArray, lost: BoolArray) -> FloatArray:
        """Take one frame, and predict the markers that are lost in it.

        Args:
            positions: What is seen, shape (M, 3) [m]; NaN elsewhere.
            lost: Which of the unseen markers to predict, shape (M,).

        Returns:
            Positions of the lost markers, shape (K, 3) [m]; NaN where fewer than three others help.
        """
        before, self._before = self._before, positions.copy()
        if self._frames % self._every_frames == 0:
            self._look(positions)
        self._frames += 1
        if not lost.any():
            return np.empty((0, 3))
        self._as_last_seen[lost & ~np.isnan(before[:, 0])] = before
        return self._predict(np.flatnonzero(lost), positions)

    def state(self) -> RigidityState:
        """Return the whole state."""
        return RigidityState(
            mean=self._mean.copy(),
            variance=self._variance.copy(),
            looks=self._looks.copy(),
            frames=self._frames,
            before=self._before.copy(),
            as_last_seen=self._as_last_seen.copy(),
        )

    def load_state(self, state: RigidityState) -> None:
        """Resume from what `state` returned.

        Raises:
            StateError: It is of another number of markers.
        """
        m = self.n_markers
        require(len(state.mean) == m, "mean", f"must be of {m} markers, not {len(state.mean)}")
        self._mean, self._variance = state.mean.copy(), state.variance.copy()
        self._looks, self._frames = state.looks.copy(), state.frames
        self._before, self._as_last_seen = state.before.copy(), state.as_last_seen.copy()

    def _look(self, positions: FloatArray) -> None:
        """Follow mean and variance of all distances, in exponential memory."""
        distances = np.linalg.norm(positions[:, None] - positions[None], axis=2)
        known = ~np.isnan(distances)
        self._looks += known
        share = np.where(known, np.maximum(self._forget, 1.0 / np.maximum(self._looks, 1)), 0.0)
        change = np.where(known, distances - self._mean, 0.0)
        self._mean += share * change
        self._variance = (1.0 - share) * (self._variance + share * change**2)

    def _predict(self, which: IntArray, positions: FloatArray) -> FloatArray:
        then = self._as_last_seen[which]  # (K, M, 3)
        helps = ~np.isnan(then[:, :, 0]) & ~np.isnan(positions[None, :, 0])  # (K, M)
        own = then[np.arange(len(which)), which]  # (K, 3)
        doubt = self._variance[which] + _UNKNOWN_M**2 / np.maximum(self._looks[which], 1)
        weights = np.where(helps, (doubt + _NOISE_M**2) ** -2.0, 0.0)
        enough = helps.sum(axis=1) >= 3
        fit = fit_rigid(then[enough], positions, weights[enough])
        predicted = np.full((len(which), 3), np.nan)
        predicted[enough] = fit.apply(own[enough][:, None])[:, 0]
        return predicted
