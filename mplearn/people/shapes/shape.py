"""The shape of a motion: what is compared across people.

A shape is a mean trajectory of a fixed number of points: the mean posture, and the movement about
it. The channels are those of the learner's view: positions of the parts of one standard body and
its joint angles, so a person's size and place have fallen away already.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Annotated, NamedTuple

import numpy as np

from ...recording import FloatArray
from ...state import Array, SharedState
from ...tree import MirrorMap, NormalisationConfig
from ...tree.exemplars import normalisation


class Shape(NamedTuple):
    """A mean trajectory, or many, stacked.

    Attributes:
        posture: Mean over the time, shape (D,).
        movement: Deviation from it, weighted, shape (P * D,).
    """

    posture: FloatArray
    movement: FloatArray


@dataclass(frozen=True, eq=False)
class ShapeState(SharedState):
    """A shape; attributes are those of `Shape`."""

    posture: Annotated[FloatArray, Array("d")]
    movement: Annotated[FloatArray, Array("pd")]


def shape_of(exemplars: Sequence[FloatArray], config: NormalisationConfig) -> Shape:
    """Return the shape of one motion's executions.

    Args:
        exemplars: Segments, shape (L, D) each; NaN counts for nothing.
        config: How segments are normalised.
    """
    points = normalisation.points_of_each(exemplars, config)
    seen = ~np.isnan(points)
    mean = np.where(seen, points, 0.0).sum(axis=0) / np.maximum(seen.sum(axis=0), 1)
    weights = normalisation.weights(config)
    weights = weights / weights.sum()
    posture = weights @ mean
    return Shape(posture, (np.sqrt(weights)[:, None] * (mean - posture)).ravel())


def mean_shape(shapes: Sequence[Shape]) -> Shape:
    """Return the mean of some shapes."""
    return Shape(*(np.mean(part, axis=0) for part in zip(*shapes, strict=True)))


def mirrored(shape: Shape, mirror: MirrorMap) -> Shape:
    """Return the mirror image of a shape."""
    movement = mirror.apply(shape.movement.reshape(-1, len(mirror.sign)))
    return Shape(mirror.apply(shape.posture), movement.ravel())
