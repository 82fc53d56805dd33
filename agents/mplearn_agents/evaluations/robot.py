"""Experiments with the robot, on the built-in library."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING

from .setting import Setting

if TYPE_CHECKING:
    from mplearn.evaluation import Table


def walks(setting: Setting) -> Iterator[Table]:
    """200 primitives in a row, with a wrong model; then each primitive, and each speed."""
    from mplearn_envs.experiments import primitive_table, random_walks, speed_table, walk_table
    from mplearn_envs.library_source import LibrarySource

    library = LibrarySource(None).now()
    found = random_walks(library, setting.seeds)
    yield walk_table(found)
    yield primitive_table(found)
    yield speed_table(library)


def pushes(_: Setting) -> Iterator[Table]:
    """The largest impulse at the chest that the robot survives."""
    from mplearn_envs.experiments import push_table

    yield push_table()


EVALUATIONS = {"walks": walks, "pushes": pushes}
