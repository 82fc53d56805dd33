"""What a robot performs of a library: by the verdicts and plans of the environment."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from mplearn.errors import InvalidValueError, LibraryError, RobotError
from mplearn.library import PrimitiveLibrary
from mplearn.maths.plane import turn_in_plane
from mplearn.maths.quaternions import quaternion_product, vector_quaternion
from mplearn.recording import FloatArray
from mplearn_envs.data.library_source import LibrarySource
from mplearn_envs.mechanics.reference import Reference, rest_reference
from mplearn_envs.planning.plan import Plan
from mplearn_envs.robot import Robot
from mplearn_envs.skills.repertoire import Repertoire
from mplearn_envs.skills.skills import Skills

from .motion import RobotMotion, Span

_HOLD = "hold"


@dataclass(frozen=True)
class Performed:
    """Motions, and what could not be among them.

    Attributes:
        motions: What the robot performs.
        left_out: Names of the primitives that it cannot, with the reasons.
    """

    motions: tuple[RobotMotion, ...]
    left_out: dict[str, str]


def perform(
    library: PrimitiveLibrary | Path | str | None,
    robot: Robot,
    path: Sequence[int | str] = (),
    *,
    walk: int | None = None,
    clips: int = 1,
    seed: int = 0,
    speed: float = 0.5,
    hold_s: float = 0.5,
) -> Performed:
    """Return what a robot makes of a library, a path or a walk: feet, balance and all.

    A motion begins as the environment does, standing upright with arms hanging, and comes to rest
    at its end. Only primitives that the robot can perform by the environment's verdicts are in it.

    Args:
        library: The primitives, or their file; None is the built-in library.
        robot: Who performs.
        path: Names or ids of primitives in their order; with none, and no walk, each primitive of
            the library becomes a motion of its own.
        walk: Number of primitives of a walk on the graph, which begins at ``path`` if that is one.
        clips: How many walks, of the seeds ``seed``, ``seed + 1``, ...
        seed: See there.
        speed: Wanted speed, as a share of the human's.
        hold_s: Time in which it comes to rest at the end [s]; 0 leaves that out.

    Raises:
        LibraryError: The library cannot be read, or is for another body.
        UnknownPrimitiveError: The path names a primitive that there is not.
        InvalidValueError: A walk begins at more than one primitive, or a number is out of range.
        RobotError: The robot can perform nothing of it, with the reasons.

    Example:
        >>> from mplearn_envs.robot import humanoid
        >>> bow = perform(None, humanoid(), ("bow down", "bow up")).motions[0]
        >>> [span.name for span in bow.spans], bow.joint_pos.shape[1]
        (['bow down', 'bow up', 'hold'], 30)
    """
    if not (np.isfinite(hold_s) and hold_s >= 0):
        raise InvalidValueError(f"hold_s must be finite and not negative, not {hold_s}")
    if walk is not None and (walk < 1 or clips < 1):
        raise InvalidValueError(f"a walk has 1 primitive or more, not {min(walk, clips)}")
    if walk is not None and len(path) > 1:
        raise InvalidValueError("a walk begins at one primitive at most")
    known = LibrarySource(library).now()
    if not len(known):
        raise LibraryError("the library is empty: there is nothing to perform")
    ids = [known[key].id for key in path]
    repertoire = Repertoire(known, robot, speed=speed)
    skills = repertoire.skills
    if walk is not None:
        left_out = {} if not ids else _refused(skills, ids)
        if left_out:
            raise _nothing(robot, left_out)
        walks = [
            _walk(repertoire, ids, walk, np.random.default_rng(seed + k)) for k in range(clips)
        ]
        return Performed(
            tuple(_motion(skills, ids, f"walk_{seed + k}", hold_s) for k, ids in enumerate(walks)),
            {},
        )
    left_out = _refused(skills, ids or known.ids)
    possible = [id for id in ids or known.ids if skills.feasibility(id).feasible]
    if not possible:
        raise _nothing(robot, left_out)
    if ids:
        name = " / ".join(known[id].name for id in possible)
        return Performed((_motion(skills, possible, name, hold_s),), left_out)
    motions = tuple(_motion(skills, [id], known[id].name, hold_s) for id in possible)
    return Performed(motions, left_out)


def _refused(skills: Skills, ids: Sequence[int]) -> dict[str, str]:
    """Return why the robot cannot perform some of the primitives, by name."""
    verdicts = {skills.library[id].name: skills.feasibility(id) for id in ids}
    return {
        name: "; ".join(str(problem) for problem in verdict.problems)
        for name, verdict in verdicts.items()
        if not verdict.feasible
    }


def _nothing(robot: Robot, left_out: dict[str, str]) -> RobotError:
    reasons = "; ".join(f"{name}: {reason}" for name, reason in list(left_out.items())[:6])
    return RobotError(f"robot {robot.name!r} can perform none of it ({reasons})")


def _walk(
    repertoire: Repertoire, start: Sequence[int], n: int, rng: np.random.Generator
) -> list[int]:
    """Return the ids of a walk by the environment's choices: as often as the demonstrator."""
    out = list(start)
    here = rest_reference(repertoire.robot)
    while len(out) < n:
        choices = repertoire.after(out[-1]) if out else repertoire.entries(here)
        if choices.dead_end:  # the demonstrator went on nowhere from here: it goes on as it begins
            choices = repertoire.entries(_end(repertoire.skills, out))
        slot = int(rng.choice(len(choices.prior), p=choices.prior))
        id = repertoire.primitive(slot)
        if id is None:
            raise RobotError(
                f"robot {repertoire.robot.name!r} can perform nothing after "
                f"{repertoire.library[out[-1]].name!r}"
            )
        out.append(id)
    return out


