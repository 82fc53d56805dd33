"""Tables whose markers have a name above and axes x, y, z below: as motion capture tools export."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from ...option_names import option
from ...recording import FloatArray, Recording
from ..clock import Clock, even_clock
from ..files import bad_file, cmu_subject, stem
from ..findings import Findings
from ..numbers import measured_rows, not_seen
from ..placing.placed_markers import placed_markers
from ..placing.space import Space
from ..rates import rate_beside
from ..reader import Hints
from .names import chosen_names
from .sheet import Sheet


@dataclass(frozen=True)
class Block:
    """Where the markers of a table stand.

    Attributes:
        names: Names of the M markers, as the file has them.
        columns: Columns x, y, z of each, length M.
        start: Line at which the data start, from 0.
        stop: One past the last line of the data.
        width: How many columns have a heading.
        time: Column of the times [s]; None where there is none.
        frame: Column of the numbers of the frames; None where there is none.
    """

    names: tuple[str, ...]
    columns: tuple[tuple[int, int, int], ...]
    start: int
    stop: int
    width: int
    time: int | None = None
    frame: int | None = None


def marker_columns(
    names: Sequence[str], axes: Sequence[str]
) -> tuple[tuple[str, ...], tuple[tuple[int, int, int], ...]]:
    """Return the markers of a row of names above a row of axes.

    A name counts for its own column and, where the cells behind it are empty, for the next two.
    Columns that are not the position of one marker, x, y and z in turn, are passed over.
    """
    found: dict[int, str] = {}
    columns: list[tuple[int, int, int]] = []
    for i in range(len(axes) - 2):
        letters = [axis.strip().lower() for axis in axes[i : i + 3]]
        own = [name.strip() for name in [*names[i : i + 3], "", "", ""][:3]]
        if letters == ["x", "y", "z"] and own[1] in ("", own[0]) and own[2] in ("", own[0]):
            found[i] = own[0]
            columns.append((i, i + 1, i + 2))
    return tuple(found.values()), tuple(columns)


def read_block(
    sheet: Sheet,
    block: Block,
    said_hz: float | None,
    space: Space,
    hints: Hints,
    findings: Findings,
    *,
    zero_is_missing: bool = False,
) -> Recording:
    """Return the markers of a block as a recording.

    Args:
        sheet: The table.
        block: Where its markers stand.
        said_hz: The rate that the file says [1/s]; None where it says none.
        space: What file or format say of lengths and axes.
        hints: What the caller says.
        findings: Where to tell what was found.
        zero_is_missing: Whether (0, 0, 0) is a marker that was not seen.

    Raises:
        RecordingError: The block does not hold what it promises.
    """
    path = sheet.path
    if not block.columns:
        raise bad_file(path, "no markers", "columns X, Y, Z below a name")
    clocks = [i for i in (block.time, block.frame) if i is not None]
    columns = [*clocks, *(i for axes in block.columns for i in axes)]
    rows = sheet.rows(block.start, block.stop)
    values = measured_rows(
        path, rows, block.width, findings, group=3, columns=columns, cut_off=sheet.cut_off
    )
    if not len(values):
        raise bad_file(path, "0 frames", "at least one")
    points = values[:, len(clocks) :].reshape(len(values), -1, 3).copy()
    if zero_is_missing:
        points[not_seen(points)] = np.nan
    seen = (~np.isnan(points).any(axis=2)).sum(axis=0)
    kept, names = chosen_names(path, block.names, seen, findings)
    clock = _clock(path, block, values[:, : len(clocks)], findings)
    flat = points[:, kept].reshape(len(points), -1)
    points = clock.even(flat).reshape(-1, len(kept), 3)
    rate_hz = hints.rate_hz or _rate(path, said_hz, clock, findings)
    person = cmu_subject(stem(path))
    return placed_markers(path, points, names, rate_hz, space, hints, findings, person=person)


def _clock(path: Path, block: Block, clocks: FloatArray, findings: Findings) -> Clock:
    """Return the clock of times, if there are any, or of frames: the columns of ``clocks``."""
    plain = Clock(np.nan, np.arange(len(clocks), dtype=np.float64), False)
    if block.time is not None and np.ptp(np.nan_to_num(clocks[:, 0])) > 0:
        clock = even_clock(path, clocks[:, 0])
        if clock.jitters:
            findings.note(f"times jitter: resampled to an even {clock.rate_hz:.6g} Hz")
        return clock
    if block.frame is None or len(clocks) < 2:
        return plain
    steps = np.diff(clocks[:, -1])
    if (steps == 1).all() or not (steps > 0).all() or (steps != np.rint(steps)).any():
        return plain
    usual = float(np.median(steps))
    places = np.concatenate([[0.0], np.cumsum(steps)]) / usual
    if (places != np.rint(places)).any() or places[-1] > 10 * len(clocks) + 1000:
        return plain
    return Clock(np.nan, places, False)


def _rate(path: Path, said_hz: float | None, clock: Clock, findings: Findings) -> float:
    said = said_hz if said_hz is not None and 0 < said_hz < np.inf else None
    measured = clock.rate_hz if clock.rate_hz > 0 else None
    if said is None and measured is None and (beside := rate_beside(path, findings)):
        return beside
    if said is None and measured is None:
        raise bad_file(path, "no rate", f"a rate, times, or {option('rate_hz')}")
    if said is None or measured is None:
        return said or measured or np.nan
    # times are often rounded to milliseconds
    slack = 0.01 + 2e-3 * measured / max(float(clock.places[-1]), 1.0)
    if abs(measured / said - 1.0) <= slack:
        return said
    findings.warn(f"the header says {said:g} Hz, the times say {measured:.6g} Hz, which is used")
    return measured
