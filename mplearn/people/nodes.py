"""The nodes of all people's trees as one tree: primitives, and a leaf a person below each."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence

from ..tree import ROOT, Change, Node, PrimitiveTree, Reparent
from .leaf import Leaf


def nodes_of(
    leaves: Sequence[Leaf],
    trees: Mapping[int, PrimitiveTree],
    numbers: Mapping[int, Mapping[int, int]],
    above: Mapping[int, Node],
    parents: Mapping[int, int],
    n_seen: int,
) -> tuple[Node, ...]:
    """Return all nodes, by id: the root, what was split, primitives, and leaves below those.

    Args:
        leaves: Of all people.
        trees: Each person's tree.
        numbers: Number here of each segment of a person's tree, by person.
        above: Nodes above primitives: what was split.
        parents: The node above each of those and each primitive.
        n_seen: Segments seen, of all people.
    """
    nodes = {ROOT: Node(ROOT, None, 0)}
    for id, node in above.items():
        nodes[id] = Node(id, parents[id], node.born_at, history=node.history)
    for id in sorted({leaf.primitive for leaf in leaves}):
        nodes[id] = Node(id, parents[id], n_seen)
    for person, tree in trees.items():
        waiting = tree.node(ROOT)
        nodes[ROOT].members += tuple(numbers[person][n] for n in waiting.members)
        nodes[ROOT].n_placed += waiting.n_placed
        nodes[ROOT].n_frames += waiting.n_frames
    for leaf in leaves:
        own = trees[leaf.person].node(leaf.local)
        members = tuple(numbers[leaf.person][n] for n in own.members)
        node = nodes[leaf.primitive]
        node.members += members
        node.n_placed += own.n_placed
        node.n_frames += own.n_frames
        node.born_at = min(node.born_at, own.born_at)
        node.frozen |= own.frozen
        if leaf.id != leaf.primitive:
            nodes[leaf.id] = Node(
                leaf.id,
                leaf.primitive,
                own.born_at,
                members,
                own.matrix,
                own.n_placed,
                own.n_frames,
                history=own.history,
                frozen=own.frozen,
            )
    for node in nodes.values():
        if node.parent is not None:
            nodes[node.parent].children += (node.id,)
    return tuple(nodes[id] for id in sorted(nodes))


def tidied(above: dict[int, Node], parents: dict[int, int], primitives: Collection[int]) -> Change:
    """Take nodes out that are above one node only, or none, and hang that one higher.

    Args:
        above: Nodes above primitives; changed in place, as is what follows.
        parents: The node above each of those, and of each primitive.
        primitives: Ids of the primitives.
    """
    for id in [id for id in parents if id not in above and id not in primitives]:
        del parents[id]
    change = Change()
    while True:
        children = {id: [c for c, p in parents.items() if p == id] for id in above}
        lone = next((id for id, below in children.items() if len(below) < 2), None)
        if lone is None:
            return change
        for child in children[lone]:
            parents[child] = parents[lone]
            change = change.then(Change(reparented=(Reparent(child, parents[lone]),)))
        del above[lone], parents[lone]
        change = change.then(Change(removed=(lone,)))
