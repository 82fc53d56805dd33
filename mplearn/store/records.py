"""What came in, in order: the records of the log."""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple, Protocol, TypeAlias

from ..recording import FloatArray
from .journal import Entry
from .life_state import LifeState


class Frames(NamedTuple):
    """Frames of the stream, about a second.

    Attributes:
        frames: Shape (T, D).
        when: Clock time of the first [s since 1970].
    """

    frames: FloatArray
    when: float


class End(NamedTuple):
    """The stream ended."""


class Begin(NamedTuple):
    """A stream begins, with channels of its own.

    Attributes:
        channels: Names of the columns of its frames.
        key: Key of the recording that it is; empty for none.
    """

    channels: tuple[str, ...]
    key: str = ""


class Done(NamedTuple):
    """A recording was learned to its end."""

    key: str


Record: TypeAlias = Frames | End | Begin | Done | Entry


class Log(Protocol):
    """Keeps what came in."""

    def append(self, record: Record, state: Callable[[], LifeState]) -> None:
        """Keep a record.

        Args:
            record: What came in.
            state: Returns what is known now, the record included.
        """
