"""The motion primitive graph: which primitive follows which, how often and when [Kulic2012, 3]."""

from __future__ import annotations

from collections.abc import Mapping

from .chains import MergedGraph, find_chains, merged_edges
from .plan import Plan


class TransitionGraph(Plan):
    """Observed transitions between primitives, and the paths, walks and predictions they allow.

    Nodes are the ids of primitives (the tree's leaves), edges are transitions between two
    primitives recognised one right after the other; constructor arguments are those of
    `TransitionCounts`.
    """

    def chains(self) -> tuple[tuple[int, ...], ...]:
        """Group the primitives into chains that only ever follow each other, like SQD -> SQR.

        j joins i where it is i's only successor and i is j's only predecessor. Each primitive is in
        exactly one chain.
        """
        return find_chains(self.ids, self._edges.sources, self._edges.targets)

    def merged(self) -> MergedGraph:
        """Return the graph with each of the `chains` as one node; this graph stays as it is."""
        chains = {chain[0]: chain for chain in self.chains()}
        above = TransitionGraph(order=1, concentration=self.concentration)
        for head in chains:
            above.add_node(head)
        above._edges.add(merged_edges(self._edges, chains))
        return MergedGraph(self.snapshot(), above.snapshot(), chains)

    def grouped(self, group_of: Mapping[int, int]) -> TransitionGraph:
        """Return the graph over groups of primitives, as over inner nodes of the tree.

        Args:
            group_of: Group of each primitive; one that is not named stays a node of its own.
        """
        above = TransitionGraph(
            order=self.order,
            concentration=self.concentration,
            history_capacity=self.history_capacity,
        )
        above.add(self, group_of)
        return above
