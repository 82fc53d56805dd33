"""Walks on the primitive graph: a policy chooses, the robot performs.

As a program: ``mplearn perform --policy random --steps 20 --video walk.mp4``, or ``--task goal
--policy search --episodes 5``. What it does, to copy and to change::

    import gymnasium as gym
    import mplearn_envs
    from mplearn_agents.policies import POLICIES

    env = gym.make("mplearn/PrimitiveHumanoid-v0", task="goal")
    policy = POLICIES["search"](env)
    for episode in range(5):
        policy.reset(seed=episode)
        observation, info = env.reset(seed=episode)
        over = False
        while not over:
            action = policy.act(observation, info)
            observation, reward, terminated, truncated, info = env.step(action)
            over = terminated or truncated
        print("reached" if info["is_success"] else "not reached")
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import gymnasium
import numpy as np

from mplearn.errors import InvalidValueError
from mplearn.recording import FloatArray, IntArray

from .policies import Policy

HOLD = 0


@dataclass(frozen=True)
class WalkStep:
    """One macro step.

    Attributes:
        action: What the policy chose.
        primitive: Id of the primitive that was performed; None where the robot held its posture.
        name: Its name; "hold" where there was none.
        duration_s: How long it took [s].
        reward: What it earned.
        illegal: Whether the action was not allowed.
        fallen: Whether the robot fell.
        tracking_rmse_rad: Root mean square of the joints' tracking error [rad].
        cog_deviation_m: Largest distance of the centre of gravity from the middle of the soles [m].
        zmp_margin_m: Least distance of the zero-moment point from the edge of the soles [m].

    Example:
        >>> import gymnasium as gym
        >>> import mplearn_envs
        >>> from mplearn_agents.policies import Greedy
        >>> env = gym.make("mplearn/PrimitiveHumanoid-v0", dynamics="kinematic")
        >>> step = walk(env, Greedy(), steps=1, seed=1).steps[-1]
        >>> step.primitive is not None, step.illegal, step.fallen
        (True, False, False)
    """

    action: int
    primitive: int | None
    name: str
    duration_s: float
    reward: float
    illegal: bool
    fallen: bool
    tracking_rmse_rad: float
    cog_deviation_m: float
    zmp_margin_m: float


@dataclass(frozen=True, eq=False)
class WalkResult:
    """A walk.

    Attributes:
        steps: All macro steps, holds too.
        postures: The robot's qpos at each moment recorded, shape (F, nq); F = 0 where nothing was.
        step_of: Step to which each posture belongs, shape (F,).
        rate_hz: Recorded postures per second [1/s].
        episodes: How many episodes came to their end.
        successes: In how many of them the task was solved; None if it does not say.

    Example:
        >>> import gymnasium as gym
        >>> import mplearn_envs
        >>> from mplearn_agents.policies import Greedy
        >>> env = gym.make("mplearn/PrimitiveHumanoid-v0", dynamics="kinematic")
        >>> result = walk(env, Greedy(), steps=2, seed=1)
        >>> result.duration_s > 0, result.postures.shape[0]  # nothing was recorded
        (True, 0)
    """

    steps: tuple[WalkStep, ...]
    postures: FloatArray
    step_of: IntArray
    rate_hz: float
    episodes: int = 0
    successes: int | None = None

    @property
    def primitives(self) -> tuple[int, ...]:
        """Ids of the primitives in the order of their performance."""
        return tuple(step.primitive for step in self.steps if step.primitive is not None)

    @property
    def falls(self) -> int:
        """How often the robot fell."""
        return sum(step.fallen for step in self.steps)

    @property
    def duration_s(self) -> float:
        """How long the walk took [s]."""
        return sum(step.duration_s for step in self.steps)


def walk(
    env: gymnasium.Env[Any, Any],
    policy: Policy,
    steps: int,
    seed: int | None = None,
    *,
    episodes: int | None = None,
    record: bool = False,
    show: Callable[[int], None] = lambda done: None,
) -> WalkResult:
    """Let a policy walk until it has performed a number of primitives, or episodes.

    After a fall, or where the task or the environment ends the episode, it starts again. Holding
    does not count; a policy that holds in nine of ten steps is stopped at ten times the steps.

    Args:
        env: A `mplearn/PrimitiveHumanoid-v0`, or another environment with its actions and infos.
        policy: Who chooses.
        steps: How many primitives to perform.
        seed: Seed of the environment and the policy.
        episodes: How many episodes to play to their end, whatever ``steps`` is.
        record: Whether to keep the robot's postures, as often as the environment's
            ``frame_rate_hz``, so that a film can be made.
        show: Called after each step with how many primitives, or episodes, are done.

    Raises:
        InvalidValueError: ``steps`` or ``episodes`` is less than 1.

    Example:
        >>> import gymnasium as gym
        >>> import mplearn_envs
        >>> from mplearn_agents.policies import RandomWalk
        >>> env = gym.make("mplearn/PrimitiveHumanoid-v0", dynamics="kinematic")
        >>> result = walk(env, RandomWalk(seed=1), steps=3, seed=1)
        >>> len(result.primitives), result.falls
        (3, 0)
    """
    if steps < 1:
        raise InvalidValueError(f"a walk has at least 1 step, not {steps}")
    if episodes is not None and episodes < 1:
        raise InvalidValueError(f"a walk has at least 1 episode, not {episodes}")
    base: Any = env.unwrapped
    done: list[WalkStep] = []
    postures: list[FloatArray] = []
    step_of: list[int] = []

    def keep() -> None:
        postures.append(base.simulation.data.qpos.copy())
        step_of.append(len(done))

    if record:
        base.frame_callback = keep
    policy.reset(seed)
    observation, info = env.reset(seed=seed)
    performed = n_ended = 0
    outcomes: list[bool] = []

    def goes_on() -> bool:
        if episodes is not None:
            return n_ended < episodes
        return performed < steps and len(done) < 10 * steps

    while goes_on():
        action = policy.act(observation, info)
        observation, reward, terminated, truncated, info = env.step(action)
        held = action == HOLD or info["illegal"]
        done.append(
            WalkStep(
                action=action,
                primitive=None if held else info["primitive"],
                name="hold" if held else info["primitive_name"],
                duration_s=info["duration_s"],
                reward=float(reward),
                illegal=info["illegal"],
                fallen=bool(info["fallen"]),
                tracking_rmse_rad=info["tracking_rmse_rad"],
                cog_deviation_m=info["cog_deviation_m"],
                zmp_margin_m=info["zmp_margin_m"],
            )
        )
        performed += not held
        if terminated or truncated:
            n_ended += 1
            if "is_success" in info:
                outcomes.append(bool(info["is_success"]))
            observation, info = env.reset()
        show(performed if episodes is None else n_ended)
    if record:
        base.frame_callback = None
    return WalkResult(
        steps=tuple(done),
        postures=np.array(postures),
        step_of=np.array(step_of, dtype=np.int64),
        rate_hz=float(base.pictures.frame_rate_hz) if record else 0.0,
        episodes=n_ended,
        successes=sum(outcomes) if len(outcomes) == n_ended else None,
    )
