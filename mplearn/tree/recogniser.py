"""The recogniser: what the tree knows at one moment, frozen."""

from __future__ import annotations

import math
from copy import copy
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from ..hmm.sequences import as_frames
from ..recording import FloatArray
from ..state import Count, State, require, validated, within
from .config import TreeConfig
from .distance import Distance
from .exemplars import normalisation
from .exemplars.bank import BankState, ExemplarBank
from .nodes.search import IndexState, NodeIndex
from .placement import Match
from .rejection import Impostors, spreads

_ROUNDING = 1e-9  # share of a radius; an impostor that lies on the threshold lies outside


class Recognition(NamedTuple):
    """What a segment was recognised as.

    Attributes:
        primitive: Id of the primitive; None where none is like it.
        distance: To the nearest primitive [nat a frame]; inf where there is none.
        ratio: That over the primitive's radius; above 1 outside. An open-set score.
        alternatives: All that it was compared with, best first.

    Example:
        >>> import numpy as np
        >>> from mplearn.tree import PrimitiveTree, TreeConfig
        >>> tree = PrimitiveTree(TreeConfig(), n_channels=2, rate_hz=100.0)
        >>> lift = np.outer(np.sin(np.linspace(0, np.pi, 60)), [1.0, 0.5])
        >>> placed = [tree.insert(k * lift) for k in (1.0, 1.01, 0.99, -1.0, -1.01)]
        >>> recognition = tree.recogniser().recognise(np.cos(lift))
        >>> recognition.primitive is None, recognition.ratio > 1.0
        (True, True)
    """

    primitive: int | None
    distance: float
    ratio: float
    alternatives: tuple[Match, ...]


@dataclass(frozen=True, eq=False)
class RecogniserState(State):
    """A recogniser; attributes are those of its constructor."""

    config: TreeConfig
    shortest_frames: Count
    bank: BankState
    index: IndexState

    def check(self) -> None:
        """Check that the nodes' exemplars are there, normalised as the rules say."""
        points = self.bank.columns.shape[2]
        wanted = self.config.normalisation.n_points
        require(points == wanted, "bank.columns", f"must hold {wanted} points each, not {points}")
        known = set(self.bank.numbers.tolist())
        used = {number for group in self.index.members for number in group}
        if self.config.n_candidates:  # the bank holds what is searched, and nothing else
            require(used >= known, "index.members", f"must name {sorted(known - used)}")
        for k, group in enumerate(self.index.members):
            require(
                known.issuperset(group), f"index.members[{k}]", "must name exemplars of the bank"
            )


