"""Random walks on the learned graph, performed in simulation with a wrong model."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from mplearn.library import PrimitiveLibrary
from mplearn.maths.plane import turn_in_plane, wrap_angle
from mplearn.recording import FloatArray
from mplearn_envs.execution.simulation import Simulation
from mplearn_envs.execution.tracking_report import TrackingReport
from mplearn_envs.mechanics import reference_robot, rest_reference
from mplearn_envs.mechanics.kinematics import places
from mplearn_envs.planning import Plan
from mplearn_envs.robot import Robot, humanoid
from mplearn_envs.skills.skills import Skills

from .model_error import disturb

FASTEST = 2.0  # as a share of the human's speed; limits slow down most motions


@dataclass
class Walk:
    """What came of one random walk.

    Attributes:
        speed: Speed that was asked for, as a share of the human's.
        lifting: Whether primitives that lift a foot were among them.
        fell: Name of the primitive in which the robot fell; empty if it never did.
        duration_s: Simulated time [s].
        steps: Of each primitive performed: name, largest COG deviation [m], smallest margin of the
            zero-moment point [m], mean square of the tracking error [rad^2], drift [m] and turn
            [rad] of the standing foot against the plan, share of the human's speed.
        detours: How many of them could not begin at once: the robot stood upright first.

    Example:
        >>> walk = Walk(speed=0.5, lifting=False, duration_s=12.0)
        >>> walk.steps.append(("bow down", 0.01, 0.03, 0.001, 0.0, 0.0, 0.5))
        >>> "fell" if walk.fell else f"stood for {walk.duration_s:g} s"
        'stood for 12 s'
    """

    speed: float
    lifting: bool
    fell: str = ""
    duration_s: float = 0.0
    steps: list[tuple[str, float, float, float, float, float, float]] = field(default_factory=list)
    detours: int = 0


def random_walks(
    library: PrimitiveLibrary,
    seeds: Sequence[int],
    n_primitives: int = 200,
    speeds: Sequence[float] = (0.5, 1.0, FASTEST),
    error: float = 0.1,
    robot: Robot | None = None,
) -> list[Walk]:
    """Walk at random on the graph, with and without primitives that lift a foot.

    The next primitive is drawn by how often the demonstrator chose it; where he chose none that the
    robot can perform, any. The robot is never reset.

    Args:
        library: The primitives.
        seeds: One walk each; masses, gains and friction are drawn anew for each.
        n_primitives: Primitives in a row.
        speeds: Speeds, as shares of the human's.
        error: Largest model error, as a share.
        robot: Who walks; None is the humanoid.

    Example:
        >>> from mplearn_envs.data.library_source import LibrarySource
        >>> library = LibrarySource(None).now()  # the built-in one
        >>> walks = random_walks(library, seeds=[1], n_primitives=1, speeds=[0.5])
        >>> {walk.lifting for walk in walks}, {walk.fell for walk in walks}
        ({False, True}, {''})
    """
    out = []
    for speed in speeds:
        skills = Skills(library, robot or humanoid(), speed)
        feasible = [id for id in library.ids if skills.feasibility(id).feasible]
        for lifting in (False, True):
            allowed = [id for id in feasible if lifting or not skills[id].lifts]
            for seed in seeds:
                rng = np.random.default_rng(seed)
                walk = Walk(speed, lifting)
                go(walk, skills, allowed, n_primitives, error, rng)
                out.append(walk)
    return out


def go(
    walk: Walk,
    skills: Skills,
    allowed: list[int],
    n_primitives: int,
    error: float,
    rng: np.random.Generator,
    *,
    any_order: bool = False,
) -> None:
    """Walk, until the end or a fall.

    Args:
        walk: What came of it is written here.
        skills: The primitives, as the robot performs them.
        allowed: Ids of those that may be performed.
        n_primitives: Primitives in a row.
        error: Largest model error, as a share.
        rng: Source of randomness.
        any_order: Whether any primitive follows any other, and not as the demonstrator chose.
    """
    library = skills.library
    simulation = Simulation(skills.robot)
    disturb(simulation.model, error, rng)
    simulation.reset()
    here = rest_reference(skills.robot)
    last: int | None = None
    for _ in range(n_primitives):
        last = _next(None if any_order else library, last, allowed, rng)
        plan = skills.plan(here, last)
        walk.detours += bool(skills.judge_plan(skills.at_once(here, last)))
        before = simulation.data.qpos.copy()
        report = simulation.perform(plan)
        walk.duration_s += report.duration_s
        after = simulation.data.qpos.copy()
        pace = skills[last].motion.duration_s / plan.duration_s
        name = library[last].name
        figures = _figures(plan, report, before, after, skills.robot)
        walk.steps.append((name, *figures, pace))
        here = plan.end
        if report.fallen:
            walk.fell = name
            return


def _next(
    library: PrimitiveLibrary | None, last: int | None, allowed: list[int], rng: np.random.Generator
) -> int:
    weight = np.ones(len(allowed))
    if last is not None and library is not None:
        prior = dict(zip(library.graph.ids, library.graph.prior(last), strict=True))
        chosen = np.array([prior.get(id, 0.0) for id in allowed])
        weight = chosen if chosen.sum() > 0 else weight
    return int(rng.choice(allowed, p=weight / weight.sum()))


def _figures(
    plan: Plan,
    report: TrackingReport,
    before: FloatArray,
    after: FloatArray,
    robot: Robot,
) -> tuple[float, float, float, float, float]:
    ref = reference_robot(robot)
    drift, turn = np.nan, np.nan
    stood = [side for side in range(2) if side not in (plan.up[0], plan.up[-1])]
    if stood and not report.fallen:
        feet = places(ref.tree, ref.stance.feet, np.stack((before, after)))[:, stood[0]]
        wanted = places(ref.tree, ref.stance.feet, plan.q[[0, -1]])[:, stood[0]]
        moved = _moved(feet) - _moved(wanted)
        drift, turn = float(np.hypot(moved[0], moved[1])), float(abs(moved[2]))
    return (
        float(report.cog_deviation_m.max()),
        float(report.zmp_margin_m.min()),
        float(np.mean(report.tracking_error_rad**2)),
        drift,
        turn,
    )


def _moved(place: FloatArray) -> FloatArray:
    """Return how a foot moved, (2, 3) to (3,): x, y [m] as it stood first, yaw [rad]."""
    x, y, turn = place[1] - place[0]
    return np.array([*turn_in_plane(x, y, -place[0, 2]), wrap_angle(turn)])
