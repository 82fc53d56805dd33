"""Plans are taken at their word: nothing is simulated."""

from __future__ import annotations

from collections.abc import Callable, Hashable
from typing import Any, NamedTuple

import numpy as np

from mplearn.recording import FloatArray
from mplearn_envs.mechanics.momentum import velocities
from mplearn_envs.mechanics.reference import Reference, rest_reference
from mplearn_envs.planning.plan import Plan
from mplearn_envs.skills.repertoire import Repertoire

from .bodies import NOMINAL, Body
from .performer import Outcome, Performer, PerformerState
from .risk import FallRisk, risk_of, strain_of
from .sensors import Measured, Sensors
from .tracking_report import TrackingReport


class _Place(NamedTuple):
    """Where a kinematic robot is.

    Attributes:
        key: Of its reference.
        reference: See there.
        measured: What is measured there.
        leads_home: Whether it can come to rest from there.
    """

    key: Hashable
    reference: Reference
    measured: Measured
    leads_home: bool


class _Known(NamedTuple):
    """An outcome, where it led, and what of it bears on the risk of falling."""

    outcome: Outcome
    place: _Place
    strain: FloatArray


class KinematicPerformer(Performer):
    """Takes plans at their word: the robot is where its reference is, without contact or delay.

    COG and zero-moment point come from the plan. What comes of an action depends on the reference
    posture at its start and the motion alone, so it is remembered, exactly, in the repertoire's
    memory. A body that is as the robot believes never falls; one of another level falls as often as
    it was seen to in simulation, see `FallRisk`.

    Args:
        repertoire: What can be performed.
        hold_s: Duration of holding [s].
        body: What the body may be like: one of the levels.
    """

    def __init__(self, repertoire: Repertoire, hold_s: float, body: Body = NOMINAL) -> None:
        super().__init__(repertoire, hold_s)
        self._level_risk = risk_of(body)
        self._embody(0)
        self._count = 0
        self._sensors = Sensors(self.simulation)
        self._rest = self._arrive(rest_reference(self.simulation.robot), True)
        self._here = self._rest

    def reset(self, draw: int = 0) -> Measured:
        """Stand upright at rest, arms hanging; return how the robot stands."""
        self._embody(draw)
        self._count = 0
        self._here = self._rest
        self.reference = self._rest.reference
        return self._rest.measured

    def perform(
        self,
        id: int | None,
        on_frame: Callable[[], None] | None,
        frame_steps: int,
        speed: float = 1.0,
    ) -> Outcome:
        """Perform a primitive; None holds. See `Performer.perform`."""
        motion = ("hold", self.hold_s) if id is None else (*self.repertoire.skills.key(id), speed)
        key = (self._here.key, motion)
        known: _Known | None = self.repertoire.memory.get(key)
        if known is None or on_frame is not None:
            plan = self.plan(id, speed)
            known = self._performed(plan)
            self.repertoire.memory.put(key, known)
            if on_frame is not None:
                self._play(plan, on_frame, frame_steps)
        self._here = known.place
        self.reference = known.place.reference
        self._count += 1
        return known.outcome if self._risk is None else self._chanced(known, self._risk)

    @property
    def leads_home(self) -> bool:
        """Whether the robot can go from where it is to where it stands at rest."""
        return self._here.leads_home

    def state(self) -> PerformerState:
        """Return all that the future depends on."""
        return PerformerState(self.reference, None, self._draw, self._count)

    def load_state(self, state: PerformerState) -> Measured:
        """Go on from there, from the reference where the state is a simulation's."""
        if state.draw != self._draw:
            self._embody(state.draw)
        self._count = state.n_performed
        self._here = self._arrive(state.reference)
        self.reference = state.reference
        return self._here.measured

    def _embody(self, draw: int) -> None:
        """Draw a body; the same number gives the same one."""
        self._draw = draw
        self._risk = None if self._level_risk is None else self._level_risk.of_body(draw)

    def _chanced(self, known: _Known, risk: FallRisk) -> Outcome:
        """Return the outcome, or a fall on the way, as luck will have it."""
        rng = np.random.default_rng([self._draw, 2, self._count])
        outcome = known.outcome
        if rng.random() >= risk.probability(known.strain, outcome.report.duration_s):
            return outcome
        return outcome._replace(report=outcome.report.fallen_at(float(rng.random())))

    def show(self) -> None:
        """Put the simulated robot where the reference is."""
        self._sensors.at(self.reference.q)

    def _performed(self, plan: Plan) -> _Known:
        report = TrackingReport.as_planned(plan)
        place = self._arrive(plan.end, None, velocities(plan.q[-2:], plan.knot_s)[-1])
        return _Known(Outcome.of(report, place.measured, plan.speed), place, strain_of(plan))

    def _arrive(
        self,
        reference: Reference,
        leads_home: bool | None = None,
        velocity: FloatArray | None = None,
    ) -> _Place:
        key = tuple(np.asarray(part).tobytes() for part in reference)
        if leads_home is None:
            leads_home = self.repertoire.skills.leads_home(reference)
        return _Place(key, reference, self._sensors.at(reference.q, velocity), leads_home)

    def _play(self, plan: Plan, on_frame: Callable[[], None], frame_steps: int) -> None:
        """Show a plan's reference postures."""
        n_steps = len(plan.commands) // (len(plan.q) - 1)
        next_frame = frame_steps
        for knot in range(1, len(plan.q)):
            if knot * n_steps >= next_frame:
                next_frame += frame_steps
                self._sensors.at(plan.q[knot])
                on_frame()

    def __getstate__(self) -> dict[str, Any]:
        return {name: value for name, value in self.__dict__.items() if name != "_sensors"}

    def __setstate__(self, state: dict[str, Any]) -> None:
        self.__dict__.update(state)
        self._sensors = Sensors(self.simulation)
