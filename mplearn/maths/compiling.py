"""How kernels are compiled, and kept on disk.

**When a kernel is compiled again.** numba takes a kernel from its cache as long as the kernel's own
file is as old as it was; what it calls in other files, and the constants it takes from there, are
compiled into it and may have changed since. `njit` here looks at all of these, too. What cannot be
read, as it is of classes that were renamed since, is compiled again as well; numba would raise.

**Entrances.** For each kernel numba makes, besides the kernel, an entrance for Python and one for
C, which take every array of every record apart: longer to compile than a short kernel itself.
`kernel` and `inner_kernel` leave them out where many kernels call each other with large records;
`inlined` kernels are never compiled by themselves.

**Shapes that do not match.** For each assignment of an array to a part of another (``a[:3] = b``)
numba compiles what puts both shapes into a message, with all of its text handling, again in each
kernel that calls that one, a tenth to a fifth of all compiling. It asks who compiles for another
message: that of our kernels names no shapes.
"""

from __future__ import annotations

import hashlib
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from types import CodeType, FunctionType, ModuleType
from typing import Any, TypeVar, cast

import numba
import numpy as np
from numba.core.caching import FunctionCache
from numba.core.dispatcher import Dispatcher
from numba.core.extending import _Intrinsic
from numba.extending import overload

_Kernel = TypeVar("_Kernel", bound=Callable[..., Any])
_ASKED = "raise_with_shape_context"  # what numba asks in that case
# options that numba has and its types do not name
_NO_C: dict[str, Any] = {"no_cfunc_wrapper": True}
_NO_PYTHON: dict[str, Any] = {"no_cfunc_wrapper": True, "no_cpython_wrapper": True}


def njit(*, cache: bool = False, **options: Any) -> Callable[[_Kernel], _Kernel]:
    """Return numba's decorator of this name; what it keeps on disk is what it would compile now.

    Example:
        >>> @njit()
        ... def twice(x: float) -> float:
        ...     return 2.0 * x
        >>> twice(1.5)
        3.0
    """

    def compiled(function: _Kernel) -> _Kernel:
        made: Any = numba.njit(**options)(function)
        if hasattr(made, "py_func"):  # else numba is switched off
            made._compiler = _Compiler(made._compiler)
            if cache:
                made._cache = _Cache(function)
        return cast("_Kernel", made)

    return compiled


def kernel(function: _Kernel) -> _Kernel:
    """Compile a kernel, kept on disk, that leaves Python to other threads; it has no C entrance."""
    return njit(cache=True, nogil=True, **_NO_C)(function)


def inner_kernel(function: _Kernel) -> _Kernel:
    """Compile one that only kernels of its own file call.

    It has no entrance for Python either: a process that calls it from there ends.
    """
    return njit(cache=True, nogil=True, **_NO_PYTHON)(function)


def inlined(function: _Kernel) -> _Kernel:
    """Put a kernel's code where it is called, for one that is called in one place.

    Otherwise numba compiles it by itself, and once more within each kernel that calls it, directly
    or not.
    """
    return njit(inline="always")(function)


def fingerprint(function: Callable[..., Any]) -> str:
    """Return what a kernel is made of, as a hash: its code, what it calls, constants it takes.

    Equal in all processes of one version of Python. What is called is looked up now, as numba does
    when it compiles.
    """
    found = hashlib.sha256()
    _add(function, found, set())
    return found.hexdigest()


class _Compiler:
    """Numba's compiler of a kernel, with a short message about shapes that do not match."""

    def __init__(self, compiler: Any) -> None:
        self._compiler = compiler

    def __getattr__(self, name: str) -> Any:
        return getattr(self._compiler, name)

    def compile(self, args: Any, return_type: Any) -> Any:
        with _short_message():
            return self._compiler.compile(args, return_type)


@contextmanager
def _short_message() -> Iterator[None]:
    from numba.np import arrayobj  # with half of numba: late, for what is only defined

    usual = getattr(arrayobj, _ASKED, None)  # numba lets one thread at a time compile
    setattr(arrayobj, _ASKED, _raise_of_shapes)
    try:
        yield
    finally:
        setattr(arrayobj, _ASKED, usual)


def _raise_of_shapes(given: tuple[int, ...], wanted: tuple[int, ...]) -> None:
    """Raise what an assignment between different shapes raises in a kernel."""
    raise NotImplementedError  # what is compiled is below


@overload(_raise_of_shapes)
def _raise_of_shapes_compiled(given: Any, wanted: Any) -> Callable[..., None]:
    def impl(given: Any, wanted: Any) -> None:
        raise ValueError("cannot assign slice from input of different size")

    return impl


class _Cache(FunctionCache):
    """A kernel's compiled forms on disk, good as long as its `fingerprint` is the same."""

    def __init__(self, function: Callable[..., Any]) -> None:
        super().__init__(function)  # type: ignore[no-untyped-call]
        self._looked = False

    def load_overload(self, sig: Any, target_context: Any) -> Any:
        self._look()
        try:
            return super().load_overload(sig, target_context)  # type: ignore[no-untyped-call]
        except Exception:  # kept of arguments whose classes have other names now, or damaged
            with suppress(OSError):
                self._cache_file.flush()  # type: ignore[no-untyped-call]
            return None

    def save_overload(self, sig: Any, data: Any) -> None:
        self._look()
        super().save_overload(sig, data)  # type: ignore[no-untyped-call]

    def _look(self) -> None:
        """Look at what the kernel is made of; late, for what it calls may be defined after it."""
        if not self._looked:
            file = self._cache_file
            file._source_stamp = (file._source_stamp, fingerprint(self._py_func))
            self._looked = True


def _add(value: Any, found: Any, seen: set[int]) -> None:
    """Add a value that a kernel refers to."""
    if isinstance(value, Dispatcher):
        found.update(repr(sorted(value.targetoptions.items())).encode())
        value = value.py_func
    if isinstance(value, _Intrinsic):
        value = value._defn
    if isinstance(value, FunctionType):
        if id(value) not in seen:
            seen.add(id(value))
            _add_code(value.__code__, value.__globals__, found, seen)
            _add(value.__defaults__ or (), found, seen)
            for cell in value.__closure__ or ():
                _add(cell.cell_contents, found, seen)
    elif isinstance(value, tuple):
        for each in value:
            _add(each, found, seen)
    elif isinstance(value, np.ndarray):
        found.update(repr((value.dtype, value.shape)).encode() + value.tobytes())
    elif isinstance(value, type):
        found.update(repr((value.__qualname__, getattr(value, "_fields", ()))).encode())
    elif isinstance(value, (bool, int, float, complex, str, bytes, np.generic, np.dtype)):
        found.update(repr(value).encode())
    else:
        found.update(type(value).__qualname__.encode())


def _add_code(code: CodeType, names: dict[str, Any], found: Any, seen: set[int]) -> None:
    found.update(code.co_code + repr((code.co_names, code.co_varnames)).encode())
    for constant in code.co_consts:
        if isinstance(constant, CodeType):
            _add_code(constant, names, found, seen)
        else:
            _add(constant, found, seen)
    for name in code.co_names:
        value = names.get(name)
        if isinstance(value, ModuleType):
            if value.__name__.startswith("mplearn"):
                for attribute in code.co_names:
                    _add(getattr(value, attribute, None), found, seen)
        else:
            _add(value, found, seen)
