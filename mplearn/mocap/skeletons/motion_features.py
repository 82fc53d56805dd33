"""Features of motion as generators of motion from text are trained on, back to joints [HumanML3D].

A row is a frame, y up: how fast the root turns and moves on the floor, and how high it is; where
the other joints are, seen from the root; how they are turned (six numbers each) and move; which
feet are down. What stands still or turns is found by adding up, so a take begins at the origin,
heading along z. HumanML3D has 263 columns (22 joints of SMPL, 20 Hz), KIT-ML 251 (21 joints,
12.5 Hz).
"""

from __future__ import annotations

from pathlib import Path

import numpy as np

from ...recording import FloatArray
from ..files import bad_file

RATES_HZ = {263: 20.0, 251: 12.5}
"""Rate by the number of columns, which tells the data set [1/s]."""

_N_ROOT, _N_FEET = 4, 4  # columns of the root's motion, at first, and of the feet, at last


def joints_of_features(path: Path, features: FloatArray) -> FloatArray:
    """Return where joints are, shape (T, J, 3) [the data set's unit], y up.

    Args:
        path: The file, for messages.
        features: Shape (T, 263) or (T, 251).

    Raises:
        RecordingError: They were divided by their spread, as networks take them.
    """
    feet = features[:, -_N_FEET:]
    known = feet[~np.isnan(feet)]
    if not np.isin(known, (0.0, 1.0)).all():
        raise bad_file(
            path,
            f"{features.shape[1]} features of motion that do not say which feet are down by 0 and "
            "1: they seem to be normalised, by a mean and a spread that are not in the file",
            "features as HumanML3D has them (new_joint_vecs), or joints",
        )
    n_others = (features.shape[1] + 1) // 12 - 1  # 3 + 6 + 3 numbers each, 3 of the root's speed
    heading = 2.0 * _added_up(features[:, 0])
    ahead = _turned(features[:, None, 1:3], heading, back_one=True)[:, 0]
    root = np.stack([_added_up(ahead[:, 0]), features[:, 3], _added_up(ahead[:, 1])], axis=1)
    others = features[:, _N_ROOT : _N_ROOT + 3 * n_others].reshape(len(features), n_others, 3)
    level = _turned(others[..., [0, 2]], heading)
    places = np.stack([level[..., 0], others[..., 1], level[..., 1]], axis=2)
    places[..., [0, 2]] += root[:, None, [0, 2]]
    return np.concatenate([root[:, None], places], axis=1)


def _added_up(steps: FloatArray) -> FloatArray:
    """Return what steps from each frame to the next add up to, shape (T,), from zero."""
    return np.concatenate([[0.0], np.cumsum(steps[:-1])])


def _turned(level: FloatArray, heading: FloatArray, *, back_one: bool = False) -> FloatArray:
    """Return x and z, shape (T, N, 2), that were seen under a heading (T,) [rad], in the world."""
    if back_one:  # a step leads to the next frame, and was seen from there
        heading = np.concatenate([heading[1:], heading[-1:]])
    cos, sin = np.cos(heading)[:, None], np.sin(heading)[:, None]
    x, z = level[..., 0], level[..., 1]
    return np.stack([cos * x - sin * z, sin * x + cos * z], axis=2)
