"""Who does the work: this process, processes of this machine, or (`cluster`) those of many."""

from __future__ import annotations

import multiprocessing
import os
import signal
import sys
import threading
import time
from collections.abc import Callable, Iterator
from concurrent.futures import BrokenExecutor, Future, ProcessPoolExecutor
from contextlib import contextmanager
from numbers import Integral
from typing import Any, Protocol, TypeVar

from ..errors import InvalidValueError
from ..spawning import deaf_to_interrupts

T = TypeVar("T")

_GRACE_S = 5.0  # for a step that hears no signal
_ONE_THREAD = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "NUMBA_NUM_THREADS")


class Executor(Protocol):
    """Does work that needs nothing but its arguments, in any order.

    One that loses all that it was given where a worker dies has an attribute ``jobs``, how much it
    does at once: it is not given more than that.

    Example:
        >>> from mplearn.corpus import Here
        >>> executor: Executor = Here()
        >>> [executor.submit(pow, 2, n).result() for n in (3, 4)]
        [8, 16]
    """

    def submit(self, work: Callable[..., T], *args: Any) -> Future[T]:
        """Have ``work(*args)`` done; a dead worker is an error of the future, not of this call."""

    def close(self) -> None:
        """Let the workers go."""


def room(executor: Executor) -> int:
    """Return how much an executor is given at once, so that what waits outlives its workers.

    Raises:
        InvalidValueError: It has ``jobs``, which are no number from 1 on.

    Example:
        >>> room(Processes(jobs=2)), room(Here()) > 1000
        (2, True)
    """
    jobs = getattr(executor, "jobs", sys.maxsize)
    if not _is_count(jobs):
        raise InvalidValueError(f"an executor's jobs must be a number from 1 on, not {jobs!r:.40}")
    return int(jobs)


def _is_count(jobs: object) -> bool:
    return isinstance(jobs, Integral) and int(jobs) >= 1


def workers(executor: Executor | None, jobs: int) -> Executor:
    """Return who does the work: an executor of one's own, so many processes, or this one for 0.

    Raises:
        InvalidValueError: The executor cannot be given work, or ``jobs`` is no number from 0 on.

    Example:
        >>> type(workers(None, 0)).__name__, type(workers(Here(), 4)).__name__
        ('Here', 'Here')
    """
    if executor is None:
        return Processes(jobs) if jobs else Here()
    if not callable(getattr(executor, "submit", None)):
        raise InvalidValueError(f"an executor has submit(work, *args): {executor!r:.60} has not")
    room(executor)
    return executor


class Here:
    """Does the work in this process, at once.

    Example:
        >>> here = Here()
        >>> here.submit(sum, [1, 2, 3]).result()
        6
        >>> type(here.submit(int, "one").exception()).__name__  # of the work, not of the call
        'ValueError'
    """

    def submit(self, work: Callable[..., T], *args: Any) -> Future[T]:
        """Do ``work(*args)`` and return what came of it."""
        future: Future[T] = Future()
        try:
            future.set_result(work(*args))
        except Exception as error:
            future.set_exception(error)
        return future

    def close(self) -> None:
        """Do nothing: there is nobody to let go."""


class Processes:
    """Does the work in processes of this machine, each started anew (spawn), of one thread.

    A process that dies takes all that was submitted with it; what is submitted after that is done
    by new ones. So no more than they do at once should be (`room`).

    Args:
        jobs: How many.

    Raises:
        InvalidValueError: ``jobs`` is not positive.

    Example:
        >>> workers = Processes(jobs=1)  # a process starts with the first work
        >>> workers.close()
        >>> Processes(jobs=0)
        Traceback (most recent call last):
        mplearn.errors.InvalidValueError: ...
    """

    def __init__(self, jobs: int) -> None:
        if not _is_count(jobs):
            raise InvalidValueError(f"jobs must be a whole number, at least 1, not {jobs!r:.40}")
        self.jobs = int(jobs)
        self._pool: ProcessPoolExecutor | None = None

    def submit(self, work: Callable[..., T], *args: Any) -> Future[T]:
        """Have ``work(*args)`` done by one of the processes."""
        with _one_thread(), deaf_to_interrupts():  # processes are started as they are needed
            if self._pool is not None:
                try:
                    return self._pool.submit(work, *args)
                except BrokenExecutor:
                    self._pool.shutdown()
            self._pool = ProcessPoolExecutor(
                self.jobs, multiprocessing.get_context("spawn"), _prepare
            )
            return self._pool.submit(work, *args)

    def close(self) -> None:
        """End the processes, once they are done with what they do."""
        if self._pool is not None:
            self._pool.shutdown(cancel_futures=True)
            self._pool = None


@contextmanager
def _one_thread() -> Iterator[None]:
    """Let processes that are started meanwhile have one thread each: there is one a core."""
    before = {name: os.environ.get(name) for name in _ONE_THREAD}
    os.environ.update(dict.fromkeys(_ONE_THREAD, "1"))
    try:
        yield
    finally:
        for name, value in before.items():
            if value is None:
                os.environ.pop(name)
            else:
                os.environ[name] = value


def _prepare() -> None:
    """Leave Ctrl-C to the parent, and end with it, however it ends."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    threading.Thread(target=_end_with_parent, daemon=True).start()


def _end_with_parent() -> None:
    """End as by SIGTERM, so that what is in hand is not held to have killed the process."""
    parent = multiprocessing.parent_process()
    if parent is not None:
        parent.join()
        os.kill(os.getpid(), signal.SIGTERM)
        time.sleep(_GRACE_S)
        os._exit(1)
