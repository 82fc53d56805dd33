"""Position, velocity and acceleration in each state: what a trajectory-HMM is solved from."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ..hmm import LeftRightHMM
from ..maths.filters import lowpass
from ..recording import FloatArray, IntArray

_CUTOFF_HZ = 6.0  # of human motion; what is faster in an exemplar's derivatives is noise
_FLOOR = 0.02  # least standard deviation within a state, as a share of that over the motion


@dataclass(frozen=True, eq=False)
class Dynamics:
    """How a primitive moves in each of its states: Gaussians, and how long it stays.

    Attributes:
        means: Shape (3, N, D): position, velocity [1/s], acceleration [1/s^2].
        variances: Shape (3, N, D).
        durations_s: Mean time in each state, shape (N,) [s].

    Example:
        >>> import numpy as np
        >>> from mplearn.hmm import fit
        >>> ramp = np.linspace(0.0, 1.0, 51)[:, None]  # 1 in a second
        >>> found = estimate_dynamics(fit([ramp], 5, variance_floor=1e-3), [ramp], rate_hz=50.0)
        >>> found.means.shape, bool(np.allclose(found.means[1], 1.0, atol=0.05))
        ((3, 5, 1), True)
    """

    means: FloatArray
    variances: FloatArray
    durations_s: FloatArray


def estimate_dynamics(
    hmm: LeftRightHMM, exemplars: Sequence[FloatArray], rate_hz: float
) -> Dynamics:
    """Estimate the dynamics of a primitive from exemplars, aligned to its states by Viterbi.

    Args:
        hmm: The primitive's model.
        exemplars: Finite motions of shape (T, D) at ``rate_hz``. Those of fewer frames than the
            model has states cannot be aligned and are left out; if none remains, the model's own
            means stand in, each for 1 / (1 - a_ii) frames.
        rate_hz: Frames per second of the model and the exemplars [1/s].

    Example:
        >>> import numpy as np
        >>> from mplearn.hmm import fit
        >>> swing = np.sin(np.linspace(0, np.pi, 50))[:, None]
        >>> found = estimate_dynamics(fit([swing], 6, variance_floor=1e-3), [swing], rate_hz=50.0)
        >>> bool(found.means[1, 0, 0] > 0 > found.means[1, -1, 0])  # first up, at last down
        True
    """
    usable = [frames for frames in exemplars if len(frames) >= hmm.n_states]
    if not usable:
        usable = [_stepwise(hmm)]
    states = np.concatenate([hmm.decode(frames) for frames in usable])
    smooth = [lowpass(frames, rate_hz, _CUTOFF_HZ) for frames in usable]
    columns = (
        smooth,
        [_derivative(frames, rate_hz) for frames in smooth],
        [_derivative(_derivative(frames, rate_hz), rate_hz) for frames in smooth],
    )
    moments = [_moments(np.concatenate(column), states, hmm.n_states) for column in columns]
    means, variances = (np.stack(part) for part in zip(*moments, strict=True))
    durations_s = np.bincount(states, minlength=hmm.n_states) / len(usable) / rate_hz
    return Dynamics(means, variances, durations_s)


def _stepwise(hmm: LeftRightHMM) -> FloatArray:
    durations = hmm.durations_frames
    last = durations.mean() if len(durations) else 1.0
    frames = np.repeat(hmm.means, np.ceil(np.append(durations, last)).astype(int), axis=0)
    return np.asarray(frames)


def _derivative(frames: FloatArray, rate_hz: float) -> FloatArray:
    if len(frames) < 2:
        return np.zeros_like(frames)
    return np.asarray(np.gradient(frames, 1.0 / rate_hz, axis=0))


def _moments(values: FloatArray, states: IntArray, n_states: int) -> tuple[FloatArray, FloatArray]:
    """Mean and floored variance of the values in each state, shape (N, D) each."""
    member = (states == np.arange(n_states)[:, None]).astype(np.float64)  # (N, T)
    member /= member.sum(axis=1, keepdims=True)
    means = member @ values
    variances = np.maximum(member @ values**2 - means**2, 0.0)
    spread = values.var(axis=0)
    floor = _FLOOR**2 * np.maximum(spread, 1e-6 * max(float(spread.max()), 1e-9))
    return means, np.maximum(variances, floor)
