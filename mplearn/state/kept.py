"""Which parts some checkpoints hold, and which none does any more."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Mapping


class Kept:
    """The parts of the checkpoints that are kept, each with all that it is made of.

    Taking one up or letting one go costs what it does not share with the others.

    Example:
        >>> import numpy as np
        >>> from mplearn.state import Blob, checkpoint
        >>> kept, one = Kept(), checkpoint(Blob(np.zeros(3)))
        >>> kept.add(1, one.held)
        >>> [key in kept for key in one.parts], len(kept)
        ([True], 1)
        >>> kept.drop(1) == list(one.parts), len(kept)
        (True, 0)
    """

    def __init__(self) -> None:
        self._held: dict[int, Mapping[str, tuple[str, ...]]] = {}
        self._n_named: Counter[str] = Counter()  # in how many checkpoints
        self._n_used: Counter[str] = Counter()  # in how many of what those name

    def __contains__(self, key: object) -> bool:
        """Whether a part is kept."""
        return key in self._n_used

    def __len__(self) -> int:
        """Number of parts."""
        return len(self._n_used)

    def __iter__(self) -> Iterator[int]:
        """Go through the numbers of the checkpoints, the oldest first."""
        return iter(sorted(self._held))

    def add(self, number: int, held: Mapping[str, tuple[str, ...]]) -> None:
        """Take a checkpoint up whose parts are written.

        Args:
            number: Of the checkpoint, of none that is kept.
            held: What it names, see `Checkpoint.held`.
        """
        self._held[number] = held
        for key, parts in held.items():
            self._n_named[key] += 1
            if self._n_named[key] == 1:
                self._n_used.update(parts)

    def drop(self, number: int) -> list[str]:
        """Let a checkpoint go; return the keys of the parts that none holds any more."""
        gone = []
        for key, parts in self._held.pop(number).items():
            self._n_named[key] -= 1
            if self._n_named[key]:
                continue
            del self._n_named[key]
            for part in parts:
                self._n_used[part] -= 1
                if not self._n_used[part]:
                    del self._n_used[part]
                    gone.append(part)
        return gone
