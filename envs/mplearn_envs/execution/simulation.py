"""The robot in MuJoCo: it performs plans, and tells how it stands."""

from __future__ import annotations

import copy
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

from .bodies import NOMINAL, Body, body_model, draw_pushes, embody
from .mujoco_loop import Simulated, Track, send
from .reflexes import LONGEST_S, NO_PUSHES, Pushes, Reflexes, new_progress, send_with_steps
from .tracking_report import FALL_DROP_M, assess, has_fallen
from .tracking_report import TrackingReport as TrackingReport

Feedback: TypeAlias = Literal["steps", "always", "never"]
SETTLE_S = 1.0
_STATE = mujoco.mjtState.mjSTATE_INTEGRATION
_DIVERGED = (
    mujoco.mjtWarning.mjWARN_BADQPOS,
    mujoco.mjtWarning.mjWARN_BADQVEL,
    mujoco.mjtWarning.mjWARN_BADQACC,
)
_WILD = 1e3  # no robot is so fast [m/s, rad/s]


class Simulation:
    """One robot on a floor. A deep copy shares the model; one that was pickled has its own.

    `reset` makes it stand.

    Args:
        robot: The robot.
        feedback: When the ankles correct the balance (`AnkleFeedback`): in plans in which a foot is
            lifted or the weight moves, always, or never.
        body: What its body may be like, and whether it takes steps to survive where it would fall
            otherwise (`Reflexes`); the ankles correct the balance always, then.

    Attributes:
        model: The compiled model.
        data: Its state.
        draw: Which body was drawn, see `embody`.

    Example:
        >>> from mplearn_envs.mechanics import rest_reference
        >>> from mplearn_envs.planning import Planner
        >>> from mplearn_envs.robot import humanoid
        >>> simulation = Simulation(humanoid())
        >>> simulation.reset()
        >>> plan = Planner(humanoid()).hold(rest_reference(humanoid()), 0.5)
        >>> report = simulation.perform(plan)
        >>> report.fallen, round(report.duration_s, 3)
        (False, 0.5)
    """

    def __init__(self, robot: Robot, feedback: Feedback = "steps", body: Body = NOMINAL) -> None:
        if feedback not in get_args(Feedback):
            raise InvalidValueError(
                f"feedback must be one of {get_args(Feedback)}, not {feedback!r}"
            )
        self.robot = robot
        self.feedback = feedback
        self.body = body
        self.model = body_model(robot, body)
        self.data = mujoco.MjData(self.model)
        self._placed = False
        self.embody(0)
        self._corners = sole_corners(self.model)
        self._feet = np.array([self.model.body(name).id for name in robot.feet])

    def embody(self, draw: int) -> None:
        """Draw a body; `reset` makes it stand.

        Args:
            draw: Which; the same number gives the same body.
        """
        self.draw = draw
        self._drawn = embody(self.model, self.robot, self.body, draw)
        if not self.body.certain:  # another body settles elsewhere
            self.__dict__.pop("_settled", None)

    def draw_pushes(self, count: int, duration_s: float) -> Pushes:
        """Return what pushes the robot that was drawn in a macro step; see `draw_pushes`.

        Args:
            count: Which macro step of the episode, from 0.
            duration_s: How long it is planned to take [s].
        """
        return draw_pushes(self.model, self.robot, self.body, self.draw, count, duration_s)

    @cached_property
    def _reflexes(self) -> Reflexes:
        return Reflexes(self.robot)

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
        data.qpos[7:] += self._drawn.off
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
        self._placed = True
        self._update_positions()

    def perform(
        self,
        plan: Plan,
        on_frame: Callable[[], None] | None = None,
        frame_steps: int = 10,
        pushes: Pushes = NO_PUSHES,
    ) -> TrackingReport:
        """Send a plan's commands to the servos and simulate, until the end or a fall.

        Other threads go on meanwhile.

        Args:
            plan: What to perform.
            on_frame: Called at the first reference posture after every ``frame_steps`` steps, to
                take pictures; without it all is simulated in one go, with the same result.
            frame_steps: See there.
            pushes: What pushes the robot meanwhile; only one that takes steps can be pushed so.

        Raises:
            InvalidValueError: The robot stands nowhere yet, or it is pushed and takes no steps.
        """
        if not self._placed:
            raise InvalidValueError(
                "the robot stands nowhere yet: call reset(), or load_state(state), before perform"
            )
        if self.body.steps:
            return self._perform_watchful(plan, on_frame, frame_steps, pushes)
        if len(pushes.steps):
            raise InvalidValueError("pushes need a body with steps=True")
        n_knots = len(plan.q) - 1
        n_steps = len(plan.commands) // n_knots
        at_once = n_knots if on_frame is None else -(-frame_steps // n_steps)
        corrects = self.feedback == "always" or (self.feedback == "steps" and plan.steps)
        law = make_ankle_feedback(self.robot, plan, corrects)
        robot = Simulated.of(self.model, self.data, self._feet)
        track = Track.begin(self.data, n_knots)
        done, fallen = 0, False
        while done < n_knots and not fallen:
            last = min(done + at_once, n_knots)
            done, fallen = send(robot, plan.commands, plan.q, law, track, done, last)
            self._update_positions()
            if on_frame is not None:
                on_frame()
        return self._assess(plan, track, done + 1, fallen)

    def _perform_watchful(
        self, plan: Plan, on_frame: Callable[[], None] | None, frame_steps: int, pushes: Pushes
    ) -> TrackingReport:
        """Perform a plan, and steps where the robot would fall; see `perform`."""
        reflexes = self._reflexes
        n_knots = len(plan.q) - 1
        n_steps = len(plan.commands) // n_knots
        longest = n_knots + round(LONGEST_S / plan.knot_s)
        at_once = longest if on_frame is None else -(-frame_steps // n_steps)
        progress = new_progress(self.data.ctrl, self._drawn.lag)
        track = Track.begin(self.data, n_knots)
        robot = Simulated.of(self.model, self.data, self._feet)
        what = robot, reflexes.balance(plan), reflexes.planned(plan), pushes, progress
        fallen, over = False, False
        while not over and progress.knot[0] < longest:
            last = min(int(progress.knot[0]) + at_once, longest)
            fallen, over = send_with_steps(*what, track, last)
            self._update_positions()
            if on_frame is not None:
                on_frame()
        self.data.xfrc_applied[:] = 0.0
        done = int(progress.knot[0])
        known = min(done, n_knots) + 1
        report = self._assess(plan, track, known, fallen)
        if report.fallen or not progress.by_steps[0]:
            return report
        end = reflexes.arrival(plan, self.data.qpos)
        back = reflexes.return_commands(end, progress.command)
        for i, command in enumerate(back):
            self.data.ctrl[:] = command
            mujoco.mj_step(self.model, self.data)
            if on_frame is not None and (i + 1) % frame_steps == 0:
                self._update_positions()
                on_frame()
        self._update_positions()
        return report._replace(
            fallen=self._diverged() or has_fallen(self.data.qpos, end.q, FALL_DROP_M),
            duration_s=done * plan.knot_s + len(back) * reflexes.law.period_s,
            n_steps=int(progress.stepping.step[0]["n_steps"]),
            end=end,
        )

    def _assess(self, plan: Plan, track: Track, n: int, fallen: bool) -> TrackingReport:
        """Compare the first rows of a track with what was planned.

        A simulation diverges where parts are too light for what drives them; MuJoCo then puts the
        robot back to its zero. That is a fall, with finite numbers.
        """
        q, v = track.q[:n], track.v[:n]
        wild = ~(np.abs(v).max(axis=1) < _WILD) | ~np.isfinite(q).all(axis=1)
        if wild.any():
            n = max(2, int(wild.argmax()) + 1)
            q, v, fallen = q[:n], v[:n], True
            q[wild[:n]], v[wild[:n]] = q[0], v[0]
        fallen = self._diverged() or fallen
        return assess(self.robot, plan, q, v, fallen)

    def _diverged(self) -> bool:
        """Return whether MuJoCo put the robot back to its zero since this was asked last."""
        found = False
        for each in _DIVERGED:
            found |= bool(self.data.warning[each].number)
            self.data.warning[each].number = 0
        return found

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
        """Return a copy that shares the model where no other body is drawn in it."""
        copied = object.__new__(Simulation)
        memo[id(self)] = copied
        copied.__dict__.update(self.__dict__)
        if not self.body.certain:  # it draws others
            copied.model = copy.copy(self.model)
        copied.__dict__.pop("_reflexes", None)  # they have memory of their own
        copied.data = mujoco.MjData(copied.model)
        copied.load_state(self.state())
        copied._placed = self._placed
        return copied

    def __getstate__(self) -> dict[str, Any]:
        return {
            "robot": self.robot,
            "feedback": self.feedback,
            "body": self.body,
            "draw": self.draw,
            "state": self.state(),
            "placed": self._placed,
        }

    def __setstate__(self, state: dict[str, Any]) -> None:
        Simulation.__init__(self, state["robot"], state["feedback"], state["body"])
        self.embody(state["draw"])
        self.load_state(state["state"])
        self._placed = state["placed"]
