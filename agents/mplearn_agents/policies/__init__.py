"""Policies over a primitive graph: one idea a file, one interface (`Policy`)."""

from collections.abc import Callable

from .base import Policy as Policy
from .base import legal_actions as legal_actions
from .base import transition_prior as transition_prior
from .greedy import Greedy as Greedy
from .path_to_goal import PathToGoal as PathToGoal
from .random_walk import RandomWalk as RandomWalk
from .uniform import UniformLegal as UniformLegal

#: The policies that need nothing but the environment's info, by name.
POLICIES: dict[str, Callable[[], Policy]] = {
    "random": RandomWalk,
    "uniform": UniformLegal,
    "greedy": Greedy,
}
