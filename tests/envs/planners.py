"""The humanoid's planner and reference, made when a test asks: collecting compiles no kernels."""

from functools import cache

from mplearn_envs.mechanics import reference_robot, rest_reference
from mplearn_envs.mechanics.reference import Reference, ReferenceRobot
from mplearn_envs.planning import Planner
from mplearn_envs.robot import humanoid


@cache
def planner() -> Planner:
    return Planner(humanoid())


@cache
def humanoid_reference() -> ReferenceRobot:
    return reference_robot(humanoid())


@cache
def at_rest() -> Reference:
    return rest_reference(humanoid())
