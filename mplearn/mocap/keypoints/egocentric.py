"""Key points as the body itself sees them: ahead and to the left, in body lengths.

Where in the picture an animal is, how large, and which way it looks, says nothing of what it does.
So key points are taken relative to their middle, along the body's heading, in units of its length.
"""

from __future__ import annotations

import re

import numpy as np

from ...errors import RecordingError
from ...maths.resampling import bridge_gaps
from ...recording import BoolArray, FloatArray

_FRONT = re.compile(r"nose|snout|head|beak|mouth|face|forehead|front", re.I)
_BACK = re.compile(r"tail|rump|abdomen|hip|back", re.I)
_TIP = re.compile(r"tail.*(tip|end|mid)|tip|end", re.I)
_SURE = 0.6  # likelihood below which a point was not seen: DeepLabCut's own cut-off
_BRIDGED_S = 0.3  # a longer gap stays one
_AXES = ("ahead", "left", "up")


def seen_from_the_body(
    points: FloatArray, names: tuple[str, ...], rate_hz: float, likelihood: FloatArray | None = None
) -> tuple[FloatArray, tuple[str, ...], float]:
    """Return key points along a body's heading, in body lengths.

    The middle is the mean of the points. The heading is the direction from what is named as the
    back of a body to what is named as its front; where names do not tell, it is the longest axis
    of the points, so turned that the body moves ahead more than back. Of 3-D points it is
    horizontal. The length is the median of the distance between the outermost points along it.

    Args:
        points: Shape (T, K, 2), x to the right and y up, or (T, K, 3), z up, in any unit; NaN where
            a point was not seen.
        names: Of the points, length K.
        rate_hz: Frames per second [1/s].
        likelihood: Of each point, shape (T, K), in [0, 1]; below 0.6 it counts as not seen, NaN
            where nobody doubts it.

    Returns:
        Frames, shape (T, 2 K) or (T, 3 K) [body lengths], NaN where gaps are longer than 0.3 s;
        names of the channels, ``nose.ahead``, ``nose.left`` (and ``nose.up``); and the body's
        length in the file's unit.

    Raises:
        RecordingError: There are fewer than three points that were ever seen, or they are at one
            place.
    """
    points = np.array(points, dtype=np.float64)
    if likelihood is not None:
        points[likelihood < _SURE] = np.nan
    n_frames, _, n_axes = points.shape
    visible: BoolArray = np.asarray(np.isfinite(points).all(axis=2))
    ever: BoolArray = np.asarray(visible.any(axis=0))
    if ever.sum() < 3:
        raise RecordingError(
            f"{int(ever.sum())} key points were seen, of {len(names)}; expected at least three"
        )
    names = tuple(name for name, kept in zip(names, ever, strict=True) if kept)
    points = points[:, ever]
    gaps = _long_gaps(visible[:, ever], round(_BRIDGED_S * rate_hz))
    filled = bridge_gaps(points.reshape(n_frames, -1)).reshape(points.shape)
    middle = filled.mean(axis=1)
    ahead = _heading(filled[..., :2], middle[:, :2], names)
    left = np.stack([-ahead[:, 1], ahead[:, 0]], axis=1)
    own = filled - middle[:, None]
    along = np.einsum("tkd,td->tk", own[..., :2], ahead)
    across = np.einsum("tkd,td->tk", own[..., :2], left)
    length = float(np.median(np.ptp(along, axis=1)))
    if not (np.isfinite(length) and length > 1e-6 * float(np.abs(filled).max())):
        raise RecordingError("all key points are at one place")
    seen = np.stack([along, across, *([own[..., 2]] if n_axes == 3 else [])], axis=2) / length
    seen[gaps] = np.nan
    channels = tuple(f"{name}.{axis}" for name in names for axis in _AXES[:n_axes])
    return seen.reshape(n_frames, -1), channels, length


def _heading(points: FloatArray, middle: FloatArray, names: tuple[str, ...]) -> FloatArray:
    """Return where the body heads, shape (T, 2), of length 1."""
    front = [k for k, name in enumerate(names) if _FRONT.search(name)]
    back = [k for k, name in enumerate(names) if _BACK.search(name) and k not in front]
    back = [k for k in back if not _TIP.search(names[k])] or back  # a tail's tip goes anywhere
    if front:
        behind = points[:, back].mean(axis=1) if back else middle
        ahead = points[:, front].mean(axis=1) - behind
    else:
        own = points - middle[:, None]
        _, axes = np.linalg.eigh(np.einsum("tki,tkj->tij", own, own))
        ahead = axes[:, :, 1]
        turned = np.sign((ahead[1:] * ahead[:-1]).sum(axis=1))
        turned[turned == 0] = 1.0
        ahead[1:] *= np.cumprod(turned)[:, None]
        steps = np.diff(middle, axis=0)
        if (steps * ahead[:-1]).sum() < 0:
            ahead = -ahead
    lengths = np.linalg.norm(ahead, axis=1, keepdims=True)
    known = lengths[:, 0] > 1e-9 * max(1e-12, float(np.median(lengths)))
    unit = np.where(known[:, None], ahead / np.where(lengths > 0, lengths, 1.0), np.nan)
    unit = bridge_gaps(unit)
    return np.asarray(unit / np.linalg.norm(unit, axis=1, keepdims=True))


def _long_gaps(seen: BoolArray, longest: int) -> BoolArray:
    """Return where a point, shape (T, K), is unseen for longer."""
    gaps = np.zeros_like(seen)
    for k in range(seen.shape[1]):
        edges = np.flatnonzero(np.diff(np.r_[True, seen[:, k], True].astype(np.int8)))
        for start, end in zip(edges[::2], edges[1::2], strict=True):
            gaps[start:end, k] = end - start > longest
    return gaps
