"""Workers that die, as a machine's do that lacks memory."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable
from concurrent.futures import Future
from concurrent.futures.process import BrokenProcessPool
from typing import Any


class Frail:
    """Processes of a machine that lacks memory: whenever one work is done, a worker dies.

    All that was submitted is lost with it, as with a pool of processes. What is in ``fatal`` kills
    its worker each time.
    """

    def __init__(self, jobs: int, fatal: str = "") -> None:
        self.jobs, self._fatal = jobs, fatal
        self._given: list[tuple[Future[Any], Callable[..., Any], tuple[Any, ...]]] = []
        self._lock = threading.Lock()
        self.most = self.deaths = 0
        self._open = True
        self._thread = threading.Thread(target=self._do, daemon=True)
        self._thread.start()

    def submit(self, work: Callable[..., Any], *args: Any) -> Future[Any]:
        future: Future[Any] = Future()
        with self._lock:
            self._given.append((future, work, args))
            self.most = max(self.most, len(self._given))
        return future

    def _do(self) -> None:
        while self._open:
            time.sleep(0.05)  # until all are submitted
            with self._lock:
                given, self._given = self._given, []
            if not given:
                continue
            first, work, args = given[0]
            if not self._fatal or self._fatal not in str(args):
                try:
                    first.set_result(work(*args))
                except Exception as error:  # of the work: the worker lives
                    first.set_exception(error)
                given = given[1:]
            self.deaths += bool(given)
            for future, _, _ in given:
                future.set_exception(BrokenProcessPool("ended abruptly"))

    def close(self) -> None:
        self._open = False
        self._thread.join()
