"""How well on-line inverse kinematics finds postures: on a known truth, and on people's markers."""

from __future__ import annotations

import time
from collections.abc import Iterable, Sequence
from typing import NamedTuple

import numpy as np

from ...body import Body, InverseKinematics, human_body, robot_body
from ...demonstrator import Demonstration, Person, Variability, demonstrate, markov_script
from ...mocap import GapTracker
from ...recording import BoolArray, FloatArray, Recording
from ..table import Table

NOISE_M = 0.002
SHARES_MISSING = (0.0, 0.1)
MOTIONS = 40
CALIBRATION_S = 0.6
SETTLED_S = 1.0  # the first second is left out of the errors
UNDETERMINED_RAD = 0.5  # a joint whose uncertainty stays above this is not determined


class Followed(NamedTuple):
    """What the inverse kinematics made of a recording.

    Attributes:
        postures: Shape (T, 7 + n).
        uncertainty_rad: Median standard deviation of each hinge, shape (n,) [rad].
        residuals_m: Distance of each marker from its place, shape (T, M) [m]; NaN where missing.
        took_s: Processor time of each frame, gaps and inverse kinematics, shape (T,) [s].
    """

    postures: FloatArray
    uncertainty_rad: FloatArray
    residuals_m: FloatArray
    took_s: FloatArray


def follow(recording: Recording, body: Body) -> Followed:
    """Follow a recording of markers frame by frame, gaps first, on a body fitted to its start."""
    markers = recording.markers
    ik = InverseKinematics(body, recording.marker_names, rate_hz=recording.rate_hz)
    ik.calibrate(markers[: max(2, round(CALIBRATION_S * recording.rate_hz))])
    gaps = GapTracker(markers.shape[1], recording.rate_hz)
    postures, sigma, residuals, took = [], [], [], []
    for frame in markers:
        begin = time.process_time()
        postures.append(ik.update(gaps.update(frame)))
        took.append(time.process_time() - begin)
        sigma.append(ik.uncertainty[6:])
        residuals.append(ik.residual_m)
    return Followed(
        np.array(postures),
        np.median(sigma, axis=0),
        np.array(residuals),
        np.array(took),
    )


def joint_error_table(seeds: Sequence[int], n_motions: int = MOTIONS) -> Table:
    """Compare joint angles with the demonstrator's, on persons drawn at random.

    Args:
        seeds: One person and performance each.
        n_motions: Motions in each performance.

    Example:
        >>> table = joint_error_table(seeds=[1], n_motions=2)
        >>> table.columns[:3]
        ('markers missing', 'joint error, mean', 'worst person')
    """
    rows = []
    for share in SHARES_MISSING:
        parts = [_joint_errors(_performed(seed, share, n_motions)) for seed in seeds]
        names = human_body().joint_names
        loose = np.array([part.loose for part in parts]).any(axis=0)
        error = np.mean([part.error_deg for part in parts], axis=0)  # (n,)
        worst = int(np.argmax(np.where(loose, -1.0, error)))
        means = [part.error_deg[~part.loose].mean() for part in parts]
        took = np.concatenate([part.took_s for part in parts])
        apart = [f"{names[j]} {error[j]:.1f}" for j in np.flatnonzero(loose)]
        rows.append(
            (
                f"{100 * share:.0f} %",
                f"{np.mean(means):.2f} deg",
                f"{np.max(means):.2f} deg",
                f"{names[worst]} {error[worst]:.1f} deg",
                ", ".join(apart) or "-",
                f"{1000 * np.mean([part.residual_m for part in parts]):.1f} mm",
                *_times(took),
            )
        )
    return Table(
        title=f"Inverse kinematics: 40 joints, {len(seeds)} persons of the demonstrator",
        columns=(
            "markers missing",
            "joint error, mean",
            "worst person",
            "worst joint",
            "not determined (deg)",
            "marker residual",
            "frame, median",
            "frame, p99",
        ),
        rows=tuple(rows),
        note=(
            f"34 markers, {1000 * NOISE_M:.0f} mm noise a coordinate, markers hidden for 0.05 to "
            "0.5 s each. Mean absolute error of the hinge angles against the truth, the "
            "calibration's error included: sizes and marker places are fitted to the first "
            f"{CALIBRATION_S} s. A joint is not determined where its stated uncertainty stays "
            f"above {UNDETERMINED_RAD} rad; it is left out of the means. Processor time of gap "
            "tracking and inverse kinematics, one core."
        ),
    )


def marker_residual_table(takes: Iterable[Recording]) -> Table:
    """Measure how far people's markers are from where the body fitted to them has them.

    Args:
        takes: Recordings of known marker sets.

    Example:
        >>> from mplearn.demonstrator import demonstrate
        >>> table = marker_residual_table([demonstrate(["BAR", "BAL"], seed=1).recording])
        >>> table.columns[:4]
        ('person', 'body', 'frames', 'mean')
    """
    rows = []
    everything: dict[str, list[Followed]] = {"human": [], "robot": []}
    takes = list(takes)
    for person in dict.fromkeys(take.person for take in takes):
        for body in (human_body(), robot_body()):
            followed = [follow(take, body) for take in takes if take.person == person]
            everything[body.name] += followed
            rows.append(_residual_row(person or "unnamed", body.name, followed))
    if len(rows) > 2:
        rows += [_residual_row("all", name, followed) for name, followed in everything.items()]
    return Table(
        title="Inverse kinematics: marker residuals of people",
        columns=("person", "body", "frames", "mean", "worst take", "frame, median", "frame, p99"),
        rows=tuple(rows),
        note=(
            "Mean distance of a marker from its place on the body, over all frames and markers "
            f"seen. Sizes and places are fitted to the first {CALIBRATION_S} s of each take. The "
            "human body has 40 hinges; the robot's 30 follow the same markers."
        ),
    )


class _JointErrors(NamedTuple):
    error_deg: FloatArray  # (n,)
    loose: BoolArray  # (n,): not determined
    residual_m: float
    took_s: FloatArray  # (T,)


def _performed(seed: int, missing: float, n_motions: int) -> Demonstration:
    rng = np.random.default_rng(seed)
    return demonstrate(
        markov_script(n_motions, rng),
        seed,
        person=Person.random(rng),
        variability=Variability(noise_m=NOISE_M, occlusion=missing),
    )


def _joint_errors(performed: Demonstration) -> _JointErrors:
    followed = follow(performed.recording, human_body())
    first = round(SETTLED_S * performed.recording.rate_hz)
    error = np.abs(followed.postures - performed.posture.frames)[first:, 7:]
    return _JointErrors(
        np.degrees(error.mean(axis=0)),
        followed.uncertainty_rad > UNDETERMINED_RAD,
        float(np.nanmean(followed.residuals_m)),
        followed.took_s,
    )


def _residual_row(person: str, body: str, followed: Sequence[Followed]) -> tuple[str, ...]:
    means = [float(np.nanmean(each.residuals_m)) for each in followed]
    frames = [len(each.postures) for each in followed]
    return (
        person,
        body,
        str(sum(frames)),
        f"{1000 * np.average(means, weights=frames):.1f} mm",
        f"{1000 * max(means):.1f} mm",
        *_times(np.concatenate([each.took_s for each in followed])),
    )


def _times(took_s: FloatArray) -> tuple[str, str]:
    median, late = np.median(took_s), np.percentile(took_s, 99)
    return f"{1e3 * median:.2f} ms", f"{1e3 * late:.2f} ms"
