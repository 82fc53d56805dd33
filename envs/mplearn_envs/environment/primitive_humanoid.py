"""``mplearn/PrimitiveHumanoid-v0``: a humanoid whose actions are skills learned by watching."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, Literal

from mplearn_envs.data.library_source import LibrarySource, Source
from mplearn_envs.execution.bodies import Body
from mplearn_envs.execution.modes import Dynamics
from mplearn_envs.robot import Robot
from mplearn_envs.tasks import Task

from .macro_step import MacroStepEnv
from .options import ActionOptions, MotionOptions, PictureOptions
from .plain import from_plain


class PrimitiveHumanoidEnv(MacroStepEnv):
    """A humanoid that stands and performs motion primitives; the agent chooses which comes next.

    The library holds the primitives and the graph of their observed transitions ([Kulic2012], 3).
    An action performs a whole primitive (a macro step of some seconds) on the simulated robot: the
    upper body is tracked, the legs balance (4.2.1), and lift a foot where the motion does.

    ## Action space

    ``Discrete(capacity)``. Action 0 is hold: keep the posture for ``hold_s``. Action k performs the
    primitive in slot k; primitives take slots in the order of their ids, and keep them. Free slots
    are never legal. With S ``speeds`` (`ActionOptions`) it is ``Discrete(S * capacity)``: action
    b * capacity + k is slot k at the speed b, and masks and prior have as many numbers.

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
    that the robot can perform (`Feasibility`; ``env.unwrapped.infeasible()`` has the reasons
    against the others). The prior is their observed frequency; hold has probability 0 as long as
    there is another choice. Holding changes nothing in that: the same successors stay legal. At a
    dead end only hold is legal, with probability 1; it makes an *entry*: as at the start of an
    episode, those primitives are legal that start nearest to the present posture (up to 0.5 rad
    farther than the nearest one), with their observed frequency as prior. So a walk by the prior
    goes on for ever::

        action = env.action_space.sample(probability=info["transition_prior"])

    Nothing is performed whose plan from where the robot stands cannot be: where the feet stand so
    that a primitive cannot begin at once, the robot first goes to where it stands at rest
    (`Skills.plan`), and the step takes as long. Where it cannot come to rest, as it may be after
    steps that caught a push, only what can begin at once is legal.

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
    A learner with one discount a step needs `EndInsteadOfDiscount`: without it, holding (short
    steps) seems better than it is. A `StepDiscountWarning` says so where such a learner is seen.

    ## Start, end

    An episode starts upright at rest, arms hanging, always the same but for the task. It terminates
    when the robot falls or the task is done. ``gym.make`` truncates it after 100 macro steps, or
    ``max_episode_steps``.

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

    The same keys and shapes after `reset` and after `step` (C = capacity):

    ================== ================ ======================================================
    key                value            meaning
    ================== ================ ======================================================
    action_mask        int8 (C,)        1 where an action is legal
    transition_prior   float64 (C,)     probability of each action
    infeasible         int8 (C,)        1 where the demonstrator might have gone and the robot
                                        cannot; ``env.unwrapped.infeasible()`` has the reasons
    dead_end           bool             whether nothing but holding is legal
    library_version    str              of the library
    primitive          int              id of the primitive performed last, -1 for none
    primitive_name     str              its name, "" for none
    task               dict             `Task.report`: numbers, arrays of fixed lengths
    is_success         bool             whether the task is solved, where it can be
    duration_s         float            how long the macro step took [s]; 0 after a reset
    discount           float            ``discount`` to the power of that; 1 after a reset
    reward_terms       dict of floats   the reward's terms; 0 after a reset
    illegal, novel     bool             whether the action was
    fallen             bool             whether the robot fell
    speed              float            of performance, as a share of the human's
    tracking_rmse_rad  float            root mean square of the joints' tracking error [rad]
    cog_deviation_m    float            largest distance of the COG from its plan [m]
    zmp_margin_m       float            least distance of the ZMP from the soles' edge [m]
    ================== ================ ======================================================

    ## Arguments

    Args:
        library: A `PrimitiveLibrary` or its file; None is the built-in one. Or what is live: a
            `MotionLearner`, or a function that returns a library.
        robot: The robot, its name, or a TOML file that describes it (`make_robot`); None is the
            humanoid.
        task: A `Task` or its name: "free", "goal", "follow" or "recite".
        dynamics: "simulated" or "kinematic".
        discount: Discount per second.
        flat: Whether observations are flat arrays.
        motion: How primitives are performed (speed, style, feasibility): `MotionOptions`, or a
            mapping of some of them.
        actions: What actions there are, and what they cost (capacity, holding, illegal and novel
            ones): `ActionOptions`, or a mapping of some of them.
        pictures: How pictures are drawn (size, balance, rate): `PictureOptions`, or a mapping of
            some of them.
        render_mode: None, "rgb_array" or "human".
        body: How the body differs from what the robot believes, and what happens to it: "nominal"
            (nothing), "randomised" or "harsh"; or a `Body`, or a mapping of some of its values
            (and a ``level`` to start from). Each episode draws one.

    All of these but what is live are kept in ``env.spec``, objects too, as JSON holds them:
    ``gym.make(EnvSpec.from_json(env.spec.to_json()))`` makes the same environment.

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

    Example:
        >>> import gymnasium as gym
        >>> import mplearn_envs
        >>> env = gym.make("mplearn/PrimitiveHumanoid-v0")
        >>> observation, info = env.reset(seed=0)
        >>> action = int(info["action_mask"].nonzero()[0][1])  # 0 is hold
        >>> observation, reward, terminated, truncated, info = env.step(action)
        >>> terminated, info["primitive"] > 0
        (False, True)
        >>> env.close()
    """

    def __init__(
        self,
        library: Source | Mapping[str, Any] = None,
        *,
        robot: Robot | str | None = None,
        task: str | Task | Mapping[str, Any] = "free",
        dynamics: Dynamics = "simulated",
        discount: float = 0.95,
        flat: bool = False,
        motion: MotionOptions | Mapping[str, Any] | None = None,
        actions: ActionOptions | Mapping[str, Any] | None = None,
        pictures: PictureOptions | Mapping[str, Any] | None = None,
        render_mode: Literal["human", "rgb_array"] | None = None,
        body: Body | str | Mapping[str, Any] = "nominal",
    ) -> None:
        source = LibrarySource(from_plain(library))
        super().__init__(
            source,
            robot=robot,
            task=task,
            dynamics=dynamics,
            discount=discount,
            flat=flat,
            motion=motion,
            actions=actions,
            pictures=pictures,
            render_mode=render_mode,
            body=body,
        )

    def _begin(self, options: Mapping[str, Any]) -> None:
        if self.source.live:
            library = self.source.now()
            self.repertoire.require_room(len(library))
            self.repertoire.update(library)
