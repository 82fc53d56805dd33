"""The segmentation strip: a stretch of the stream, with found and true segments under it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Literal

import numpy as np

from mplearn.recording import FloatArray

from .theme import BLUE, INK, LIGHT_BLUE, LINE, MUTED, ORANGE, PALE, new_figure, readable

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure


@dataclass(frozen=True)
class StripSegment:
    """A segment of the strip.

    Attributes:
        start_s: Its start [s].
        end_s: Its end [s].
        label: What is written in it; nothing for a pause or what was not recognised.
        verdict: ``"truth"``; ``"right"`` or ``"wrong"`` where it was recognised; ``"unknown"``
            where it was not; ``"still"`` for a pause.

    Example:
        >>> StripSegment(0.5, 1.7, "bow", "right").verdict
        'right'
    """

    start_s: float
    end_s: float
    label: str
    verdict: Literal["truth", "right", "wrong", "unknown", "still"]


_FACE = {
    "truth": "white",
    "right": "#dbe8f6",
    "wrong": "#f8e0d0",
    "unknown": PALE,
    "still": "white",
}
_EDGE = {"truth": MUTED, "right": BLUE, "wrong": ORANGE, "unknown": MUTED, "still": LINE}


def draw_stream(
    features: FloatArray,
    start_s: float,
    rate_hz: float,
    found: Sequence[StripSegment],
    truth: Sequence[StripSegment],
    row_s: float = 12.0,
) -> Figure:
    """Draw the stretch in rows of equal length.

    Args:
        features: The stretch as the learner saw it, shape (T, D).
        start_s: Where it begins in the stream [s].
        rate_hz: Frames per second [1/s].
        found: What the learner made of it.
        truth: What the demonstrator meant.
        row_s: Length of a row [s].

    Example:
        >>> import numpy as np
        >>> found = [StripSegment(0.5, 1.7, "bow", "right"), StripSegment(1.7, 2.5, "", "still")]
        >>> truth = [StripSegment(0.5, 1.8, "bow", "truth")]
        >>> figure = draw_stream(np.zeros((150, 3)), 0.0, 50.0, found, truth)
        >>> len(figure.axes)
        1
    """
    end_s = start_s + len(features) / rate_hz
    rows = max(1, int(np.ceil((end_s - start_s) / row_s - 1e-6)))
    figure = new_figure(11.5, 1.75 * rows)
    busiest = np.argsort(-np.nanstd(features, axis=0), kind="stable")[:6]
    curves = features[:, busiest] - np.nanmean(features[:, busiest], axis=0)
    curves /= np.nanmax(np.abs(curves)) or 1.0
    times = start_s + np.arange(len(features)) / rate_hz
    for row in range(rows):
        axes = figure.add_subplot(rows, 1, row + 1)
        left = start_s + row * row_s
        inside = (times >= left) & (times <= left + row_s)
        axes.plot(times[inside], curves[inside], color=LIGHT_BLUE, linewidth=1.0)
        for segment in truth:
            axes.axvline(segment.end_s, ymin=0.42, color=LINE, linewidth=0.8, zorder=0)
        _draw_row(axes, found, -1.55, left, left + row_s)
        _draw_row(axes, truth, -2.2, left, left + row_s)
        axes.set_xlim(left, left + row_s)
        axes.set_ylim(-2.5, 1.1)
        axes.set_yticks([0.0, -1.55, -2.2], ["joints", "found", "truth"], color=INK)
        axes.tick_params(axis="y", length=0)
        axes.spines["left"].set_visible(False)
    axes.set_xlabel("time [s]")
    return figure


def _draw_row(
    axes: Axes, segments: Sequence[StripSegment], at: float, left: float, right: float
) -> None:
    for segment in segments:
        if segment.end_s <= left or segment.start_s >= right or segment.verdict == "still":
            continue
        start, end = max(segment.start_s, left), min(segment.end_s, right)
        axes.barh(
            at,
            end - start,
            left=start,
            height=0.52,
            color=_FACE[segment.verdict],
            edgecolor=_EDGE[segment.verdict],
            linewidth=0.8,
            hatch="////" if segment.verdict == "unknown" else None,
        )
        letters = int((end - start) / (right - left) * 150)
        if letters >= 3 and segment.label:
            axes.text(
                (start + end) / 2,
                at,
                readable(segment.label, letters),
                ha="center",
                va="center",
                fontsize=6.8,
                clip_on=True,
            )
