"""Films of walks: the robot alone, or with the person who taught it."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
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
    person: tuple[Body, FloatArray] | None = None,
    size: tuple[int, int] = (640, 420),
    *,
    balance: bool = False,
) -> Iterator[NDArray[np.uint8]]:
    """Yield a picture, shape (H, W, 3), for each recorded posture of a walk.

    Args:
        walk: A walk with postures.
        robot_xml: The robot's model.
        person: A body and its posture for each picture, shape (F, 7 + n), to stand beside.
        size: Width and height of the pictures [pixels].
        balance: Whether the robot's support polygon, COG and ZMP are drawn on the floor.

    Raises:
        MissingDependencyError: There is no off-screen renderer on this machine.

    Example:
        >>> from mplearn.body import robot_body
        >>> from mplearn_agents.walk import WalkResult, WalkStep
        >>> step = WalkStep(3, 7, "bow down", 1.0, 0.0, False, False, 0.01, 0.01, 0.03)
        >>> postures = robot_body().rest[None].repeat(2, axis=0)
        >>> walk = WalkResult((step,), postures, np.zeros(2, int), 25.0)
        >>> try:
        ...     shape = next(film(walk, robot_body().xml, size=(64, 48))).shape
        ... except MissingDependencyError:  # no renderer on this machine
        ...     shape = (48, 64, 3)
        >>> shape
        (48, 64, 3)
    """
    bodies = [robot_xml] if person is None else [robot_xml, person[0].xml]
    zmp = zero_moment_points(walk, robot_xml) if balance else None
    with Stage(bodies, size, balance=balance) as stage:
        for k, posture in enumerate(walk.postures):
            shown = [posture] if person is None else [posture, person[1][k]]
            yield stage.picture(shown, None if zmp is None else zmp[k])


def zero_moment_points(walk: WalkResult, robot_xml: str) -> FloatArray:
    """Return the inverted pendulum's ZMP at each recorded posture of a walk, shape (F, 2) [m].

    The COG's acceleration is taken from the pictures' own rate, so what is faster than a few
    pictures is not in it.
    """
    import mujoco

    from mplearn_envs.mechanics.support import pendulum_zmp

    model = mujoco.MjModel.from_xml_string(robot_xml)
    data = mujoco.MjData(model)
    cog = np.empty((len(walk.postures), 3))
    for k, posture in enumerate(walk.postures):
        data.qpos[:] = posture
        mujoco.mj_kinematics(model, data)
        mujoco.mj_comPos(model, data)
        cog[k] = data.subtree_com[1]
    if len(cog) < 2:
        return cog[:, :2]
    velocity = np.gradient(cog, 1.0 / walk.rate_hz, axis=0)
    return pendulum_zmp(cog, np.gradient(velocity, 1.0 / walk.rate_hz, axis=0))


def with_captions(
    pictures: Iterable[NDArray[np.uint8]], walk: WalkResult, names: Sequence[str]
) -> Iterator[NDArray[np.uint8]]:
    """Write what is performed, and when, on the pictures of a film.

    Args:
        pictures: One for each recorded posture of the walk.
        walk: The walk.
        names: What each of its steps is called.

    Example:
        >>> import numpy as np
        >>> from mplearn_agents.walk import WalkResult, WalkStep
        >>> step = WalkStep(3, 7, "bow down", 1.0, 0.0, False, False, 0.01, 0.01, 0.03)
        >>> walk = WalkResult((step,), np.zeros((2, 37)), np.zeros(2, int), 25.0)
        >>> blank = np.zeros((120, 320, 3), np.uint8)
        >>> len(list(with_captions([blank, blank], walk, ["bow down"])))
        2
    """
    for k, picture in enumerate(pictures):
        step = int(walk.step_of[k])
        note = f"{step + 1} / {len(walk.steps)}   {(k + 1) / walk.rate_hz:.1f} s"
        yield captioned(picture, names[step], note)


def middle_pictures(walk: WalkResult) -> dict[int, int]:
    """Return, for each step that performs a primitive, the index of the picture in its middle.

    Example:
        >>> import numpy as np
        >>> from mplearn_agents.walk import WalkResult, WalkStep
        >>> step = WalkStep(3, 7, "bow down", 1.0, 0.0, False, False, 0.01, 0.01, 0.03)
        >>> walk = WalkResult((step,), np.zeros((26, 37)), np.zeros(26, int), 25.0)
        >>> middle_pictures(walk)
        {0: 14}
    """
    middles = {}
    for k, step in enumerate(walk.steps):
        shown = np.flatnonzero(walk.step_of == k)
        if step.primitive is not None and len(shown):
            middles[k] = int(shown[int(0.55 * len(shown))])
    return middles
