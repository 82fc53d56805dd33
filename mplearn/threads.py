"""One thread for what learns: its arrays are small, and threads that wait for more cost a core."""

from __future__ import annotations

from contextlib import AbstractContextManager
from typing import Any

from threadpoolctl import threadpool_limits


def one_thread() -> AbstractContextManager[Any]:
    """While this lasts, linear algebra of this process has one thread.

    OpenBLAS's threads wait for each other by spinning: beside other processes that takes several
    times the work. What is computed is then the same on any number of cores, too.

    Example:
        >>> import numpy as np
        >>> with one_thread():
        ...     float(np.linalg.norm([3.0, 4.0]))
        5.0
    """
    import scipy.linalg  # noqa: F401  its library is limited only once it is loaded

    limits: AbstractContextManager[Any] = threadpool_limits(1, user_api="blas")
    return limits
