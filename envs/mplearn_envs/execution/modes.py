"""The modes: which performer there is for which."""

from __future__ import annotations

from typing import Literal, TypeAlias, get_args

from mplearn.errors import InvalidValueError
from mplearn_envs.skills.repertoire import Repertoire

from .kinematic import KinematicPerformer
from .performer import Performer
from .simulated import SimulatedPerformer

Dynamics: TypeAlias = Literal["simulated", "kinematic"]


def make_performer(dynamics: Dynamics, repertoire: Repertoire, hold_s: float) -> Performer:
    """Return the performer of a mode.

    Raises:
        InvalidValueError: There is no such mode.
    """
    if dynamics == "simulated":
        return SimulatedPerformer(repertoire, hold_s)
    if dynamics == "kinematic":
        return KinematicPerformer(repertoire, hold_s)
    raise InvalidValueError(f"dynamics must be one of {get_args(Dynamics)}, not {dynamics!r}")
