"""The ways to make a primitive move: one function a style, all of the same form."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Literal, TypeAlias

import numpy as np

from ..errors import InvalidValueError
from ..maths.resampling import stretch
from ..recording import FloatArray
from .averaging import average_of_motions
from .joins import drawn_from, joined
from .schedule import GenerativePrimitive, Schedule, state_durations_s
from .smooth import most_likely_trajectory

StyleName: TypeAlias = Literal["deterministic", "nearest", "averaged", "smooth"]


@dataclass(frozen=True, eq=False)
class Request:
    """What a style is asked for.

    Attributes:
        path: The primitives, in order.
        timing: State of each frame.
        model_rate_hz: Frame rate of models and exemplars [1/s].
        rate_hz: Frame rate of the motion [1/s].
        start: Posture to start from, at rest, shape (D,); None starts where the motion does.
        blend_s: Time over which one piece passes into the next [s].
        n_samples: How many samples "averaged" draws.
        rng: Source of randomness of "averaged".
    """

    path: Sequence[GenerativePrimitive]
    timing: Schedule
    model_rate_hz: float
    rate_hz: float
    start: FloatArray | None
    blend_s: float
    n_samples: int
    rng: np.random.Generator | None

    @property
    def lengths(self) -> list[int]:
        """Frames of each primitive, length P."""
        ends = np.append(self.timing.starts, len(self.timing.states))
        return [int(n) for n in np.diff(ends)]


@dataclass(frozen=True)
class Style:
    """A way to generate.

    Attributes:
        frames: Makes the motion, shape (T, D), T as the timing says.
        cutoff_hz: Cut-off of the low-pass filter it needs; infinite where it needs none [1/s].
        starts_itself: Whether it honours ``start`` by itself.
    """

    frames: Callable[[Request], FloatArray]
    cutoff_hz: float = math.inf
    starts_itself: bool = False


def deterministic(request: Request) -> FloatArray:
    """Emit the mean of each state for its expected duration [Kulic2007]: steps, to be filtered."""
    rows = [primitive.hmm.means for primitive in request.path]
    first_row = np.cumsum([0, *(len(means) for means in rows[:-1])])
    return np.concatenate(rows)[first_row[request.timing.positions] + request.timing.states]


def smooth(request: Request) -> FloatArray:
    """Solve a trajectory-HMM over the whole path at once, see `most_likely_trajectory`."""
    known = [primitive.dynamics for primitive in request.path]
    first_row = np.cumsum([0, *(d.means.shape[1] for d in known[:-1])])
    rows = first_row[request.timing.positions] + request.timing.states
    means = np.concatenate([d.means for d in known], axis=1)
    variances = np.concatenate([d.variances for d in known], axis=1)
    return most_likely_trajectory(means, variances, rows, request.rate_hz, request.start)


def nearest(request: Request) -> FloatArray:
    """Replay stored exemplars [Lee2006], each time the one that begins nearest to where we are.

    Without a posture to start from, the first is the one that its model finds most likely.
    """
    pieces: list[FloatArray] = []
    posture = request.start
    for primitive, n_frames in zip(request.path, request.lengths, strict=True):
        if not primitive.exemplars:
            raise InvalidValueError(
                f"primitive {primitive.id} holds no exemplars; style 'nearest' replays them"
            )
        if posture is None:
            costs = [-primitive.hmm.score(frames) / len(frames) for frames in primitive.exemplars]
        else:
            scale = np.sqrt(primitive.dynamics.variances[0].mean(axis=0))
            costs = [float(np.sum(((f[0] - posture) / scale) ** 2)) for f in primitive.exemplars]
        pieces.append(stretch(primitive.exemplars[int(np.argmin(costs))], n_frames))
        posture = pieces[-1][-1]
    return joined(pieces, request.rate_hz, request.blend_s)


def averaged(request: Request) -> FloatArray:
    """Draw many motions from each model, normalise their time and average them [Takano2006]."""
    if request.rng is None:
        raise InvalidValueError("style 'averaged' draws samples: pass rng, a numpy Generator")
    pieces = [
        _average_of_samples(primitive, request, request.rng, n_frames)
        for primitive, n_frames in zip(request.path, request.lengths, strict=True)
    ]
    return joined(pieces, request.rate_hz, request.blend_s)


def from_start(frames: FloatArray, request: Request) -> FloatArray:
    """Bend a motion so that it starts at rest at the posture that was asked for, if one was."""
    if request.start is None:
        return frames
    rest = np.zeros_like(request.start)
    return drawn_from(frames, request.start, rest, request.rate_hz, request.blend_s)


STYLES: dict[str, Style] = {
    "deterministic": Style(deterministic, cutoff_hz=2.5),
    "nearest": Style(nearest),
    "averaged": Style(averaged, cutoff_hz=3.0),
    "smooth": Style(smooth, starts_itself=True),
}


def _average_of_samples(
    primitive: GenerativePrimitive, request: Request, rng: np.random.Generator, n_frames: int
) -> FloatArray:
    hmm = primitive.hmm
    expected = state_durations_s(primitive) * request.model_rate_hz
    stays = rng.geometric(1.0 / np.maximum(expected, 1.0), size=(request.n_samples, len(expected)))
    n_own = max(round(expected.sum()), 1)
    average = average_of_motions(hmm.means, hmm.variances, stays, n_own, rng)
    return stretch(average, n_frames)
