"""Where an unseen marker must be, from the markers that keep their distance to it.

Markers on one segment of the body keep their distances. How much each distance varies is followed
on-line; from it follows how much a marker says about another. The neighbours of an unseen marker,
as they lay when it was last seen, are moved onto where they are now by the best weighted rigid
motion [Kabsch1976], and the marker with them.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, NamedTuple

import numpy as np

from ..maths.compiling import njit
from ..maths.rotation_kernels import nearest_rotation
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

    def check(self) -> None:
        """Check that no distance was seen more often than there were frames."""
        require(bool((self.looks <= self.frames).all()), "looks", f"must be at most {self.frames}")


class Neighbours(NamedTuple):
    """What is known of the distances between markers, for kernels, which change it in place.

    Attributes are those of `RigidityState`; ``frames`` has shape (1,).
    """

    mean: FloatArray
    variance: FloatArray
    looks: IntArray
    frames: IntArray
    before: FloatArray
    as_last_seen: FloatArray

    @classmethod
    def empty(cls, m: int) -> Neighbours:
        """Return what is known of m markers before the first frame."""
        return cls(
            mean=np.zeros((m, m)),
            variance=np.zeros((m, m)),
            looks=np.zeros((m, m), dtype=np.int64),
            frames=np.zeros(1, dtype=np.int64),
            before=np.full((m, 3), np.nan),
            as_last_seen=np.full((m, m, 3), np.nan),
        )

    def state(self) -> RigidityState:
        """Return the whole state."""
        return RigidityState(
            mean=self.mean.copy(),
            variance=self.variance.copy(),
            looks=self.looks.copy(),
            frames=int(self.frames[0]),
            before=self.before.copy(),
            as_last_seen=self.as_last_seen.copy(),
        )

    @classmethod
    def from_state(cls, state: RigidityState, m: int) -> Neighbours:
        """Return what `state` returned.

        Raises:
            StateError: It is of another number of markers.
        """
        require(len(state.mean) == m, "mean", f"must be of {m} markers, not {len(state.mean)}")
        return cls(
            state.mean.copy(),
            state.variance.copy(),
            state.looks.copy(),
            np.array([state.frames], dtype=np.int64),
            state.before.copy(),
            state.as_last_seen.copy(),
        )


class LookRules(NamedTuple):
    """How distances are followed, for kernels: every so many frames, forgetting such a share."""

    every_frames: int
    forget: float

    @classmethod
    def at(cls, rate_hz: float) -> LookRules:
        """Return the rules at a frame rate."""
        every_frames = max(1, round(_STEP_S * rate_hz))
        return cls(every_frames, 1.0 - float(np.exp(-every_frames / rate_hz / _MEMORY_S)))


@njit(cache=True)
def see_neighbours(
    positions: FloatArray, held: BoolArray, known: Neighbours, rules: LookRules
) -> None:
    """Take up a frame.

    Args:
        positions: What is seen, shape (M, 3) [m]; NaN elsewhere.
        held: Which of the unseen markers will be predicted, shape (M,).
        known: What is known of the distances; changed in place.
        rules: How they are followed.
    """
    if known.frames[0] % rules.every_frames == 0:
        _look(positions, known, rules.forget)
    known.frames[0] += 1
    for m in range(len(positions)):
        if held[m] and known.before[m, 0] == known.before[m, 0]:
            known.as_last_seen[m] = known.before
    known.before[:] = positions


@njit(cache=True)
def _look(positions: FloatArray, known: Neighbours, forget: float) -> None:
    """Follow mean and variance of all distances, in exponential memory."""
    for i in range(len(positions)):
        for j in range(len(positions)):
            square = 0.0
            for axis in range(3):
                square += (positions[i, axis] - positions[j, axis]) ** 2
            if square != square:
                continue
            known.looks[i, j] += 1
            share = max(forget, 1.0 / known.looks[i, j])
            change = np.sqrt(square) - known.mean[i, j]
            known.mean[i, j] += share * change
            known.variance[i, j] = (1.0 - share) * (known.variance[i, j] + share * change**2)


@njit(cache=True)
def predict(m: int, positions: FloatArray, known: Neighbours) -> FloatArray:
    """Return where an unseen marker must be, shape (3,) [m].

    Args:
        m: The marker.
        positions: What is seen, shape (M, 3) [m]; NaN elsewhere.
        known: What is known of the distances.

    Returns:
        NaN where fewer than three others help.
    """
    then = known.as_last_seen[m]
    weights = np.zeros(len(positions))
    helping, total = 0, 0.0
    middle_then, middle_now = np.zeros(3), np.zeros(3)
    for k in range(len(positions)):
        if then[k, 0] != then[k, 0] or positions[k, 0] != positions[k, 0]:
            continue
        doubt = known.variance[m, k] + _UNKNOWN_M**2 / max(known.looks[m, k], 1)
        weights[k] = (doubt + _NOISE_M**2) ** -2.0
        helping += 1
        total += weights[k]
        for i in range(3):
            middle_then[i] += weights[k] * then[k, i]
            middle_now[i] += weights[k] * positions[k, i]
    if helping < 3:
        return np.full(3, np.nan)
    middle_then /= total
    middle_now /= total
    spread = np.zeros((3, 3))
    for k in range(len(positions)):
        if weights[k] > 0.0:
            for i in range(3):
                part = weights[k] / total * (positions[k, i] - middle_now[i])
                for j in range(3):
                    spread[i, j] += part * (then[k, j] - middle_then[j])
    turn = nearest_rotation(spread)
    out = middle_now.copy()
    for i in range(3):
        for j in range(3):
            out[i] += turn[i, j] * (then[m, j] - middle_then[j])
    return out
