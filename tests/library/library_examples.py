"""A small library of made-up primitives between four postures."""

from functools import cache

import numpy as np

from mplearn.graph import TransitionGraph
from mplearn.hmm import fit
from mplearn.library import Primitive, PrimitiveLibrary, TreeNode

RATE = 100.0
CHANNELS = tuple(f"joint_{i}" for i in range(5))
_PAIRS = ((0, 1), (1, 0), (0, 2), (2, 0), (1, 2), (2, 1))


def demonstrations(source, target, seed, n=5):
    rng = np.random.default_rng(seed)
    postures = np.random.default_rng(0).normal(0, 0.6, (4, len(CHANNELS)))
    for n_frames in rng.integers(80, 130, n):
        s = np.linspace(0, 1, n_frames)[:, None]
        course = 10 * s**3 - 15 * s**4 + 6 * s**5
        motion = postures[source] + (postures[target] - postures[source]) * course
        yield motion + 0.003 * rng.standard_normal(motion.shape)


def example_primitive(id, source, target):
    motions = list(demonstrations(source, target, seed=id))
    return Primitive.from_exemplars(id, fit(motions, 8), motions, RATE, parent=100)


@cache
def example_library():
    primitives = tuple(example_primitive(id, *pair) for id, pair in enumerate(_PAIRS))
    graph = TransitionGraph()
    for id in range(len(_PAIRS)):
        graph.add_node(id)
    for i, (_, end) in enumerate(_PAIRS):
        for j, (begin, _) in enumerate(_PAIRS):
            if end == begin:
                for k in range(1 + (i + j) % 3):
                    graph.observe(i, j, 1.0 + 0.1 * k, before=[])
    tree = (TreeNode(100, None, 30), *(TreeNode(p.id, 100, 5) for p in primitives))
    return PrimitiveLibrary(primitives, graph, CHANNELS, RATE, body="example", tree=tree)
