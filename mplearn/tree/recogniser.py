"""The recogniser: what the tree knows at one moment, frozen."""

from __future__ import annotations

import math
from dataclasses import asdict
from typing import Any, NamedTuple

import numpy as np

from ..hmm.sequences import as_frames
from ..recording import FloatArray
from . import form
from .bank import ExemplarBank
from .config import FormConfig, TreeConfig
from .placement import Match
from .search import NodeIndex


class Recognition(NamedTuple):
    """What a segment was recognised as.

    Attributes:
        primitive: Id of the primitive; None where none is like it.
        distance: To the nearest primitive [nat a frame]; inf where there is none.
        ratio: That over the primitive's radius; above 1 outside. An open-set score.
        alternatives: All that it was compared with, best first.
    """

    primitive: int | None
    distance: float
    ratio: float
    alternatives: tuple[Match, ...]


class Recogniser:
    """Recognises segments as the tree would place them at the moment it was taken.

    `PrimitiveTree.recogniser` makes it; it never changes.

    Args:
        config: Rules of the tree.
        bank: The exemplars of its nodes.
        index: Its nodes.
        shortest_frames: Fewest frames of a segment.
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

    def recognise(self, frames: FloatArray) -> Recognition:
        """Recognise a segment, shape (T, D).

        Raises:
            FrameError: The frames have another width, or hold infinite values.
        """
        frames = as_frames(frames, self._bank.n_channels)
        if refusal(frames, self.shortest_frames):
            return Recognition(None, float("inf"), float("inf"), ())
        points = form.centred(form.points_of(frames, self.config.form), self.config.form)
        matches = self._index.search(self._bank.model(points), self._bank)
        if not matches:
            return Recognition(None, float("inf"), float("inf"), ())
        best = matches[0]
        known = best.ratio <= 1 and best.node in self.primitives
        return Recognition(best.node if known else None, best.distance, best.ratio, tuple(matches))

    def state(self) -> dict[str, Any]:
        """Return everything as plain values and arrays."""
        return {
            "config": asdict(self.config),
            "shortest_frames": self.shortest_frames,
            "bank": self._bank.points(),
            "index": self._index.state(),
        }

    @classmethod
    def from_state(cls, state: dict[str, Any]) -> Recogniser:
        """Return the recogniser that `state` described: equal in every decision."""
        settings = dict(state["config"])
        config = TreeConfig(**(settings | {"form": FormConfig(**settings["form"])}))
        bank = ExemplarBank.from_points(config, state["bank"])
        index = NodeIndex.from_state(config, bank, state["index"])
        return cls(config, bank, index, int(state["shortest_frames"]))


def refusal(frames: FloatArray, shortest_frames: int, longest_frames: float = math.inf) -> str:
    """Return why a segment cannot be compared, or learned; empty where it can."""
    if len(frames) > longest_frames:
        return f"{len(frames)} frames are too many for a motion; at most {longest_frames}"
    if len(frames) < shortest_frames:
        return f"{len(frames)} frames are too few for a motion; at least {shortest_frames}"
    missing = np.isnan(frames).mean(axis=0)
    if missing.max() > 0.5:
        worst = int(missing.argmax())
        return f"channel {worst} is missing in {missing[worst]:.0%} of the frames"
    return ""
