"""What a motion capture system sees of a posture: markers, with noise and occlusions."""

from __future__ import annotations

import numpy as np

from mplearn.body import KinematicTree, MarkerSet
from mplearn.body.kinematics.kernels import points_of_postures
from mplearn.recording import FloatArray

from .variability import Variability


class Cameras:
    """Measures the markers on a body, block after block of a stream.

    A marker is seen for a while, then hidden for a while, both of random length, whatever the
    others do.

    Args:
        tree: Kinematics of the body.
        markers: The M markers on it.
        rate_hz: Frames per second.
        variability: Its ``noise_m``, ``occlusion`` and ``occlusion_s`` are used.
        rng: Source of randomness.
    """

    def __init__(
        self,
        tree: KinematicTree,
        markers: MarkerSet,
        rate_hz: float,
        variability: Variability,
        rng: np.random.Generator,
    ) -> None:
        self._linkage, self._rate_hz, self._variability = tree.linkage, rate_hz, variability
        self._bodies, self._offsets = markers.attach(tree)
        self._noise, self._hiding = rng.spawn(2)
        self._n_frames = 0
        share = variability.occlusion
        hidden_s = sum(variability.occlusion_s) / 2.0
        self._seen_s = hidden_s * (1.0 - share) / share if share > 0.0 else np.inf
        # each marker's next occlusion, [start, end) in seconds
        self._next_s = np.array([self._occlusion_s(0.0) for _ in markers.names])

    def measure(self, postures: FloatArray) -> FloatArray:
        """Return the markers (T, M, 3) [m] of the next T postures (T, nq); NaN where hidden."""
        markers = points_of_postures(postures, self._linkage, self._bodies, self._offsets)
        markers += self._variability.noise_m * self._noise.standard_normal(markers.shape)
        end = self._n_frames + len(postures)
        for marker in np.flatnonzero(self._next_s[:, 0] * self._rate_hz < end):
            self._hide(markers[:, marker], int(marker), end)
        self._n_frames = end
        return markers

    def _hide(self, marker: FloatArray, index: int, end: int) -> None:
        """Put the marker's occlusions before frame `end` into its frames (T, 3) of this block."""
        while True:
            first, last = np.ceil(self._next_s[index] * self._rate_hz).astype(np.int64)
            if first >= end:
                return
            marker[max(first - self._n_frames, 0) : last - self._n_frames] = np.nan
            if last > end:
                return
            self._next_s[index] = self._occlusion_s(self._next_s[index, 1])

    def _occlusion_s(self, after_s: float) -> tuple[float, float]:
        if np.isinf(self._seen_s):
            return np.inf, np.inf
        start_s = after_s + self._hiding.exponential(self._seen_s)
        return start_s, start_s + self._hiding.uniform(*self._variability.occlusion_s)
