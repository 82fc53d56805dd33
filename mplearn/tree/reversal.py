"""What a person did to a tree is undone, and what was learned since stays.

An edit is known by the nodes that it changed, as they were before and after. To undo it, the nodes
of before come back in the place of those of after; exemplars and counts that came since go to the
node of before that they are nearest to. The same with before and after exchanged does it again.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Annotated, NamedTuple

import numpy as np

from ..recording import FloatArray, IntArray
from ..state import Array, State
from .nodes.node import Node, NodeState, without_one
from .nodes.node_table import NodeTable
from .nodes.search import mean_nearest
from .nodes.structure import Structure
from .placement import ROOT


@dataclass(frozen=True, eq=False)
class NodesEdit(State):
    """The nodes that an edit changed.

    Attributes:
        before: As they were.
        after: As they were then.
        floor: Variance floor of the models by which distances were measured, shape (D,).

    Example:
        >>> import numpy as np
        >>> from mplearn.tree import PrimitiveTree, TreeConfig
        >>> tree = PrimitiveTree(TreeConfig(), n_channels=2, rate_hz=100.0)
        >>> lift = np.outer(np.sin(np.linspace(0, np.pi, 60)), [1.0, 0.5])
        >>> placed = [tree.insert(k * lift) for k in (1.0, 1.01, 0.99, -1.0, -1.01, -0.99)]
        >>> before, leaves = tree.state(), tree.leaves
        >>> change = tree.remove(leaves[1])
        >>> after = tree.state()
        >>> NodesEdit.between(before.nodes, after.nodes, after.floor).leaves == {leaves[1]}
        True
    """

    before: tuple[NodeState, ...]
    after: tuple[NodeState, ...]
    floor: Annotated[FloatArray, Array("d", low=1e-30)]

    @classmethod
    def between(
        cls, before: Iterable[NodeState], after: Iterable[NodeState], floor: FloatArray
    ) -> NodesEdit:
        """Return what differs between the nodes of one moment and another."""
        old, new = {node.id: node for node in before}, {node.id: node for node in after}
        changed = [id for id in {**old, **new} if old.get(id) is not new.get(id)]
        return cls(
            tuple(old[id] for id in changed if id in old),
            tuple(new[id] for id in changed if id in new),
            floor,
        )

    def reversed(self) -> NodesEdit:
        """Return the edit that undoes this one."""
        return NodesEdit(self.after, self.before, self.floor)

    @property
    def leaves(self) -> set[int]:
        """Ids of the leaves that it is about: not those of which only the place changed."""
        now = {node.id: node for node in self.after}
        same = {
            node.id
            for node in self.before
            if node.id in now and _content(node) == _content(now[node.id])
        }
        nodes = (*self.before, *self.after)
        return {node.id for node in nodes if node.id != ROOT and not node.children} - same


class Exchange(NamedTuple):
    """What came of undoing an edit.

    Attributes:
        back: Leaves that are there again.
        heirs: Leaves that are gone, each with the leaf that has what it had learned since; None
            where that is forgotten.
        moved: Segments that are in another leaf than before: number and leaf.
        changed: Leaves with other exemplars than before.

    Example:
        >>> import numpy as np
        >>> from mplearn.tree import NodesEdit, PrimitiveTree, TreeConfig
        >>> tree = PrimitiveTree(TreeConfig(), n_channels=2, rate_hz=100.0)
        >>> lift = np.outer(np.sin(np.linspace(0, np.pi, 60)), [1.0, 0.5])
        >>> placed = [tree.insert(k * lift) for k in (1.0, 1.01, 0.99, -1.0, -1.01, -0.99)]
        >>> before, leaves = tree.state(), tree.leaves
        >>> change = tree.merge(*leaves)
        >>> after = tree.state()
        >>> edit = NodesEdit.between(before.nodes, after.nodes, after.floor)
        >>> tree.exchange(edit.reversed()).back == (leaves[1],), tree.leaves == leaves
        (True, True)
    """

    back: tuple[int, ...] = ()
    heirs: Mapping[int, int | None] = {}
    moved: tuple[tuple[int, int], ...] = ()
    changed: tuple[int, ...] = ()


def exchange(structure: Structure, edit: NodesEdit, when: int) -> Exchange:
    """Put the nodes after an edit in the place of those before it.

    Args:
        structure: The tree.
        edit: The nodes that are to go, and those that are to come: ``before`` goes.
        when: Segments seen.
    """
    return _Reversal(structure, edit, when).do()


class _Reversal:
    def __init__(self, structure: Structure, edit: NodesEdit, when: int) -> None:
        self.structure, self.memory, self.when = structure, structure.memory, when
        self.floor = edit.floor
        self.stood_for: Mapping[int, tuple[int, int]] = {}
        self.old = {node.id: node for node in edit.before}
        self.new = {node.id: node for node in edit.after}
        nodes = structure.nodes
        self.back = [id for id in self.new if id not in self.old and id not in nodes]
        self.both = [id for id in self.new if id in self.old and id in nodes]
        leaves = [id for id in (*self.back, *self.both) if id != ROOT and not self.new[id].children]
        self.leaves = [id for id in leaves if self._is_other(id)]
        ends = [id for id in self.old if id not in self.new and id in nodes]
        for id in (*ends, *(id for id in leaves if id in self.both)):
            ends += [each for each in self._below(id) if each not in ends]
        self.gone = [id for id in ends if id not in self.new]
        self.was = {id: nodes[id].is_leaf for id in (*self.gone, *self.both)}
        inner = [id for id in self.both if id != ROOT and self.new[id].children]
        self.ended = [id for id in (*self.gone, *inner) if self.was[id]]  # as leaves

    def do(self) -> Exchange:
        nodes = self.structure.nodes
        known = {n for node in (*self.old.values(), *self.new.values()) for n in node.members}
        sources = [*self.ended, *(id for id in self.leaves if self.was.get(id, False))]
        gained = {id: [n for n in nodes[id].members if n not in known] for id in sources}
        placed = self._gains(sources)
        homes = self._homes(gained)
        shares = {id: self._shared(id, gained[id], homes, placed[id]) for id in sources}
        self.stood_for = self._stood_for_since(sources)
        moved = self._restore(gained, homes)
        heirs = {id: self._heir(id, gained, homes) for id in self.ended}
        for shared in shares.values():
            for home, (n, n_frames) in shared.items():
                nodes[home].n_placed += n
                nodes[home].n_frames += n_frames
        self._hang()
        return Exchange(
            back=tuple(id for id in self.leaves if id not in self.was or not self.was[id]),
            heirs=heirs,
            moved=tuple(moved),
            changed=tuple(id for id in self.leaves if self.was.get(id, False)),
        )

    # ---- what was learned since

    def _is_other(self, id: int) -> bool:
        """Whether a leaf has other exemplars than it had, or was none."""
        old = self.old.get(id)
        return old is None or bool(old.children) or _content(old) != _content(self.new[id])

    def _below(self, id: int) -> list[int]:
        """Return what goes with a node: not what hangs on an inner one that stays."""
        found, pending = [], list(self.structure.nodes[id].children)
        while pending:
            at = pending.pop()
            if at in self.new and self.new[at].children:
                continue
            found.append(at)
            pending += self.structure.nodes[at].children
        return found

    def _gains(self, sources: Sequence[int]) -> dict[int, tuple[int, int]]:
        """Return how many segments, and frames, came to each leaf since."""
        gains = {}
        nodes = self.structure.nodes
        for id in sources:
            node, at = nodes[id], id
            while at not in self.old and at != ROOT:  # born of one of those since
                at = nodes[at].parent or ROOT
            before = self.old.get(at)
            if before is None or at == id:
                n, frames = (before.n_placed, before.n_frames) if before else (0, 0)
            else:
                among = [nodes[each] for each in sources if at in self._above(each)]
                share = node.n_placed / max(sum(each.n_placed for each in among), 1)
                n, frames = round(share * before.n_placed), round(share * before.n_frames)
            gains[id] = max(node.n_placed - n, 0), max(node.n_frames - frames, 0)
        return gains

    def _above(self, id: int) -> list[int]:
        found, at = [], self.structure.nodes[id].parent
        while at is not None:
            found.append(at)
            at = self.structure.nodes[at].parent
        return found

    def _homes(self, gained: Mapping[int, Sequence[int]]) -> dict[int, int]:
        """Return the leaf that each new exemplar goes to: the nearest."""
        bank, n_nearest = self.memory.bank, self.structure.config.n_nearest
        if len(self.leaves) == 1:
            return {n: self.leaves[0] for group in gained.values() for n in group}
        for id in self.leaves:
            for number, blob in self.new[id].exemplars():
                self.memory.recall(number, blob)
        homes = {}
        for number in (n for group in gained.values() for n in group):
            exemplars = [self.new[id].members.tolist() for id in self.leaves]
            rows = [bank.distances(bank[number], group) for group in exemplars]
            far = [float(mean_nearest(row[None], n_nearest)[0]) for row in rows]
            homes[number] = self.leaves[int(np.argmin(far))] if far else ROOT
        for id in self.leaves:
            self.memory.release(*self.new[id].members.tolist())
        return {number: id for number, id in homes.items() if id != ROOT}

    def _heir(
        self, id: int, gained: Mapping[int, Sequence[int]], homes: Mapping[int, int]
    ) -> int | None:
        """Return the leaf that most of what a leaf held is in."""
        if not self.leaves:
            return None
        votes = Counter(dict.fromkeys(self.leaves, 0))
        votes.update(homes[n] for n in gained.get(id, ()) if n in homes)
        held = set(self.old[id].members.tolist()) if id in self.old else set()
        for each in self.leaves:
            votes[each] += len(held & set(self.new[each].members.tolist()))
        return max(votes, key=lambda each: (votes[each], self.new[each].n_placed, -each))

    def _shared(
        self, id: int, gained: Sequence[int], homes: Mapping[int, int], gain: tuple[int, int]
    ) -> dict[int, tuple[int, int]]:
        """Return which leaf how many of the segments, and frames, go to that came to a leaf since.

        Each goes where the exemplar goes that is it, or stands for it.
        """
        node, then = self.structure.nodes[id], self.old.get(id)
        votes = {home: np.zeros(2) for home in self.leaves}
        for number in gained:
            if number in homes:
                votes[homes[number]] += self._weight(number, node.stood_for)
        for home in self.leaves:
            if then is None:
                break
            of_home = set(self.new[home].members.tolist())
            stood_for = {number: of for number, *of in then.stood_for}
            for number in of_home.intersection(node.members):
                votes[home] += self._weight(number, node.stood_for)
            for number, blob in then.exemplars():
                if number in of_home:
                    votes[home] -= 1, len(blob.array)
                    votes[home] -= stood_for.get(number, (0, 0))
        table = np.array([votes[home] for home in self.leaves]).reshape(-1, 2).clip(min=0.0)
        if not table.any():
            new = (self.new[home] for home in self.leaves)
            table = np.array([(each.n_placed, each.n_frames) for each in new]).reshape(-1, 2)
        shares = zip(_parts(gain[0], table[:, 0]), _parts(gain[1], table[:, 1]), strict=True)
        return dict(zip(self.leaves, shares, strict=True))

    def _weight(self, number: int, stood_for: Mapping[int, tuple[int, int]]) -> IntArray:
        """Return how many segments, and frames, an exemplar is and stands for."""
        n, n_frames = stood_for.get(number, (0, 0))
        return np.array([1 + n, self.structure.length_of(number) + n_frames])

    def _stood_for_since(self, sources: Sequence[int]) -> dict[int, tuple[int, int]]:
        """Return what exemplars stand for of what came since."""
        since = {}
        for id in sources:
            then = {n: of for n, *of in self.old[id].stood_for} if id in self.old else {}
            for number, (n, n_frames) in self.structure.nodes[id].stood_for.items():
                n_then, n_frames_then = then.get(number, (0, 0))
                since[number] = max(n - n_then, 0), max(n_frames - n_frames_then, 0)
        return since

    # ---- the nodes

    def _restore(
        self, gained: Mapping[int, Sequence[int]], homes: Mapping[int, int]
    ) -> list[tuple[int, int]]:
        """Make nodes what they were, with what came since; return segments that moved."""
        nodes, memory = self.structure.nodes, self.memory
        held = {
            n: id for id in (*self.gone, *self.leaves) if id in nodes for n in nodes[id].members
        }
        stale = [list(nodes[id].members) for id in self.gone]
        for id in (*self.back, *self.both):
            new, node = self.new[id], nodes.get(id)
            if node is not None and (id == ROOT or not self._is_other(id)):
                old = self.old[id]
                node.whole = node.whole if old.whole == new.whole else new.whole
                node.frozen = node.frozen if old.frozen == new.frozen else new.frozen
                said = set(old.apart)
                if id == ROOT:
                    node.n_placed += new.n_placed - old.n_placed
                    node.n_frames += new.n_frames - old.n_frames
                node.apart = (node.apart - (said - set(new.apart))) | (set(new.apart) - said)
                continue
            own = [n for group in gained.values() for n in group if homes.get(n) == id]
            if node is not None and new.children and not self.was[id]:
                own = [n for n in node.members if n not in self.old[id].members]
            for number, blob in new.exemplars():
                memory.recall(number, blob)
            memory.hold(*own)
            if node is not None:
                stale.append(list(node.members))
            history = node.history if node else new.history
            nodes[id] = Node.from_state(new)
            nodes[id].history = (*history, ("undone", self.when))
            self._extend(nodes[id], own)
        for id in self.gone:
            del nodes[id]
        mine = {n for id in self.leaves for n in nodes[id].members}
        self._take_from_others(mine)
        memory.release(*(n for group in stale for n in group))
        self.structure.nodes = NodeTable(nodes[id] for id in sorted(nodes))
        return [
            (n, id)
            for id in self.leaves
            for n in self.structure.nodes[id].members
            if held.get(n) != id
        ]

    def _extend(self, node: Node, own: Sequence[int]) -> None:
        """Measure a node's distances where that is needed, and let it take exemplars."""
        bank = self.memory.bank
        if not np.array_equal(bank.floor, self.floor):
            node.matrix = bank.matrix(node.members)
        for number in own:
            node.add(number, bank.distances(bank[number], node.members))
        for number in self.stood_for.keys() & set(node.members) if node.is_leaf else ():
            node.stand_for(number, *self.stood_for[number])
        gone = node.thin(self.structure.config.max_exemplars, self.structure.length_of)
        self.memory.release(*gone)

    def _take_from_others(self, mine: set[int]) -> None:
        """Take exemplars from leaves, or the root, that they have come to since."""
        nodes = self.structure.nodes
        for node in [n for n in nodes.values() if n.is_leaf or n.id == ROOT]:
            places = [i for i, number in enumerate(node.members) if number in mine]
            keeps = node.id == ROOT or len(places) < len(node.members)
            if node.id in self.leaves or node.frozen or not places or not keeps:
                continue
            self.memory.release(*node.remove(places))
            self.structure.index.put(node, self.memory.bank)

    def _hang(self) -> None:
        """Put nodes below those that were above them, as far as those are there."""
        nodes, structure = self.structure.nodes, self.structure
        above = {id: node.parent for id, node in (self.old | self.new).items()}
        inner = {ROOT, *(id for id in self.new if self.new[id].children)}
        inner |= {id for id, node in nodes.items() if not node.is_leaf and id not in self.leaves}
        for node in nodes.values():
            if node.id == ROOT:
                continue
            parent = self.new[node.id].parent if node.id in self.new else node.parent
            while parent not in nodes or parent not in inner:
                parent = above.get(ROOT if parent is None else parent)
                parent = ROOT if parent is None else parent
            node.parent = parent
        for node in nodes.values():
            mine = [id for id in nodes if nodes[id].parent == node.id]
            order = [*(self.new[node.id].children if node.id in self.new else ()), *node.children]
            places = {id: place for place, id in reversed(list(enumerate(order)))}
            node.children = tuple(sorted(mine, key=lambda id: (places.get(id, len(order)), id)))
        for id in [id for id in self.new if id in nodes and id in inner - {ROOT}]:
            if not nodes[id].children:  # what was below it is gone since
                node = nodes[nodes[id].parent or ROOT]
                node.children = without_one(node.children, id)
                self.memory.release(*nodes.pop(id).members)
        structure.reindex()
        structure.tune()


def _parts(total: int, weights: FloatArray) -> list[int]:
    """Return a whole number parted by weights."""
    ends = np.round(total * np.cumsum(weights) / max(weights.sum(), 1.0)).astype(np.int64)
    parts: list[int] = np.diff(ends, prepend=0).tolist()
    return parts


def _content(node: NodeState) -> tuple[object, ...]:
    return node.members.tolist(), bool(node.children)
