"""Experiments with the robot, on the built-in library."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING

from .setting import Setting

if TYPE_CHECKING:
    from mplearn.evaluation import Table


def walks(setting: Setting) -> Iterator[Table]:
    """200 primitives in a row, with a wrong model; then each primitive, and each speed."""
    from mplearn_envs.data.library_source import LibrarySource
    from mplearn_envs.experiments import primitive_table, random_walks, speed_table, walk_table

    library = LibrarySource(None).now()
    found = random_walks(library, setting.seeds)
    yield walk_table(found)
    yield primitive_table(found)
    yield speed_table(library)


def other_robots(setting: Setting) -> Iterator[Table]:
    """The same walks of the Unitree G1 at half speed, where its model is installed."""
    from mplearn.errors import MissingDependencyError
    from mplearn_envs.data.library_source import LibrarySource
    from mplearn_envs.experiments import random_walks, speed_table, walk_table
    from mplearn_envs.robot import unitree_g1

    try:
        robot = unitree_g1()
    except MissingDependencyError:
        return
    library = LibrarySource(None).now()
    yield walk_table(random_walks(library, setting.seeds, speeds=(0.5,), robot=robot), robot.name)
    yield speed_table(library, robot)


def pushes(_: Setting) -> Iterator[Table]:
    """The largest impulse at the chest without a step, and what is survived by steps."""
    from mplearn_envs.data.library_source import LibrarySource
    from mplearn_envs.experiments import push_table, survival_table

    yield push_table()
    library = LibrarySource(None).now()
    for error in (0.0, 0.1):
        yield survival_table(library, error=error)


def bodies(_: Setting) -> Iterator[Table]:
    """Random walks in bodies that are not as the robot believes, and pushed."""
    from mplearn_envs.experiments import soak_table

    yield soak_table()


EVALUATIONS = {"walks": walks, "other-robots": other_robots, "pushes": pushes, "bodies": bodies}
