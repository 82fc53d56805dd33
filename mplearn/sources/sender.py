"""What every sender is."""

from __future__ import annotations

from abc import ABC, abstractmethod

from .source import Block


class Sender(ABC):
    """Sends frames by one protocol."""

    @abstractmethod
    def send(self, block: Block) -> None:
        """Send frames, one after another; what is NaN throughout was lost, and is left out."""

    @abstractmethod
    def close(self) -> None:
        """Free what is open."""
