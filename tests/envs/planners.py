"""The humanoid's planner, made when a test asks: collecting tests compiles no kernels of plans."""

from functools import cache

from mplearn_envs.planning import Planner
from mplearn_envs.robot import humanoid


@cache
def planner() -> Planner:
    return Planner(humanoid())
