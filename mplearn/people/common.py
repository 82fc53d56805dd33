"""What several people's leaves say together: one model a primitive, one recogniser."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from ..hmm import LeftRightHMM, fit
from ..recording import FloatArray
from ..tree import ROOT, PrimitiveTree, Recogniser, TreeConfig
from ..tree.exemplars.bank import ExemplarBank
from ..tree.nodes.search import NodeIndex


def common_model(models: Sequence[LeftRightHMM], exemplars: Sequence[FloatArray]) -> LeftRightHMM:
    """Return the group model of one primitive by several people.

    Args:
        models: Each person's own, whose variance floors hold here too.
        exemplars: The executions of all, shape (L, D) each.
    """
    n_states = min(model.n_states for model in models)
    floor = np.min([model.variances.min(axis=0) for model in models], axis=0)
    return fit(exemplars, n_states, variance_floor=floor)


class CommonRecogniser:
    """One recogniser for all people; what has not changed since it was last asked for is kept.

    A primitive's exemplars are those of all its leaves, its width that of the widest of them.
    Distances are counted in units of the variance floor, which differs from person to person: here
    it is the mean of theirs.

    Args:
        config: Rules of the trees.
    """

    def __init__(self, config: TreeConfig) -> None:
        self._config = config
        self._bank = ExemplarBank(config, 1, np.ones(1))
        self._index = NodeIndex(config, self._bank)

    def of(
        self,
        trees: Mapping[int, PrimitiveTree],
        leaves: Mapping[int, Sequence[tuple[int, int]]],
        numbers: Mapping[int, Mapping[int, int]],
    ) -> Recogniser:
        """Return what would be recognised now, frozen.

        Args:
            trees: Each person's tree.
            leaves: Person and id in that person's tree of the leaves of each primitive.
            numbers: Number here of each segment of a person's tree, by person.
        """
        floor = np.mean([tree.bank.floor for tree in trees.values()], axis=0)
        if not np.array_equal(floor, self._bank.floor):
            self._bank = ExemplarBank(self._config, len(floor), floor)
            self._index = NodeIndex(self._config, self._bank)
        bank, index = self._bank, self._index
        scales = {
            person: float(np.sqrt(tree.bank.floor.mean() / floor.mean()))
            for person, tree in trees.items()
        }
        index.limit = max(scales[person] * tree.limit for person, tree in trees.items())
        for id in set(index.ids.tolist()) - set(leaves):
            index.drop(id)
        held: set[int] = set()
        for id, group in leaves.items():
            members: list[int] = []
            widths = [0.0]
            for person, leaf in group:
                node = trees[person].node(leaf)
                widths.append(scales[person] * node.diameter)
                for n in node.members:
                    members.append(numbers[person][n])
                    if members[-1] not in bank:
                        seen = trees[person].bank[n]
                        model = bank.model(seen.columns.T, float(seen.duration))
                        bank.add(members[-1], model)
            index.enter((id, ROOT, True, max(widths)), members, bank)
            held.update(members)
        for number in set(bank.numbers()) - held:
            bank.drop(number)
        shortest_frames = next(iter(trees.values())).shortest_frames
        recogniser = Recogniser(self._config, bank.fork(), index.fork(), shortest_frames)
        return recogniser.calibrated(self._config.false_acceptance)