def _end(skills: Skills, ids: Sequence[int]) -> Reference:
    """Return where the reference robot is after some primitives."""
    here = rest_reference(skills.robot)
    for id in ids:
        here = skills.plan(here, id).end
    return here


def _motion(skills: Skills, ids: Sequence[int], name: str, hold_s: float) -> RobotMotion:
    """Return the postures of one plan after another, each where the one before has led."""
    robot = skills.robot
    here = rest_reference(robot)
    place = np.zeros(3)  # x, y, yaw of the present plan's origin in the world
    parts: list[FloatArray] = [here.q[None]]
    spans: list[Span] = []
    now = 0.0
    for id in [*ids, *([None] if hold_s > 0 else [])]:
        plan = skills.hold(here, hold_s) if id is None else skills.plan(here, id)
        knot_s = plan.knot_s
        parts.append(_placed(plan.q[1:], place))
        end = now + plan.duration_s
        label = _HOLD if id is None else skills.library[id].name
        spans.append(Span(-1 if id is None else id, label, now, end))
        place, here, now = _next_place(plan, place), plan.end, end
    postures = np.concatenate(parts)
    return RobotMotion(
        name=name,
        joint_names=robot.joint_names,
        rate_hz=1.0 / knot_s,
        root_pos=postures[:, :3],
        root_quat=postures[:, 3:7] / np.linalg.norm(postures[:, 3:7], axis=1, keepdims=True),
        joint_pos=postures[:, 7:] + robot.attention_angles,
        spans=tuple(spans),
    )


def _next_place(plan: Plan, place: FloatArray) -> FloatArray:
    """Return the origin of what follows: plans begin between the feet, see `recentred`."""
    middle, yaw = plan.ground[-1, :, :2].mean(axis=0), float(plan.ground[-1, :, 2].mean())
    x, y = turn_in_plane(middle[0], middle[1], place[2])
    return np.array([place[0] + x, place[1] + y, place[2] + yaw])


def _placed(q: FloatArray, place: FloatArray) -> FloatArray:
    """Return postures, shape (K, 7 + n), moved on the floor to where their origin is."""
    out = q.copy()
    x, y = turn_in_plane(q[:, 0], q[:, 1], place[2])
    out[:, 0], out[:, 1] = x + place[0], y + place[1]
    turn = vector_quaternion(0.0, 0.0, place[2])
    out[:, 3:7] = np.stack(quaternion_product(turn, tuple(q[:, 3:7].T)), axis=1)
    return out
