"""A store as others read it, while it grows."""

from __future__ import annotations

from pathlib import Path

from ..arguments import path_of
from ..errors import NotAStoreError, StoreDamagedError
from ..learner import MotionLearner
from ..library import PrimitiveLibrary
from .database import errors_of, open_reading
from .life import LifelongLearner
from .rows import checkpoints, read_rows, record_of
from .store import Found, read_all


class StoreReader:
    """What a store holds now; the store is neither changed, nor held up.

    Args:
        path: The file.

    Attributes:
        life: What is known, as of the last `refresh`: to look at.

    Raises:
        StoreError: It cannot be read; the class says why.

    Example:
        >>> import numpy as np
        >>> from mplearn import LearnerConfig, MotionLearner
        >>> from mplearn.store import LifelongLearner
        >>> config = LearnerConfig(channels=("x", "y"), rate_hz=100.0)
        >>> with LifelongLearner.open("life.db", lambda: MotionLearner(config)) as life:
        ...     events = life.learn_many(np.zeros((300, 2)))
        >>> StoreReader("life.db").life.n_frames
        300
    """

    def __init__(self, path: str | Path) -> None:
        self.path = path_of("path", path)
        self._seq = -1
        self.life = self._read()

    def refresh(self) -> bool:
        """Take note of what came since; say whether anything did.

        Raises:
            StoreError: The store cannot be read any more.
        """
        connection = open_reading(self.path)
        try:
            with errors_of(self.path):
                connection.execute("BEGIN")
                newest = (checkpoints(connection) or [0])[0]
                try:
                    rows = list(read_rows(connection, self._seq))
                except StoreDamagedError:  # the log no longer reaches back so far
                    rows = []
                    newest = max(newest, self._seq + 1)
                finally:
                    connection.execute("ROLLBACK")
        finally:
            connection.close()
        if not rows and newest <= self._seq:
            return False
        if rows and rows[-1].seq >= newest:
            for row in rows:
                self.life.replay(record_of(row))
            self._seq = rows[-1].seq
        else:
            self.life = self._read()
        return True

    def _read(self) -> LifelongLearner:
        found = _found(self.path)
        self._seq = found.rows[-1].seq if found.rows else found.seq
        return LifelongLearner.of_found(found)


def library_of(path: str | Path) -> PrimitiveLibrary:
    """Return what a store knows now, frozen.

    Raises:
        StoreError: It cannot be read; the class says why.

    Example:
        >>> import numpy as np
        >>> from mplearn import LearnerConfig, MotionLearner
        >>> from mplearn.store import LifelongLearner, Rename
        >>> t = np.arange(800) / 100.0
        >>> swing = np.where(t % 2 < 1, np.sin(np.pi * t) ** 2, 0.0)[:, None]  # up, down, a rest
        >>> config = LearnerConfig(("elbow",), segmenter="zero-velocity")
        >>> life = LifelongLearner.open("names.db", lambda: MotionLearner(config))
        >>> with life:
        ...     events = life.learn_many(swing)
        ...     entry = life.execute(Rename(1, "up"), by="Anna")
        >>> library_of("names.db").names[0]
        'up'
    """
    return StoreReader(path).life.snapshot()


def learner_of(path: str | Path) -> MotionLearner:
    """Return what a store knows now, to be merged: models are made once they are asked for.

    Raises:
        StoreError: It cannot be read; the class says why.

    Example:
        >>> import numpy as np
        >>> from mplearn import LearnerConfig, MotionLearner
        >>> from mplearn.store import LifelongLearner
        >>> t = np.arange(800) / 100.0
        >>> swing = np.where(t % 2 < 1, np.sin(np.pi * t) ** 2, 0.0)[:, None]  # up, down, a rest
        >>> config = LearnerConfig(("elbow",), segmenter="zero-velocity")
        >>> life = LifelongLearner.open("swings.db", lambda: MotionLearner(config))
        >>> with life:
        ...     events = life.learn_many(swing)
        >>> learner_of("swings.db").n_frames
        800
    """
    return LifelongLearner.of_found(_found(path_of("path", path)), lazily=True).learner


def _found(path: Path) -> Found:
    connection = open_reading(path)
    try:
        with errors_of(path):
            found = read_all(connection, path)
    finally:
        connection.close()
    if found is None:
        raise NotAStoreError(f"{path} holds no store: it was never finished")
    return found
