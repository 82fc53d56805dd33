"""How kernels are compiled where many call each other with large records.

For each kernel numba makes, besides the kernel, an entrance for Python and one for C, which take
every array of every record apart: longer to compile than a short kernel itself.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, TypeVar, cast

from numba import njit

_Kernel = TypeVar("_Kernel", bound=Callable[..., Any])
# options that numba has and its types do not name
_NO_C: dict[str, Any] = {"no_cfunc_wrapper": True}
_NO_PYTHON: dict[str, Any] = {"no_cfunc_wrapper": True, "no_cpython_wrapper": True}


def kernel(function: _Kernel) -> _Kernel:
    """Compile a kernel, kept on disk, that leaves Python to other threads; it has no C entrance."""
    return cast("_Kernel", njit(cache=True, nogil=True, **_NO_C)(function))


def inner_kernel(function: _Kernel) -> _Kernel:
    """Compile one that only kernels of its own file call.

    It has no entrance for Python either: a process that calls it from there ends.
    """
    return cast("_Kernel", njit(cache=True, nogil=True, **_NO_PYTHON)(function))
