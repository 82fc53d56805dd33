"""Who performs: the simulated robot, or its plans taken at their word."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Hashable
from typing import Any, Literal, NamedTuple, TypeAlias, get_args

import numpy as np

from mplearn.errors import InvalidValueError
from mplearn.recording import FloatArray

from .control.momentum import velocities
from .control.planner import Plan
from .control.reference import Reference, rest_reference
from .measurement import Measured, Sensors
from .performance import Performance
from .repertoire import Repertoire
from .simulation import Simulation

Dynamics: TypeAlias = Literal["simulated", "kinematic"]


class Outcome(NamedTuple):
    """What came of an action.

    Attributes:
        performance: What happened meanwhile.
        measured: How the robot stands now.
        figures: For ``info``: ``speed`` of performance, as a share of the human's;
            ``tracking_rmse_rad``; ``cog_deviation_m``, the largest; ``zmp_margin_m``, the least.
    """

    performance: Performance
    measured: Measured
    figures: dict[str, float]

    @classmethod
    def of(cls, performance: Performance, measured: Measured, speed: float) -> Outcome:
        """Return an outcome with its figures."""
        error = performance.tracking_error_rad
        figures = {
            "speed": speed,
            "tracking_rmse_rad": float(np.sqrt(error @ error / len(error))),
            "cog_deviation_m": float(performance.cog_deviation_m.max()),
            "zmp_margin_m": float(performance.zmp_margin_m.min()),
        }
        return cls(performance, measured, figures)


class PerformerState(NamedTuple):
    """Where a performer is.

    Attributes:
        reference: Where the reference robot is.
        simulated: State of the simulation; None where nothing is simulated.
    """

    reference: Reference
    simulated: FloatArray | None


class Performer(ABC):
    """Performs one primitive after another.

    Args:
        repertoire: What can be performed.
        hold_s: Duration of holding [s].

    Attributes:
        simulation: The robot; what is drawn.
        reference: Where the reference robot is, from which the next motion starts.
    """

    def __init__(self, repertoire: Repertoire, hold_s: float) -> None:
        self.repertoire = repertoire
        self.hold_s = hold_s
        self.simulation = Simulation(repertoire.robot)
        self.reference: Reference = rest_reference(self.simulation.robot)

    @abstractmethod
    def reset(self) -> Measured:
        """Stand upright at rest, arms hanging; return how the robot stands."""

    @abstractmethod
    def perform(
        self, id: int | None, on_frame: Callable[[], None] | None, frame_steps: int
    ) -> Outcome:
        """Perform a primitive; None holds.

        Args:
            id: The primitive.
            on_frame: Called every ``frame_steps`` steps, to take pictures of ``simulation``.
            frame_steps: See there.
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

    def _plan(self, id: int | None) -> Plan:
        if id is None:
            return self.repertoire.hold(self.reference, self.hold_s)
        return self.repertoire.plan(self.reference, id)


class SimulatedPerformer(Performer):
    """Sends plans to the servos of the simulated robot; see `Performer`."""

    def __init__(self, repertoire: Repertoire, hold_s: float) -> None:
        super().__init__(repertoire, hold_s)
        self._sensors = Sensors(self.simulation)

    def reset(self) -> Measured:
        """Stand upright at rest, arms hanging; return how the robot stands."""
        self.simulation.reset()
        self.reference = rest_reference(self.simulation.robot)
        return self._sensors.read()

    def perform(
        self, id: int | None, on_frame: Callable[[], None] | None, frame_steps: int
    ) -> Outcome:
        """Perform a primitive; None holds. See `Performer.perform`."""
        plan = self._plan(id)
        performance = self.simulation.perform(plan, on_frame, frame_steps)
        self.reference = plan.end
        return Outcome.of(performance, self._sensors.read(), plan.speed)

    def state(self) -> PerformerState:
        """Return all that the future depends on."""
        return PerformerState(self.reference, self.simulation.state())

    def load_state(self, state: PerformerState) -> Measured:
        """Go on from there; see `Performer.load_state`."""
        if state.simulated is None:
            raise InvalidValueError("a kinematic state cannot be loaded into a simulation")
        self.simulation.load_state(state.simulated)
        self.reference = state.reference
        return self._sensors.read()

    def show(self) -> None:
        """Nothing to do: the simulation is what there is."""

    def __getstate__(self) -> dict[str, Any]:
        return {name: value for name, value in self.__dict__.items() if name != "_sensors"}

    def __setstate__(self, state: dict[str, Any]) -> None:
        self.__dict__.update(state)
        self._sensors = Sensors(self.simulation)


class KinematicPerformer(Performer):
    """Takes plans at their word: the robot is where its reference is, without contact or delay.

    COG and zero-moment point come from the plan; nothing ever falls. What comes of an action
    depends on the reference posture at its start and the motion alone, so it is remembered,
    exactly, in the repertoire's memory.
    """

    def __init__(self, repertoire: Repertoire, hold_s: float) -> None:
        super().__init__(repertoire, hold_s)
        self._sensors = Sensors(self.simulation)
        self._rest = self._arrive(rest_reference(self.simulation.robot))
        self._here = self._rest

    def reset(self) -> Measured:
        """Stand upright at rest, arms hanging; return how the robot stands."""
        self._here = self._rest
        self.reference = self._rest.reference
        return self._rest.measured

    def perform(
        self, id: int | None, on_frame: Callable[[], None] | None, frame_steps: int
    ) -> Outcome:
        """Perform a primitive; None holds. See `Performer.perform`."""
        motion = ("hold", self.hold_s) if id is None else self.repertoire.key(id)
        key = (self._here.key, motion)
        known: _Known | None = self.repertoire.memory.recall(key)
        if known is None or on_frame is not None:
            plan = self._plan(id)
            known = self._performed(plan)
            self.repertoire.memory.remember(key, known)
            if on_frame is not None:
                self._play(plan, on_frame, frame_steps)
        self._here = known.place
        self.reference = known.place.reference
        return known.outcome

    def state(self) -> PerformerState:
        """Return all that the future depends on."""
        return PerformerState(self.reference, None)

    def load_state(self, state: PerformerState) -> Measured:
        """Go on from there, from the reference where the state is a simulation's."""
        self._here = self._arrive(state.reference)
        self.reference = state.reference
        return self._here.measured

    def show(self) -> None:
        """Put the simulated robot where the reference is."""
        self._sensors.at(self.reference.q)

    def _performed(self, plan: Plan) -> _Known:
        n_knots = len(plan.q) - 1
        performance = Performance(
            np.arange(1.0, n_knots + 1.0) * plan.knot_s,
            np.zeros(n_knots),
            np.zeros(n_knots),
            plan.zmp_margin_m[1:],
            False,
            plan.duration_s,
        )
        place = self._arrive(plan.end, velocities(plan.q[-2:], plan.knot_s)[-1])
        return _Known(Outcome.of(performance, place.measured, plan.speed), place)

    def _arrive(self, reference: Reference, velocity: FloatArray | None = None) -> _Place:
        key = tuple(np.asarray(part).tobytes() for part in reference)
        return _Place(key, reference, self._sensors.at(reference.q, velocity))

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


class _Place(NamedTuple):
    """Where a kinematic robot is: its reference, the key of that, and what is measured there."""

    key: Hashable
    reference: Reference
    measured: Measured


class _Known(NamedTuple):
    """An outcome, and where it led."""

    outcome: Outcome
    place: _Place


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
