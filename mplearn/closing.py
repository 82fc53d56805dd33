"""What is closed at the end of a ``with`` statement."""

from __future__ import annotations

from typing import Self


class Closing:
    """Something that is closed, once nothing more is wanted of it, also by ``with``."""

    def close(self) -> None:
        """Give back what is held."""
        raise NotImplementedError

    def __enter__(self) -> Self:
        """Return itself."""
        return self

    def __exit__(self, *error: object) -> None:
        """Close it."""
        self.close()
