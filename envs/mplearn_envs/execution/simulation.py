"""The robot in MuJoCo: it performs plans, and tells how it stands."""

from __future__ import annotations

from collections.abc import Callable
from functools import cached_property
from typing import Any, Literal, TypeAlias, get_args

import mujoco
import numpy as np

from mplearn.errors import InvalidValueError
from mplearn.recording import FloatArray
from mplearn_envs.control.ankle_feedback import make_ankle_feedback
from mplearn_envs.mechanics.gravity import standing_commands
from mplearn_envs.mechanics.reference import rest_reference
from mplearn_envs.planning.plan import Plan
from mplearn_envs.robot import Robot
from mplearn_envs.robot.feet import sole_corners

from .mujoco_loop import Views, send
from .tracking_report import TrackingReport as TrackingReport
from .tracking_report import assess

Feedback: TypeAlias = Literal["steps", "always", "never"]
SETTLE_S = 1.0
_STATE = mujoco.mjtState.mjSTATE_INTEGRATION


class Simulation:
    """One robot on a floor. A deep copy shares the model; one that was pickled has its own.

    Args:
        robot: The robot.
        feedback: When the ankles correct the balance (`AnkleFeedback`): in plans in which a foot is
            lifted or the weight moves, always, or never.

    Attributes:
        model: The compiled model.
        data: Its state.
    """

    def __init__(self, robot: Robot, feedback: Feedback = "steps") -> None:
        if feedback not in get_args(Feedback):
            raise InvalidValueError(
                f"feedback must be one of {get_args(Feedback)}, not {feedback!r}"
            )
        self.robot = robot
        self.feedback = feedback
        self.model = mujoco.MjModel.from_xml_string(robot.xml)
        self.data = mujoco.MjData(self.model)
        self._corners = sole_corners(self.model)
        self._feet = np.array([self.model.body(name).id for name in robot.feet])
        self._views = Views.of(self.data)

    @cached_property
    def _settled(self) -> FloatArray:
        """State of a robot that has stood still for a second; every reset starts from it."""
        data = mujoco.MjData(self.model)
        rest = rest_reference(self.robot).q
        data.qpos[:] = rest
        data.ctrl[:] = standing_commands(self.robot, rest)
        for _ in range(round(SETTLE_S / self.model.opt.timestep)):
            mujoco.mj_step(self.model, data)
        data.time = 0.0
        return self._state_of(data)

    def reset(self) -> None:
        """Put the robot to its standing posture, at rest."""
        self.load_state(self._settled)

    def state(self) -> FloatArray:
        """Return all that the future depends on (``mjSTATE_INTEGRATION``)."""
        return self._state_of(self.data)

    def load_state(self, state: FloatArray) -> None:
        """Go on from what `state` returned, bit for bit."""
        mujoco.mj_setState(self.model, self.data, state, _STATE)
        self._update_positions()

    def perform(
        self, plan: Plan, on_frame: Callable[[], None] | None = None, frame_steps: int = 10
    ) -> TrackingReport:
        """Send a plan's commands to the servos and simulate, until the end or a fall.

        Other threads go on meanwhile.

        Args:
            plan: What to perform.
            on_frame: Called at the first reference posture after every ``frame_steps`` steps, to
                take pictures; without it all is simulated in one go, with the same result.
            frame_steps: See there.
        """
        n_knots = len(plan.q) - 1
        n_steps = len(plan.commands) // n_knots
        at_once = n_knots if on_frame is None else -(-frame_steps // n_steps)
        guided = self.feedback == "always" or (self.feedback == "steps" and plan.steps)
        law = make_ankle_feedback(self.robot, plan, guided)
        addresses = self.model._address, self.data._address
        q, v = np.empty((n_knots + 1, self.model.nq)), np.empty((n_knots + 1, self.model.nv))
        q[0], v[0] = self.data.qpos, self.data.qvel
        done, fallen = 0, False
        while done < n_knots and not fallen:
            last = min(done + at_once, n_knots)
            done, fallen = send(
                *addresses, self._views, self._feet, plan.commands, law, plan.q, done, last, q, v
            )
            self._update_positions()
            if on_frame is not None:
                on_frame()
        return assess(self.robot, plan, q[: done + 1], v[: done + 1], fallen)

    def soles(self) -> FloatArray:
        """Return the lower corners of both soles, shape (2, 4, 3) [m]."""
        turn = self.data.xmat[self._feet].reshape(2, 3, 3)
        return np.asarray(
            np.einsum("sij,scj->sci", turn, self._corners) + self.data.xpos[self._feet][:, None]
        )

    def _update_positions(self) -> None:
        """Bring poses and velocities up to the state, which a step leaves one step behind."""
        mujoco.mj_kinematics(self.model, self.data)
        mujoco.mj_comPos(self.model, self.data)
        mujoco.mj_comVel(self.model, self.data)
        mujoco.mj_camlight(self.model, self.data)

    def _state_of(self, data: mujoco.MjData) -> FloatArray:
        out = np.empty(mujoco.mj_stateSize(self.model, _STATE))
        mujoco.mj_getState(self.model, data, out, _STATE)
        return out

    def __deepcopy__(self, memo: dict[int, Any]) -> Simulation:
        """Return a copy that shares the model."""
        copied = object.__new__(Simulation)
        memo[id(self)] = copied
        copied.__dict__.update(self.__dict__)
        copied.data = mujoco.MjData(self.model)
        copied._views = Views.of(copied.data)
        copied.load_state(self.state())
        return copied

    def __getstate__(self) -> dict[str, Any]:
        return {"robot": self.robot, "feedback": self.feedback, "state": self.state()}

    def __setstate__(self, state: dict[str, Any]) -> None:
        Simulation.__init__(self, state["robot"], state["feedback"])
        self.load_state(state["state"])
