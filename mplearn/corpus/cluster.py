"""The workers of a Ray cluster [Moritz2018], on one machine or on many that see the same files."""

from __future__ import annotations

import os
import re
from collections.abc import Callable
from concurrent.futures import Future
from typing import Any, TypeVar

from ..errors import CorpusError
from ..extras import require

T = TypeVar("T")

_RETRIES = 3  # of a task whose machine or process is lost
_TRACEBACK = re.compile(r"Traceback \(most recent call last\):\n(?:[ \t].*\n)*")


class RayTasks:
    """Does the work as tasks of Ray, which are tried again where a worker or a machine is lost.

    All machines need mplearn, and see the recordings and the folder of stores under the same paths.

    Args:
        address: Of a cluster's head (``"auto"``: the one that this machine belongs to); empty
            starts one on this machine alone.

    Raises:
        MissingDependencyError: Ray is not installed (extra ``cluster``).
        CorpusError: There is no such cluster.
    """

    def __init__(self, address: str = "") -> None:
        os.environ.setdefault("RAY_USAGE_STATS_ENABLED", "0")
        self._ray: Any = require("ray", "cluster")
        self._own = not self._ray.is_initialized()
        if self._own:
            kinds = (ConnectionError, ValueError, RuntimeError, self._ray.exceptions.RayError)
            try:
                self._ray.init(address=address or "local", log_to_driver=False)
            except kinds as error:
                where = f"no Ray cluster at {address!r}" if address else "Ray does not start here"
                raise CorpusError(f"{where}: {_story(error)}") from error

    def submit(self, work: Callable[..., T], *args: Any) -> Future[T]:
        """Have ``work(*args)`` done by one of the cluster's workers."""
        task = self._ray.remote(max_retries=_RETRIES)(work)
        future: Future[T] = Future()
        task.remote(*args).future().add_done_callback(lambda done: _pass_on(done, future))
        return future

    def close(self) -> None:
        """Leave the cluster, or end the one that was started here."""
        if self._own:
            self._ray.shutdown()


def _story(error: BaseException | None) -> str:
    """Return what an error says, and what it was raised from, once each, without tracebacks.

    Ray names what it misses, a token (``RAY_AUTH_MODE``) for instance, in either.
    """
    told: list[str] = []
    while error is not None:
        text = " ".join(_TRACEBACK.sub("", str(error)).split()) or type(error).__name__
        if not any(text in other for other in told):
            told.append(text)
        error = error.__cause__ or (None if error.__suppress_context__ else error.__context__)
    return "; ".join(told)


def _pass_on(done: Future[T], to: Future[T]) -> None:
    """Pass on what came of a task; an error of the work as it was raised, without Ray's story."""
    error = done.exception()
    if error is None:
        to.set_result(done.result())
    else:
        cause = getattr(error, "cause", None)
        to.set_exception(cause if isinstance(cause, Exception) else error)
