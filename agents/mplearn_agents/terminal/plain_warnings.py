"""Warnings of ours in a line, without the place in the program that they come from."""

from __future__ import annotations

import warnings
from collections.abc import Iterator
from contextlib import contextmanager

from mplearn.errors import RecordingWarning, StoreWarning


@contextmanager
def plain_warnings() -> Iterator[None]:
    """While this lasts, what is wrong with a recording or a store is printed as errors are."""
    before = warnings.formatwarning

    def plain(
        message: Warning | str,
        category: type[Warning],
        filename: str,
        lineno: int,
        line: str | None = None,
    ) -> str:
        if issubclass(category, RecordingWarning | StoreWarning):
            return f"mplearn: warning: {' '.join(str(message).split())}\n"
        return before(message, category, filename, lineno, line)

    warnings.formatwarning = plain
    try:
        yield
    finally:
        warnings.formatwarning = before
