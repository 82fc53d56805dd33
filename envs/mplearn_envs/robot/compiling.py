"""Simulation models as text, and compiled once."""

from __future__ import annotations

from functools import cache
from importlib.resources import files
from typing import TYPE_CHECKING

from mplearn.errors import RobotError

if TYPE_CHECKING:
    import mujoco


@cache
def compile_once(xml: str) -> mujoco.MjModel:
    """Compile a model once; nobody changes a robot's model (an environment copies it)."""
    import mujoco

    try:
        return mujoco.MjModel.from_xml_string(xml)
    except ValueError as error:
        raise RobotError(f"the robot's MJCF does not compile: {error}") from error


def read_model(name: str) -> str:
    """Return the text of one of the package's models."""
    return (files(__package__) / "models" / f"{name}.xml").read_text(encoding="utf-8")
