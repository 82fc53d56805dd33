"""Recordings and their segments as an xarray data set, in the dimensions of `movement`.

``position`` has time, space, keypoints and individuals, as poses have in `movement`; beside it
stands which primitive goes on at each time, and the table of segments.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from ..errors import RecordingError
from ..extras import require
from ..library import RecognisedSegment, SegmentTable
from ..recording import Recording

NONE = -1
"""Stands for no primitive."""

_AXES = (("x", "y", "z"), ("ahead", "left", "up"), ("ahead", "left"))  # the latter from the body


def as_dataset(recording: Recording, table: SegmentTable) -> Any:
    """Return a recording of markers, or of key points, with its segments as an `xarray.Dataset`.

    Args:
        recording: Markers, M of them, or key points of an animal as they are read.
        table: Its segments.

    Returns:
        ``position``, shape (time T, space 3, keypoints M, individuals 1) [m], or of key points,
        whose space is ahead, left (and up) of the body [body lengths]; ``primitive``, shape
        (time T, individuals 1), -1 where there is none; and the columns of the table along the
        dimension ``segments``. ``time`` is in seconds.

    Raises:
        RecordingError: The recording holds neither.
        MissingDependencyError: xarray is not installed (extra ``tables``).

    Example:
        >>> import numpy as np
        >>> from mplearn import Recording
        >>> from mplearn.library import SegmentTable, RecognisedSegment
        >>> take = Recording(np.zeros((100, 3)), 50.0, ("C7.x", "C7.y", "C7.z"), name="bow")
        >>> row = RecognisedSegment("bow", 0.5, 1.7, 3, "down", "down", 0.2, 0.6)
        >>> dataset = as_dataset(take, SegmentTable([row]))
        >>> dataset.position.shape, int(dataset.primitive[40, 0])
        ((100, 3, 1, 1), 3)
    """
    xarray = require("xarray", "tables")
    names, axes = _points_of(recording)
    points = recording.frames.reshape(len(recording), len(names), len(axes))
    position = points.transpose(0, 2, 1)[..., None]
    primitive = np.full((len(recording), 1), NONE, dtype=np.int32)
    for row in table:
        at = slice(round(row.start_s * recording.rate_hz), round(row.end_s * recording.rate_hz))
        primitive[at] = NONE if row.primitive is None else row.primitive
    segments = {
        f"segment_{name}": ("segments", _column(table, name)) for name in RecognisedSegment._fields
    }
    return xarray.Dataset(
        {
            "position": (("time", "space", "keypoints", "individuals"), position),
            "primitive": (("time", "individuals"), primitive),
            **segments,
        },
        coords={
            "time": np.arange(len(recording)) / recording.rate_hz,
            "space": list(axes),
            "keypoints": list(names),
            "individuals": [recording.person or "individual_0"],
        },
        attrs={
            "fps": recording.rate_hz,
            "time_unit": "seconds",
            "source_software": "mplearn",
            "ds_type": "poses",
            "name": recording.name,
            "person": recording.person,
        },
    )


def _points_of(recording: Recording) -> tuple[tuple[str, ...], tuple[str, ...]]:
    """Return the names of points, and the axes in which each is given."""
    for axes in _AXES[1:]:
        names = tuple(channel.rpartition(".")[0] for channel in recording.channels[:: len(axes)])
        if recording.channels == _channels(names, axes):
            return names, axes
    return recording.marker_names, _AXES[0]


def _channels(names: tuple[str, ...], axes: tuple[str, ...]) -> tuple[str, ...]:
    return tuple(f"{name}.{axis}" for name in names for axis in axes)


def _column(table: SegmentTable, name: str) -> Any:
    values = table.column(name)
    if name == "primitive":
        return np.array([NONE if value is None else value for value in values], dtype=np.int32)
    text = name in ("take", "name", "nearest", "person")
    return np.array(values, dtype=str if text else np.float64)


def from_dataset(dataset: Any) -> tuple[Recording, SegmentTable]:
    """Return the recording and the segments that `as_dataset` made a data set of.

    Raises:
        RecordingError: It is no such data set.

    Example:
        >>> import numpy as np
        >>> from mplearn import Recording
        >>> from mplearn.library import SegmentTable, RecognisedSegment
        >>> take = Recording(np.zeros((100, 3)), 50.0, ("C7.x", "C7.y", "C7.z"), name="bow")
        >>> row = RecognisedSegment("bow", 0.5, 1.7, 3, "down", "down", 0.2, 0.6)
        >>> recording, table = from_dataset(as_dataset(take, SegmentTable([row])))
        >>> recording.channels, table[0].name
        (('C7.x', 'C7.y', 'C7.z'), 'down')
    """
    try:
        names, axes = (
            tuple(str(name) for name in dataset[along].values) for along in ("keypoints", "space")
        )
        position = dataset["position"].transpose("time", "keypoints", "space", "individuals")
        frames = np.asarray(position.values[..., 0], dtype=np.float64).reshape(len(position), -1)
        columns = {
            name: dataset[f"segment_{name}"].values.tolist() for name in RecognisedSegment._fields
        }
        columns["primitive"] = [None if id == NONE else id for id in columns["primitive"]]
        attrs = dataset.attrs
        recording = Recording(
            frames,
            float(attrs["fps"]),
            _channels(names, axes),
            str(attrs["name"]),
            str(attrs["person"]),
        )
    except (KeyError, ValueError, AttributeError) as error:
        raise RecordingError(f"no data set of a recording and its segments: {error}") from error
    return recording, SegmentTable.of_columns(columns)
