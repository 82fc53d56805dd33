"""What a recording's points are on a body, and the recording in points that every body has."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from ..body import find_marker_set
from ..errors import RecordingError
from ..recording import BoolArray, FloatArray, Recording, marker_channels

_PARTS = (
    *("pelvis", "chest", "head"),
    *(f"{p}_{s}" for p in ("upper_arm", "forearm", "hand", "thigh", "shank", "foot") for s in "lr"),
)


@dataclass(frozen=True, eq=False)
class BodyMap:
    """Which points of a recording are which places of a body.

    A place is a weighted sum of points, so that a map works frame by frame, on-line too.

    Attributes:
        points: Names of the N points that a recording needs for it.
        places: Names of the K places of the body, of one of `mplearn.body`'s marker sets.
        weights: Weight of each point in each place, shape (K, N); rows sum to 1.
        turn: Rotation from the recording's axes to z up, shape (3, 3).
        factor: What the recording's lengths are multiplied with to be metres.
        parts: What each place was made of: (place, names of points), those of the file first.
        left_out: Names of points that are no place of the body.
        stature_m: Estimated stature of the person [m]; NaN where markers were known by name.
        confidence: How sure the map is, in [0, 1].
        warnings: What a user should know.

    Example:
        >>> from mplearn.anatomy import recognise
        >>> from mplearn.demonstrator import demonstrate
        >>> take = demonstrate(["BAR"], seed=1).recording
        >>> found = recognise(take)
        >>> found.unseen, len(found.apply(take)) == len(take)
        ((), True)
    """

    points: tuple[str, ...]
    places: tuple[str, ...]
    weights: FloatArray
    turn: FloatArray
    factor: float
    parts: tuple[tuple[str, tuple[str, ...]], ...]
    left_out: tuple[str, ...]
    stature_m: float
    confidence: float
    warnings: tuple[str, ...] = ()

    @property
    def unseen(self) -> tuple[str, ...]:
        """Parts of the body on which no place lies, as ``"hand_l"``: they are held at rest."""
        markers = find_marker_set(self.places)
        seen = set(markers.select(self.places).bodies)
        return tuple(part for part in _PARTS if part not in seen)

    def apply(self, recording: Recording) -> Recording:
        """Return a recording in the body's places, as markers [m], z up.

        A place of which a point is missing is NaN, in a frame or in the whole recording.

        Raises:
            RecordingError: The recording holds no points, or none that the map knows.
        """
        index = {name: i for i, name in enumerate(recording.marker_names)}
        there = [name in index for name in self.points]
        if not any(there):
            raise RecordingError(
                f"recording {recording.name!r} has none of the points that the body was "
                f"recognised by ({', '.join(self.points[:4])}, ...)"
            )
        found = np.full((len(recording), len(self.points), 3), np.nan)
        columns = [index[name] for name, has in zip(self.points, there, strict=True) if has]
        found[:, there] = recording.markers[:, columns]
        places = self.see(found)
        return replace(
            recording,
            frames=places.reshape(len(places), -1),
            channels=marker_channels(self.places),
            skeleton=None,
        )

    def see(self, points: FloatArray) -> FloatArray:
        """Return the places for points, shape (T, N, 3) to (T, K, 3) [m]."""
        gone: BoolArray = np.asarray(np.isnan(points).any(axis=2))  # (T, N)
        known = np.where(gone[..., None], 0.0, points)
        places = self.weights @ known @ (self.factor * self.turn).T  # (T, K, 3)
        used = (self.weights != 0.0).astype(np.float64)
        missing: BoolArray = np.expand_dims(gone @ used.T, 2) > 0.0
        return np.where(missing, np.nan, places)
