"""From a path of primitives to a trajectory, in any style, behind one call."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from ..errors import InvalidValueError
from ..maths.filters import lowpass
from ..recording import FloatArray
from .schedule import GenerativePrimitive, schedule
from .styles import STYLES, Request, StyleName, from_start
from .trajectory import Trajectory


def generate(
    path: Sequence[GenerativePrimitive],
    channels: tuple[str, ...],
    model_rate_hz: float,
    *,
    style: StyleName = "deterministic",
    rate_hz: float | None = None,
    start: FloatArray | None = None,
    cutoff_hz: float | None = None,
    blend_s: float = 0.2,
    n_samples: int = 50,
    rng: np.random.Generator | None = None,
) -> Trajectory:
    """Generate the motion of a path of primitives, at human speed.

    Args:
        path: The primitives, at least one.
        channels: Names of the D channels.
        model_rate_hz: Frame rate of the models and exemplars [1/s].
        style: "deterministic", the paper's: each state's mean for its expected duration, then a
            low-pass filter. "nearest": the stored exemplars. "averaged": the mean of many samples.
            "smooth": a trajectory-HMM over the whole path, which needs no filter.
        rate_hz: Frame rate of the trajectory [1/s]; None is the models'.
        start: Posture to start from, at rest, shape (D,). Each style reaches its own course
            continuously from there.
        cutoff_hz: Cut-off of the zero-phase low-pass filter over the whole path [1/s]; None is
            the style's own (2.5 for "deterministic", 3 for "averaged"), infinity is none.
        blend_s: Time over which pieces of "nearest" and "averaged", and a given start, pass into
            what follows [s].
        n_samples: How many samples "averaged" draws of each primitive.
        rng: Source of randomness, needed by "averaged" only.

    Raises:
        InvalidValueError: An argument is out of range, or lacks what its style needs.

    Example:
        >>> import numpy as np
        >>> from mplearn.hmm import fit
        >>> from mplearn.library import Primitive
        >>> swing = np.sin(np.linspace(0, np.pi, 50))[:, None]
        >>> model = fit([swing], n_states=6, variance_floor=1e-3)
        >>> primitive = Primitive.from_exemplars(1, model, [swing], 50.0)
        >>> twice = generate([primitive, primitive], ("elbow",), 50.0, style="smooth")
        >>> twice.frames.shape[1], twice.path
        (1, (1, 1))
    """
    if style not in STYLES:
        raise InvalidValueError(f"style must be one of {tuple(STYLES)}, not {style!r}")
    if not path:
        raise InvalidValueError("a path needs at least one primitive")
    rate = model_rate_hz if rate_hz is None else rate_hz
    if not (math.isfinite(rate) and rate > 0):
        raise InvalidValueError(f"rate_hz must be positive and finite, not {rate}")
    if not (math.isfinite(blend_s) and blend_s >= 0):
        raise InvalidValueError(f"blend_s must be at least 0 and finite, not {blend_s}")
    if n_samples < 1:
        raise InvalidValueError(f"n_samples must be at least 1, not {n_samples}")
    chosen = STYLES[style]
    timing = schedule(path, rate)
    request = Request(
        path=path,
        timing=timing,
        model_rate_hz=model_rate_hz,
        rate_hz=rate,
        start=None if start is None else _posture(start, len(channels)),
        blend_s=blend_s,
        n_samples=n_samples,
        rng=rng,
    )
    frames = lowpass(
        chosen.frames(request), rate, chosen.cutoff_hz if cutoff_hz is None else cutoff_hz
    )
    if not chosen.starts_itself or (cutoff_hz is not None and math.isfinite(cutoff_hz)):
        frames = from_start(frames, request)
    ids = np.array([primitive.id for primitive in path], dtype=np.int64)
    return Trajectory(frames, rate, channels, ids[timing.positions], timing.starts)


def _posture(start: FloatArray, n_channels: int) -> FloatArray:
    posture = np.asarray(start, dtype=np.float64)
    if posture.shape != (n_channels,) or not np.isfinite(posture).all():
        raise InvalidValueError(
            f"start must be a finite posture of shape ({n_channels},), not {posture}"
        )
    return posture
