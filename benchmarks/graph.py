"""Searching a graph of 10,000 primitives above first, against searching all of it, and networkx."""

from functools import partial

import networkx as nx
import numpy as np

from mplearn.graph import LevelledGraph, TransitionGraph

from .interleaved import interleaved

GROUPS, SIZE, NEIGHBOURS = 100, 100, 4


def kinds_of_motion(rng: np.random.Generator) -> TransitionGraph:
    """Groups of primitives that mostly follow each other, with ways to a few other groups."""
    graph = TransitionGraph(order=1)
    for id in range(GROUPS * SIZE):
        graph.add_node(id)
    near = [rng.choice(GROUPS, NEIGHBOURS, replace=False) for _ in range(GROUPS)]
    for id in range(GROUPS * SIZE):
        group = id // SIZE
        followers = (group * SIZE + rng.integers(0, SIZE, 4)).tolist()
        if rng.random() < 0.1:
            followers.append(int(rng.choice(near[group])) * SIZE + int(rng.integers(SIZE)))
        for follower in followers:
            graph.observe(id, follower, 1.0)
    return graph


def rows() -> list[tuple[str, str, str, str]]:
    rng = np.random.default_rng(0)
    graph = kinds_of_motion(rng)
    levelled = LevelledGraph(graph, [{id: 10**6 + id // SIZE for id in graph.ids}])
    whole = LevelledGraph(graph, [])
    asked = rng.integers(0, len(graph), (10, 2)).tolist()
    peer = partial(nx.dijkstra_path, graph.view(), weight="cost")
    took = interleaved(
        {
            "above": lambda: [levelled.path(*each) for each in asked],
            "whole": lambda: [whole.path(*each) for each in asked],
            "networkx": lambda: [peer(*each) for each in asked],
        },
        rounds=3,
    )
    few = np.mean([levelled.path(*each).n_expanded for each in asked])
    many = np.mean([whole.path(*each).n_expanded for each in asked])
    above, size = took["above"] / len(asked), f"{GROUPS * SIZE} primitives"
    return [
        (
            f"path above first, {said} ({size})",
            f"{1e3 * above:.1f} ms",
            f"{1e3 * took[other] / len(asked):.1f} ms",
            f"{took[other] / took['above']:.1f} x",
        )
        for other, said in (("whole", "against all at once"), ("networkx", "against networkx"))
    ] + [
        (
            f"nodes looked at ({size})",
            f"{few:.0f}",
            f"{many:.0f}, all at once",
            f"{many / few:.1f} x",
        )
    ]
