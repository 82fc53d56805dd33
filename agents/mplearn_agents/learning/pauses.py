"""No long pauses in a process that follows a stream."""

from __future__ import annotations

import gc
from collections.abc import Iterator
from contextlib import contextmanager


@contextmanager
def short_pauses() -> Iterator[None]:
    """While this lasts, what is there at its beginning is not looked through for garbage.

    Modules and compiled code hold half a million objects: to look through them takes 0.1 s, in
    which no frame is learned. To be entered once all is imported and compiled.
    """
    gc.collect()
    gc.freeze()
    try:
        yield
    finally:
        gc.unfreeze()
