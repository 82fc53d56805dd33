"""Tables of random walks: each speed, each primitive, and what is performed at all."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

import numpy as np

from mplearn.evaluation.table import Table, percent
from mplearn.library import PrimitiveLibrary
from mplearn_envs.robot import Robot, humanoid
from mplearn_envs.skills.skills import Skills

from .walks import FASTEST, Walk

_COLUMNS = ("COG off [cm]", "ZMP margin [cm]", "RMSE [deg]", "drift [mm]", "turn [deg]")
_NOTE = (
    "COG off: largest distance of the centre of gravity from its plan over the standing feet. ZMP "
    "margin: least distance of the zero-moment point from the edge of the soles that should stand. "
    "RMSE: of all joints. Drift, turn: of the standing foot against the plan, mean of a primitive."
)


def walk_table(walks: Iterable[Walk], robot: str = "robot") -> Table:
    """Return one row for each speed and choice of primitives; ``robot`` names who walks.

    Example:
        >>> from mplearn_envs.experiments import Walk
        >>> steps = [("bow down", 0.01, 0.03, 0.001, 0.0, 0.0, 0.5)]
        >>> table = walk_table([Walk(speed=0.5, lifting=False, duration_s=2.0, steps=steps)])
        >>> dict(zip(table.columns, table.rows[0], strict=True))["COG off [cm]"]
        '1.00'
    """
    rows = []
    for speed, lifting, group in _grouped(walks):
        steps = [step for walk in group for step in walk.steps]
        fell = [walk.fell for walk in group if walk.fell]
        kinds = len({step[0] for step in steps})
        rows.append(
            (
                _speed_name(speed),
                "lifted too" if lifting else "both down",
                f"{len(group)} x {max(len(walk.steps) for walk in group)}",
                str(kinds),
                f"{len(fell)}" + (f" ({', '.join(sorted(set(fell)))})" if fell else ""),
                *_columns(steps),
                f"{sum(walk.duration_s for walk in group) / 60:.0f}",
            )
        )
    return Table(
        f"Random walks of {robot!r} in simulation, masses, gains and friction wrong by up to 10 %",
        ("speed", "feet", "walks x primitives", "kinds", "falls", *_COLUMNS, "minutes"),
        tuple(rows),
        _NOTE,
    )


def primitive_table(walks: Iterable[Walk]) -> Table:
    """Return one row for each primitive and speed, from walks that lift feet too.

    Example:
        >>> from mplearn_envs.experiments import Walk
        >>> steps = [("step left", 0.01, 0.03, 0.001, 0.0, 0.0, 0.5)]
        >>> table = primitive_table([Walk(speed=0.5, lifting=True, duration_s=2.0, steps=steps)])
        >>> [row[0] for row in table.rows]
        ['step left']
    """
    rows = []
    for speed, lifting, group in _grouped(walks):
        if not lifting:
            continue
        steps = [step for walk in group for step in walk.steps]
        for name in sorted({step[0] for step in steps}):
            of_it = [step for step in steps if step[0] == name]
            pace = float(np.median([step[6] for step in of_it]))
            rows.append(
                (name, _speed_name(speed), f"{pace:.2f}", str(len(of_it)), *_columns(of_it))
            )
    return Table(
        "Each primitive in these walks",
        ("primitive", "speed", "pace", "times", *_COLUMNS),
        tuple(rows),
        _NOTE + " Pace: the human's duration over the robot's, time to shift the weight and to "
        "come from where the robot was included; median.",
    )


def speed_table(
    library: PrimitiveLibrary, robot: Robot | None = None, speeds: Sequence[float] = (0.5, 1.0)
) -> Table:
    """Return which share of the primitives the robot performs at a speed, and why not the rest.

    Example:
        >>> from mplearn_envs.data.library_source import LibrarySource
        >>> table = speed_table(LibrarySource(None).now(), speeds=[0.5])
        >>> len(table.rows), table.columns
        (1, ('speed', 'performed', 'performed slower', 'refused', 'pace', 'why'))
    """
    robot = robot or humanoid()
    rows = []
    for speed in speeds:
        skills = Skills(library, robot, speed)
        named = {library[id].name: skills.feasibility(id) for id in library.ids}
        verdicts = list(named.values())
        full = [v for v in verdicts if v.feasible and v.speed >= 0.999 * speed]
        slowed = [v for v in verdicts if v.feasible and v.speed < 0.999 * speed]
        refused = {name: v for name, v in named.items() if not v.feasible}
        rows.append(
            (
                _speed_name(speed),
                percent(len(full) / len(verdicts)),
                percent(len(slowed) / len(verdicts)),
                percent(len(refused) / len(verdicts)),
                f"{np.median([v.tempo for v in full + slowed]) / speed:.2f}" if full else "-",
                "; ".join(f"{name}: {v.problems[0]}" for name, v in refused.items()) or "-",
            )
        )
    return Table(
        f"What robot {robot.name!r} performs of {len(library)} learned primitives",
        ("speed", "performed", "performed slower", "refused", "pace", "why"),
        tuple(rows),
        "Pace: duration wanted over duration, time to shift the weight included; median.",
    )


def _columns(steps: list[tuple[str, float, float, float, float, float, float]]) -> tuple[str, ...]:
    values = np.array([step[1:6] for step in steps])
    drift = values[np.isfinite(values[:, 3])]
    return (
        f"{100 * values[:, 0].max():.2f}",
        f"{100 * values[:, 1].min():.1f}",
        f"{np.rad2deg(np.sqrt(values[:, 2].mean())):.3f}",
        f"{1000 * drift[:, 3].mean():.1f}" if len(drift) else "-",
        f"{np.rad2deg(drift[:, 4].mean()):.2f}" if len(drift) else "-",
    )


def _grouped(walks: Iterable[Walk]) -> list[tuple[float, bool, list[Walk]]]:
    groups: dict[tuple[float, bool], list[Walk]] = {}
    for walk in walks:
        groups.setdefault((walk.speed, walk.lifting), []).append(walk)
    return [(speed, lifting, group) for (speed, lifting), group in groups.items()]


def _speed_name(speed: float) -> str:
    known = {0.5: "half", 1.0: "human", FASTEST: "fastest"}
    return known.get(speed, f"{speed:g}")
