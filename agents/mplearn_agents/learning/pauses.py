"""No long pauses in a process that follows a stream."""

from __future__ import annotations

import gc
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any


@contextmanager
def short_pauses() -> Iterator[None]:
    """While this lasts, no frame waits until all objects were looked through for garbage.

    Modules and compiled code hold half a million objects, and what is learned joins them: to look
    through all takes 0.1 s and more. What is there at the beginning is left out, and so is, from
    then on, what has stayed for a second look. Only a cycle that is given up after that would stay,
    until the end; learning makes none. To be entered once all is imported and compiled.
    """
    gc.collect()
    gc.freeze()
    gc.callbacks.append(_settle)
    try:
        yield
    finally:
        gc.callbacks.remove(_settle)
        gc.unfreeze()


def _settle(phase: str, info: dict[str, Any]) -> None:
    """Leave out what a collection of other than the youngest objects has left."""
    if phase == "stop" and info["generation"] > 0:
        gc.freeze()