class Recogniser:
    """Recognises segments as the tree would place them at the moment it was taken.

    `PrimitiveTree.recogniser` makes it; it never changes.

    Args:
        config: Rules of the tree.
        bank: The exemplars of its nodes.
        index: Its nodes.
        shortest_frames: Fewest frames of a segment.

    Example:
        >>> import numpy as np
        >>> from mplearn.tree import PrimitiveTree, TreeConfig
        >>> tree = PrimitiveTree(TreeConfig(), n_channels=2, rate_hz=100.0)
        >>> lift = np.outer(np.sin(np.linspace(0, np.pi, 60)), [1.0, 0.5])
        >>> placed = [tree.insert(k * lift) for k in (1.0, 1.01, 0.99, -1.0, -1.01)]
        >>> recogniser = tree.recogniser()
        >>> recogniser.recognise(1.005 * lift).primitive in recogniser.primitives
        True
        >>> recogniser.recognise(np.cos(lift)).primitive is None  # nothing is like it
        True
    """

    def __init__(
        self, config: TreeConfig, bank: ExemplarBank, index: NodeIndex, shortest_frames: int
    ) -> None:
        self.config = config
        self.shortest_frames = shortest_frames
        self._bank = bank
        self._index = index

    @property
    def primitives(self) -> tuple[int, ...]:
        """Ids of the primitives it knows."""
        return tuple(int(id) for id in self._index.ids[self._index.leaves])

    @property
    def distance(self) -> Distance:
        """How far segments are apart, by which it decides."""
        return self._bank.distance

    @property
    def false_acceptance(self) -> float:
        """Largest share of motions of unknown kinds to be expected that is taken for known ones.

        It is estimated from how near exemplars come to primitives that are not theirs; NaN where
        there is no second one.
        """
        index = self._index
        return Impostors.of(index, self._bank, index.radii()).rate(1.0)

    def calibrated(self, false_acceptance: float | None) -> Recogniser:
        """Return a recogniser with radii at which no more impostors are accepted than stated.

        Radii are only ever made smaller: what lies outside of the rules' own is no execution of the
        primitive, however far impostors are.

        Args:
            false_acceptance: Share of the motions of unknown kinds that may be taken for known;
                None for the rules' own radii.

        Raises:
            InvalidValueError: It is no share.
        """
        config = replace(self.config, false_acceptance=false_acceptance)
        index = copy(self._index)
        index.caps = None
        if false_acceptance is not None:
            units = spreads(index, self._bank)
            impostors = Impostors.of(index, self._bank, units)
            index.caps = impostors.threshold(false_acceptance) * units * (1 - _ROUNDING)
        return Recogniser(config, self._bank, index, self.shortest_frames)

    def recognise(self, frames: FloatArray) -> Recognition:
        """Recognise a segment, shape (T, D).

        Raises:
            FrameError: The frames have another width, or hold infinite values.
        """
        frames = as_frames(frames, self._bank.n_channels)
        if refusal(frames, self.shortest_frames):
            return Recognition(None, float("inf"), float("inf"), ())
        points = normalisation.normalised(frames, self.config.normalisation)
        matches = self._index.search(self._bank.model(points, len(frames)), self._bank)
        if not matches:
            return Recognition(None, float("inf"), float("inf"), ())
        best = matches[0]
        known = best.ratio <= 1 and best.node in self.primitives
        return Recognition(best.node if known else None, best.distance, best.ratio, tuple(matches))

    def matrices(self) -> dict[int, FloatArray]:
        """Return the distances among the exemplars of each primitive, shape (k, k).

        They are the lengths of those of `Recognition` (`Distance.length`).
        """
        index = self._index
        known = zip(index.ids.tolist(), index.leaves.tolist(), index.members, strict=True)
        return {id: self._bank.matrix(members) for id, is_leaf, members in known if is_leaf}

    def state(self) -> RecogniserState:
        """Return everything that it knows."""
        numbers = {number for group in self._index.members for number in group}
        return RecogniserState(
            config=self.config,
            shortest_frames=self.shortest_frames,
            bank=self._bank.state(numbers),
            index=self._index.state(),
        )

    @classmethod
    def from_state(cls, state: RecogniserState) -> Recogniser:
        """Return the recogniser that `state` described: equal in every decision.

        Raises:
            StateError: It describes none.
        """
        state = validated(state)
        with within("bank"):
            bank = ExemplarBank.from_state(state.config, state.bank)
        index = NodeIndex.from_state(state.config, bank, state.index)
        return cls(state.config, bank, index, state.shortest_frames)


def refusal(frames: FloatArray, shortest_frames: int, longest_frames: float = math.inf) -> str:
    """Return why a segment cannot be compared, or learned; empty where it can."""
    if len(frames) > longest_frames:
        return f"{len(frames)} frames are too many for a motion; at most {longest_frames}"
    if len(frames) < shortest_frames:
        return f"{len(frames)} frames are too few for a motion; at least {shortest_frames}"
    if not np.isnan(frames.sum()):  # nothing is missing
        return ""
    missing = np.isnan(frames).mean(axis=0)
    if missing.max() > 0.5:
        worst = int(missing.argmax())
        return f"channel {worst} is missing in {missing[worst]:.0%} of the frames"
    return ""
