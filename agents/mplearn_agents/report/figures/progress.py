"""How learning went: primitives known, and segments recognised, over the stream's time."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from .theme import BLUE, MUTED, ORANGE, PALE, new_figure

if TYPE_CHECKING:
    from matplotlib.figure import Figure


def draw_progress(
    known: Sequence[tuple[float, int]],
    recognised: Sequence[tuple[float, bool]],
    n_classes: int,
    window_s: float = 60.0,
) -> Figure:
    """Draw both curves above the same time.

    Args:
        known: How many primitives were known from each time [s] on, in order.
        recognised: For each segment that moves, its end [s] and whether it was recognised.
        n_classes: How many kinds of motion the stream holds.
        window_s: The share of recognised segments is that of the last so many seconds [s].

    Example:
        >>> known, recognised = [(0.0, 0), (12.0, 1), (15.0, 2)], [(12.0, False), (20.0, True)]
        >>> len(draw_progress(known, recognised, n_classes=2).axes)
        2
    """
    figure = new_figure(11.5, 2.6)
    axes = figure.add_subplot(1, 2, 1)
    end_s = max([t for t, _ in known] + [t for t, _ in recognised], default=1.0)
    times = [0.0, *(t for t, _ in known), end_s]
    counts = [0, *(n for _, n in known), known[-1][1] if known else 0]
    axes.step(times, counts, where="post", color=BLUE, linewidth=2)
    axes.axhline(n_classes, color=MUTED, linewidth=0.9, linestyle=(0, (4, 3)))
    axes.text(0, n_classes + 0.3, f"{n_classes} performed", fontsize=8, color=MUTED, va="bottom")
    axes.set_title("primitives known")
    axes.set_ylim(0, max([n_classes, *counts]) * 1.18)
    share = figure.add_subplot(1, 2, 2)
    ends = np.array([t for t, _ in recognised])
    hits = np.array([hit for _, hit in recognised], dtype=np.float64)
    recent = [hits[(ends > t - window_s) & (ends <= t)].mean() for t in ends]
    share.plot(ends, 100 * np.array(recent), color=ORANGE, linewidth=2)
    share.set_title(f"segments recognised, last {window_s:.0f} s [%]")
    share.set_ylim(0, 104)
    for each in (axes, share):
        each.set_xlabel("time in the stream [s]")
        each.set_xlim(0, end_s)
        each.grid(True, color=PALE, linewidth=0.8)
    return figure
