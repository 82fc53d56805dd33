"""What a recording holds: how it was read, who was recognised in it, and how well that fits."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np

from mplearn.errors import MPLearnError
from mplearn.recording import FloatArray, Recording

if TYPE_CHECKING:
    from mplearn.anatomy import BodyMap

FIT_S = 4.0  # of a recording are followed to see how well a person fits
SHOWN = 6  # postures


@dataclass(eq=False)
class Inspection:
    """What was found in one recording.

    Attributes:
        recording: What was read.
        body: The body in it; None where there is none.
        places: The recording in the body's places; None where there is no body.
        moments: Frames that are shown, shape (k,).
        postures: A person's features at those moments, shape (k, D); empty without a body.
        fit_m: Median distance of the points from the person who follows them [m]; NaN without.
        stature_m: Estimated stature of the person [m]; NaN without.
        problem: Why nobody was recognised, or nobody fits; empty where all is well.
    """

    recording: Recording
    body: BodyMap | None = None
    places: Recording | None = None
    moments: tuple[int, ...] = ()
    postures: FloatArray = field(default_factory=lambda: np.empty((0, 0)))
    fit_m: float = float("nan")
    stature_m: float = float("nan")
    problem: str = ""

    def as_dict(self) -> dict[str, Any]:
        """Return all but the arrays, as JSON can hold it."""
        recording, body = self.recording, self.body
        report = recording.report
        return {
            "take": recording.name,
            "format": report.format if report else "",
            "rate_hz": recording.rate_hz,
            "frames": len(recording),
            "duration_s": recording.duration_s,
            "unit_m": report.unit_m if report else None,
            "up": report.up if report else "",
            "channels": len(recording.channels),
            "points": len(plain_points(recording)),
            "gaps": gaps(recording),
            "recognised": {} if body is None else {p: list(points) for p, points in body.parts},
            "unseen": [] if body is None else list(body.unseen),
            "left_out": [*(report.left_out if report else ()), *(body.left_out if body else ())],
            "confidence": None if body is None else round(body.confidence, 3),
            "stature_m": _rounded(self.stature_m),
            "fit_m": _rounded(self.fit_m),
            "notes": list(report.notes) if report else [],
            "warnings": [*(report.warnings if report else ()), *(body.warnings if body else ())],
            "problem": self.problem,
        }


def inspect(recording: Recording, names: Mapping[str, str] | None = None) -> Inspection:
    """Recognise the person in a recording and follow it for a while."""
    from mplearn.anatomy import recognise
    from mplearn.body import MotionObserver, human_body

    found = Inspection(recording)
    if not recording.is_markers:
        found.problem = "no points: these are channels, and no body can be recognised in them"
        return found
    try:
        found.body = recognise(recording, names=names)
        found.places = found.body.apply(recording)
        some = found.places.sliced(0, min(len(recording), round(FIT_S * recording.rate_hz) + 2))
        observer = MotionObserver(some.marker_names, some.rate_hz, human_body())
        features = observer.observe(some.frames)
    except MPLearnError as error:
        found.problem = str(error)
        return found
    if observer.ik.calibration is None or not len(features):
        found.problem = "too little is seen of the person"
        return found
    moments = np.unique(np.linspace(0, len(features) - 1, SHOWN).round().astype(int))
    found.moments = tuple(int(m) for m in moments)
    found.postures = features[moments]
    found.stature_m = observer.ik.calibration.height_m
    found.fit_m = float(np.nanmedian(observer.ik.residual_m))
    return found


def gaps(recording: Recording) -> dict[str, float]:
    """Return the share of the frames in which each point is missing, the most missing first."""
    if not recording.is_markers:
        return {}
    missing = np.isnan(recording.markers).any(axis=2).mean(axis=0)
    names = [(float(m), name) for m, name in zip(missing, recording.marker_names, strict=True) if m]
    return {name: round(share, 4) for share, name in sorted(names, reverse=True)}


def plain_points(recording: Recording) -> tuple[str, ...]:
    """Return the points of a recording without those that only show how a joint is turned."""
    if not recording.is_markers:
        return ()
    from mplearn.mocap.skeletons.kinematics import AXIS_MARK

    ends = tuple(f"{AXIS_MARK}{axis}" for axis in "xyz")
    shown = recording.skeleton is not None
    return tuple(n for n in recording.marker_names if not (shown and n.endswith(ends)))


def _rounded(value: float) -> float | None:
    return round(value, 4) if np.isfinite(value) else None
