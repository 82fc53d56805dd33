"""Group models: a model of each node's motions, of the kind that the rules ask for."""

from __future__ import annotations

from typing import TypeAlias

import numpy as np

from ..hmm import (
    FactorialHMM,
    LeftRightHMM,
    SemiMarkovHMM,
    add_chain,
    em_step,
    fit,
    fit_semi_markov,
    needs_more_chains,
)
from ..recording import FloatArray
from .config import TreeConfig
from .nodes.node import Node
from .nodes.structure import Structure
from .placement import ROOT

_FLOOR = 0.1  # smallest standard deviation of a model, as a share of all motion's
_EM_STEPS = 5  # after each chain that is added
Model: TypeAlias = LeftRightHMM | FactorialHMM | SemiMarkovHMM
_Chains: TypeAlias = LeftRightHMM | FactorialHMM
_Members = tuple[int, ...]


class GroupModels:
    """Models of nodes, fitted when they are asked for; what they are follows from the tree's state.

    Args:
        config: Rules of the tree.
        structure: The nodes.
    """

    def __init__(self, config: TreeConfig, structure: Structure) -> None:
        self._config = config
        self._structure = structure
        self._kept: dict[int, tuple[tuple[_Members, _Members], Model]] = {}
        self._floor_of_bank = self._variances = np.zeros(0)

    @property
    def basis(self) -> FloatArray | None:
        """What models depend on besides their exemplars: one object as long as that is the same.

        None where it is other nodes, too.
        """
        return self._floor() if self._config.max_chains == 1 else None

    def of(self, id: int) -> Model:
        """Return a node's model: of one chain, or of as many as it needs to be told apart.

        With explicit durations it is a hidden semi-Markov model.

        A motion starts as one chain. While it cannot be told apart from the leaf whose mean
        trajectory is nearest, both get another one, fitted to what the others leave unexplained
        [Kulic2008b].
        """
        self._floor()
        node = self._structure.nodes[id]
        neighbour = self._neighbour(node) if self._config.max_chains > 1 else None
        key = tuple(node.members), tuple(neighbour.members) if neighbour else ()
        known, model = self._kept.get(id, (None, None))
        if model is None or known != key:
            model = self._apart(*key) if neighbour else self._alone(key[0])
            self._kept[id] = key, model
        return model

    def of_segment(self, number: int) -> LeftRightHMM:
        """Return the model of one segment by itself."""
        return self._single((number,))

    def forget(self) -> None:
        """Let the models of nodes that are gone go, once they are many."""
        nodes = self._structure.nodes
        if len(self._kept) > len(nodes):
            self._kept = {id: model for id, model in self._kept.items() if id in nodes}

    def _alone(self, members: _Members) -> LeftRightHMM | SemiMarkovHMM:
        if self._config.durations == "geometric":
            return self._single(members)
        frames = self._frames(members)
        return fit_semi_markov(frames, self._n_states(frames), variance_floor=self._floor())

    def _single(self, members: _Members) -> LeftRightHMM:
        frames = self._frames(members)
        return fit(frames, self._n_states(frames), variance_floor=self._floor())

    def _apart(self, members: _Members, others: _Members) -> _Chains:
        own, other = self._frames(members), self._frames(others)
        model: _Chains = self._single(members)
        rival: _Chains = self._single(others)
        for _ in range(self._config.max_chains - 1):
            if not needs_more_chains(model, own, rival, other):
                break
            model, rival = self._grown(model, own), self._grown(rival, other)
        return model

    def _grown(self, model: _Chains, frames: tuple[FloatArray, ...]) -> FactorialHMM:
        grown = add_chain(model, frames, self._n_states(frames))
        for _ in range(_EM_STEPS):
            grown = em_step(grown, frames, variance_floor=self._floor())
        return grown

    def _neighbour(self, node: Node) -> Node | None:
        """Return the leaf whose mean trajectory is nearest to a leaf's; None for an inner node."""
        bank, nodes = self._structure.memory.bank, self._structure.nodes.values()
        leaves = [each for each in nodes if each.is_leaf and each.id not in (ROOT, node.id)]
        if node.id == ROOT or not (node.is_leaf and leaves):
            return None
        own = bank.mean_profile(node.members)
        away = [((bank.mean_profile(each.members) - own) ** 2).sum() for each in leaves]
        return leaves[int(np.argmin(away))]

    def _frames(self, members: _Members) -> tuple[FloatArray, ...]:
        return tuple(self._structure.memory.frames[number] for number in members)

    def _n_states(self, frames: tuple[FloatArray, ...]) -> int:
        """As configured, or fewer where an exemplar is shorter."""
        return min(self._config.n_states, *(len(each) for each in frames))

    def _floor(self) -> FloatArray:
        """Return the smallest variances; where they are others than before, forget all models.

        They change with the bank's, so that looking never changes them: what all motion varies by
        at the moment would make a model depend on when it was asked for.
        """
        of_bank = self._structure.memory.bank.floor
        if of_bank is not self._floor_of_bank:
            floor = (_FLOOR / self._config.variance_floor) ** 2 * of_bank
            if not np.array_equal(floor, self._variances):
                self._kept, self._variances = {}, floor
            self._floor_of_bank = of_bank
        return self._variances
