"""What a person's body does besides the task: sway, breathing, gaze, and slow drift of the posture.

Sums of sinusoids with random frequencies and phases: smooth, without end, and a function of time
alone, so that a stream of any length needs no memory. Standing sway lies below 1 Hz, with an
amplitude of some millimetres [Winter1995].
"""

from __future__ import annotations

import numpy as np

from mplearn.recording import FloatArray

from .channels import CHANNELS, INDEX, UPPER_JOINTS, as_vector, both_sides
from .variability import Variability

_SWAY_HZ, _DRIFT_HZ, _BREATH_HZ = (0.08, 0.6), (1 / 400, 1 / 80), (0.2, 0.3)
_WAVES = 4

# standard deviations of sway [rad or leg lengths]
_SWAY: dict[str, float] = {
    "pelvis_x": 0.004,
    "pelvis_y": 0.003,
    "pelvis_roll": 0.003,
    "pelvis_pitch": 0.006,
    "pelvis_yaw": 0.008,
    "lumbar": 0.006,
    "thorax": 0.004,
    "neck": 0.012,
    "neck_yaw": 0.03,
    "clavicle": 0.004,
    "shoulder": 0.008,
    "elbow": 0.012,
    "forearm": 0.015,
    "wrist": 0.015,
}
_BREATH = both_sides(
    {
        "thorax_pitch": -0.010,
        "neck_pitch": 0.007,
        "clavicle_elevation_l": 0.016,
        "shoulder_roll_l": 0.006,
        "shoulder_pitch_l": 0.004,
    }
)


def _sway(channel: str) -> float:
    prefixes = [prefix for prefix in _SWAY if channel.startswith(prefix)]
    return _SWAY[max(prefixes, key=len)] if prefixes else 0.0


class Idling:
    """Deviations from the plan as a function of time.

    Args:
        variability: Its ``sway`` and ``drift_rad`` are used.
        rng: Source of the frequencies, amplitudes and phases.
    """

    def __init__(self, variability: Variability, rng: np.random.Generator) -> None:
        sway = variability.sway * np.array([_sway(channel) for channel in CHANNELS])
        drift = as_vector(dict.fromkeys(UPPER_JOINTS, variability.drift_rad))
        drift[INDEX["neck_yaw"]] *= 2.0
        self._sway = _Waves(sway, _SWAY_HZ, rng)
        self._drift = _Waves(drift, _DRIFT_HZ, rng)
        self._breath = variability.sway * as_vector(_BREATH)
        self._breath_hz = float(rng.uniform(*_BREATH_HZ))
        self._breath_phase = float(rng.uniform(0.0, 2.0 * np.pi))

    def __call__(self, times_s: FloatArray) -> FloatArray:
        """Return the deviations at the given times (T,), shape (T, C)."""
        turn = 2.0 * np.pi * times_s
        # breaths are not equally long
        phase = self._breath_hz * turn + 0.8 * np.sin(0.037 * turn) + self._breath_phase
        breath = np.sin(phase)[:, None] * self._breath
        return np.asarray(self._sway(times_s) + self._drift(times_s) + breath)


class _Waves:
    """Independent sums of sinusoids, one a channel, with given standard deviations."""

    def __init__(
        self, deviation: FloatArray, band_hz: tuple[float, float], rng: np.random.Generator
    ) -> None:
        shape = (_WAVES, len(deviation))
        low, high = np.log(band_hz)
        hz = np.exp(rng.uniform(low, high, shape))
        phase = rng.uniform(0.0, 2.0 * np.pi, shape)
        self._moved = np.flatnonzero(deviation > 0.0)
        self._n_channels = len(deviation)
        # slower waves are larger, as in people's sway
        size = hz**-0.5
        size *= np.sqrt(2.0) * deviation / np.linalg.norm(size, axis=0)
        self._rate = 2.0 * np.pi * hz[:, self._moved]
        self._phase, self._size = phase[:, self._moved], size[:, self._moved]

    def __call__(self, times_s: FloatArray) -> FloatArray:
        out = np.zeros((len(times_s), self._n_channels))
        for rate, phase, size in zip(self._rate, self._phase, self._size, strict=True):
            out[:, self._moved] += size * np.sin(times_s[:, None] * rate + phase)
        return out
