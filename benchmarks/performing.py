"""Planning and performing primitives, steps included, against the raw simulation."""

import time
from pathlib import Path

import mujoco
import numpy as np

import mplearn_envs
from mplearn import PrimitiveLibrary
from mplearn_envs.execution.simulation import Simulation
from mplearn_envs.mechanics import rest_reference
from mplearn_envs.planning import Motion, Plan, Planner
from mplearn_envs.robot import humanoid

STANDING = ("both arms raise", "both arms lower", "bow down", "bow up", "squat down", "squat raise")
STEPPING = (
    "right kick raise",
    "right kick retract",
    "march, right leg raise",
    "march, left leg raise",
    "march, mid step",
)
SPEED = 0.5


def rows() -> list[tuple[str, str, str, str]]:
    path = Path(mplearn_envs.__file__).parent / "data" / "default.mplearn"
    library, planner = PrimitiveLibrary.load(path), Planner(humanoid())
    columns = [library.channels.index(name) for name in planner.robot.channels]
    out = []
    for what, names in (("both feet down", STANDING), ("stepping", STEPPING)):
        motions = {}
        for name in names:
            made = library.generate([name])
            frames = np.ascontiguousarray(made.frames[:, columns])
            motions[name] = planner.motion(frames, made.rate_hz)
        plans = chained(planner, motions)
        first, again = [], []
        human_s = sum(motion.duration_s for motion in motions.values())
        chained(planner, motions, cached=True)
        for _ in range(5):
            begin = time.process_time()
            chained(planner, motions)
            middle = time.process_time()
            chained(planner, motions, cached=True)
            first.append(middle - begin)
            again.append(time.process_time() - middle)
        ours, raw = perform(planner, motions, plans)
        out += [
            (
                f"planning, {what}",
                f"{1e3 * np.median(first) / human_s:.1f} ms",
                "a second of motion, at half speed",
                "-",
            ),
            (
                f"the same from the cache, {what}",
                f"{1e3 * np.median(again) / human_s:.3f} ms",
                f"{1e3 * np.median(first) / human_s:.1f} ms, planned",
                f"{np.median(again) / np.median(first):.3f} x",
            ),
            (
                f"performing, {what}",
                f"{1e3 * ours / len(plans):.1f} ms",
                f"{1e3 * raw / len(plans):.1f} ms, mj_step of the same commands",
                f"{ours / raw:.2f} x",
            ),
        ]
    return out


def chained(planner: Planner, motions: dict[str, Motion], cached: bool = False) -> list[Plan]:
    """Plan one motion after the other."""
    here, plans = rest_reference(planner.robot), []
    for name, motion in motions.items():
        plans.append(planner.plan(here, motion, SPEED, name if cached else None))
        here = plans[-1].end
    return plans


def perform(
    planner: Planner, motions: dict[str, Motion], plans: list[Plan], rounds: int = 7
) -> tuple[float, float]:
    """Return medians of performing all, cached plans looked up, and of MuJoCo's steps alone [s]."""
    simulation, other = Simulation(planner.robot), Simulation(planner.robot)
    model, data = other.model, other.data
    ours, raw = [], []
    for _ in range(rounds + 1):
        simulation.reset()
        other.reset()
        begin = time.process_time()
        for plan in chained(planner, motions, cached=True):
            simulation.perform(plan)
        middle = time.process_time()
        for plan in plans:
            for command in plan.commands:
                data.ctrl[:] = command
                mujoco.mj_step(model, data)
        ours.append(middle - begin)
        raw.append(time.process_time() - middle)
    return float(np.median(ours[1:])), float(np.median(raw[1:]))
