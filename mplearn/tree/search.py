"""The search for the node that a segment belongs to; tree and recogniser decide by it alike."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import Any

import numpy as np

from ..recording import FloatArray, IntArray
from .bank import Exemplar, ExemplarBank
from .config import TreeConfig
from .node import Node
from .placement import ROOT, Match


class NodeIndex:
    """What the search knows of the nodes below the root.

    Args:
        config: Rules of the tree.
        bank: Holds the exemplars of the nodes.
        nodes: The nodes; the root among them is left out.
        limit: Largest radius.
        before: An index of the same bank; what it knows of nodes that have not changed is taken
            over.

    Attributes:
        factor: Radii that are used over those of the rules.
    """

    def __init__(
        self,
        config: TreeConfig,
        bank: ExemplarBank,
        nodes: Iterable[Node],
        limit: float,
        before: NodeIndex | None = None,
    ) -> None:
        below = sorted((node for node in nodes if node.parent is not None), key=lambda n: n.id)
        if config.n_candidates:
            below = [node for node in below if node.is_leaf]
        self.config = config
        self.limit = limit
        self.factor: float = 1.0 if before is None else before.factor
        self.ids = np.array([node.id for node in below], dtype=np.int64)
        self.parents = np.array([node.parent for node in below], dtype=np.int64)
        self.leaves = np.array([node.is_leaf for node in below], dtype=np.bool_)
        self.members = [list(node.members) for node in below]
        self.diameters = np.array([node.diameter for node in below])
        n_features = bank.n_channels * config.form.n_points
        self.means = np.zeros((len(below), n_features))
        known = {} if before is None else {int(id): k for k, id in enumerate(before.ids)}
        for k, (id, members) in enumerate(zip(self.ids, self.members, strict=True)):
            old = known.get(int(id))
            if before is not None and old is not None and before.members[old] == members:
                self.means[k] = before.means[old]
            else:
                self.means[k] = bank.mean_profile(members)

    def update(self, node: Node, bank: ExemplarBank) -> None:
        """Take note of a node's new exemplars."""
        k = int(np.searchsorted(self.ids, node.id))
        self.members[k] = list(node.members)
        self.diameters[k] = node.diameter
        self.means[k] = bank.mean_profile(node.members)

    def scale(self, but: int | None = None) -> float:
        """Return the median diameter of the leaves, but for one: how much executions vary.

        It is 0 where there is no leaf.
        """
        chosen = self.leaves & (self.ids != but) if but is not None else self.leaves
        return float(np.median(self.diameters[chosen])) if chosen.any() else 0.0

    def radii(self) -> FloatArray:
        """Return the radius of each node: eq. 6, capped by the scale that the leaves share."""
        radii = self.config.reach * self.diameters
        if np.isfinite(self.config.reach_cap):
            radii = np.minimum(radii, min(self.config.reach_cap * self.scale(), self.limit))
        return np.asarray(self.factor * radii)

    def radius(self, id: int) -> float:
        """Return the radius of one node."""
        return float(self.radii()[int(np.searchsorted(self.ids, id))])

    def search(self, exemplar: Exemplar, bank: ExemplarBank) -> list[Match]:
        """Return the nodes that a segment was compared with, best first.

        The first belongs to it if its ratio is at most 1.
        """
        if not len(self.ids):
            return []
        if self.config.n_candidates:
            return self._compare(exemplar, bank, self._candidates(exemplar, bank))
        return self._descend(exemplar, bank)

    def _candidates(self, exemplar: Exemplar, bank: ExemplarBank) -> IntArray:
        """Return the leaves nearest by mean trajectory."""
        if len(self.ids) <= self.config.n_candidates:
            return np.arange(len(self.ids))
        offsets = self.means - bank.profile(exemplar)
        nearness = np.einsum("kf,kf->k", offsets, offsets)
        return np.sort(np.argsort(nearness, kind="stable")[: self.config.n_candidates])

    def _compare(self, exemplar: Exemplar, bank: ExemplarBank, places: IntArray) -> list[Match]:
        members = [self.members[k] for k in places]
        row = bank.distances(exemplar, [m for group in members for m in group])
        radii = self.radii()
        matches = []
        first = 0
        for k, group in zip(places, members, strict=True):
            distance = float(mean_nearest(row[first : first + len(group)], self.config.n_nearest))
            first += len(group)
            ratio = distance / max(float(radii[k]), 1e-12)
            matches.append(Match(int(self.ids[k]), distance ** (1 / self.config.power), ratio))
        return sorted(matches, key=lambda match: (match.ratio, match.node))

    def _descend(self, exemplar: Exemplar, bank: ExemplarBank) -> list[Match]:
        found: list[Match] = []
        level = ROOT
        while True:
            places = np.flatnonzero(self.parents == level)
            if not len(places):
                return found
            matches = self._compare(exemplar, bank, places)
            inside = [match for match in matches if match.ratio <= 1]
            if not inside:
                return found + matches
            nearest = min(inside, key=lambda match: (match.distance, match.node))
            found = [nearest, *found]
            level = nearest.node

    def state(self) -> dict[str, Any]:
        """Return everything as plain values and arrays."""
        return {
            "limit": self.limit,
            "factor": self.factor,
            "ids": self.ids.copy(),
            "parents": self.parents.copy(),
            "leaves": self.leaves.copy(),
            "members": [list(group) for group in self.members],
            "diameters": self.diameters.copy(),
        }

    @classmethod
    def from_state(cls, config: TreeConfig, bank: ExemplarBank, state: dict[str, Any]) -> NodeIndex:
        """Return the index that `state` described."""
        index = cls(config, bank, (), float(state["limit"]))
        index.factor = float(state.get("factor", 1.0))
        index.ids = np.array(state["ids"], dtype=np.int64)
        index.parents = np.array(state["parents"], dtype=np.int64)
        index.leaves = np.array(state["leaves"], dtype=np.bool_)
        index.members = [[int(number) for number in group] for group in state["members"]]
        index.diameters = np.array(state["diameters"], dtype=np.float64)
        means: Sequence[FloatArray] = [bank.mean_profile(group) for group in index.members]
        if means:
            index.means = np.stack(means)
        return index


def mean_nearest(distances: FloatArray, n_nearest: int) -> FloatArray:
    """Return the mean of the smallest distances along the last axis, (..., k) -> (...)."""
    return np.asarray(np.sort(distances, axis=-1)[..., :n_nearest].mean(axis=-1))
