"""Who performs one primitive after another, and what comes of it."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from mplearn.recording import FloatArray
from mplearn_envs.mechanics.reference import Reference, rest_reference
from mplearn_envs.planning.plan import Plan
from mplearn_envs.skills.repertoire import Repertoire

from .bodies import NOMINAL, Body
from .sensors import Measured
from .simulation import Simulation
from .tracking_report import TrackingReport


class Outcome(NamedTuple):
    """What came of an action.

    Attributes:
        report: What happened meanwhile.
        measured: How the robot stands now.
        figures: For ``info``: ``speed`` of performance, as a share of the human's;
            ``tracking_rmse_rad``; ``cog_deviation_m``, the largest; ``zmp_margin_m``, the least.
    """

    report: TrackingReport
    measured: Measured
    figures: dict[str, float]

    @classmethod
    def of(cls, report: TrackingReport, measured: Measured, speed: float) -> Outcome:
        """Return an outcome with its figures."""
        error = report.tracking_error_rad
        figures = {
            "speed": speed,
            "tracking_rmse_rad": float(np.sqrt(error @ error / len(error))),
            "cog_deviation_m": float(report.cog_deviation_m.max()),
            "zmp_margin_m": float(report.zmp_margin_m.min()),
        }
        return cls(report, measured, figures)


class PerformerState(NamedTuple):
    """Where a performer is.

    Attributes:
        reference: Where the reference robot is.
        simulated: State of the simulation; None where nothing is simulated.
        draw: Which body was drawn.
        n_performed: How many macro steps it has performed.
    """

    reference: Reference
    simulated: FloatArray | None
    draw: int = 0
    n_performed: int = 0


class Performer(ABC):
    """Performs one primitive after another.

    Args:
        repertoire: What can be performed.
        hold_s: Duration of holding [s].
        body: What the body may be like.

    Attributes:
        simulation: The robot; what is drawn.
        reference: Where the reference robot is, from which the next motion starts.
    """

    def __init__(self, repertoire: Repertoire, hold_s: float, body: Body = NOMINAL) -> None:
        self.repertoire = repertoire
        self.hold_s = hold_s
        self.simulation = Simulation(repertoire.robot, body=body)
        self.reference: Reference = rest_reference(self.simulation.robot)

    @abstractmethod
    def reset(self, draw: int = 0) -> Measured:
        """Stand upright at rest, arms hanging; return how the robot stands.

        Args:
            draw: Which body is drawn.
        """

    @abstractmethod
    def perform(
        self,
        id: int | None,
        on_frame: Callable[[], None] | None,
        frame_steps: int,
        speed: float = 1.0,
    ) -> Outcome:
        """Perform a primitive; None holds.

        Args:
            id: The primitive.
            on_frame: Called every ``frame_steps`` steps, to take pictures of ``simulation``.
            frame_steps: See there.
            speed: As a share of the usual speed.
        """

    @abstractmethod
    def state(self) -> PerformerState:
        """Return all that the future depends on."""

    @abstractmethod
    def load_state(self, state: PerformerState) -> Measured:
        """Go on from there, bit for bit; return how the robot stands.

        Raises:
            InvalidValueError: The state has no simulation's, and this performer needs it.
        """

    @abstractmethod
    def show(self) -> None:
        """Bring ``simulation`` up to date, to be drawn."""

    @property
    def leads_home(self) -> bool:
        """Whether the robot can go from where it is to where it stands at rest."""
        return self.repertoire.skills.leads_home(self.reference)

    def plan(self, id: int | None, speed: float = 1.0) -> Plan:
        """Return how a primitive is performed from where the reference robot is; None holds.

        Args:
            id: The primitive.
            speed: As a share of the usual speed.
        """
        if id is None:
            return self.repertoire.skills.hold(self.reference, self.hold_s)
        return self.repertoire.skills.plan(self.reference, id, speed)
