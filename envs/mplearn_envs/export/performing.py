"""What a robot performs of a library: by the verdicts and plans of the environment."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from mplearn.errors import InvalidValueError, LibraryError, RobotError
from mplearn.library import PrimitiveLibrary
from mplearn.maths.plane import turn_in_plane
from mplearn.maths.quaternions import quaternion_product, vector_quaternion
from mplearn.recording import FloatArray
from mplearn_envs.data.library_source import LibrarySource
from mplearn_envs.execution.simulation import Simulation
from mplearn_envs.mechanics.reference import Reference, rest_reference
from mplearn_envs.planning.plan import Plan
from mplearn_envs.robot import Robot
from mplearn_envs.skills.feasibility import FeasibilityConfig
from mplearn_envs.skills.repertoire import Repertoire
from mplearn_envs.skills.skills import Skills

from .motion import RobotMotion, Span
from .own_terms import in_own_terms

_HOLD = "hold"
_CUT_OFF = FeasibilityConfig(overshoot=np.inf, slowest=0.05)  # what is shown where not all can be


@dataclass(frozen=True)
class Performed:
    """Motions, and what could not be among them.

    Attributes:
        motions: What the robot performs.
        left_out: Names of the primitives that it cannot, with the reasons.

    Example:
        >>> from mplearn_envs.export import perform
        >>> from mplearn_envs.robot import humanoid
        >>> performed = perform(None, humanoid(), ("bow down", "bow up"))
        >>> [motion.name for motion in performed.motions], performed.left_out
        (['bow down / bow up'], {})
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
    simulated: bool = False,
    upper_body: bool = False,
    show: Callable[[int, int], None] = lambda done, of: None,
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
        simulated: Whether to return what the robot does in MuJoCo, servos, contacts and all,
            instead of what it is to do. A motion in which it falls is left out.
        upper_body: Whether only arms, head and the trunk's turn are performed, by a robot that
            stands: for motions whose legs it cannot follow.
        show: Called after each motion with how many are done, and of how many.

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
    limits = _CUT_OFF if upper_body else None
    repertoire = Repertoire(known, robot, speed=speed, limits=limits, upper_body=upper_body)
    skills = repertoire.skills
    left_out = _refused(skills, ids or known.ids) if walk is None or ids else {}
    possible = [id for id in ids or known.ids if walk is not None or id not in left_out]
    if not possible or (walk is not None and left_out):
        raise _nothing(robot, {known[id].name: reason for id, reason in left_out.items()})
    if walk is not None:
        jobs = [
            (f"walk_{k}", _walk(repertoire, ids, walk, np.random.default_rng(k)))
            for k in range(seed, seed + clips)
        ]
    elif ids:
        jobs = [(" / ".join(known[id].name for id in possible), possible)]
    else:
        jobs = [(known[id].name, [id]) for id in possible]
    names = {known[id].name: reason for id, reason in left_out.items()}
    motions = []
    for k, (name, path_ids) in enumerate(jobs, start=1):
        stage = _Simulated(robot) if simulated else _Planned(robot)
        try:
            motions.append(_motion(skills, path_ids, name, hold_s, stage))
        except _FallError as fall:
            names[name] = str(fall)
        show(k, len(jobs))
    if not motions:
        raise _nothing(robot, names)
    return Performed(tuple(motions), names)


def _refused(skills: Skills, ids: Sequence[int]) -> dict[int, str]:
    """Return why the robot cannot perform some of the primitives, by id."""
    verdicts = {id: skills.feasibility(id) for id in ids}
    return {
        id: "; ".join(str(problem) for problem in verdict.problems)
        for id, verdict in verdicts.items()
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


class _FallError(Exception):
    """The robot fell; its message says in which primitive."""


class _Planned:
    """The robot does what is planned: plans begin between the feet, so each is moved there."""

    def __init__(self, robot: Robot) -> None:
        self.first = rest_reference(robot).q
        self._place = np.zeros(3)  # x, y, yaw of the present plan's origin in the world

    def postures(self, plan: Plan) -> FloatArray | None:
        """Return the postures at a plan's knots but the first, shape (K, 7 + n)."""
        x0, y0, yaw0 = self._place
        out = plan.q[1:].copy()
        x, y = turn_in_plane(out[:, 0], out[:, 1], yaw0)
        out[:, 0], out[:, 1] = x + x0, y + y0
        turn = vector_quaternion(0.0, 0.0, yaw0)
        out[:, 3:7] = np.stack(quaternion_product(turn, tuple(out[:, 3:7].T)), axis=1)
        middle, yaw = plan.ground[-1, :, :2].mean(axis=0), float(plan.ground[-1, :, 2].mean())
        x, y = turn_in_plane(middle[0], middle[1], yaw0)
        self._place = np.array([x0 + x, y0 + y, yaw0 + yaw])
        return out


class _Simulated:
    """The simulated robot is sent the plans."""

    def __init__(self, robot: Robot) -> None:
        self._simulation = Simulation(robot)
        self._simulation.reset()
        self.first = self._simulation.data.qpos.copy()

    def postures(self, plan: Plan) -> FloatArray | None:
        """Return the postures at a plan's knots but the first; None where the robot falls."""
        simulation, out = self._simulation, []
        n_steps = len(plan.commands) // (len(plan.q) - 1)
        report = simulation.perform(
            plan, lambda: out.append(simulation.data.qpos.copy()), frame_steps=n_steps
        )
        return None if report.fallen else np.array(out)


def _motion(
    skills: Skills, ids: Sequence[int], name: str, hold_s: float, stage: _Planned | _Simulated
) -> RobotMotion:
    """Return the postures of one plan after another.

    Raises:
        _FallError: The robot fell.
    """
    robot = skills.robot
    here = rest_reference(robot)
    parts: list[FloatArray] = [stage.first[None]]
    spans: list[Span] = []
    now = 0.0
    for id in [*ids, *([None] if hold_s > 0 else [])]:
        plan = skills.hold(here, hold_s) if id is None else skills.plan(here, id)
        label = _HOLD if id is None else skills.library[id].name
        postures = stage.postures(plan)
        if postures is None:
            raise _FallError(f"in simulation it falls in {label!r}")
        parts.append(postures)
        end = now + plan.duration_s
        spans.append(Span(-1 if id is None else id, label, now, end))
        here, now = plan.end, end
    whole = np.concatenate(parts)
    own = in_own_terms(robot, whole)
    return RobotMotion(
        name=name,
        joint_names=own.joint_names,
        rate_hz=1.0 / plan.knot_s,
        root_pos=own.root_pos,
        root_quat=own.root_quat,
        joint_pos=own.joint_pos,
        spans=tuple(spans),
    )
