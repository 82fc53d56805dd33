"""How far the learning of a corpus is."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass


@dataclass(frozen=True)
class Progress:
    """How far the learning of a corpus is.

    Attributes:
        takes: Takes of the corpus.
        learned: Takes learned, those of earlier runs included.
        refused: Why not, by name, for those that cannot be.
        watched_s: Length of what was learned [s].
        primitives: Primitives known, those of each shard by themselves.
        shards: Shards of the corpus.
        done: Shards that were learned.
        merged: Merges of two done, of one less than there are shards.
        elapsed_s: Since this run began [s].
        already: Takes that earlier runs had done.
        deaths: Processes that died.

    Example:
        >>> progress = Progress(200, 50, {}, 3000.0, 41, 8, 2, 1, 100.0, already=0, deaths=0)
        >>> progress.rate, progress.left_s
        (0.5, 300.0)
    """

    takes: int
    learned: int
    refused: Mapping[str, str]
    watched_s: float
    primitives: int
    shards: int
    done: int
    merged: int
    elapsed_s: float
    already: int
    deaths: int

    @property
    def rate(self) -> float:
        """Takes a second in this run [1/s]."""
        return self._now / self.elapsed_s if self.elapsed_s > 0 else 0.0

    @property
    def left_s(self) -> float | None:
        """Time that the other takes will need [s]; None before the first is done."""
        left = self.takes - self.learned - len(self.refused)
        return left / self.rate if self.rate > 0 else None

    @property
    def _now(self) -> int:
        return self.learned + len(self.refused) - self.already
