"""What is kept on disk of a kernel is what would be compiled now."""

import importlib
import os
import sys
import time
from itertools import count
from pathlib import Path
from typing import Any

import numba
import numpy as np
import pytest

from mplearn.maths.compiling import njit

CALLER = """
from mplearn.maths.compiling import njit
from called import SHIFT, inner

@njit(cache=True)
def outer(x):
    return later(x) + SHIFT[0]

@njit(cache=True)
def later(x):
    return inner(x)
"""
CALLED = """
from mplearn.maths.compiling import njit
SHIFT = ({shift},)
FACTOR = {factor}

@njit(cache=True)
def inner(x, plus={plus}):
    return FACTOR * x + plus{more}
"""


@pytest.fixture
def outer(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Any:
    """Load the two files anew, as another process would; the caller's file is never touched."""
    monkeypatch.syspath_prepend(tmp_path)
    (tmp_path / "caller.py").write_text(CALLER)
    times = count(int(time.time()) + 2, 2)  # Python's own cache looks at whole seconds, and sizes

    def load(shift: float = 1.0, factor: float = 2.0, more: str = "", plus: float = 0.0) -> Any:
        called = tmp_path / "called.py"
        text = CALLED.format(shift=shift, factor=factor, more=more, plus=plus)
        if not called.exists() or called.read_text() != text:
            called.write_text(text)
            os.utime(called, (0, next(times)))
        for name in ("caller", "called"):
            monkeypatch.delitem(sys.modules, name, raising=False)
        importlib.invalidate_caches()
        return importlib.import_module("caller").outer

    return load


def test_a_kernel_is_compiled_again_where_what_it_calls_or_takes_has_changed(outer: Any) -> None:
    first = outer()
    assert first(3.0) == 7.0 and not first.stats.cache_hits
    again = outer()
    assert again(3.0) == 7.0 and again.stats.cache_hits
    for changed, result in (
        ({"more": " - 1.0"}, 6.0),  # the text of a kernel two calls away
        ({"factor": 5.0}, 16.0),  # a constant of it
        ({"shift": 4.0}, 10.0),  # a constant from its file
        ({"plus": 2.0}, 9.0),  # what it takes for an argument that is left out
        ({}, 7.0),
    ):
        renewed = outer(**changed)
        assert renewed(3.0) == result
        assert not renewed.stats.cache_hits


TAKER = """
from mplearn.maths.compiling import njit

@njit(cache=True)
def total(pair):
    return pair.x + pair.y
"""
TAKEN = """
from typing import NamedTuple

class {name}(NamedTuple):
    x: float
    y: float
"""


def test_a_kernel_is_compiled_again_where_a_class_of_its_arguments_was_renamed(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.syspath_prepend(tmp_path)
    (tmp_path / "taker.py").write_text(TAKER)
    hits = []
    for k, name in enumerate(("Pair", "Pair", "Couple", "Couple")):
        taken = tmp_path / "taken.py"
        taken.write_text(TAKEN.format(name=name))
        os.utime(taken, ns=(0, 10**9 * (k + 1)))
        for module in ("taker", "taken"):
            monkeypatch.delitem(sys.modules, module, raising=False)
        importlib.invalidate_caches()
        total = importlib.import_module("taker").total
        pair = getattr(importlib.import_module("taken"), name)
        assert total(pair(1.0, 2.0)) == 3.0
        hits.append(bool(total.stats.cache_hits))
    assert hits == [False, True, False, True]


@njit()
def _put(out: Any, values: Any) -> None:
    out[1:] = values


def test_shapes_that_do_not_match_are_refused_in_few_words_in_our_kernels_alone() -> None:
    out = np.zeros(4)
    _put(out, np.arange(3.0))
    _put(out, np.ones(1))
    assert out.tolist() == [0.0, 1.0, 1.0, 1.0]
    with pytest.raises(ValueError, match="different size"):
        _put(out, np.ones(2))
    code = next(iter(_put.inspect_llvm().values()))
    theirs = numba.njit(_put.py_func)
    with pytest.raises(ValueError, match=r"shape \(3,\) from input of shape \(2,\)"):
        theirs(out, np.ones(2))
    assert len(code) < 0.5 * len(next(iter(theirs.inspect_llvm().values())))
