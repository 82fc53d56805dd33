"""Each way to generate, against repetitions of the same person that no model has seen."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterable, Sequence
from typing import Any, NamedTuple

import numpy as np

from ... import hmm
from ...generation import generate
from ...library import Primitive
from ...maths.filters import lowpass
from ...maths.resampling import stretch
from ...recording import FloatArray, Recording
from ..executions import split_repetitions
from ..observing import observe
from ..table import Table
from .sessions import by_person

HELD_OUT = 3  # repetitions of each primitive; the others are learned from
STATES = 8
HUMAN_HZ = 6.0  # what is faster in a person's own motion is noise of the measurement
POINTS = 100  # to which times are normalised

#: The ways compared: what `generate` is told. A cut-off of infinity is no filter.
WAYS: dict[str, dict[str, Any]] = {
    "deterministic": {"style": "deterministic", "cutoff_hz": np.inf},
    "deterministic, filter 1.5 Hz": {"style": "deterministic", "cutoff_hz": 1.5},
    "deterministic, filter 2.5 Hz (default)": {"style": "deterministic", "cutoff_hz": 2.5},
    "deterministic, filter 4 Hz": {"style": "deterministic", "cutoff_hz": 4.0},
    "averaged sampling, filter 3 Hz (default)": {"style": "averaged"},
    "nearest example (default)": {"style": "nearest"},
    "nearest example, filter 4 Hz": {"style": "nearest", "cutoff_hz": 4.0},
    "smooth (default)": {"style": "smooth"},
    "smooth, filter 3 Hz": {"style": "smooth", "cutoff_hz": 3.0},
}
ANOTHER = "another repetition by the person"


class Quality(NamedTuple):
    """How near one generated motion is to a person's.

    Attributes:
        rmse_deg: Root mean square difference of the joint angles to the held-out repetitions,
            after time normalisation [deg].
        jerk: Mean |jerk| of the joint angles relative to the held-out repetitions'.
    """

    rmse_deg: float
    jerk: float


def generation_table(takes: Iterable[Recording]) -> Table:
    """Learn each primitive of each person from some repetitions; compare with the others.

    Args:
        takes: Recordings of markers with labelled repetitions, of any number of people.

    Example:
        >>> import numpy as np
        >>> from mplearn import LabelledSegment, Recording
        >>> wave = 1 - np.cos(2 * np.pi * np.arange(400) / 100)  # four repetitions
        >>> def take(name, size, person="anna"):
        ...     labels = tuple(LabelledSegment(100 * k, 100 * k + 100, name) for k in range(4))
        ...     frames = size * wave[:, None]
        ...     return Recording(frames, 100.0, ("elbow",), name=name, labels=labels, person=person)
        >>> table = generation_table([take("up", 1.0), take("out", -1.0)])
        >>> table.columns[:3]
        ('style', 'RMSE', "mean |jerk| / human's")
    """
    found: dict[str, list[Quality]] = defaultdict(list)
    n_people = 0
    for own in by_person(takes).values():
        n_people += 1
        for take in split_repetitions([observe(take) for take in own]):
            joints = [i for i, name in enumerate(take.channels) if not name.startswith("base_")]
            for motions in _by_class(take).values():
                if len(motions) < HELD_OUT + 3 or min(map(len, motions)) < 2 * STATES:
                    continue
                for way, quality in _qualities(motions, take, joints).items():
                    found[way].append(quality)
    return Table(
        title="Generation against held-out repetitions of the same person",
        columns=("style", "RMSE", "mean |jerk| / human's", "smooth is better in: RMSE", "jerk"),
        rows=tuple(_row(way, found) for way in found),
        note=(
            f"{len(found[ANOTHER])} primitives of {n_people} people, in the joint angles of the "
            f"robot; models of {STATES} states from all but the last {HELD_OUT} repetitions of "
            "each, which are compared with what is generated after both are brought to "
            f"{POINTS} points in time. The person's own jerk is taken below {HUMAN_HZ:g} Hz. The "
            "last columns: share of the primitives in which smooth (default) is the better one. "
            "[Kulic2012] filters what is generated deterministically, and gives no cut-off."
        ),
    )


def _by_class(take: Recording) -> dict[str, list[FloatArray]]:
    motions: dict[str, list[FloatArray]] = defaultdict(list)
    for label in take.labels:
        motions[label.label].append(take.frames[label.start : label.end])
    return motions


def _qualities(
    motions: Sequence[FloatArray], take: Recording, joints: Sequence[int]
) -> dict[str, Quality]:
    learned, held_out = motions[:-HELD_OUT], motions[-HELD_OUT:]
    model = hmm.fit(learned, STATES)
    primitive = Primitive.from_exemplars(0, model, learned, take.rate_hz, max_kept=len(learned))
    human = [lowpass(motion[:, joints], take.rate_hz, HUMAN_HZ) for motion in held_out]
    jerk = float(np.mean([_jerk(motion, take.rate_hz) for motion in human]))
    made = {
        way: generate(
            [primitive], take.channels, take.rate_hz, rng=np.random.default_rng(0), **told
        ).frames[:, joints]
        for way, told in WAYS.items()
    }
    made[ANOTHER] = lowpass(learned[-1][:, joints], take.rate_hz, HUMAN_HZ)
    return {
        way: Quality(_rmse_deg(frames, human), _jerk(frames, take.rate_hz) / jerk)
        for way, frames in made.items()
    }


def _rmse_deg(frames: FloatArray, human: Sequence[FloatArray]) -> float:
    ours = stretch(frames, POINTS)
    squares = [np.mean((ours - stretch(motion, POINTS)) ** 2) for motion in human]
    return float(np.degrees(np.sqrt(np.mean(squares))))


def _jerk(frames: FloatArray, rate_hz: float) -> float:
    """Return the mean |jerk| [rad/s^3]."""
    return float(np.abs(np.diff(frames, n=3, axis=0)).mean() * rate_hz**3)


def _row(way: str, found: dict[str, list[Quality]]) -> tuple[str, ...]:
    own, smooth = np.array(found[way]), np.array(found["smooth (default)"])
    rmse, jerk = own.mean(axis=0)
    better = (smooth < own).mean(axis=0)
    shares = ("-", "-") if way == "smooth (default)" else (f"{100 * b:.0f} %" for b in better)
    return (way, f"{rmse:.2f} deg", f"{jerk:.2f}", *shares)
