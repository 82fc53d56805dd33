"""From what is being learned to a library, which is frozen."""

from __future__ import annotations

from ..body import View
from ..graph import TransitionGraph
from ..hmm import LeftRightHMM
from ..library import Primitive, PrimitiveLibrary, TreeNode
from ..people import PeopleTree


def library_of(
    tree: PeopleTree,
    graph: TransitionGraph,
    view: View,
    channels: tuple[str, ...],
    rate_hz: float,
    body: str,
) -> PrimitiveLibrary:
    """Return the primitives and transitions that are known now.

    What several people do is one primitive, with a node of the tree for each person below it.

    Args:
        tree: Its leaves become primitives.
        graph: Their transitions.
        view: How the tree sees the channels.
        channels: What the primitives are made of.
        rate_hz: Frames per second [1/s].
        body: Name of the body whose features the channels are; empty for none.
    """
    primitives = []
    for id in tree.leaves:
        node, seen = tree.node(id), tree.model(id)
        model = LeftRightHMM(
            view.read(seen.means), view.read_variances(seen.variances), seen.log_stay
        )
        primitives.append(
            Primitive.from_exemplars(
                id,
                model,
                [view.read(frames) for frames in tree.exemplars(id)],
                rate_hz,
                n_exemplars=node.n_placed,
                mean_duration_s=node.n_frames / node.n_placed / rate_hz,
                parent=node.parent,
            )
        )
    return PrimitiveLibrary(
        primitives=tuple(primitives),
        graph=graph,
        channels=channels,
        rate_hz=rate_hz,
        body=body,
        tree=tuple(TreeNode(node.id, node.parent, node.n_placed) for node in tree.nodes),
        recogniser=tree.recogniser(),
    )
