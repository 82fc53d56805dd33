"""What a person did to the primitives of several people is undone; what was learned since stays."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import NamedTuple

from ..state import Count, State
from ..tree import ROOT, Exchange, Merge, Node, NodesEdit
from ..tree.placement import Change
from .constraints import Key
from .editing import settled
from .people_state import PeopleState
from .sharing import Sharing
from .sharing_state import AboveState, SharingState


class LeafNames(NamedTuple):
    """Who a leaf is; attributes are those of `Leaf`."""

    person: Count
    local: Count
    id: Count
    primitive: Count
    founded: Count


@dataclass(frozen=True, eq=False)
class SharedSide(State):
    """What was said of some leaves at one moment.

    Attributes:
        leaves: The leaves.
        numbers: Person, number in that person's tree, and here, of their exemplars.
        together: Pairs of leaves that are one motion.
        apart: Pairs that are not.
        above: Nodes above primitives.
        parents: The node above each.
    """

    leaves: tuple[LeafNames, ...] = ()
    numbers: tuple[tuple[Count, Count, Count], ...] = ()
    together: tuple[tuple[tuple[Count, Count], tuple[Count, Count]], ...] = ()
    apart: tuple[tuple[tuple[Count, Count], tuple[Count, Count]], ...] = ()
    above: tuple[AboveState, ...] = ()
    parents: tuple[tuple[Count, Count], ...] = ()


@dataclass(frozen=True, eq=False)
class TreeEdit(State):
    """What an edit changed in a person's tree."""

    person: Count
    nodes: NodesEdit


@dataclass(frozen=True, eq=False)
class PeopleEdit(State):
    """What an edit changed: in each person's tree, and in what people share.

    Attributes:
        trees: The trees of those who had one.
        before: What was shared before; None as long as there was one person.
        after: What was shared then.

    Example:
        >>> import numpy as np
        >>> from mplearn.people import PeopleTree
        >>> from mplearn.tree import TreeConfig
        >>> tree = PeopleTree(TreeConfig(), n_channels=2, rate_hz=100.0)
        >>> lift = np.outer(np.sin(np.linspace(0, np.pi, 60)), [1.0, 0.5])
        >>> placed = [tree.insert(k * lift, 0) for k in (1.0, 1.01, 0.99, -1.0, -1.01)]
        >>> before, leaves = tree.state(), tree.leaves
        >>> change = tree.remove(leaves[0])
        >>> edit = PeopleEdit.between(before, tree.state())
        >>> leaves[0] in edit.primitives, len(tree.leaves)
        (True, 1)
    """

    trees: tuple[TreeEdit, ...]
    before: SharedSide | None
    after: SharedSide | None

    @classmethod
    def between(cls, before: PeopleState, after: PeopleState) -> PeopleEdit:
        """Return what differs between the trees of one moment and another."""
        trees = tuple(
            TreeEdit(old.person, NodesEdit.between(old.tree.nodes, new.tree.nodes, new.tree.floor))
            for old, new in zip(before.trees, after.trees, strict=True)
        )
        if before.sharing is None or after.sharing is None:
            return cls(trees, None, None)
        old, new = (_side(each, trees) for each in (before.sharing, after.sharing))
        return cls(trees, _less(old, new, trees), _less(new, old, trees))

    def reversed(self) -> PeopleEdit:
        """Return the edit that undoes this one."""
        trees = tuple(TreeEdit(each.person, each.nodes.reversed()) for each in self.trees)
        return PeopleEdit(trees, self.after, self.before)

    @property
    def primitives(self) -> set[int]:
        """Ids of the primitives that it is about."""
        if self.before is None or self.after is None:
            return {id for each in self.trees for id in each.nodes.leaves}
        return {leaf.primitive for side in (self.before, self.after) for leaf in side.leaves}


def _side(state: SharingState, trees: Iterable[TreeEdit]) -> SharedSide:
    """Return what is said of leaves, and the numbers of exemplars that an edit is about."""
    held = {
        (each.person, n)
        for each in trees
        for node in (*each.nodes.before, *each.nodes.after)
        for n in node.members.tolist()
    }
    return SharedSide(
        tuple(
            LeafNames(leaf.person, leaf.local, leaf.id, leaf.primitive, leaf.founded)
            for leaf in state.leaves
        ),
        tuple(
            (own.person, there, here)
            for own in state.numbers
            for there, here in zip(own.there.tolist(), own.here.tolist(), strict=True)
            if (own.person, there) in held
        ),
        state.constraints.together,
        state.constraints.apart,
        state.above,
        state.parents,
    )


def _less(one: SharedSide, other: SharedSide, trees: Iterable[TreeEdit]) -> SharedSide:
    """Return what is said in one and not in the other, and of leaves that changed in a tree."""
    changed = {(each.person, id) for each in trees for id in each.nodes.leaves}
    leaves, together, apart = set(other.leaves), set(other.together), set(other.apart)
    ids, parents = {node.id for node in other.above}, set(other.parents)
    return SharedSide(
        tuple(e for e in one.leaves if e not in leaves or (e.person, e.local) in changed),
        one.numbers,
        tuple(pair for pair in one.together if pair not in together),
        tuple(pair for pair in one.apart if pair not in apart),
        tuple(node for node in one.above if node.id not in ids),
        tuple(each for each in one.parents if each not in parents),
    )


