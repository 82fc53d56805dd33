"""Films of walks: the robot alone, or with the person who taught it."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from mplearn.recording import FloatArray
from mplearn_agents.walk import WalkResult

from .captions import captioned
from .stage import Stage

if TYPE_CHECKING:
    from mplearn.body import Body


def film(
    walk: WalkResult,
    robot_xml: str,
    names: Sequence[str],
    person: tuple[Body, FloatArray] | None = None,
    size: tuple[int, int] = (640, 440),
) -> Iterator[NDArray[np.uint8]]:
    """Yield a captioned picture, shape (H, W, 3), for each recorded posture of a walk.

    Args:
        walk: A walk with postures.
        robot_xml: The robot's model.
        names: What each step of the walk is called.
        person: A body and its posture for each picture, shape (F, 7 + n), to stand beside.
        size: Width and height of the pictures [pixels].

    Raises:
        MissingDependencyError: There is no off-screen renderer on this machine.
    """
    bodies = [robot_xml] if person is None else [robot_xml, person[0].xml]
    with Stage(bodies, size) as stage:
        for k, posture in enumerate(walk.postures):
            postures = [posture] if person is None else [posture, person[1][k]]
            step = int(walk.step_of[k])
            note = f"{step + 1} / {len(walk.steps)}   {(k + 1) / walk.rate_hz:.1f} s"
            yield captioned(stage.picture(postures), names[step], note)
