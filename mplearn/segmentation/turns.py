"""Where a motion that never rests turns round: along its main axis, confirmed by the posture.

Walking, jogging, arm circles have no rest, and the speed of the whole body never falls far. But the
axis along which the body moved most of late (the first principal component of its velocity, with a
memory of about a second) reverses twice a cycle. A reversal alone is not a boundary: the trunk
leans forward and back while a person stands up. It is one as soon as the *whole* posture has come
back a part of the way to where it was at the reversal before. Where the axis lags behind a new
motion, the farthest posture since the last turn serves, once the posture has come back from it.

Nothing here knows a period, and nothing depends on the unit or on the rate.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from ..maths.compiling import njit
from ..recording import FloatArray
from .base import check_positive, check_share, frames_of
from .kernels import Smooth, distance
from .speed import KNOWN, MOVING, RETURN, TURN, close, running_speed
from .watch import begin

AXIS_STEPS_HZ = 100.0  # steps of the power method that finds the axis [1/s]
_HASTE = 4.0  # how much faster than usual the axis forgets at most
_LATELY_S = 0.25  # over which it is seen whether the motion still lies along the axis [s]


@dataclass(frozen=True)
class TurnConfig:
    """How turns of a motion that does not rest are found; times in seconds.

    Attributes:
        axis_s: How long the motion is remembered that the main axis is taken from [s].
        axis_share: Where less than this share of the motion's energy lies along the axis of late,
            another motion has begun: what was before is forgotten the faster.
        min_length_s: Shortest time between turns [s].
        zigzag: A turn is seen when the motion has come back along the axis by this share of how far
            it had led,
        zigzag_s: or of how far it leads in this time at the pace of late [s], whichever is less.
        back: And confirmed when the whole posture has come back by this share of the way.
        reach_s: A turn counts if the motion led farther than its pace of late does in this [s],
        reach_running_s: and farther than the running speed does in this [s].
        hysteresis: A minimum of the speed at a turn is a boundary if it lies below this share of
            both peaks.

    Example:
        >>> from mplearn.segmentation import KohlmorgenLemmConfig
        >>> KohlmorgenLemmConfig(turns=TurnConfig(min_length_s=0.3)).turns.min_length_s
        0.3
    """

    axis_s: float = 1.0
    axis_share: float = 0.5
    min_length_s: float = 0.2
    zigzag: float = 0.3
    zigzag_s: float = 0.3
    back: float = 0.3
    reach_s: float = 0.1
    reach_running_s: float = 0.08
    hysteresis: float = 0.45

    def __post_init__(self) -> None:
        check_positive(self, "axis_s", "min_length_s", "zigzag_s", "reach_s", "reach_running_s")
        check_share(self, "axis_share", "zigzag", "back", "hysteresis")


TURN_STATE = np.dtype(
    [
        ("path", "f8"),  # how far the motion has led along the axis
        ("along", "f8"),  # energy of late along the axis, and all of it
        ("energy", "f8"),
        ("pace", "f8"),  # root of the forgetful mean of the squared speed
        ("anchor", "i8"),  # the last turn, or the last boundary
        ("far", "f8"),  # largest distance from the anchor along the axis, and when
        ("far_frame", "i8"),
        ("away", "f8"),  # largest distance of the whole posture from that at the anchor, and when
        ("away_frame", "i8"),
        ("candidate", "i8"),  # a turn to be confirmed, -1: none
        ("before", "i8"),  # the turn, or the boundary, before it
        ("apart", "f8"),  # how far the postures of the two are apart
    ]
)
SHARES = (
    "axis_share",
    "zigzag",
    "zigzag_s",
    "back",
    "reach_s",
    "reach_running_s",
    "hysteresis",
)  # settings that the rate does not change
TURN_SETTINGS = np.dtype(
    [
        ("forget", "f8"),  # weights of a frame
        ("forget_fast", "f8"),
        ("steps", "i8"),  # of the power method in a frame
        ("interval_s", "f8"),
        ("shortest", "i8"),
        ("tolerance", "i8"),
        *((name, "f8") for name in SHARES),
    ]
)


def turn_settings(config: TurnConfig, rate_hz: float, tolerance_s: float) -> Any:
    """Convert the settings to frames, shape (1,)."""
    settings = np.zeros(1, dtype=TURN_SETTINGS)
    for name in SHARES:
        settings[name] = getattr(config, name)
    settings["forget"] = 1.0 / (config.axis_s * rate_hz)
    settings["forget_fast"] = 1.0 / frames_of(_LATELY_S, rate_hz)
    settings["steps"] = frames_of(AXIS_STEPS_HZ / rate_hz, 1.0)
    settings["interval_s"] = 1.0 / rate_hz
    settings["shortest"] = frames_of(config.min_length_s, rate_hz)
    settings["tolerance"] = frames_of(tolerance_s, rate_hz)
    return settings


class Trail(NamedTuple):
    """What is kept of where the motion led.

    Attributes:
        turning: State, shape (1,), of `TURN_STATE`.
        covariance: Forgetful second moment of the velocity, shape (D, D).
        axis: The main axis, of unit length, shape (D,).
        places: The latest filtered frames, a ring, shape (R, D).
        paths: How far they lie along the axis, a ring, shape (R,).
        anchor_place: The filtered frame at the anchor, shape (D,).
        before_place: That at the turn before the candidate, shape (D,).
    """

    turning: Any
    covariance: FloatArray
    axis: FloatArray
    places: FloatArray
    paths: FloatArray
    anchor_place: FloatArray
    before_place: FloatArray


def new_trail(n_channels: int, n_kept: int) -> Trail:
    """Return what is kept before the first frame; of the latest frames, so many."""
    turning = np.zeros(1, dtype=TURN_STATE)
    turning["candidate"] = -1
    d = n_channels
    places = np.zeros((n_kept, d))
    return Trail(
        turning, np.zeros((d, d)), np.zeros(d), places, np.zeros(n_kept), np.zeros(d), np.zeros(d)
    )


@njit(cache=True)
def follow_axis(t: int, s: float, smooth: Smooth, q: Any, trail: Trail) -> None:
    """Take the newest frame into the axis, and into the path along it.

    Args:
        t: The frame.
        s: Its speed.
        smooth: The filter, that has seen it.
        q: Settings, a record of `TURN_SETTINGS`.
        trail: What is kept.
    """
    k = trail.turning[0]
    covariance, axis = trail.covariance, trail.axis
    v = np.sqrt(smooth.weights) * smooth.velocity
    weight = max(q.forget, 1.0 / (t + 1))
    k.pace = math.sqrt((1.0 - weight) * k.pace * k.pace + weight * s * s)
    wanted = q.axis_share * k.energy
    if k.along < wanted:
        haste = wanted / k.along if k.along * _HASTE > wanted else _HASTE
        weight = max(weight, min(1.0, haste * q.forget))
    for i in range(len(v)):
        share = weight * v[i]
        row = covariance[i]
        for j in range(len(v)):
            row[j] = (1.0 - weight) * row[j] + share * v[j]
    if not axis.any():
        axis[:] = v
    for _ in range(q.steps):
        turned = np.dot(covariance, axis)
        norm = math.sqrt(np.dot(turned, turned))
        if norm > 0.0:
            axis[:] = turned / norm
    step = np.dot(axis, v)
    k.path += step * q.interval_s
    lately = max(q.forget_fast, 1.0 / (t + 1))
    k.along += lately * (step * step - k.along)
    k.energy += lately * (s * s - k.energy)
    trail.places[t % trail.places.shape[0]] = smooth.place
    trail.paths[t % trail.paths.shape[0]] = k.path


@njit(cache=True)
def anchor_at(frame: int, t: int, weights: FloatArray, trail: Trail) -> None:
    """Let distances be counted from a frame on; what has come since is looked at again."""
    k = trail.turning[0]
    size = trail.paths.shape[0]
    first = max(frame, t - size + 1, 0)
    k.anchor = frame
    trail.anchor_place[:] = trail.places[first % size]
    k.far, k.far_frame, k.away, k.away_frame = 0.0, first, 0.0, first
    for u in range(first, t + 1):
        _stretch(u, weights, trail)


@njit(cache=True)
def _stretch(u: int, weights: FloatArray, trail: Trail) -> tuple[float, float]:
    """Return how far frame u lies from the anchor, along the axis and as a whole; keep the most."""
    k = trail.turning[0]
    size = trail.paths.shape[0]
    first = max(k.anchor, u - size + 1, 0)
    far = abs(trail.paths[u % size] - trail.paths[first % size])
    away = distance(trail.places[u % size], trail.anchor_place, weights)
    if far >= k.far:
        k.far, k.far_frame = far, u
    if away >= k.away:
        k.away, k.away_frame = away, u
    return far, away


@njit(cache=True)
def near_turn(frame: int, q: Any, trail: Trail) -> bool:
    """Whether the motion along the axis turned, or turns, at about that frame."""
    k = trail.turning[0]
    candidate = k.candidate >= 0 and abs(frame - k.candidate) <= q.tolerance
    return bool(candidate or abs(frame - k.far_frame) <= q.tolerance)


@njit(cache=True)
def drop_candidate(frame: int, t: int, weights: FloatArray, trail: Trail) -> None:
    """A boundary was found otherwise: what was not confirmed is no turn."""
    trail.turning[0].candidate = -1
    anchor_at(frame, t, weights, trail)


@njit(cache=True)
def look_for_turn(
    m: Any, p: Any, q: Any, ready: float, smooth: Smooth, speeds: FloatArray, trail: Trail, out: Any
) -> int:
    """Look for a turn of the open motion that is confirmed by now.

    Args:
        m: State of the watch over the speed.
        p: Settings of that.
        q: Settings, a record of `TURN_SETTINGS`.
        ready: How much likelier a boundary is than without knowledge.
        smooth: The filter.
        speeds: The latest speeds, a ring.
        trail: What is kept.
        out: Receives what closes, of `CUT`.

    Returns:
        How many segments closed, 0 to 2: with a turn, the one before it that was not confirmed.
    """
    k = trail.turning[0]
    weights, t = smooth.weights, m.frames - 1
    far, away = _stretch(t, weights, trail)
    alone = max(q.reach_s * k.pace, q.reach_running_s * running_speed(m))
    least, left = alone / ready, 1.0 - q.back / ready
    if (
        k.far > least
        and far < k.far - q.zigzag * min(k.far, q.zigzag_s * k.pace)
        and k.far_frame - k.anchor >= q.shortest
    ):
        k.before, k.candidate = k.anchor, k.far_frame
        trail.before_place[:] = trail.anchor_place
        anchor_at(k.candidate, t, weights, trail)
        k.apart = distance(trail.anchor_place, trail.before_place, weights)
        away = distance(smooth.place, trail.anchor_place, weights)
    n = 0
    if k.candidate >= 0:
        still_apart = distance(smooth.place, trail.before_place, weights)
        if still_apart < left * k.apart:
            sure = 1.0 - least / max(k.apart, least)
            known = k.apart <= alone or still_apart >= (1.0 - q.back) * k.apart
            cause = KNOWN if known and ready > 1.0 else TURN
            n = _close_both(m, p, q, k.before, k.candidate, sure, cause, out)
            k.candidate = -1
    if (
        n == 0
        and k.away > least
        and away < left * k.away
        and k.away_frame - max(k.anchor, m.start) >= q.shortest
    ):
        end, cause = k.away_frame, RETURN
        if abs(k.far_frame - end) <= q.tolerance and k.far_frame - m.start >= q.shortest:
            end, cause = k.far_frame, TURN
        if ready > 1.0 and (k.away <= alone or away >= (1.0 - q.back) * k.away):
            cause = KNOWN
        n = _close_both(m, p, q, k.anchor, end, 1.0 - least / k.away, cause, out)
        drop_candidate(end, t, weights, trail)
    if n > 0:
        m.mode = MOVING
        begin(m, speeds)
    return int(n)


@njit(cache=True)
def _close_both(
    m: Any, p: Any, q: Any, before: int, end: int, sure: float, cause: int, out: Any
) -> int:
    """Close the open segment at `end`, and at the turn before it where that lies inside."""
    n = 0
    if end - m.start < q.shortest:
        return n
    if before - m.start >= q.shortest:
        n = close(m, p, before, sure, False, cause, out, n)
    return int(close(m, p, end, sure, False, cause, out, n))