def exchanged(sharing: Sharing, edit: PeopleEdit, exchanges: Mapping[int, Exchange]) -> Exchange:
    """Let what people share follow an edit that was undone in their trees.

    Args:
        sharing: What they share; it knows the trees as they are now.
        edit: What is to go, and what is to come.
        exchanges: What came of it in each person's tree.
    """
    gone_side, back_side = edit.before, edit.after
    if gone_side is None or back_side is None:  # there was one person: ids were those of the tree
        gone_side, back_side = (_alone(edit, at) for at in (0, 1))
    old = {(leaf.person, leaf.local): leaf for leaf in gone_side.leaves}
    new = {(leaf.person, leaf.local): leaf for leaf in back_side.leaves}
    before = {leaf.key: leaf.primitive for leaf in sharing.leaves}
    for person, there, here in back_side.numbers:
        sharing.numbers.setdefault(person, {}).setdefault(there, here)
    sharing.constraints.exchange(gone_side, SharedSide())
    _follow_leaves(sharing, old, new, exchanges)
    sharing.constraints.exchange(SharedSide(), back_side, [leaf.key for leaf in sharing.leaves])
    _follow_above(sharing, gone_side, back_side)
    return _settled(sharing, before, exchanges)


def _alone(edit: PeopleEdit, at: int) -> SharedSide:
    """Return what would have been said of the leaves of the only person there was."""
    leaves: list[LeafNames] = []
    numbers: list[tuple[int, int, int]] = []
    above: list[AboveState] = []
    parents: list[tuple[int, int]] = []
    for each in edit.trees:
        nodes = (each.nodes.before, each.nodes.after)[at]
        for node in (node for node in nodes if node.id != ROOT):
            parents.append((node.id, node.parent or ROOT))
            numbers += [(each.person, n, n) for n in node.members.tolist()]
            if node.children:
                above.append(AboveState(node.id, node.born_at, node.history))
            else:
                leaves.append(LeafNames(each.person, node.id, node.id, node.id, node.id))
    return SharedSide(tuple(leaves), tuple(numbers), (), (), tuple(above), tuple(parents))


def _follow_leaves(
    sharing: Sharing,
    old: Mapping[Key, LeafNames],
    new: Mapping[Key, LeafNames],
    exchanges: Mapping[int, Exchange],
) -> None:
    known = {leaf.key: leaf for leaf in sharing.leaves}
    for person, found in exchanges.items():
        for local in found.back:
            if (person, local) not in known:
                leaf = sharing.new_leaf(person, local)
                names = new.get(leaf.key)
                if names is None:
                    leaf.primitive = leaf.founded = sharing.new_id()
                    sharing.parents[leaf.primitive] = ROOT
                    continue
                leaf.id, leaf.primitive, leaf.founded = names[2:]
        for local in found.changed:
            if (person, local) in known:
                sharing.look_again(known[person, local])
        for local, heir in found.heirs.items():
            sharing.constraints.follow({(person, local): () if heir is None else [(person, heir)]})
            if (person, local) in known:
                sharing.drop_leaf(known[person, local])
    for key, names in new.items():
        now, was = known.get(key), old.get(key)
        if now is not None and was is not None and now.primitive == was.primitive:
            now.id, now.primitive, now.founded = names[2:]


def _follow_above(sharing: Sharing, gone: SharedSide, back: SharedSide) -> None:
    kept = {node.id for node in back.above}
    for node in gone.above:
        if node.id not in kept:
            sharing.above.pop(node.id, None)
            sharing.parents.pop(node.id, None)
    for node in back.above:
        sharing.above.setdefault(node.id, Node(node.id, None, node.born_at, history=node.history))
    wanted = dict(back.parents)
    for id in {*sharing.primitives, *sharing.above}:
        parent = wanted.get(id, sharing.parents.get(id, ROOT))
        sharing.parents[id] = parent if parent in sharing.above else ROOT


def _settled(
    sharing: Sharing, before: Mapping[Key, int], exchanges: Mapping[int, Exchange]
) -> Exchange:
    """Say what came of primitives, and let what waits and names follow."""
    now = {leaf.key: leaf.primitive for leaf in sharing.leaves}
    gone = sorted(set(before.values()) - set(now.values()))
    heirs: dict[int, int | None] = {}
    for id in gone:
        votes: Counter[int] = Counter()
        for key in (key for key, primitive in before.items() if primitive == id):
            heir = exchanges[key[0]].heirs.get(key[1]) if key[0] in exchanges else None
            at = now.get(key if heir is None else (key[0], heir))
            if at is not None:
                votes[at] += 1
        heirs[id] = min(votes, key=lambda each: (-votes[each], each)) if votes else None
    merges = tuple(Merge(heir, id) for id, heir in heirs.items() if heir is not None)
    settled(sharing, Change(merges=merges))
    moved = [
        (sharing.numbers[person][n], now[person, local])
        for person, found in exchanges.items()
        for n, local in found.moved
        if (person, local) in now and n in sharing.numbers[person]
    ]
    back = sorted(set(now.values()) - set(before.values()))
    return Exchange(tuple(back), heirs, tuple(moved))
