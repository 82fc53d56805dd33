"""The robot in MuJoCo: it performs plans, and tells how it stands."""

from __future__ import annotations

from collections.abc import Callable
from functools import cached_property
from typing import Any, Literal, TypeAlias, get_args

import mujoco
import numpy as np

from mplearn.errors import InvalidValueError
from mplearn.recording import FloatArray

from .control.gravity import standing_commands
from .control.guide import Guide
from .control.plan import Plan
from .control.reference import rest_reference, sole_corners
from .performance import Performance as Performance
from .performance import assess, fallen_at
from .robot import Robot

Feedback: TypeAlias = Literal["steps", "always", "never"]
SETTLE_S = 1.0
_STATE = mujoco.mjtState.mjSTATE_INTEGRATION
_PHYSICS = mujoco.mjtState.mjSTATE_FULLPHYSICS
_INPUTS = int(
    mujoco.mjtState.mjSTATE_CTRL
    | mujoco.mjtState.mjSTATE_QFRC_APPLIED
    | mujoco.mjtState.mjSTATE_XFRC_APPLIED
)


class Simulation:
    """One robot on a floor.

    Args:
        robot: The robot.
        feedback: When the ankles correct the balance (`Guide`): in plans in which a foot is lifted
            or the weight moves, always, or never.

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
        self._corners = sole_corners(robot)
        self._feet = [self.model.body(name).id for name in robot.feet]

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
    ) -> Performance:
        """Send a plan's commands to the servos and simulate, until the end or a fall.

        Other threads go on meanwhile.

        Args:
            plan: What to perform.
            on_frame: Called at the first reference posture after every ``frame_steps`` steps, to
                take pictures; without it all is simulated in one go, with the same result.
            frame_steps: See there.
        """
        nq, nv = self.model.nq, self.model.nv
        n_knots = len(plan.q) - 1
        n_steps = len(plan.commands) // n_knots
        at_once = n_knots if on_frame is None else -(-frame_steps // n_steps)
        guided = self.feedback == "always" or (self.feedback == "steps" and plan.steps)
        guide = Guide(self.robot, plan) if guided else None
        state = np.empty((n_knots + 1, mujoco.mj_stateSize(self.model, _PHYSICS)))
        mujoco.mj_getState(self.model, self.data, state[0], _PHYSICS)
        done, fallen = 0, False
        while done < n_knots and not fallen:
            last = min(done + at_once, n_knots)
            before = self.state()
            first = done * n_steps
            states = self._send(plan.commands[first : last * n_steps], guide, first)
            state[done + 1 : last + 1] = states[n_steps - 1 :: n_steps]
            q = state[done + 1 : last + 1, 1 : 1 + nq]
            down = np.flatnonzero(fallen_at(q, plan.q[done + 1 : last + 1]))
            if fallen := len(down) > 0:
                last = done + 1 + int(down[0])
                mujoco.mj_setState(self.model, self.data, before, _STATE)
                self._send(plan.commands[first : last * n_steps], guide, first)
            done = last
            self._update_positions()
            if on_frame is not None:
                on_frame()
        q, v = state[: done + 1, 1 : 1 + nq], state[: done + 1, 1 + nq : 1 + nq + nv]
        return assess(self.robot, plan, q, v, fallen)

    def _send(self, commands: FloatArray, guide: Guide | None, first: int) -> FloatArray:
        """Simulate some steps; return the states after each, shape (N, n_state)."""
        return self._roll_out(commands) if guide is None else self._step(commands, guide, first)

    def _roll_out(self, commands: FloatArray) -> FloatArray:
        from mujoco.rollout import rollout

        model, data = self.model, self.data
        start = np.empty(mujoco.mj_stateSize(model, _PHYSICS))
        mujoco.mj_getState(model, data, start, _PHYSICS)
        applied = np.concatenate((data.qfrc_applied, data.xfrc_applied.ravel()))
        control = np.empty((1, len(commands), model.nu + len(applied)))
        control[..., : model.nu], control[..., model.nu :] = commands, applied
        states, _ = rollout(
            model,
            data,
            start,
            control,
            control_spec=_INPUTS,
            initial_warmstart=data.qacc_warmstart.copy(),
        )
        return np.asarray(states[0])

    def _step(self, commands: FloatArray, guide: Guide, first: int) -> FloatArray:
        model, data = self.model, self.data
        step, measure, control = mujoco.mj_step, mujoco.mj_subtreeVel, data.ctrl
        cog, velocity, axes = data.subtree_com[1], data.subtree_linvel[1], data.xaxis
        left, right = self._feet
        feet = slice(left, right + 1, right - left)  # views, not copies
        places, turns = data.xpos[feet], data.xmat[feet]
        states = np.empty((len(commands), mujoco.mj_stateSize(model, _PHYSICS)))
        for i, command in enumerate(commands):
            measure(model, data)
            control[:] = command
            guide.correct(first + i, control, cog, velocity, places, turns, axes)
            step(model, data)
            mujoco.mj_getState(model, data, states[i], _PHYSICS)
        return states

    def soles(self) -> FloatArray:
        """Return the lower corners of both soles, shape (2, 4, 3) [m]."""
        turn = self.data.xmat[self._feet].reshape(2, 3, 3)
        return np.asarray(
            np.einsum("sij,scj->sci", turn, self._corners) + self.data.xpos[self._feet][:, None]
        )

    def _update_positions(self) -> None:
        """Bring poses up to the state, which a step leaves one step behind."""
        mujoco.mj_kinematics(self.model, self.data)
        mujoco.mj_comPos(self.model, self.data)
        mujoco.mj_camlight(self.model, self.data)

    def _state_of(self, data: mujoco.MjData) -> FloatArray:
        out = np.empty(mujoco.mj_stateSize(self.model, _STATE))
        mujoco.mj_getState(self.model, data, out, _STATE)
        return out

    def __getstate__(self) -> dict[str, Any]:
        return {"robot": self.robot, "feedback": self.feedback, "state": self.state()}

    def __setstate__(self, state: dict[str, Any]) -> None:
        Simulation.__init__(self, state["robot"], state["feedback"])
        self.load_state(state["state"])
