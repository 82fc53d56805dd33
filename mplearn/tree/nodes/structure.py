"""The nodes of the tree, and the operations that keep them whole: nothing here decides anything."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from ...recording import FloatArray, IntArray
from ..config import TreeConfig
from ..exemplars.memory import SegmentMemory
from ..placement import ROOT, Change, Merge, Reparent, Split
from .node import Node, without_one
from .node_table import NodeTable
from .search import NodeIndex


class Structure:
    """Nodes by id. Every operation keeps counts, distances, held segments and the index true.

    Args:
        config: Rules of the tree.
        memory: Holds the segments.

    Attributes:
        nodes: The nodes by id, in the order of their birth.
        next_id: Id of the node that is formed next.
        least: Members from which on a cluster becomes a node.
        index: What the search knows of them.
    """

    def __init__(self, config: TreeConfig, memory: SegmentMemory) -> None:
        self.config = config
        self.memory = memory
        self.nodes = NodeTable([Node(ROOT, None, 0)])
        self.next_id = ROOT + 1
        self.least = config.min_exemplars
        self.index = NodeIndex(config, memory.bank)

    @property
    def root(self) -> Node:
        """The root: what was not placed anywhere else."""
        return self.nodes[ROOT]

    def reindex(self) -> None:
        """Let the search know all nodes anew."""
        self.index = NodeIndex(self.config, self.memory.bank)
        for node in self.nodes.values():
            self.index.put(node, self.memory.bank)

    def _note(self, *changed: Node) -> None:
        """Let the search know what has changed in some nodes, or that they are gone."""
        for node in changed:
            if node.id in self.nodes:
                self.index.put(node, self.memory.bank)
            else:
                self.index.drop(node.id)
        self.tune()

    def tune(self) -> None:
        """Let radii follow the scale of all motion."""
        self.index.limit = self.config.reach_limit * self.memory.scale()

    def length_of(self, number: int) -> int:
        """Return the frames of a segment that is held."""
        return len(self.memory.frames[number])

    @property
    def groups(self) -> dict[int, Sequence[int]]:
        """Numbers of the segments in each node."""
        return {id: node.members for id, node in self.nodes.items()}

    def homes(self, numbers: Sequence[int]) -> IntArray:
        """Return the ids of the nodes that the search knows these segments in, shape (n,).

        `ROOT` where it knows one in none.
        """
        return np.array(self.index.homes(numbers), np.int64)

    def remeasured(self, matrices: Mapping[int, FloatArray]) -> None:
        """Take over distances in the nodes that were measured again."""
        for id, node in self.nodes.items():
            node.matrix = matrices[id]
        self.index.remeasured(self.nodes, self.memory.bank)
        self.tune()

    def remeasure(self) -> None:
        """Measure all distances again."""
        for node in self.nodes.values():
            node.matrix = self.memory.bank.matrix(node.members)
        self.reindex()
        self.tune()

    def add(self, node: Node, number: int) -> None:
        """Put a segment into a node; the least informative exemplars of a full one go.

        A frozen one knows it, and stays as it is; so does one that holds it already.
        """
        if node.frozen or number in node.members:
            return
        bank = self.memory.bank
        node.add(number, bank.distances(bank[number], node.members))
        node.n_placed += 1
        node.n_frames += self.length_of(number)
        self.memory.hold(number)
        if node.id == ROOT:
            excess = len(node.members) - self.config.max_unplaced
            self.memory.release(*node.remove(list(range(excess))))
        else:
            self._thin(node)
            self.index.put(node, bank)

    def child(self, parent: Node, members: Sequence[int], when: int) -> Node:
        """Form a node below another from some of its exemplars."""
        child = Node(self.next_id, parent.id, when, history=(("born", when),))
        self.next_id += 1
        places = [parent.members.index(number) for number in members]
        child.members = tuple(members)
        child.matrix = parent.matrix[np.ix_(places, places)]
        child.n_placed = len(members)
        child.n_frames = sum(map(self.length_of, members))
        self.memory.hold(*members)
        if parent.id == ROOT:
            self.memory.release(*parent.remove(places))
        else:
            parent.settled = parent.settled.union(members)
        self.nodes[child.id] = child
        parent.children += (child.id,)
        self._thin(child)
        self._note(parent, child)
        return child

    def take_in(self, leaf: Node, numbers: Sequence[int]) -> Change:
        """Move segments that wait in the root into a leaf."""
        for number in numbers:
            self.add(leaf, number)
            self.memory.release(*self.root.remove([self.root.members.index(number)]))
        return Change(moved=tuple((number, leaf.id) for number in numbers))

    def shed(self, leaf: Node, numbers: Sequence[int]) -> Change:
        """Move exemplars of a leaf to those that wait in the root."""
        leaf.remove([leaf.members.index(number) for number in numbers])
        leaf.n_placed -= len(numbers)
        leaf.n_frames -= sum(map(self.length_of, numbers))
        for number in numbers:
            self.add(self.root, number)
        self.memory.release(*numbers)
        self._note(leaf)
        return Change(moved=tuple((number, ROOT) for number in numbers))

    def split(self, leaf: Node, groups: Sequence[Sequence[int]], when: int) -> Change:
        """Form a leaf of each group of a leaf's exemplars; it becomes the node above them."""
        leaf.history += (("split", when),)
        n_kept = len(leaf.members)
        born: list[int] = []
        moved: list[tuple[int, int]] = []
        for group in groups:
            child = self.child(leaf, group, when)
            child.n_placed = max(len(group), round(len(group) / n_kept * leaf.n_placed))
            child.n_frames = round(leaf.n_frames / leaf.n_placed * child.n_placed)
            child.stood_for = {n: of for n, of in leaf.stood_for.items() if n in child.members}
            born.append(child.id)
            moved += [(number, child.id) for number in group]
        return Change(tuple(born), (Split(leaf.id, tuple(born)),), moved=tuple(moved))

    def merge(self, older: Node, younger: Node, joint: FloatArray, when: int) -> Change:
        """Let one leaf absorb another, ``joint`` being the distances among their exemplars."""
        older.matrix = joint
        older.members += younger.members
        twice = [i for i, n in enumerate(older.members) if n in older.members[:i]]
        stood_for = {**younger.stood_for, **older.stood_for}
        self.memory.release(*older.remove(twice))  # in both since something was undone
        older.stood_for = stood_for
        older.n_placed += younger.n_placed
        older.n_frames += younger.n_frames
        older.history += (("merged", when),)
        older.apart |= younger.apart
        for node in self.nodes.values():
            if younger.id in node.apart:
                node.apart = (node.apart - {younger.id}) | {older.id}
        self._thin(older)  # before the search looks at it
        change = self._unhang(younger, when)
        self._note(older)
        merged = Change(merges=(Merge(older.id, younger.id),))
        return merged.then(change._replace(removed=change.removed[1:]))

    def joint(self, first: Node, second: Node) -> FloatArray:
        """Return the distances among the exemplars of two nodes, those of the first before."""
        across = self.memory.bank.across(first.members, second.members)
        return np.block([[first.matrix, across], [across.T, second.matrix]])

    def remove(self, leaf: Node, when: int, *, forget: bool) -> Change:
        """Take a leaf out; its exemplars are forgotten, or wait in the root again."""
        change = self._unhang(leaf, when)
        if not forget:
            for number in leaf.members:
                self.add(self.root, number)
            change = change._replace(moved=tuple((number, ROOT) for number in leaf.members))
        self.memory.release(*leaf.members)
        self.tune()
        return change

    def reparent(self, node: Node, parent: Node, when: int) -> Change:
        """Hang a node below another inner node, which learns its exemplars."""
        above = self.nodes[node.parent if node.parent is not None else ROOT]
        above.children = without_one(above.children, node.id)
        places = [i for i, number in enumerate(above.members) if number in node.members]
        if above.id != ROOT:
            self.memory.release(*above.remove(places))
        node.parent = parent.id
        node.history += (("moved", when),)
        parent.children += (node.id,)
        if parent.id != ROOT:
            bank = self.memory.bank
            for number in [n for n in node.members if n not in parent.members]:
                parent.add(number, bank.distances(bank[number], parent.members))
                self.memory.hold(number)
            parent.settled = parent.settled.union(node.members)
            self._thin(parent)
        change = Change(reparented=(Reparent(node.id, parent.id),)).then(self._tidy(above, when))
        self._note(node, parent, above)
        return change

    def _unhang(self, leaf: Node, when: int) -> Change:
        """Take a leaf from its place; its exemplars stay held."""
        del self.nodes[leaf.id]
        parent = self.nodes[leaf.parent if leaf.parent is not None else ROOT]
        parent.children = without_one(parent.children, leaf.id)
        self._note(leaf, parent)
        return Change(removed=(leaf.id,)).then(self._tidy(parent, when))

    def _tidy(self, node: Node, when: int) -> Change:
        """Take an inner node out that is above one node only, or none, and hang that one higher."""
        if node.id == ROOT or len(node.children) > 1 or set(node.members) - node.settled:
            return Change()
        above = self.nodes[node.parent if node.parent is not None else ROOT]
        del self.nodes[node.id]
        above.children = without_one(above.children, node.id)
        self.memory.release(*node.members)
        change = Change(removed=(node.id,))
        for id in node.children:
            child = self.nodes[id]
            child.parent = above.id
            child.history += (("moved", when),)
            above.children += (id,)
            change = change.then(Change(reparented=(Reparent(id, above.id),)))
        self._note(node, above, *(self.nodes[id] for id in node.children))
        return change.then(self._tidy(above, when))

    def _thin(self, node: Node) -> None:
        self.memory.release(*node.thin(self.config.max_exemplars, self.length_of))
