"""``mplearn/PrimitiveHumanoid-v0``: a humanoid whose actions are skills learned by watching."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any, Literal, SupportsFloat

import gymnasium
import numpy as np
from gymnasium import spaces
from numpy.typing import NDArray

from mplearn.errors import InvalidValueError
from mplearn.generation import StyleName
from mplearn.library import PrimitiveLibrary

from .control.planner import Plan, Planner, PlannerConfig
from .control.reference import rest_reference
from .feasibility import FeasibilityConfig
from .observation import Observation, observation_limits, observation_space, observe
from .repertoire import HOLD, Repertoire, open_library
from .robot import Robot, humanoid
from .simulation import Performance, Simulation
from .tasks import Choice, Task, make_task


class PrimitiveHumanoidEnv(gymnasium.Env[Observation, np.int64]):
    """A humanoid that stands and performs motion primitives; the agent chooses which comes next.

    The library holds the primitives and the graph of their observed transitions ([Kulic2012], 3).
    An action performs a whole primitive (a macro step of some seconds) on the simulated robot: the
    upper body is tracked, the legs balance with both feet down (4.2.1).

    ## Action space

    ``Discrete(capacity)``. Action 0 is hold: keep the posture for ``hold_s``. Action k performs the
    primitive in slot k; primitives take slots in the order of their ids. Free slots are never
    legal.

    ## Observation space

    A ``Dict`` (n = 30 joints, in the order of ``env.unwrapped.robot.joint_names``):

    ================== ==== ==================================== ======= ======= =====
    key                num  meaning                              min     max     unit
    ================== ==== ==================================== ======= ======= =====
    posture            0    height of the base                   -10     10      m
    posture            1    roll of the base                     -pi/2   pi/2    rad
    posture            2    pitch of the base                    -pi     pi      rad
    posture            3..  joint angles                         -2 pi   2 pi    rad
    velocity           0-2  linear, x along the heading          -100    100     m/s
    velocity           3-5  angular, base's frame                -100    100     rad/s
    velocity           6..  joint velocities                     -100    100     rad/s
    cog                0-2  COG from the middle of the soles     -10     10      m
    support_margin     0    COG to edge of the support polygon   -10     10      m
    current_primitive       slot performed last; 0: none         0       cap-1   slot
    action_mask        0..  1 where an action is legal           0       1       -
    transition_prior   0..  probability of each action           0       1       -
    ================== ==== ==================================== ======= ======= =====

    What lies outside the bounds (in a wild fall) is cut off. A support margin is negative where the
    COG is outside, and -1 where fewer than three corners of the soles touch the floor.

    ## Legal actions, and the prior

    Hold is always legal. After a primitive, those are legal that were observed to follow it and
    that the robot can perform (`Feasibility`). The prior is their observed frequency; hold has
    probability 0 as long as there is another choice. Holding changes nothing in that: the same
    successors stay legal. At a dead end only hold is legal, with probability 1; it makes an
    *entry*: as at the start of an episode, those primitives are legal that start nearest to the
    present posture (up to 0.5 rad farther than the nearest one), with their observed frequency as
    prior. So a walk by the prior goes on for ever::

        action = env.action_space.sample(probability=info["transition_prior"])

    An illegal action holds and costs ``illegal_penalty``, flagged in ``info["illegal"]``; with
    ``illegal="raise"`` it is an error.

    ## Reward

    Semi-Markov: R = bonuses + integral over [0, T] of discount^t rates(t) dt, T being
    ``info["duration_s"]`` and ``discount`` per second; see the tasks (`FreeTask` by default).
    ``info["discount"]`` is discount^T, for whoever bootstraps.

    ## Start, end

    An episode starts upright at rest, arms hanging, always the same. It terminates when the robot
    falls, and is truncated after ``max_steps`` macro steps.

    ## Info

    ``action_mask`` (int8), ``transition_prior`` (float64), ``infeasible`` (slot: reasons, of what
    the demonstrator might have chosen here), ``dead_end``, ``library_version``, ``primitive`` (id
    or None), ``primitive_name``; after a step also ``duration_s``, ``discount``, ``reward_terms``,
    ``illegal``, ``fallen``, ``speed``, ``tracking_rmse_rad``, ``cog_deviation_m`` (largest),
    ``zmp_margin_m`` (least).

    ## Arguments

    Args:
        library: A `PrimitiveLibrary` or its file; None is the built-in one.
        robot: The robot; None is the humanoid.
        task: A `Task` or its name.
        capacity: Number of actions; None is the next power of two that fits, at least 32.
        speed: Speed of performance as a share of the human's. The paper's robot moved at 0.5.
        style: How motions are generated from primitives, see `mplearn.generation`.
        max_steps: Macro steps until truncation.
        hold_s: Duration of holding [s].
        discount: Discount per second.
        illegal: What an illegal action does: "hold" or "raise".
        illegal_penalty: Price of an illegal action.
        feasibility: What the robot is allowed; None is the default.
        render_mode: None, "rgb_array" or "human".
        width: Width of pictures [pixels].
        height: Height of pictures [pixels].
        frame_rate_hz: How often ``frame_callback`` is called [1/s of simulated time].

    Attributes:
        frame_callback: Called while a macro step goes on, so that a video of it is smooth: call
            ``env.render()`` there. Not pickled.

    ## Versions

    * v0: first.
    """

    metadata: dict[str, Any] = {  # noqa: RUF012 (gymnasium declares it so)
        "render_modes": ["human", "rgb_array"],
        "render_fps": 25,
    }

    def __init__(
        self,
        library: PrimitiveLibrary | str | Path | None = None,
        *,
        robot: Robot | None = None,
        task: str | Task = "free",
        capacity: int | None = None,
        speed: float = 0.5,
        style: StyleName = "deterministic",
        max_steps: int = 100,
        hold_s: float = 0.5,
        discount: float = 0.95,
        illegal: Literal["hold", "raise"] = "hold",
        illegal_penalty: float = 1.0,
        feasibility: FeasibilityConfig | None = None,
        render_mode: str | None = None,
        width: int = 640,
        height: int = 480,
        frame_rate_hz: float = 25.0,
    ) -> None:
        _require("max_steps", max_steps, max_steps >= 1)
        _require("hold_s", hold_s, 0.05 <= hold_s <= 60.0)
        _require("discount", discount, 0.0 < discount <= 1.0)
        _require("illegal_penalty", illegal_penalty, np.isfinite(illegal_penalty))
        _require("frame_rate_hz", frame_rate_hz, 0.0 < frame_rate_hz <= 250.0)
        _require("illegal", illegal, illegal in ("hold", "raise"))
        _require("render_mode", render_mode, render_mode in (None, "human", "rgb_array"))
        self.library = open_library(library)
        self.robot = robot or humanoid()
        self.task = make_task(task)
        self.speed = speed
        self.style = style
        self.max_steps = max_steps
        self.hold_s = hold_s
        self.discount = discount
        self.illegal = illegal
        self.illegal_penalty = illegal_penalty
        self.feasibility = feasibility
        self.render_mode = render_mode
        self.width = width
        self.height = height
        self.frame_rate_hz = frame_rate_hz
        self.frame_callback: Callable[[], object] | None = None

        self.simulation = Simulation(self.robot)
        period_s = float(self.simulation.model.opt.timestep)
        self.planner = Planner(self.robot, PlannerConfig(period_s=period_s))
        self.repertoire = Repertoire(
            self.library, self.planner, capacity, speed, style, feasibility
        )
        self.capacity = self.repertoire.capacity
        self.action_space = spaces.Discrete(self.capacity)
        self._limits = observation_limits(len(self.robot.joint_names))
        self.observation_space = observation_space(self._limits, self.capacity)
        self._frame_steps = max(1, round(1.0 / (frame_rate_hz * period_s)))
        self._picture: Any = None
        self._running = False

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[Observation, dict[str, Any]]:
        """Put the robot upright, at rest; returns observation and info."""
        super().reset(seed=seed)
        self.task.reset()
        self.simulation.reset()
        self._reference = rest_reference(self.robot)
        self._current: int | None = None
        self._history: tuple[int, ...] = ()
        self._n_steps = 0
        self._running = True
        self._choices = self.repertoire.entries(self._reference.target)
        self._show()
        return self._observation(), self._info()

    def step(
        self, action: np.int64 | int
    ) -> tuple[Observation, SupportsFloat, bool, bool, dict[str, Any]]:
        """Perform a primitive, or hold; see the class.

        Raises:
            InvalidValueError: The action is no integer of the action space, or illegal with
                ``illegal="raise"``; or the episode has not begun or is over.
        """
        slot = self._slot(action)
        legal = bool(self._choices.mask[slot])
        chosen = self.repertoire.primitive(slot) if legal else None
        bonuses = self.task.bonuses(
            Choice(chosen, legal, float(self._choices.prior[slot]), self._history)
        )
        if not legal:
            bonuses["illegal"] = -self.illegal_penalty
        plan = self._plan(chosen)
        performance = self.simulation.perform(plan, self._frame, self._frame_steps)
        self._reference = plan.end
        self._advance(chosen)

        terms = bonuses | self._discounted(performance)
        self._running = not performance.fallen
        truncated = self._n_steps >= self.max_steps
        info = self._info() | {
            "duration_s": performance.duration_s,
            "discount": self.discount**performance.duration_s,
            "reward_terms": terms,
            "illegal": not legal,
            "fallen": performance.fallen,
            "speed": plan.speed,
            "tracking_rmse_rad": float(np.sqrt(np.mean(performance.tracking_error_rad**2))),
            "cog_deviation_m": float(performance.cog_deviation_m.max()),
            "zmp_margin_m": float(performance.zmp_margin_m.min()),
        }
        return self._observation(), sum(terms.values()), performance.fallen, truncated, info

    def action_masks(self) -> NDArray[np.bool_]:
        """Return which actions are legal, shape (capacity,): the convention of sb3-contrib."""
        return self._choices.mask.astype(np.bool_)

    def render(self) -> NDArray[np.uint8] | None:
        """Return a picture, shape (height, width, 3), or show the window.

        Raises:
            InvalidValueError: There is no render mode.
        """
        if self.render_mode is None:
            raise InvalidValueError("render needs render_mode='rgb_array' (or 'human')")
        if self.render_mode == "human":
            self._show()
            return None
        if self._picture is None:
            from .rendering import Renderer

            self._picture = Renderer(self.simulation.model, self.width, self.height)
        picture: NDArray[np.uint8] = self._picture.render(self.simulation.data)
        return picture

    def close(self) -> None:
        """Free what drawing needed; a second time does nothing."""
        if self._picture is not None:
            self._picture.close()
            self._picture = None

    def _slot(self, action: np.int64 | int) -> int:
        if not self._running:
            raise InvalidValueError("the episode has not begun or is over: call reset first")
        value = np.asarray(action)
        if value.shape != () or value.dtype.kind not in "iu" or not 0 <= value < self.capacity:
            raise InvalidValueError(
                f"an action is an integer in [0, {self.capacity}), not {action!r}"
            )
        slot = int(value)
        if self.illegal == "raise" and not self._choices.mask[slot]:
            allowed = np.flatnonzero(self._choices.mask).tolist()
            raise InvalidValueError(f"action {slot} is illegal here; legal are {allowed}")
        return slot

    def _plan(self, chosen: int | None) -> Plan:
        if chosen is None:
            return self.planner.hold(self._reference, self.hold_s)
        return self.repertoire.plan(self._reference, chosen)

    def _advance(self, chosen: int | None) -> None:
        self._n_steps += 1
        if chosen is not None:
            self._current = chosen
            self._history = (*self._history, chosen)
            self._choices = self.repertoire.after(chosen)
        elif self._current is None or self._choices.dead_end:
            self._current = None
            self._choices = self.repertoire.entries(self._reference.target)

    def _discounted(self, performance: Performance) -> dict[str, float]:
        """Return the terms of a macro step's moments: the discounted integral of the rates."""
        weight = self.discount**performance.time_s * np.diff(performance.time_s, prepend=0.0)
        terms = {name: float(r @ weight) for name, r in self.task.rates(performance).items()}
        if performance.fallen:
            terms["fall"] = self.task.fall() * self.discount**performance.duration_s
        return terms

    def _observation(self) -> Observation:
        slot = HOLD if self._current is None else self.repertoire.slots[self._current]
        return observe(self._limits, self.simulation, slot, self._choices)

    def _info(self) -> dict[str, Any]:
        choices, current = self._choices, self._current
        return {
            "action_mask": choices.mask.copy(),
            "transition_prior": choices.prior.copy(),
            "infeasible": dict(choices.refused),
            "dead_end": choices.dead_end,
            "library_version": self.library.version,
            "primitive": current,
            "primitive_name": "" if current is None else self.library[current].name,
        }

    def _frame(self) -> None:
        if self.frame_callback is not None:
            self.frame_callback()
        self._show()

    def _show(self) -> None:
        if self.render_mode == "human":
            if self._picture is None:
                from .rendering import Viewer

                self._picture = Viewer(self.simulation.model, self.simulation.data)
            self._picture.show()

    def __getstate__(self) -> dict[str, Any]:
        return {**self.__dict__, "_picture": None, "frame_callback": None}


def _require(name: str, value: object, holds: bool | np.bool_) -> None:
    if not holds:
        allowed = {
            "max_steps": "an integer from 1",
            "hold_s": "in [0.05, 60] s",
            "discount": "in (0, 1]",
            "illegal_penalty": "finite",
            "frame_rate_hz": "in (0, 250] 1/s",
            "illegal": "'hold' or 'raise'",
            "render_mode": "None, 'human' or 'rgb_array'",
        }
        raise InvalidValueError(f"{name} must be {allowed[name]}, not {value!r}")
