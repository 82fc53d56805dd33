"""How a learner looks at frames: what it compares, and what it can perform, in one vector.

Of a body's features the view holds the key points and the joint angles, the latter as the arc that
a lever of `LEVER_M` sweeps, so that all channels are lengths that matter alike. The features can
be read back from it, so one model recognises a motion and generates it.
"""

from __future__ import annotations

from typing import Protocol

import numpy as np

from mplearn.recording import FloatArray

from ..models.body import Body
from ..models.robot import robot_body
from .features import feature_channels
from .keypoints import keypoint_channels, keypoints_of

LEVER_M = 0.02


class View(Protocol):
    """A way to look at frames.

    Attributes:
        channels: Names of the channels seen.

    Example:
        >>> import numpy as np
        >>> from mplearn.body import feature_channels
        >>> view = view_of(feature_channels())  # of a body: compared by where its parts are
        >>> len(feature_channels()), len(view.channels)
        (33, 78)
    """

    channels: tuple[str, ...]

    def see(self, frames: FloatArray) -> FloatArray:
        """Return what is seen of frames, shape (T, D) to (T, V)."""
        ...

    def read(self, seen: FloatArray) -> FloatArray:
        """Return the frames, or the means of models, that were seen so, (..., V) to (..., D)."""
        ...

    def read_variances(self, seen: FloatArray) -> FloatArray:
        """Return variances of frames from variances of what is seen, (..., V) to (..., D)."""
        ...


class PlainView:
    """Sees frames as they are.

    Args:
        channels: Names of the D channels.

    Example:
        >>> import numpy as np
        >>> view = PlainView(("hip", "knee"))
        >>> view.see(np.array([[0.1, 0.2]])).tolist()
        [[0.1, 0.2]]
    """

    def __init__(self, channels: tuple[str, ...]) -> None:
        self.channels = channels

    def see(self, frames: FloatArray) -> FloatArray:
        """Return the frames."""
        return frames

    def read(self, seen: FloatArray) -> FloatArray:
        """Return what is seen."""
        return seen

    def read_variances(self, seen: FloatArray) -> FloatArray:
        """Return the variances."""
        return seen


class BodyView:
    """Sees features of a body: key points [m], base height [m], angles times the lever [m].

    Args:
        body: The body.

    Example:
        >>> import numpy as np
        >>> from mplearn.body import features_of, robot_body
        >>> view = BodyView(robot_body())
        >>> features = features_of(robot_body().rest[None])
        >>> seen = view.see(features)
        >>> seen.shape, bool(np.allclose(view.read(seen), features))
        ((1, 78), True)
    """

    def __init__(self, body: Body) -> None:
        self.body = body
        self.channels = (*keypoint_channels(), *feature_channels(body)[1:])
        self._n_points = len(keypoint_channels()) - 1  # but for the base's height
        self._scale = np.full(len(feature_channels(body)), LEVER_M)
        self._scale[0] = 1.0  # the base's height is a length

    def see(self, frames: FloatArray) -> FloatArray:
        """Return key points and scaled features, shape (T, 3 + n) to (T, V)."""
        points = keypoints_of(frames, self.body)[:, : self._n_points]
        return np.concatenate((points, frames * self._scale), axis=1)

    def read(self, seen: FloatArray) -> FloatArray:
        """Return the features, shape (..., V) to (..., 3 + n)."""
        return np.asarray(seen[..., self._n_points :] / self._scale)

    def read_variances(self, seen: FloatArray) -> FloatArray:
        """Return the features' variances, shape (..., V) to (..., 3 + n)."""
        return np.asarray(seen[..., self._n_points :] / self._scale**2)


def view_of(channels: tuple[str, ...]) -> View:
    """Return the view of frames with these channels: the robot's if they are its features.

    Example:
        >>> type(view_of(("hip", "knee"))).__name__
        'PlainView'
    """
    robot = robot_body()
    return BodyView(robot) if channels == feature_channels(robot) else PlainView(channels)
