"""Where on the graph the robot can be, how soon, and how it stands there."""

from __future__ import annotations

import heapq
from typing import NamedTuple

import numpy as np

from mplearn_envs.mechanics.reference import Reference, rest_reference
from mplearn_envs.skills.action_choices import HOLD, Choices
from mplearn_envs.skills.repertoire import Repertoire

from .sensors import Measured, Sensors
from .simulation import Simulation


class Arrival(NamedTuple):
    """The soonest end of a primitive.

    Attributes:
        time_s: Least time until then [s].
        reference: Where the reference robot is then.
        measured: How it stands.
    """

    time_s: float
    reference: Reference
    measured: Measured


def earliest_arrivals(repertoire: Repertoire, choices: Choices) -> dict[int, Arrival]:
    """Follow the legal transitions from rest in order of time (Dijkstra, on plans).

    Args:
        repertoire: What the robot can perform.
        choices: What may be done first.

    Returns:
        The soonest end of each primitive that can be reached without holding.
    """
    robot = repertoire.robot
    sensors = Sensors(Simulation(robot))
    found: dict[int, Arrival] = {}
    queue: list[tuple[float, int, Reference]] = []  # time, which offer, where it leads
    offered: list[int] = []

    def offer(time_s: float, here: Reference, following: Choices) -> None:
        for slot in np.flatnonzero(following.mask).tolist():
            id = repertoire.primitive(slot)
            if slot != HOLD and id is not None and id not in found:
                plan = repertoire.skills.plan(here, id)
                heapq.heappush(queue, (time_s + plan.duration_s, len(offered), plan.end))
                offered.append(id)

    offer(0.0, rest_reference(robot), choices)
    while queue:
        time_s, order, end = heapq.heappop(queue)
        id = offered[order]
        if id not in found:
            found[id] = Arrival(time_s, end, sensors.at(end.q))
            offer(time_s, end, repertoire.after(id))
    return found
