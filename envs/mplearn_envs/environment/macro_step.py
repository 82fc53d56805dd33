"""The core of the environments: one action performs a whole primitive."""

from __future__ import annotations

import copy
from collections.abc import Callable, Mapping
from functools import cached_property
from typing import Any, ClassVar, Literal, NamedTuple, SupportsFloat, get_args

import gymnasium
import mujoco
import numpy as np
from gymnasium import spaces
from numpy.typing import NDArray

from mplearn.errors import InvalidValueError
from mplearn.library import PrimitiveLibrary
from mplearn_envs.data.library_source import LibrarySource
from mplearn_envs.execution.bodies import Body, make_body
from mplearn_envs.execution.modes import Dynamics, make_performer, require_fit
from mplearn_envs.execution.performer import Performer
from mplearn_envs.execution.simulation import Simulation
from mplearn_envs.rendering.screen import RENDER_MODES, Screen
from mplearn_envs.robot import Robot, humanoid, make_robot
from mplearn_envs.skills.action_choices import HOLD, Choices
from mplearn_envs.skills.repertoire import Manner, Repertoire, shared_repertoire
from mplearn_envs.tasks import Choice, Scene, Task, make_task

from .episode import Episode, EpisodeState
from .observation import Observation, ObservationBuilder
from .options import ActionOptions, MotionOptions, PictureOptions, require_number, require_one_of
from .plain import PlainSpec, from_plain
from .random_streams import RandomStreams
from .rewards import add, earned_meanwhile
from .step_discount import warn_of_step_discount

#: Terms of the reward that are the environment's own.
TERMS = ("fall", "illegal", "novel")


class StepInfo(NamedTuple):
    """What ``info`` says of a macro step; the defaults are those after a reset.

    Attributes:
        duration_s: How long it took [s].
        discount: Discount over that time.
        illegal: Whether the action was illegal.
        novel: Whether the transition was never observed.
        fallen: Whether the robot fell.
        speed: Speed of performance, as a share of the human's.
        tracking_rmse_rad: Root mean square of the joints' tracking error [rad].
        cog_deviation_m: Largest distance of the COG from its plan [m].
        zmp_margin_m: Least distance of the zero-moment point from the edge of the soles [m].
    """

    duration_s: float = 0.0
    discount: float = 1.0
    illegal: bool = False
    novel: bool = False
    fallen: bool = False
    speed: float = 0.0
    tracking_rmse_rad: float = 0.0
    cog_deviation_m: float = 0.0
    zmp_margin_m: float = 0.0


