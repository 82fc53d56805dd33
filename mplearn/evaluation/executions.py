"""From repetitions to primitives: each repetition of a take goes out, turns, and comes back.

What is needed is found in the data alone: the reversal is the farthest posture from where the
repetition starts, the side is that of the limb which travels, and "out" leads away from the posture
at which the person's takes with the same limb usually start.
"""

from __future__ import annotations

import re
import warnings
from collections.abc import Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from ..errors import RecordingError
from ..maths.resampling import bridge_gaps
from ..maths.rigid_fit import fit_upright
from ..recording import BoolArray, FloatArray, IntArray, LabelledSegment, Recording

TRAVEL_RATIO = 3.0  # a limb that travels this much farther than its mirror image names the side
TRAVEL_M = 0.02  # and at least this far, root mean square [m]
TRAVEL_RAD = 0.1  # the same for joint angles [rad]
_MARKERS = {"leg": "ANK", "arm": "WR"}
_JOINTS = {"leg": ("hip", "knee"), "arm": ("shoulder", "elbow")}


def stood_like(frames: FloatArray, frame: FloatArray) -> FloatArray:
    """Move marker frames, shape (T, D), so that the first stands where one frame does, (D,) [m]."""
    points = frames.reshape(len(frames), -1, 3)
    return fit_upright(points[0], frame.reshape(-1, 3)).apply(points).reshape(frames.shape)


def without_gaps(frames: FloatArray, name: str = "") -> FloatArray:
    """Bridge missing measurements linearly, shape (T, D).

    Raises:
        RecordingError: A column holds no measurement at all.
    """
    filled = bridge_gaps(frames)
    unseen = np.isnan(filled).any(axis=0)
    if unseen.any():
        raise RecordingError(f"recording {name!r}: column {unseen.argmax()} is missing throughout")
    return filled


def all_without_gaps(takes: Sequence[Recording]) -> list[FloatArray]:
    """Bridge the gaps of a person's takes, shape (T, D) each.

    A marker that a take never shows is put between the three that are nearest to it in the others,
    so that takes can be compared and joined; it is no measurement.

    Raises:
        RecordingError: A take never shows a column that is no marker's, or no marker at all.
    """
    filled = []
    for take in takes:
        if not take.is_markers:
            filled.append(without_gaps(take.frames, take.name))
            continue
        markers = bridge_gaps(take.frames).reshape(len(take), -1, 3)
        unseen: BoolArray = np.asarray(np.isnan(markers).any(axis=(0, 2)))
        if unseen.all():
            raise RecordingError(f"recording {take.name!r}: all markers are missing throughout")
        for marker in np.flatnonzero(unseen):
            near = _neighbours(takes, int(marker), ~unseen)
            markers[:, marker] = markers[:, near].mean(axis=1)
        filled.append(markers.reshape(take.frames.shape))
    return filled


def _neighbours(takes: Sequence[Recording], marker: int, seen: BoolArray) -> IntArray:
    """Return the three seen markers that are nearest to one in takes that show it; all if none."""
    distances = [
        np.linalg.norm(take.markers - take.markers[:, [marker]], axis=2)
        for take in takes
        if np.isfinite(take.markers[:, marker]).any()
    ]
    if not distances:
        return np.flatnonzero(seen)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", RuntimeWarning)  # of markers that are never seen together
        usual = np.nanmedian(np.concatenate(distances), axis=0)
    return np.argsort(np.where(seen & np.isfinite(usual), usual, np.inf))[:3]


