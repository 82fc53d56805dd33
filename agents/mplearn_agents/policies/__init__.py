"""Policies over a primitive graph: one idea a file, one interface (`Policy`)."""

from collections.abc import Callable
from functools import partial
from typing import Any

import gymnasium

from .base import Policy as Policy
from .base import legal_actions as legal_actions
from .base import transition_prior as transition_prior
from .experienced import Experienced as Experienced
from .greedy import Greedy as Greedy
from .imitation import Imitation as Imitation
from .mirror import Mirror as Mirror
from .path_to_goal import PathToGoal as PathToGoal
from .path_to_goal import PathToTask as PathToTask
from .random_walk import RandomWalk as RandomWalk
from .search import Search as Search
from .uniform import UniformLegal as UniformLegal

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
    "experienced": Experienced.for_env,
    "mirror": lambda _: Mirror(),
    "search": Search.for_env,
}
