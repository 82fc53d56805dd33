"""How soon each primitive can have been performed: the best that any agent can do (Dijkstra)."""

from __future__ import annotations

import heapq
from typing import NamedTuple

import numpy as np

from .action_choices import Choices
from .repertoire import Repertoire


class Way(NamedTuple):
    """The quickest way to the end of a primitive.

    Attributes:
        time_s: How long it takes [s].
        n_steps: How many primitives it has, this one included.
    """

    time_s: float
    n_steps: int


def soonest(repertoire: Repertoire, start: int | None, choices: Choices) -> dict[int, Way]:
    """Return the quickest way to each primitive that can be reached without holding.

    Nothing is simulated: with plans taken at their word, the times are exact, for where the robot
    stands after a primitive does not depend on how it came there.

    Args:
        repertoire: What the robot can perform.
        start: The primitive that has just ended; None is the robot at rest.
        choices: What may be done first.
    """
    found: dict[int, Way] = {}
    queue: list[tuple[float, int, int]] = []  # time, steps, which

    def offer(before: int | None, way: Way, following: Choices) -> None:
        for id in performed(repertoire, following):
            if id not in found:
                time_s = way.time_s + repertoire.skills.transition_s(before, id)
                heapq.heappush(queue, (time_s, way.n_steps + 1, id))

    offer(start, Way(0.0, 0), choices)
    while queue:
        time_s, n_steps, id = heapq.heappop(queue)
        if id not in found:
            found[id] = Way(time_s, n_steps)
            offer(id, found[id], repertoire.after(id))
    return found


def performed(repertoire: Repertoire, choices: Choices) -> list[int]:
    """Return the ids of the primitives that are legal."""
    slots = np.flatnonzero(choices.mask).tolist()
    return [id for slot in slots if (id := repertoire.primitive(slot)) is not None]