def find_reversal(frames: FloatArray, rate_hz: float) -> int:
    """Return the frame at which a repetition turns round.

    The farthest posture from its ends, among those where the motion is slow, in the middle 60 %.
    Where the far posture is held, the middle of the hold.

    Args:
        frames: One repetition, without gaps, shape (L, D).
        rate_hz: Frames per second [1/s].
    """
    length = len(frames)
    smooth = _smooth(frames, max(1, round(0.1 * rate_hz)))
    far = np.linalg.norm(smooth - 0.5 * (smooth[0] + smooth[-1]), axis=1)
    speed = np.linalg.norm(np.gradient(smooth, axis=0), axis=1)
    score = far / max(far.max(), 1e-12) - speed / max(speed.max(), 1e-12)
    score[: length // 5] = -np.inf
    score[length - length // 5 :] = -np.inf
    best = int(np.argmax(score))
    near = score > score[best] - 0.03
    first = last = best
    while near[first - 1]:
        first -= 1
    while near[last + 1]:
        last += 1
    return (first + last) // 2


class Limb(NamedTuple):
    """What does the travelling in a motion.

    Attributes:
        side: "L" or "R"; empty where both sides travel alike.
        part: "leg" or "arm"; "body" where no single limb travels.
    """

    side: str
    part: str


def find_limb(recording: Recording, frames: FloatArray) -> Limb:
    """Find the limb that travels, if its mirror image does not.

    With markers: the ankle, else the wrist; else the foot over which the pelvis moves. With joint
    angles: the side whose channels (``*_l``, ``*_r``) vary.

    Args:
        recording: Names the columns.
        frames: The motion, without gaps, shape (T, D).
    """
    if not recording.is_markers:
        for part, stems in _JOINTS.items():
            left, right = (
                frames[:, [c.startswith(stems) and c.endswith(e) for c in recording.channels]]
                for e in ("_l", "_r")
            )
            side = _farther(_spread(left), _spread(right), least=TRAVEL_RAD)
            if side:
                return Limb(side, part)
        return Limb("", "body")
    points = frames.reshape(len(frames), -1, 3)
    for part, stem in _MARKERS.items():
        left_end, right_end = (_marker(recording, points, f"{side}{stem}") for side in "LR")
        if left_end is not None and right_end is not None:
            side = _farther(_spread(left_end), _spread(right_end), least=TRAVEL_M)
            if side:
                return Limb(side, part)
    return Limb(_leaned_to(recording, points), "body")


def split_repetitions(takes: Sequence[Recording]) -> tuple[Recording, ...]:
    """Label the primitives inside the repetitions of a person's takes.

    The first repetition of a take is dropped: it starts in the middle of a motion. The others are
    two primitives each, ``"m02L-out"`` and ``"m02L-back"`` for class ``m02`` done on the left.

    Args:
        takes: Recordings of one person whose labels are repetitions, markers or features.

    Returns:
        The same frames, with finer labels, in the same order.

    Raises:
        RecordingError: A take has fewer than two labelled repetitions, or one that is too short.
    """
    filled = all_without_gaps(takes)
    for take in takes:
        if len(take.labels) < 2 or min(label.end - label.start for label in take.labels) < 10:
            raise RecordingError(
                f"take {take.name!r} needs at least 2 labelled repetitions of 10 frames or more, "
                f"not {len(take.labels)}"
            )
    limbs = [
        find_limb(take, frames[take.labels[1].start : take.labels[-1].end])
        for take, frames in zip(takes, filled, strict=True)
    ]
    split: list[Recording] = []
    for take, frames, limb in zip(takes, filled, limbs, strict=True):
        alike = [i for i, other in enumerate(limbs) if other.part == limb.part]
        rest = _rest([takes[i] for i in alike], [filled[i] for i in alike])
        split.append(_split(take, frames, limb.side, rest))
    return tuple(split)


def _split(take: Recording, frames: FloatArray, side: str, rest: FloatArray) -> Recording:
    turns = [
        label.start + find_reversal(frames[label.start : label.end], take.rate_hz)
        for label in take.labels[1:]
    ]
    starts = [label.start for label in take.labels[1:]]
    from_rest = np.mean([_posture_distance(take, frames[i], rest) for i in starts])
    turned = np.mean([_posture_distance(take, frames[i], rest) for i in turns])
    halves = ("out", "back") if from_rest <= turned else ("back", "out")
    labels: list[LabelledSegment] = []
    for label, turn in zip(take.labels[1:], turns, strict=True):
        name = f"{label.label}{side}"
        labels.append(replace(label, end=turn, label=f"{name}-{halves[0]}"))
        labels.append(replace(label, start=turn, label=f"{name}-{halves[1]}"))
    return replace(take, labels=tuple(labels))


def _rest(takes: Sequence[Recording], filled: Sequence[FloatArray]) -> FloatArray:
    """Return the median posture at which repetitions start, shape (D,)."""
    starts: list[FloatArray] = []
    for take, frames in zip(takes, filled, strict=True):
        for label in take.labels[1:]:
            start = frames[label.start]
            if take.is_markers and starts:
                start = stood_like(start[None], starts[0])[0]
            starts.append(start)
    return np.asarray(np.median(starts, axis=0))


def _posture_distance(take: Recording, frame: FloatArray, rest: FloatArray) -> float:
    if take.is_markers:
        frame = stood_like(frame[None], rest)[0]
    return float(np.linalg.norm(frame - rest))


def _smooth(frames: FloatArray, width: int) -> FloatArray:
    from scipy.ndimage import uniform_filter1d

    return np.asarray(uniform_filter1d(frames, 2 * width + 1, axis=0, mode="nearest"))


def _spread(values: FloatArray) -> float:
    """Root mean square distance from the mean of a motion, shape (T, k)."""
    return float(np.sqrt(((values - values.mean(axis=0)) ** 2).sum(axis=1).mean()))


def _farther(left: float, right: float, least: float) -> str:
    if left > max(least, TRAVEL_RATIO * right):
        return "L"
    return "R" if right > max(least, TRAVEL_RATIO * left) else ""


def _marker(recording: Recording, points: FloatArray, name: str) -> FloatArray | None:
    """Mean of the markers whose name starts so, shape (T, 3); None where there is none."""
    chosen = [bool(re.match(name, marker.upper())) for marker in recording.marker_names]
    return points[:, chosen].mean(axis=1) if any(chosen) else None


def _leaned_to(recording: Recording, points: FloatArray) -> str:
    """Return the side of the foot that the pelvis moves over, and away from the other's."""
    left, right, hip_l, hip_r = (
        _marker(recording, points, name) for name in ("LANK", "RANK", "LASI", "RASI")
    )
    if left is None or right is None or hip_l is None or hip_r is None:
        return ""
    pelvis = 0.5 * (hip_l + hip_r)
    between = (left - right)[:, :2]
    apart = np.maximum(np.linalg.norm(between, axis=1), 1e-6)
    place = ((pelvis - right)[:, :2] * between).sum(axis=1) / apart**2  # 0 over right, 1 over left
    low, high = np.percentile(place, [5, 95])
    if max(high - 0.5, 0.5 - low) < 0.25:
        return ""
    return "L" if high - 0.5 > 0.5 - low else "R"
