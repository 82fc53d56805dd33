"""A generated motion as it was shown: in the joints that it was learned in, without a plan."""

from __future__ import annotations

import numpy as np

from mplearn.body import posture_of, robot_body
from mplearn.errors import InvalidValueError
from mplearn.generation.trajectory import Trajectory
from mplearn_envs.robot import humanoid

from .motion import RobotMotion, Span
from .own_terms import in_own_terms


def as_shown(motion: Trajectory, names: dict[int, str] | None = None) -> RobotMotion:
    """Return a motion of the humanoid that does, on the spot, what was shown.

    What is learned leaves out where on the floor somebody stands, and where she looks: the base
    stays above the origin and looks ahead. Neither feet nor balance are planned (see `perform`).

    Args:
        motion: In the channels of the humanoid, in any order.
        names: Of the primitives, by id.

    Raises:
        InvalidValueError: The channels are others', or there is one frame only.

    Example:
        >>> from mplearn_envs.data.library_source import LibrarySource
        >>> library = LibrarySource(None).now()
        >>> bow = as_shown(library.generate(["bow down", "bow up"]))
        >>> len(bow.spans), bow.joint_pos.shape[1]
        (2, 30)
    """
    robot = humanoid()
    lacking = set(robot.channels) - set(motion.channels)
    if lacking:
        raise InvalidValueError(
            f"these channels are not a body's: of {len(robot.channels)} that the humanoid has "
            f"{len(lacking)} are not among them, such as {min(lacking)!r}"
        )
    columns = [motion.channels.index(name) for name in robot.channels]
    hinges = 7 + robot_body().driven
    postures = posture_of(motion.frames[:, columns])
    own = in_own_terms(robot, np.hstack((postures[:, :7], postures[:, hinges])))
    ends = [*motion.starts[1:].tolist(), len(motion) - 1]
    spans = [
        Span(id, (names or {}).get(id, f"P{id}"), start / motion.rate_hz, end / motion.rate_hz)
        for id, start, end in zip(motion.path, motion.starts.tolist(), ends, strict=True)
    ]
    return RobotMotion(
        name=" / ".join(span.name for span in spans),
        joint_names=own.joint_names,
        rate_hz=motion.rate_hz,
        root_pos=own.root_pos,
        root_quat=own.root_quat,
        joint_pos=own.joint_pos,
        spans=tuple(spans),
    )
