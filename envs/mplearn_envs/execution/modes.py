"""The modes: which performer there is for which."""

from __future__ import annotations

from typing import Literal, TypeAlias, get_args

from mplearn.errors import InvalidValueError
from mplearn_envs.skills.repertoire import Repertoire

from .bodies import NOMINAL, Body
from .kinematic import KinematicPerformer
from .performer import Performer
from .simulated import SimulatedPerformer

Dynamics: TypeAlias = Literal["simulated", "kinematic"]


def make_performer(
    dynamics: Dynamics, repertoire: Repertoire, hold_s: float, body: Body = NOMINAL
) -> Performer:
    """Return the performer of a mode.

    Raises:
        InvalidValueError: There is no such mode.
    """
    if dynamics == "simulated":
        return SimulatedPerformer(repertoire, hold_s, body)
    if dynamics == "kinematic":
        return KinematicPerformer(repertoire, hold_s)
    raise InvalidValueError(f"dynamics must be one of {get_args(Dynamics)}, not {dynamics!r}")


def require_simulated(dynamics: Dynamics, body: Body) -> None:
    """Check that a mode knows bodies of a kind.

    Raises:
        InvalidValueError: It takes plans at their word, and the body is not as planned for.
    """
    if dynamics == "kinematic" and body != NOMINAL:
        raise InvalidValueError(
            "dynamics='kinematic' takes plans at their word, and no body but 'nominal': "
            "use dynamics='simulated'"
        )
