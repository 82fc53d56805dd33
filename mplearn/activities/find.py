"""From postures to activities, their number not given.

To walk, or to do knee bends, is to come back to the same postures again and again. A recording is
cut into stretches within which postures recur (`stretches`), and stretches whose postures mix are
one activity (`mixing`). It takes whole recordings: it is not on-line.
"""

from __future__ import annotations

import math

import numpy as np

from ..errors import InvalidValueError
from ..maths.resampling import bridge_gaps
from ..recording import FloatArray, IntArray
from .config import ActivityConfig
from .mixing import group
from .stretches import band_of_links, best_stretches


def find_activities(
    frames: FloatArray, rate_hz: float, config: ActivityConfig | None = None
) -> IntArray:
    """Return the activity of each frame, shape (T,), numbered by first appearance.

    Time grows with the square of the duration; the memory with its product with the number of
    stretches.

    Args:
        frames: Postures whose Euclidean distance means something, shape (T, D); see `postures_of`.
            Missing values (NaN) are interpolated.
        rate_hz: Frames per second [1/s].
        config: What is assumed of activities.

    Raises:
        InvalidValueError: There are no frames, or their values or their rate are not finite.

    Example:
        >>> import numpy as np
        >>> t = np.arange(6000) / 50.0
        >>> arms, legs = np.sin(4 * t) * (t < 60), np.sin(5 * t) * (t >= 60)
        >>> found = find_activities(np.stack((arms, legs), axis=1), 50.0)
        >>> np.unique(found).tolist(), np.flatnonzero(np.diff(found)).tolist()
        ([0, 1], [2999])
    """
    config = config or ActivityConfig()
    if frames.ndim != 2 or not len(frames) or np.isinf(frames).any():
        raise InvalidValueError(
            f"frames must be finite or NaN, of shape (T, D) with T > 0, not {frames.shape}"
        )
    if not (math.isfinite(rate_hz) and rate_hz > 0):
        raise InvalidValueError(f"rate_hz must be positive, not {rate_hz}")

    def steps(seconds: float) -> int:
        return max(1, round(seconds / config.step_s))

    step_of_frame = (np.arange(len(frames)) / (rate_hz * config.step_s) + 1e-9).astype(np.int64)
    step_of_frame = np.unique(step_of_frame, return_inverse=True)[1]  # none is empty
    first_of_step = np.flatnonzero(np.diff(step_of_frame, prepend=-1))
    sums = np.add.reduceat(_complete(frames), first_of_step, axis=0)
    points = sums / np.bincount(step_of_frame)[:, None]
    apart = steps(config.apart_s)
    least = 2 * apart
    if len(points) < 2 * least:
        return np.zeros(len(frames), np.int64)
    reach, count = steps(config.reach_s), steps(config.neighbours_s)
    band = band_of_links(points, apart, reach, count, config.recurrence)
    starts = best_stretches(band, least)
    activities = group(points, starts, apart, count, config.mixing)
    return activities[np.repeat(np.arange(len(starts)), np.diff([*starts, len(points)]))][
        step_of_frame
    ]


def _complete(frames: FloatArray) -> FloatArray:
    """Return the frames with missing values interpolated; channels never measured are left out."""
    filled = bridge_gaps(frames)
    return filled[:, ~np.isnan(filled).any(axis=0)]
