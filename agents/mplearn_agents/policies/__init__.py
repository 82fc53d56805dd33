"""Policies over a primitive graph: one idea a file, one interface (`Policy`)."""

from collections.abc import Callable
from functools import partial
from typing import Any

import gymnasium

from .base import Policy as Policy
from .base import legal_actions as legal_actions
from .base import transition_prior as transition_prior
from .clairvoyant import Clairvoyant as Clairvoyant
from .experienced import Experienced as Experienced
from .greedy import Greedy as Greedy
from .hindsight import Foresight as Foresight
from .hindsight import Hindsight as Hindsight
from .imitation import Imitation as Imitation
from .mirror import Mirror as Mirror
from .outlooks import experienced_follower as experienced_follower
from .outlooks import hindsight as hindsight
from .outlooks import oracle_follower as oracle_follower
from .path_to_goal import PathToGoal as PathToGoal
from .path_to_goal import PathToTask as PathToTask
from .random_walk import RandomWalk as RandomWalk
from .search import Search as Search
from .uniform import UniformLegal as UniformLegal


def experienced(env: gymnasium.Env[Any, Any]) -> Policy:
    """Return who has explored first, and acts on what was found out, whatever the task wants."""
    from mplearn_envs.tasks import FollowTask  # MuJoCo is not imported before it is needed

    follows = isinstance(env.unwrapped.task, FollowTask)  # type: ignore[attr-defined]
    return experienced_follower(env) if follows else Experienced.for_env(env)


def oracle(env: gymnasium.Env[Any, Any]) -> Policy:
    """Return who knows the graph: what others miss of its return is their regret.

    With the task ``follow`` it knows how the demonstrator goes on (`KnowsTheGraph`), in an online
    environment what will be known when (`Clairvoyant`).

    Raises:
        InvalidValueError: It is neither.

    Example:
        >>> import gymnasium as gym
        >>> import mplearn_envs
        >>> env = gym.make("mplearn/PrimitiveHumanoid-v0", task="follow", dynamics="kinematic")
        >>> policy = oracle(env)
        >>> observation, info = env.reset(seed=1)
        >>> bool(info["action_mask"][policy.act(observation, info)])
        True
    """
    from mplearn_envs.environment.online import OnlinePrimitiveHumanoidEnv

    online = isinstance(env.unwrapped, OnlinePrimitiveHumanoidEnv)
    return Clairvoyant(env) if online else oracle_follower(env)


#: All policies by name, each made for an environment.
POLICIES: dict[str, Callable[[gymnasium.Env[Any, Any]], Policy]] = {
    "random": lambda _: RandomWalk(),
    "uniform": lambda _: UniformLegal(),
    "greedy": lambda _: Greedy(),
    "imitation": Imitation.for_env,
    "likely-path": partial(PathToTask.for_env, prefer="likely"),
    "short-path": partial(PathToTask.for_env, prefer="short"),
    "quick-path": partial(PathToTask.for_env, prefer="quick"),
    "pooled-path": partial(PathToTask.for_env, prefer="quick", pooled=True),
    "experienced": experienced,
    "mirror": lambda _: Mirror(),
    "hindsight": hindsight,
    "oracle": oracle,
    "search": Search.for_env,
}
