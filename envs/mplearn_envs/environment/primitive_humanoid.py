"""``mplearn/PrimitiveHumanoid-v0``: a humanoid whose actions are skills learned by watching."""

from __future__ import annotations

from typing import Literal

from mplearn.generation import StyleName
from mplearn_envs.data.library_source import LibrarySource, Source
from mplearn_envs.execution.modes import Dynamics
from mplearn_envs.rendering.screen import Screen
from mplearn_envs.robot import Robot, humanoid
from mplearn_envs.skills.feasibility import FeasibilityConfig
from mplearn_envs.skills.repertoire import Repertoire, shared_repertoire
from mplearn_envs.tasks import Task, make_task

from .macro_step import MacroStepEnv
from .options import require_options


class PrimitiveHumanoidEnv(MacroStepEnv):
    """A humanoid that stands and performs motion primitives; the agent chooses which comes next.

    The library holds the primitives and the graph of their observed transitions ([Kulic2012], 3).
    An action performs a whole primitive (a macro step of some seconds) on the simulated robot: the
    upper body is tracked, the legs balance (4.2.1), and lift a foot where the motion does.

    ## Action space

    ``Discrete(capacity)``. Action 0 is hold: keep the posture for ``hold_s``. Action k performs the
    primitive in slot k; primitives take slots in the order of their ids, and keep them. Free slots
    are never legal.

    ## Observation space

    A ``Dict`` (n = 30 joints, in the order of ``env.unwrapped.robot.joint_names``), or with
    ``flat=True`` one array, as `gymnasium.spaces.flatten` makes it (keys in alphabetical order,
    current_primitive as one-hot):

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
    task               0..  what the task shows, see there
    ================== ==== ==================================== ======= ======= =====

    What lies outside the bounds (in a wild fall) is cut off. A support margin is negative where the
    COG is outside, and -1 where fewer than three corners of the soles touch the floor. A task that
    shows nothing has no ``task``.

    ## Legal actions, and the prior

    Hold is always legal. After a primitive, those are legal that were observed to follow it and
    that the robot can perform (`Feasibility`; ``info["infeasible"]`` has the reasons against the
    others). The prior is their observed frequency; hold has probability 0 as long as there is
    another choice. Holding changes nothing in that: the same successors stay legal. At a dead end
    only hold is legal, with probability 1; it makes an *entry*: as at the start of an episode,
    those primitives are legal that start nearest to the present posture (up to 0.5 rad farther than
    the nearest one), with their observed frequency as prior. So a walk by the prior goes on for
    ever::

        action = env.action_space.sample(probability=info["transition_prior"])

    With a ``novel_penalty`` every primitive that the robot can perform is legal everywhere; one
    that was never observed there has prior 0, costs the penalty, and is flagged in
    ``info["novel"]``.

    An illegal action holds and costs ``illegal_penalty``, flagged in ``info["illegal"]``; with
    ``illegal="raise"`` it is an error.

    ## Reward

    Semi-Markov: R = bonuses + integral over [0, T] of discount^t rates(t) dt + discount^T arrivals,
    T being ``info["duration_s"]`` and ``discount`` per second; see the tasks: `FreeTask` (the
    default), `GoalTask`, `FollowTask`, `ReciteTask`, or your own `Task`. ``info["discount"]`` is
    discount^T, for whoever bootstraps.

    ## Start, end

    An episode starts upright at rest, arms hanging, always the same but for the task. It terminates
    when the robot falls or the task is done, and is truncated after ``max_steps`` macro steps.

    ## Fidelity

    ``dynamics="simulated"`` sends the plans to the servos of the robot in MuJoCo.
    ``dynamics="kinematic"`` takes plans at their word: the robot is where it was planned to be, COG
    and zero-moment point are the plan's, and it never falls. Spaces, durations, masks and priors
    are the same, observations and rewards nearly (a test bounds the difference), and it is more
    than a hundred times faster.

    ## A library that grows

    A `MotionLearner` (or a function that returns a library) makes the environment *live*: at each
    reset it takes a new snapshot. Primitives that live on keep their slots. Give it the capacity
    that it will need. While nothing is known, only hold is legal.

    ## Info

    ``action_mask`` (int8), ``transition_prior`` (float64), ``infeasible`` (slot: reasons, of what
    the demonstrator might have chosen here), ``dead_end``, ``library_version``, ``primitive`` (id,
    -1 for none), ``primitive_name``, ``task`` (`Task.report`), ``is_success`` (where the task has
    success); after a step also ``duration_s``, ``discount``, ``reward_terms``, ``illegal``,
    ``novel``, ``fallen``, ``speed``, ``tracking_rmse_rad``, ``cog_deviation_m`` (largest),
    ``zmp_margin_m`` (least).

    ## Arguments

    Args:
        library: A `PrimitiveLibrary` or its file; None is the built-in one. Or what is live: a
            `MotionLearner`, or a function that returns a library.
        robot: The robot; None is the humanoid.
        task: A `Task` or its name: "free", "goal", "follow" or "recite".
        dynamics: "simulated" or "kinematic".
        capacity: Number of actions; None is the next power of two that fits, at least 32.
        speed: Speed of performance as a share of the human's. The paper's robot moved at 0.5.
        style: How motions are generated from primitives, see `mplearn.generation`.
        max_steps: Macro steps until truncation.
        hold_s: Duration of holding [s].
        discount: Discount per second.
        illegal: What an illegal action does: "hold" or "raise".
        illegal_penalty: Price of an illegal action.
        novel_penalty: Price of a transition that was never observed; None makes it illegal.
        feasibility: What the robot is allowed; None is the default.
        flat: Whether observations are flat arrays.
        render_mode: None, "rgb_array" or "human".
        width: Width of pictures [pixels].
        height: Height of pictures [pixels].
        draw_balance: Whether support polygon, COG and ZMP are drawn on the floor of pictures.
        frame_rate_hz: How often ``frame_callback`` is called [1/s of simulated time].

    Attributes:
        repertoire: What the robot can perform, in which slots, and what may follow what.
        frame_callback: Called while a macro step goes on, so that a video of it is smooth: call
            ``env.render()`` there. Not pickled.

    Raises:
        LibraryError: The library is missing, damaged, empty, for another robot, of another version,
            or larger than the capacity.
        InvalidValueError: An option is wrong; the message says what is allowed.

    ## Versions

    * v0: first.
    """

    def __init__(
        self,
        library: Source = None,
        *,
        robot: Robot | None = None,
        task: str | Task = "free",
        dynamics: Dynamics = "simulated",
        capacity: int | None = None,
        speed: float = 0.5,
        style: StyleName = "deterministic",
        max_steps: int = 100,
        hold_s: float = 0.5,
        discount: float = 0.95,
        illegal: Literal["hold", "raise"] = "hold",
        illegal_penalty: float = 1.0,
        novel_penalty: float | None = None,
        feasibility: FeasibilityConfig | None = None,
        flat: bool = False,
        render_mode: Literal["human", "rgb_array"] | None = None,
        width: int = 640,
        height: int = 480,
        draw_balance: bool = False,
        frame_rate_hz: float = 25.0,
    ) -> None:
        require_options(locals())
        self.source = LibrarySource(library)
        self.robot = robot or humanoid()
        self.task = make_task(task)
        self.dynamics = dynamics
        self.speed = speed
        self.style = style
        self.max_steps = max_steps
        self.hold_s = hold_s
        self.discount = discount
        self.illegal = illegal
        self.illegal_penalty = illegal_penalty
        self.novel_penalty = novel_penalty
        self.feasibility = feasibility
        self.flat = flat
        self.draw_balance = draw_balance
        self.frame_rate_hz = frame_rate_hz
        self.repertoire = self._repertoire(capacity)
        self._set_up(flat, Screen(render_mode, width, height, draw_balance))

    def _begin(self) -> None:
        if self.source.live:
            library = self.source.now()
            self.repertoire.require_room(len(library))
            self.repertoire.update(library)

    def _repertoire(self, capacity: int | None) -> Repertoire:
        library, novel = self.source.now(), self.novel_penalty is not None
        what = (capacity, self.speed, self.style, self.feasibility)
        if self.source.live:
            return Repertoire(library, self.robot, *what, novel=novel, growing=True)
        return shared_repertoire(library, self.robot, *what, novel)
