"""A recorded skeleton as a graph: what lies at one place is one node, and branches are compared."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from ..mocap.placing.hanging import hanging, longest_way
from ..recording import FloatArray, Skeleton

TOGETHER = 0.006  # joints closer than this share of the skeleton's extent are one
LIKE, LIKE_FLAT = 0.2, 0.012  # how unlike two bones of a pair may be: relative, of the extent


@dataclass(frozen=True, eq=False)
class JointTree:
    """The joints of a skeleton, those at one place taken together.

    Attributes:
        joints: Joints of the skeleton at each node, the uppermost first, length N.
        edges: Nodes that a bone joins to each node, in no order of rank, length N.
        points: Where the nodes are in some frames, shape (T, N, 3) [m].
        rest: Where they are while all angles are zero, shape (N, 3) [m].
        names: Names of the joints at each node, length N.
    """

    joints: tuple[tuple[int, ...], ...]
    edges: tuple[tuple[int, ...], ...]
    points: FloatArray
    rest: FloatArray
    names: tuple[tuple[str, ...], ...]

    @classmethod
    def of(cls, skeleton: Skeleton, points: FloatArray) -> JointTree:
        """Return the graph of a skeleton.

        Args:
            skeleton: Its joints, without any that only show how a joint is turned.
            points: Where they are in some frames, shape (T, J, 3) [m].
        """
        parents, lengths = hanging(points, skeleton.parents)
        near = TOGETHER * longest_way(parents, lengths)
        node_of: list[int] = []
        members: list[list[int]] = []
        for joint, parent in enumerate(parents):
            if parent >= 0 and lengths[joint] <= near:
                node_of.append(node_of[parent])
                members[node_of[joint]].append(joint)
            else:
                node_of.append(len(members))
                members.append([joint])
        edges: list[list[int]] = [[] for _ in members]
        for node, (first, *_) in enumerate(members):
            if parents[first] >= 0:
                edges[node].append(node_of[parents[first]])
                edges[node_of[parents[first]]].append(node)
        firsts = [first for first, *_ in members]
        return cls(
            joints=tuple(map(tuple, members)),
            edges=tuple(map(tuple, edges)),
            points=points[:, firsts],
            rest=rest_positions(skeleton)[firsts],
            names=tuple(tuple(skeleton.names[j] for j in group) for group in members),
        )

    def __len__(self) -> int:
        """Number of nodes."""
        return len(self.joints)

    def length(self, a: int, b: int) -> float:
        """Return how far apart two nodes usually are [m]."""
        return float(np.median(_norm(self.points[:, a] - self.points[:, b])))

    @cached_property
    def extent(self) -> float:
        """Length of the longest way along bones [m]."""
        return max((self.longest(a, -1)[0] for a in range(len(self))), default=0.0)

    def longest(self, node: int, away_from: int) -> tuple[float, tuple[int, ...]]:
        """Return the longest way from a node that does not go by another: length, nodes."""
        best: tuple[float, tuple[int, ...]] = (0.0, (node,))
        for other in self.edges[node]:
            if other != away_from:
                length, way = self.longest(other, node)
                length += self._bones[node, other]
                if length > best[0]:
                    best = (length, (node, *way))
        return best

    def beyond(self, node: int, away_from: int) -> frozenset[int]:
        """Return a node and all that hangs on it on the side away from another."""
        found = {node}
        for other in self.edges[node]:
            if other != away_from:
                found |= self.beyond(other, node)
        return frozenset(found)

    def way(self, a: int, b: int) -> tuple[int, ...]:
        """Return the nodes from one to another, both included."""
        stack: list[tuple[int, int, tuple[int, ...]]] = [(a, -1, (a,))]
        while stack:
            node, before, way = stack.pop()
            if node == b:
                return way
            stack.extend((n, node, (*way, n)) for n in self.edges[node] if n != before)
        return ()

    def paired(self, node: int, a: int, b: int) -> tuple[float, tuple[tuple[int, int], ...]]:
        """Return the longest ways, bone for bone alike, down two branches that part at a node.

        Returns:
            Their length [m], and the pairs of nodes on them; empty where the first bones differ.
        """
        return self._alike(node, a, node, b)

    def _alike(
        self, from_a: int, a: int, from_b: int, b: int
    ) -> tuple[float, tuple[tuple[int, int], ...]]:
        one, other = self._bones[from_a, a], self._bones[from_b, b]
        if abs(one - other) > LIKE * max(one, other) + LIKE_FLAT * self.extent:
            return 0.0, ()
        best: tuple[float, tuple[tuple[int, int], ...]] = (0.0, ())
        for below_a in self.edges[a]:
            for below_b in self.edges[b]:
                if below_a != from_a and below_b != from_b:
                    found = self._alike(a, below_a, b, below_b)
                    if found[0] > best[0]:
                        best = found
        return best[0] + 0.5 * (one + other), ((a, b), *best[1])

    @cached_property
    def _bones(self) -> dict[tuple[int, int], float]:
        return {(a, b): self.length(a, b) for a in range(len(self)) for b in self.edges[a]}


def rest_positions(skeleton: Skeleton) -> FloatArray:
    """Return where joints are while all angles are zero, shape (J, 3) [m]."""
    places = np.array(skeleton.offsets, dtype=np.float64)
    for joint, parent in enumerate(skeleton.parents):
        if parent >= 0:
            places[joint] += places[parent]
    return places


def _norm(vectors: FloatArray) -> FloatArray:
    lengths: FloatArray = np.sqrt((vectors * vectors).sum(axis=-1))
    return lengths
