"""Sums in vector registers are those of a loop, to the bit."""

import numpy as np
import pytest
from numba.core.errors import TypingError

from mplearn.maths.compiling import njit
from mplearn.maths.sums import LANES, pair_squares, row_squares, squares_tile


@njit()
def tile(columns, means, scales, given, row, at, out):  # type: ignore[no-untyped-def]
    squares_tile(columns, means, scales, given, row, at, out)


@pytest.mark.parametrize(("n_channels", "n_points", "n_rows"), [(1, 4, 4), (7, 9, 5), (78, 16, 8)])
def test_a_tile_holds_the_sums_of_a_loop(n_channels: int, n_points: int, n_rows: int) -> None:
    rng = np.random.default_rng(n_channels)
    columns = rng.normal(size=(n_channels, n_points))
    columns[0, n_points - 1] = np.nan
    means, scales = rng.normal(size=(2, n_rows, n_channels))
    given = rng.normal(size=n_rows)
    wanted = np.repeat(given[:, None], n_points, axis=1)
    for d in range(n_channels):
        offset = columns[d] - means[:, d, None]
        wanted += scales[:, d, None] * offset * offset
    row, at = n_rows - LANES, n_points - LANES
    out = np.full((n_rows, n_points), 7.0)
    tile(columns, means, scales, given, row, at, out)
    np.testing.assert_array_equal(out[row:, at:], wanted[row:, at:])
    out[row:, at:] = 7.0
    assert (out == 7.0).all()


def test_values_that_do_not_lie_side_by_side_are_refused() -> None:
    apart = np.zeros((8, 8))[:, ::2]
    with pytest.raises(TypingError, match="contiguous"):
        tile(apart, apart, apart, np.zeros(8), 0, 0, apart)


@njit()
def sums(rows, row, one, out):  # type: ignore[no-untyped-def]
    row_squares(rows, row, one, out)


@pytest.mark.parametrize("width", [4, 7, 64, 1251])
def test_each_lane_sums_every_fourth_value(width: int) -> None:
    rng = np.random.default_rng(width)
    rows, one, out = rng.normal(size=(6, width)), rng.normal(size=width), np.full((4, 4), 7.0)
    sums(rows, 2, one, out)
    wanted = np.zeros((LANES, LANES))
    for k in range(width - width % LANES):
        wanted[:, k % LANES] += (rows[2:, k] - one[k]) ** 2
    np.testing.assert_array_equal(out, wanted)


@njit()
def pairs(rows, row, others, at, out):  # type: ignore[no-untyped-def]
    pair_squares(rows, row, others, at, out)


@pytest.mark.parametrize("width", [3, 4, 7, 1251])
def test_sums_of_two_at_once_are_those_of_each(width: int) -> None:
    rng = np.random.default_rng(width)
    rows, others = rng.normal(size=(6, width)), rng.normal(size=(5, width))
    others[4, 0] = np.nan
    out, wanted = np.full((LANES, 2, LANES), 7.0), np.empty((LANES, 2, LANES))
    pairs(rows, 2, others, 3, out)
    for m in range(2):
        alone = np.empty((LANES, LANES))
        sums(rows, 2, others[3 + m], alone)
        wanted[:, m] = alone
    np.testing.assert_array_equal(out, wanted)
