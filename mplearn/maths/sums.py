"""Sums in compiled loops: numpy's to the bit, and a loop's to the bit but in vector registers.

numba alone keeps one value in a register where order matters.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from llvmlite import ir
from numba.core import cgutils, types
from numba.core.errors import TypingError
from numba.extending import intrinsic

from ..recording import FloatArray
from .compiling import njit

LANES = 4  # doubles in a vector, and rows at once, so that sums do not wait for each other
_emit: Any = cgutils
_DOUBLE = ir.DoubleType()
_VECTOR = ir.VectorType(_DOUBLE, LANES)
_UNDEFINED = ir.Constant(_VECTOR, ir.Undefined)
_FIRST = ir.Constant(ir.VectorType(ir.IntType(32), LANES), [0] * LANES)
_WIDE = ir.VectorType(_DOUBLE, 2 * LANES)
_BOTH = ir.Constant(ir.VectorType(ir.IntType(32), 2 * LANES), list(range(2 * LANES)))
_HALVES = [
    ir.Constant(ir.VectorType(ir.IntType(32), LANES), list(range(start, start + LANES)))
    for start in (0, LANES)
]


def _require_contiguous(*arrays: Any) -> None:
    """Check, while a kernel is compiled, that the values of arrays lie side by side."""
    if any(not isinstance(each, types.Array) or each.layout != "C" for each in arrays):
        raise TypingError(f"arrays must be contiguous, not {arrays}")


def _vector_at(builder: Any, place: Any) -> Any:
    """Return a place in memory as that of a vector."""
    return builder.bitcast(place, _VECTOR.as_pointer())


def _squares_tile(
    _context: Any, columns: Any, means: Any, scales: Any, given: Any, row: Any, at: Any, out: Any
) -> tuple[Any, Callable[..., Any]]:
    """Write `LANES` rows and points of sums of scaled squares, added channel after channel.

    It is called as ``squares_tile(columns, means, scales, given, row, at, out)``.

    ``out[n, t] = given[n] + sum over d of scales[n, d] * (columns[d, t] - means[n, d]) ** 2``, to
    the bit as a loop over d has it, for n from ``row`` on and t from ``at`` on. All arrays lie side
    by side in memory; nothing is checked.

    Args:
        columns: Shape (D, T).
        means: Shape (N, D).
        scales: Shape (N, D).
        given: Shape (N,).
        row: First row, at most N - `LANES`.
        at: First point, at most T - `LANES`.
        out: Shape (N, T).
    """
    _require_contiguous(columns, means, scales, given, out)
    return types.void(columns, means, scales, given, types.intp, types.intp, out), _tile


squares_tile: Any = intrinsic(_squares_tile)


def _row_squares(
    _context: Any, rows: Any, row: Any, one: Any, out: Any
) -> tuple[Any, Callable[..., Any]]:
    """Sum the squared offsets of `LANES` rows from one; each lane sums every `LANES`-th value.

    It is called as ``row_squares(rows, row, one, out)``: ``out[i, j]`` becomes the sum over k of
    ``(rows[row + i, LANES * k + j] - one[LANES * k + j]) ** 2``, as a loop over k has it to the
    bit, as far as `LANES` values are left. All arrays lie side by side in memory.

    Args:
        rows: Shape (N, K).
        row: First row, at most N - `LANES`.
        one: Shape (K,).
        out: Shape (`LANES`, `LANES`).
    """
    _require_contiguous(rows, one, out)
    return types.void(rows, types.intp, one, out), _squares


def _squares(context: Any, builder: Any, signature: Any, args: Any) -> Any:
    """Emit the code of `row_squares`."""

    def array(k: int) -> Any:
        return context.make_array(signature.args[k])(context, builder, args[k])

    rows, one, out, row = array(0), array(2), array(3), args[1]
    (width,) = _emit.unpack_tuple(builder, one.shape)
    starts = [builder.mul(builder.add(row, row.type(k)), width) for k in range(LANES)]
    sums = [_emit.alloca_once_value(builder, _VECTOR([0.0] * LANES)) for _ in starts]
    with _emit.for_range(builder, builder.udiv(width, row.type(LANES))) as loop:
        at = builder.mul(loop.index, row.type(LANES))
        theirs = builder.load(_vector_at(builder, builder.gep(one.data, [at])), align=8)
        for start, total in zip(starts, sums, strict=True):
            place = builder.gep(rows.data, [builder.add(start, at)])
            offset = builder.fsub(builder.load(_vector_at(builder, place), align=8), theirs)
            term = builder.fmul(offset, offset)
            builder.store(builder.fadd(builder.load(total), term), total)
    for k, total in enumerate(sums):
        place = builder.gep(out.data, [row.type(LANES * k)])
        builder.store(builder.load(total), _vector_at(builder, place), align=8)
    return context.get_dummy_value()


row_squares: Any = intrinsic(_row_squares)


def _pair_squares(
    _context: Any, rows: Any, row: Any, others: Any, at: Any, out: Any
) -> tuple[Any, Callable[..., Any]]:
    """Sum the squared offsets of `LANES` rows from two others; each sum as `row_squares` has it.

    It is called as ``pair_squares(rows, row, others, at, out)``: ``out[i, m]`` becomes what
    `row_squares` makes of ``rows[row + i]`` and ``others[at + m]``, in about half the time that two
    calls take: two rows share a vector of twice the width.

    Args:
        rows: Shape (N, K).
        row: First row, at most N - `LANES`.
        others: Shape (M, K).
        at: First of the two others, at most M - 2.
        out: Shape (`LANES`, 2, `LANES`).
    """
    _require_contiguous(rows, others, out)
    return types.void(rows, types.intp, others, types.intp, out), _pairs


def _pairs(context: Any, builder: Any, signature: Any, args: Any) -> Any:
    """Emit the code of `pair_squares`."""

    def array(k: int) -> Any:
        return context.make_array(signature.args[k])(context, builder, args[k])

    def values(data: Any, place: Any) -> Any:
        return builder.load(_vector_at(builder, builder.gep(data, [place])), align=8)

    def joined(low: Any, high: Any) -> Any:
        return builder.shuffle_vector(low, high, _BOTH)

    rows, others, out, row, at = array(0), array(2), array(4), args[1], args[3]
    _, width = _emit.unpack_tuple(builder, rows.shape)
    starts = [builder.mul(builder.add(row, row.type(k)), width) for k in range(LANES)]
    theirs = [builder.mul(builder.add(at, at.type(m)), width) for m in range(2)]
    pairs = list(zip(starts[::2], starts[1::2], strict=True))
    sums = {
        (k, m): _emit.alloca_once_value(builder, _WIDE([0.0] * (2 * LANES)))
        for k in range(len(pairs))
        for m in range(2)
    }
    with _emit.for_range(builder, builder.udiv(width, row.type(LANES))) as loop:
        step = builder.mul(loop.index, row.type(LANES))
        ones = [values(others.data, builder.add(each, step)) for each in theirs]
        twice = [joined(one, one) for one in ones]
        for k, pair in enumerate(pairs):
            two = joined(*(values(rows.data, builder.add(each, step)) for each in pair))
            for m, one in enumerate(twice):
                offset = builder.fsub(two, one)
                term = builder.fmul(offset, offset)
                builder.store(builder.fadd(builder.load(sums[k, m]), term), sums[k, m])
    for (k, m), total in sums.items():
        both = builder.load(total)
        for side, lanes in enumerate(_HALVES):
            half = builder.shuffle_vector(both, both, lanes)
            place = builder.gep(out.data, [row.type(LANES * (2 * (2 * k + side) + m))])
            builder.store(half, _vector_at(builder, place), align=8)
    return context.get_dummy_value()


pair_squares: Any = intrinsic(_pair_squares)


def _tile(context: Any, builder: Any, signature: Any, args: Any) -> Any:
    """Emit the code of `squares_tile`."""

    def array(k: int) -> Any:
        return context.make_array(signature.args[k])(context, builder, args[k])

    def spread(place: Any) -> Any:
        value = builder.insert_element(_UNDEFINED, builder.load(place), ir.IntType(32)(0))
        return builder.shuffle_vector(value, _UNDEFINED, _FIRST)

    columns, means, scales, given, out = (array(k) for k in (0, 1, 2, 3, 6))
    row, at = args[4], args[5]
    n_channels, n_points = _emit.unpack_tuple(builder, columns.shape)
    rows = [builder.add(row, row.type(k)) for k in range(LANES)]
    starts = [builder.mul(each, n_channels) for each in rows]
    sums = [
        _emit.alloca_once_value(builder, spread(builder.gep(given.data, [each]))) for each in rows
    ]
    with _emit.for_range(builder, n_channels) as loop:
        place = builder.add(builder.mul(loop.index, n_points), at)
        points = builder.load(_vector_at(builder, builder.gep(columns.data, [place])), align=8)
        for start, total in zip(starts, sums, strict=True):
            value = builder.add(start, loop.index)
            offset = builder.fsub(points, spread(builder.gep(means.data, [value])))
            scaled = builder.fmul(spread(builder.gep(scales.data, [value])), offset)
            term = builder.fmul(scaled, offset)
            builder.store(builder.fadd(builder.load(total), term), total)
    for each, total in zip(rows, sums, strict=True):
        place = builder.add(builder.mul(each, n_points), at)
        builder.store(
            builder.load(total), _vector_at(builder, builder.gep(out.data, [place])), align=8
        )
    return context.get_dummy_value()


_AT_ONCE = 8
_PART = 128  # values that are summed in one loop; more are halved


@njit(cache=True)
def pairwise_sum(values: FloatArray) -> float:
    """Return the sum of some values side by side in memory, in the order in which numpy adds them.

    Args:
        values: Shape (n,).

    Example:
        >>> import numpy as np
        >>> values = np.linspace(0.0, 1.0, 1000) ** 3
        >>> bool(pairwise_sum(values) == values.sum())
        True
    """
    n = len(values)
    if n < _AT_ONCE:
        total = 0.0
        for value in values:
            total += value
        return float(total)
    if n > _PART:
        half = n // 2 - n // 2 % _AT_ONCE
        return pairwise_sum(values[:half]) + pairwise_sum(values[half:])
    a, b, c, d = values[0], values[1], values[2], values[3]
    e, f, g, h = values[4], values[5], values[6], values[7]
    whole = n - n % _AT_ONCE
    for i in range(_AT_ONCE, whole, _AT_ONCE):
        a, b, c, d = a + values[i], b + values[i + 1], c + values[i + 2], d + values[i + 3]
        e, f, g, h = e + values[i + 4], f + values[i + 5], g + values[i + 6], h + values[i + 7]
    total = ((a + b) + (c + d)) + ((e + f) + (g + h))
    for i in range(whole, n):
        total += values[i]
    return float(total)
