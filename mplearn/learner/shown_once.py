"""Motions that were shown once, as primitives of a library: to be performed, not recognised."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from ..body import View
from ..hmm import fit
from ..library import Primitive, PrimitiveLibrary, TreeNode
from ..people import PeopleTree
from ..recording import FloatArray
from ..tree import ROOT
from .chain import Chain
from .snapshot import read_model

FIRST_ID = 1 << 30  # of a motion shown once: far from those of the tree, which are for life
POSTURE_S = 2.0  # of a take in which nothing moves that are kept
N_STATES = 8
STILL_VARIANCE = 1e-6  # least variance of a model of what does not move [m^2, rad^2]


def with_shown_once(
    library: PrimitiveLibrary, tree: PeopleTree, chain: Chain, view: View
) -> PrimitiveLibrary:
    """Return a library that also holds what no primitive was made of, in its order.

    Each such segment is a primitive of one exemplar, named ``once-N`` after its number N. Its
    transitions are those that were seen. The recogniser does not know it, so nothing is ever
    recognised as it.

    Args:
        library: What is known.
        tree: What it was taken of.
        chain: The latest segments.
        view: How the tree sees the library's channels.
    """
    waiting = tree.unplaced()
    once = tuple(
        Primitive.from_exemplars(
            FIRST_ID + number,
            read_model(view, model),
            [view.read(frames)],
            library.rate_hz,
            name=f"once-{number}",
            parent=ROOT,
        )
        for number, (frames, model) in waiting.items()
    )
    graph = library.graph.copy()
    for primitive in once:
        graph.add_node(primitive.id)
    for one, other, duration_s in chain.successions():
        first, second = (
            FIRST_ID + seen.number if seen.number in waiting else seen.primitive
            for seen in (one, other)
        )
        if first is None or second is None or max(first, second) < FIRST_ID:
            continue  # one is forgotten; or both are known, and were counted
        graph.observe(first, second, duration_s)
    return replace(
        library,
        primitives=(*library.primitives, *once),
        graph=graph,
        tree=(*library.tree, *(TreeNode(each.id, ROOT, 1) for each in once)),
    )


def with_takes(library: PrimitiveLibrary, takes: Sequence[FloatArray]) -> PrimitiveLibrary:
    """Return a library that also holds takes as they came, of which a learner made no motion.

    Of a take in which nothing moves the first seconds are enough: they show its posture.

    Args:
        library: What is known.
        takes: In the library's channels, shape (T, D) each.

    Example:
        >>> import numpy as np
        >>> from mplearn import LearnerConfig, MotionLearner
        >>> library = MotionLearner(LearnerConfig(("elbow",), rate_hz=50.0)).snapshot()
        >>> held = np.full((200, 1), 0.7)
        >>> len(library), len(with_takes(library, [held]))
        (0, 1)
    """
    longest = round(POSTURE_S * library.rate_hz)
    pieces = [frames[:longest] for frames in takes if len(frames)]
    once = tuple(
        Primitive.from_exemplars(
            FIRST_ID + number,
            fit([frames], min(N_STATES, len(frames)), variance_floor=STILL_VARIANCE),
            [frames],
            library.rate_hz,
            name=f"once-{number}",
            parent=ROOT,
        )
        for number, frames in enumerate(pieces)
    )
    nodes = tuple(TreeNode(each.id, ROOT, 1) for each in once)
    return replace(library, primitives=(*library.primitives, *once), tree=(*library.tree, *nodes))
