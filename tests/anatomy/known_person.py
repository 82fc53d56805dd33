"""A person who moves, and what is true of it."""

from dataclasses import dataclass

import numpy as np

from mplearn.body import MotionObserver, features_of, human_body, keypoints_of
from mplearn.body.models.body import Body
from mplearn.recording import Recording

SCRIPT = ("BAR", "BAL", "RAR", "RAL", "BAD", "BAU", "SQD", "SQR", "LKR", "LKT", "SAR", "SAL")
RATE_HZ = 25.0


@dataclass(frozen=True)
class Truth:
    """A performance: the person's own body, the postures, and what the cameras saw."""

    body: Body
    postures: np.ndarray
    markers: Recording

    def errors(self, places: Recording) -> tuple[np.ndarray, np.ndarray]:
        """Return how far a recording's features are from the truth: angles [deg], points [mm]."""
        human = human_body()
        truth = features_of(self.postures, human)
        observer = MotionObserver(places.marker_names, places.rate_hz, human)
        found = observer.observe(places.frames)
        points = [keypoints_of(f, human)[:, :45].reshape(len(f), -1, 3) for f in (truth, found)]
        angles = np.degrees(np.abs(found - truth)[:, 3:])
        return angles, 1000 * np.linalg.norm(points[1] - points[0], axis=2)
