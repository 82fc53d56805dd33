"""The modes: which performer there is for which."""

from __future__ import annotations

from typing import Literal, TypeAlias, get_args

from mplearn.errors import InvalidValueError
from mplearn_envs.skills.repertoire import Repertoire

from .bodies import BODIES, NOMINAL, Body
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
        return KinematicPerformer(repertoire, hold_s, body)
    raise InvalidValueError(f"dynamics must be one of {get_args(Dynamics)}, not {dynamics!r}")


def require_fit(dynamics: Dynamics, body: Body) -> None:
    """Check that a mode knows bodies of a kind.

    Raises:
        InvalidValueError: Nothing is simulated, and how often such a body falls was never seen.
    """
    if dynamics == "kinematic" and body not in BODIES.values():
        raise InvalidValueError(
            f"dynamics='kinematic' knows how often bodies of the levels {tuple(BODIES)} fall, and "
            "of no others: use dynamics='simulated'"
        )
