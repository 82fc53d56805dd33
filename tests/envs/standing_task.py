"""A task on the standing library, and the best way to do it."""

import gymnasium
import numpy as np
from standing_env import ID, legal
from standing_library import standing_library


def make(task, **options):
    options = {"dynamics": "kinematic"} | options
    return gymnasium.make(ID, library=standing_library(), task=task, **options)


def shortest_way(env, info, slots):
    """Return the actions that lead to one of the slots with the fewest primitives (brute force)."""
    repertoire = env.unwrapped.repertoire
    ways = [[slot] for slot in legal(info) if slot]
    while ways:
        way = ways.pop(0)
        if way[-1] in slots:
            return way
        after = repertoire.after(repertoire.primitive(way[-1]))
        ways += [[*way, slot] for slot in np.flatnonzero(after.mask).tolist() if slot]
        assert len(way) < 8
    raise AssertionError("no way")


def named(info):
    """Return the slots that a task names."""
    slots = info["task"]["slots"]
    assert slots.dtype == np.int64
    return slots[slots >= 0].tolist()