class MacroStepEnv(PlainSpec, gymnasium.Env[Observation, np.int64]):
    """Chooses and performs primitives of a repertoire, and rewards it by a task.

    See `PrimitiveHumanoidEnv` for the meaning of everything. An environment derived from this one
    says where its library comes from, and may override `_begin` and `_meanwhile`.
    """

    metadata: dict[str, Any] = {  # noqa: RUF012 (gymnasium declares it so)
        "render_modes": list(RENDER_MODES),
        "render_fps": 25,
    }

    reset_options: ClassVar[tuple[str, ...]] = ()  # of the environment's own, beside the task's

    def __init__(
        self,
        source: LibrarySource,
        *,
        robot: Robot | str | None,
        task: Task | str | Mapping[str, Any],
        dynamics: Dynamics,
        discount: float,
        flat: bool,
        motion: MotionOptions | Mapping[str, Any] | None,
        actions: ActionOptions | Mapping[str, Any] | None,
        pictures: PictureOptions | Mapping[str, Any] | None,
        render_mode: Literal["human", "rgb_array"] | None,
        body: Body | str | Mapping[str, Any] = "nominal",
    ) -> None:
        require_one_of("dynamics", dynamics, get_args(Dynamics))
        require_one_of("flat", flat, (False, True))
        require_one_of("render_mode", render_mode, (None, *RENDER_MODES))
        require_number("discount", discount, 1e-9, 1.0, "in (0, 1]")
        self.source = source
        self.robot = make_robot(from_plain(robot)) if robot is not None else humanoid()
        self.task = make_task(from_plain(task))
        self.dynamics: Dynamics = dynamics
        self.discount = discount
        self.motion = MotionOptions.of(from_plain(motion), "motion")
        self.actions = ActionOptions.of(from_plain(actions), "actions")
        self.pictures = PictureOptions.of(from_plain(pictures), "pictures")
        self.body = make_body(from_plain(body))
        require_fit(dynamics, self.body)
        self.repertoire = self._made_repertoire()
        self.capacity = self.repertoire.capacity
        self._n_speeds = len(self.actions.speeds)
        self.action_space = spaces.Discrete(self.capacity * self._n_speeds)
        self._builder = ObservationBuilder(
            len(self.robot.joint_names),
            self.capacity,
            self.task.space(self.repertoire),
            flat,
            self._n_speeds,
        )
        self.observation_space = self._builder.space
        self._screen = Screen(
            render_mode, self.pictures.width, self.pictures.height, self.pictures.draw_balance
        )
        self.render_mode = render_mode
        self.frame_callback: Callable[[], object] | None = None
        self._episode: Episode | None = None
        self._streams: RandomStreams | None = None
        self._terms: dict[str, float] = {}
        self._stepped = False

    def _made_repertoire(self) -> Repertoire:
        library = self.source.now()
        if self.source.live:
            return Repertoire(library, self.robot, **self._manner()._asdict(), growing=True)
        return shared_repertoire(library, self.robot, self._manner())

    def _manner(self) -> Manner:
        motion, actions = self.motion, self.actions
        return Manner(
            actions.capacity,
            motion.speed,
            motion.style,
            motion.feasibility,
            motion.upper_body,
            actions.novel_penalty is not None,
        )

    @cached_property
    def performer(self) -> Performer:
        """Who performs; made when it is first needed."""
        return make_performer(self.dynamics, self.repertoire, self.actions.hold_s, self.body)

    @cached_property
    def _frame_steps(self) -> int:
        period_s = self.repertoire.skills.planner.config.period_s
        return max(1, round(1.0 / (self.pictures.frame_rate_hz * period_s)))

    # ---- what derived environments do besides

    def _begin(self, options: Mapping[str, Any]) -> None:
        """Prepare an episode, before the robot is put upright."""

    def _entries(self) -> Choices:
        """Return what may be done first in an episode."""
        return self.repertoire.entries(self.performer.reference)

    def _meanwhile(self, duration_s: float) -> None:
        """Let the world go on for the duration of a macro step."""

    # ---- gymnasium's interface

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[Observation, dict[str, Any]]:
        """Put the robot upright, at rest; returns observation and info.

        Args:
            seed: Seed of the episodes from here on.
            options: For the task: see there.

        Raises:
            InvalidValueError: There is no such option.
            RobotError: The robot can perform nothing of the library.
            NoPathError: The task's goal cannot be reached.
        """
        super().reset(seed=seed)
        if seed is not None or self._streams is None:
            own = seed if seed is not None else int(self.np_random.integers(2**63))
            self._streams = RandomStreams.of(own)
        self._episode = None
        self._require_known(options or {})
        self._begin(options or {})
        draw = 0 if self.body.certain else int(self.streams.body.integers(2**63))
        measured = self.performer.reset(draw)
        episode = Episode(measured, self._entries())
        self.task.reset(self._scene(episode, options or {}))
        self._episode = episode
        self._terms = dict.fromkeys((*self.task.terms, *TERMS), 0.0)
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
        before = self._running()
        if not self._stepped and self.discount < 1.0:
            self._stepped = True
            warn_of_step_discount(self.discount)
        slot, speed = self._chosen(action, before.choices.mask)
        legal = bool(before.choices.mask[slot])
        novel = bool(before.choices.novel[slot])
        chosen = self.repertoire.primitive(slot) if legal else None
        probability = float(before.choices.prior[slot])
        terms = self.task.bonuses(Choice(chosen, legal, probability, before.history))
        if not legal:
            terms["illegal"] = -self.actions.illegal_penalty
        if novel:
            terms["novel"] = -(self.actions.novel_penalty or 0.0)
        watched = self.frame_callback is not None or self.render_mode == "human"
        outcome = self.performer.perform(
            chosen, self._frame if watched else None, self._frame_steps, speed
        )
        report, duration_s = outcome.report, outcome.report.duration_s
        remaining = self.discount**duration_s
        add(terms, earned_meanwhile(self.task, report, self.discount))
        self._meanwhile(duration_s)
        episode = before.after(
            chosen, outcome.measured, duration_s, self.repertoire, self.performer
        )
        add(terms, self.task.arrive(self._scene(episode, {})), remaining)
        terminated = report.fallen or self.task.done
        self._episode = episode._replace(running=not terminated)

        step = StepInfo(duration_s, remaining, not legal, novel, report.fallen, **outcome.figures)
        return self._observation(), sum(terms.values()), terminated, False, self._info(step, terms)

    def action_masks(self) -> NDArray[np.bool_]:
        """Return which actions are legal, shape (A,): the convention of sb3-contrib."""
        return self._begun().choices.mask_at(self._n_speeds).astype(np.bool_)

    def render(self) -> NDArray[np.uint8] | None:
        """Return a picture, shape (height, width, 3), or show the window.

        Raises:
            InvalidValueError: There is no render mode.
        """
        self.performer.show()
        return self._screen.picture(self.simulation)

    def close(self) -> None:
        """Free what drawing needed; a second time does nothing."""
        self._screen.close()

    def state(self) -> EpisodeState:
        """Return where the episode is: with `load_state`, actions can be tried."""
        episode = self._begun()
        task, streams = copy.deepcopy((self.task, self.streams), self._shared())
        return EpisodeState(self.performer.state(), episode, task, streams)

    def load_state(self, state: EpisodeState) -> tuple[Observation, dict[str, Any]]:
        """Go on from there, bit for bit; returns observation and info, as `reset` does.

        The state may be another environment's with the same library, robot and task; a simulated
        one's may be loaded into a kinematic one, to look ahead.

        Raises:
            InvalidValueError: A kinematic state is loaded into a simulated environment.
        """
        measured = self.performer.load_state(state.performer)
        same_kind = (state.performer.simulated is None) == (self.dynamics == "kinematic")
        episode = state.episode
        self._episode = episode if same_kind else episode._replace(measured=measured)
        self.task, self._streams = copy.deepcopy((state.task, state.streams), self._shared())
        return self._observation(), self._info()

    # ---- what others may look at

    @property
    def library(self) -> PrimitiveLibrary:
        """The library of now."""
        return self.repertoire.library

    def infeasible(self) -> dict[int, tuple[str, ...]]:
        """Return the slots that are 1 in ``info["infeasible"]``, and the reasons against each."""
        return dict(self._begun().choices.refused)

    @property
    def streams(self) -> RandomStreams:
        """The environment's randomness."""
        if self._streams is None:
            raise InvalidValueError("the episode has not begun: call reset first")
        return self._streams

    @property
    def simulation(self) -> Simulation:
        """The robot in MuJoCo."""
        return self.performer.simulation

    @property
    def model(self) -> mujoco.MjModel:
        """The simulation's model."""
        return self.simulation.model

    @property
    def data(self) -> mujoco.MjData:
        """The simulation's state, up to date."""
        self.performer.show()
        return self.simulation.data

    # ---- inside

    @property
    def _version(self) -> str:
        """What tells libraries apart."""
        return self.library.version

    def _begun(self) -> Episode:
        """Return the episode, over or not."""
        if self._episode is None:
            raise InvalidValueError("the episode has not begun: call reset first")
        return self._episode

    def _require_known(self, options: Mapping[str, Any]) -> None:
        """Check the names of options for a reset."""
        own = self.task.reset_options
        if own is None:
            return
        known = (*self.reset_options, *own)
        if unknown := [name for name in options if name not in known]:
            raise InvalidValueError(f"reset takes the options {known} here, not {unknown}")

    def _running(self) -> Episode:
        """Return the episode, which goes on."""
        if self._episode is None or not self._episode.running:
            raise InvalidValueError("the episode has not begun or is over: call reset first")
        return self._episode

    def _chosen(self, action: np.int64 | int, mask: NDArray[np.int8]) -> tuple[int, float]:
        """Return the slot of a valid action, and at which share of the speed."""
        value, n_actions = np.asarray(action), self.capacity * self._n_speeds
        if value.shape != () or value.dtype.kind not in "iu" or not 0 <= value < n_actions:
            raise InvalidValueError(f"an action is an integer in [0, {n_actions}), not {action!r}")
        block, slot = divmod(int(value), self.capacity)
        if self.actions.illegal == "raise" and not mask[slot]:
            allowed = np.flatnonzero(np.tile(mask, self._n_speeds)).tolist()
            raise InvalidValueError(f"action {int(value)} is illegal here; legal are {allowed}")
        return slot, self.actions.speeds[block]

    def _shared(self) -> dict[int, Any]:
        """Return what copies of a task share with it, for `copy.deepcopy`."""
        return {id(self.repertoire): self.repertoire}

    def _scene(self, episode: Episode, options: Mapping[str, Any]) -> Scene:
        return Scene(
            self.repertoire,
            episode.measured,
            self.performer.reference,
            episode.current,
            episode.history,
            episode.time_s,
            self.streams.task,
            options,
            episode.choices,
            self.discount,
            self.actions.hold_s,
        )

    def _observation(self) -> Observation:
        episode = self._begun()
        slot = HOLD if episode.current is None else self.repertoire.slots[episode.current]
        return self._builder.see(episode.measured, slot, episode.choices, self.task.observe())

    def _info(
        self, step: StepInfo | None = None, terms: Mapping[str, float] | None = None
    ) -> dict[str, Any]:
        episode, report = self._begun(), self.task.report()
        choices, current = episode.choices, episode.current
        if step is None:
            step = StepInfo(zmp_margin_m=float(episode.measured.support_margin[0]))
        info = {
            "action_mask": choices.mask_at(self._n_speeds),
            "transition_prior": choices.prior_at(self._n_speeds),
            "infeasible": choices.infeasible(),
            "dead_end": choices.dead_end,
            "library_version": self._version,
            "primitive": -1 if current is None else current,
            "primitive_name": "" if current is None else self.library[current].name,
            "task": report,
            **step._asdict(),
            "reward_terms": self._terms | dict(terms or {}),
        }
        if "success" in report:
            info["is_success"] = report["success"]
        return info

    def _frame(self) -> None:
        if self.frame_callback is not None:
            self.frame_callback()
        self._show()

    def _show(self) -> None:
        if self.render_mode == "human":
            self.performer.show()
            self._screen.show(self.simulation)

    def __getstate__(self) -> dict[str, Any]:
        return {**self.__dict__, "frame_callback": None}
