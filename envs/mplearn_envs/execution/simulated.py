"""The simulated robot performs: plans are sent to its servos."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from mplearn.errors import InvalidValueError
from mplearn_envs.mechanics.reference import rest_reference
from mplearn_envs.skills.repertoire import Repertoire

from .bodies import NOMINAL, Body
from .performer import Outcome, Performer, PerformerState
from .sensors import Measured, Sensors


class SimulatedPerformer(Performer):
    """Sends plans to the servos of the simulated robot; see `Performer`."""

    def __init__(self, repertoire: Repertoire, hold_s: float, body: Body = NOMINAL) -> None:
        super().__init__(repertoire, hold_s, body)
        self._sensors = Sensors(self.simulation)
        self._count = 0

    def reset(self, draw: int = 0) -> Measured:
        """Stand upright at rest, arms hanging; return how the robot stands."""
        self._count = 0
        self.simulation.embody(draw)
        self.simulation.reset()
        self.reference = rest_reference(self.simulation.robot)
        return self._sensors.read()

    def perform(
        self,
        id: int | None,
        on_frame: Callable[[], None] | None,
        frame_steps: int,
        speed: float = 1.0,
    ) -> Outcome:
        """Perform a primitive; None holds. See `Performer.perform`."""
        plan = self.plan(id, speed)
        simulation = self.simulation
        pushes = simulation.draw_pushes(self._count, plan.duration_s)
        self._count += 1
        report = simulation.perform(plan, on_frame, frame_steps, pushes)
        self.reference = report.end or plan.end
        return Outcome.of(report, self._sensors.read(), plan.speed)

    def state(self) -> PerformerState:
        """Return all that the future depends on."""
        return PerformerState(
            self.reference, self.simulation.state(), self.simulation.draw, self._count
        )

    def load_state(self, state: PerformerState) -> Measured:
        """Go on from there; see `Performer.load_state`."""
        if state.simulated is None:
            raise InvalidValueError("a kinematic state cannot be loaded into a simulation")
        if state.draw != self.simulation.draw:
            self.simulation.embody(state.draw)
        self._count = state.n_performed
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
