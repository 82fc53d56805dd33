"""A disk that is full, for one process: what POSIX lets a test do without being root."""

import resource
from collections.abc import Iterator
from contextlib import contextmanager


@contextmanager
def little_room(most_bytes: int) -> Iterator[None]:
    """While this lasts, no file gets longer than that: as on a full disk, a write stops short."""
    soft, hard = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (most_bytes, hard))
    try:
        yield
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, (soft, hard))
