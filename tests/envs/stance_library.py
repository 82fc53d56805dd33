"""Motions in which the robot steps: stances apart, a heel raised, a foot in the air."""

from __future__ import annotations

from functools import cache

import numpy as np
from planners import at_rest, humanoid_reference
from standing_library import CHANNELS, KICK, RATE_HZ, STANDING_M, posture

from mplearn.graph import TransitionGraph
from mplearn.hmm import fit
from mplearn.library import Primitive, PrimitiveLibrary
from mplearn_envs.planning.stance import stand


def shown(place, heel, base):
    """Return the features of a posture, shape (3 + n,), and check that it is one.

    Args:
        place: The left foot in the right one's frame: x, y [m] and yaw [rad].
        heel: By how much each heel is raised [rad].
        base: Height above standing [m], roll and pitch of the base [rad].
    """
    target = at_rest().target.copy()
    target[:3] = STANDING_M + base[0], base[1], base[2]
    q, worst = stand(humanoid_reference(), np.array(place), np.array(heel), target, 0.5)
    assert worst < 1e-3
    return np.concatenate((target[:3], q[7:]))


def between(first, last, seconds=1.2):
    """Return a minimum-jerk motion from one posture to another, shape (T, 3 + n)."""
    x = np.linspace(0.0, 1.0, round(seconds * RATE_HZ) + 1)[:, None]
    share = x**3 * (10 - 15 * x + 6 * x**2)
    return first * (1 - share) + last * share


@cache
def stance_library() -> PrimitiveLibrary:
    """Return lunges, side lunges and kicks, each of which was seen to follow each."""
    split, wide = (-0.5, 0.2, 0.0), (0.0, 0.6, 0.0)
    upright = posture({})
    motions = {
        "lunge": between(
            shown(split, (0.5, 0.0), (-0.1, 0, 0.1)), shown(split, (0.9, 0.0), (-0.3, 0, 0.1))
        ),
        "side lunge": between(
            shown(wide, (0.0, 0.0), (-0.1, 0, 0.1)), shown(wide, (0.0, 0.0), (-0.25, 0, 0.1))
        ),
        "kick": between(upright, posture(KICK), 0.8),
        "retract": between(posture(KICK), upright, 0.8),
    }
    rng, primitives, graph = np.random.default_rng(0), [], TransitionGraph()
    for id, (name, frames) in enumerate(motions.items(), start=1):
        exemplars = [frames + rng.normal(scale=0.002, size=len(CHANNELS)) for _ in range(3)]
        hmm = fit(exemplars, 10, variance_floor=1e-4)
        primitives.append(Primitive.from_exemplars(id, hmm, exemplars, RATE_HZ, name=name))
        graph.add_node(id)
    for before in range(1, len(motions) + 1):
        for after in range(1, len(motions) + 1):
            graph.observe(before, after, 1.0)
    return PrimitiveLibrary(tuple(primitives), graph, CHANNELS, RATE_HZ, "robot")
