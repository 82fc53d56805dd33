"""Where the parts of a body are: the view in which motions are compared.

Joint angles are what a robot needs; they are a poor measure of likeness. Near a singularity of the
shoulder two equal postures have different angles, and a radian at the wrist counts as much as one
at the hip. Points of the body, in its own heading frame, are free of both; [Kulic2012, 4.1] too
reports better segmentation from Cartesian data. They are computed from the angles, so nothing is
measured twice.
"""

from __future__ import annotations

from functools import cache

import numpy as np

from mplearn.errors import BodyError
from mplearn.recording import FloatArray, IntArray

from ..models.body import Body
from ..models.robot import robot_body
from .points import points_of

# point -> (part of the body, place in the part's frame as a share of the body's height)
_SIDED = {
    "shoulder": ("upper_arm", (0.0, 0.0, 0.0)),
    "elbow": ("forearm", (0.0, 0.0, 0.0)),
    "wrist": ("hand", (0.0, 0.0, 0.0)),
    "fingers": ("hand", (0.0, 0.0, -0.08)),
    "knee": ("shank", (0.0, 0.0, 0.0)),
    "ankle": ("foot", (0.0, 0.0, 0.0)),
    "toes": ("foot", (0.09, 0.0, 0.0)),
}
KEYPOINTS = {"face": ("head", (0.06, 0.0, 0.06))} | {
    f"{point}_{side}": (f"{part}_{side}", place)
    for side in "lr"
    for point, (part, place) in _SIDED.items()
}


def keypoint_channels() -> tuple[str, ...]:
    """Return the channel names: x, y, z of each key point, then the base's height (46).

    Example:
        >>> len(keypoint_channels()), keypoint_channels()[-1]
        (46, 'base_height')
    """
    return (*(f"{point}.{axis}" for point in KEYPOINTS for axis in "xyz"), "base_height")


def keypoints_of(features: FloatArray, body: Body | None = None) -> FloatArray:
    """Return the key points of postures, relative to the base, x ahead and y to the left.

    Args:
        features: Shape (T, 3 + driven), as `features_of` returns them.
        body: The body; the robot where not given.

    Returns:
        Shape (T, 46) [m].

    Raises:
        BodyError: The features are not this body's.

    Example:
        >>> from mplearn.body import features_of, robot_body
        >>> keypoints_of(features_of(robot_body().rest[None])).shape, len(keypoint_channels())
        ((1, 46), 46)
    """
    body = body or robot_body()
    features = np.ascontiguousarray(features, dtype=np.float64)
    if features.ndim != 2 or features.shape[1] != 3 + len(body.driven):
        raise BodyError(
            f"features of {body.name!r} have shape (T, {3 + len(body.driven)}), "
            f"not {features.shape}"
        )
    points = points_of(features, body, *_places(body))
    return np.concatenate((points.reshape(len(features), -1), features[:, :1]), axis=1)


@cache
def _places(body: Body) -> tuple[IntArray, FloatArray]:
    """Return part and place of each key point."""
    bodies = np.array([body.tree.body(part) for part, _ in KEYPOINTS.values()])
    places = np.array([place for _, place in KEYPOINTS.values()]) * body.height_m
    return bodies, places
