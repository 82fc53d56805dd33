"""Pictures of what was measured (extra ``report``)."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from ..extras import require
from ..recording import FloatArray
from .measures import Measure
from .transitions import Transitions


def _figure(width: float, height: float) -> Any:
    return require("matplotlib.figure", "report").Figure((width, height), layout="constrained")


def plot_measure(measure: Measure, groups: Mapping[str, str]) -> Any:
    """Return a figure: a column for each primitive and group, with a dot for each unit.

    Args:
        measure: What was measured.
        groups: Group of each unit, by its name.

    Returns:
        A `matplotlib.figure.Figure`; bars are the groups' medians.

    Example:
        >>> import numpy as np
        >>> tempo = Measure("duration [s]", ("anna", "ben"), ("bow",), np.array([[1.2], [0.9]]))
        >>> figure = plot_measure(tempo, {"anna": "old", "ben": "young"})
        >>> figure.axes[0].get_ylabel()
        'duration [s]'
    """
    names = sorted(set(groups.values()))
    figure = _figure(2.0 + 0.5 * len(names) * len(measure.primitives), 3.6)
    axes = figure.add_subplot()
    for g, group in enumerate(names):
        chosen = [k for k, unit in enumerate(measure.units) if groups.get(unit) == group]
        values = measure.values[chosen]
        at = np.arange(len(measure.primitives)) + (g - 0.5 * (len(names) - 1)) * 0.7 / len(names)
        spread = np.linspace(-0.1, 0.1, len(chosen)) if len(chosen) > 1 else np.zeros(1)
        for k, x in enumerate(at):
            seen = np.isfinite(values[:, k])
            axes.plot(x + spread[seen], values[seen, k], "o", ms=3, alpha=0.6, color=f"C{g}")
            if seen.any():
                axes.hlines(np.median(values[seen, k]), x - 0.14, x + 0.14, color=f"C{g}", lw=2)
        axes.plot([], [], "o", color=f"C{g}", label=group)
    axes.set_xticks(range(len(measure.primitives)), measure.primitives, rotation=45, ha="right")
    axes.set_ylabel(measure.name)
    axes.legend(frameon=False)
    return figure


def plot_transitions(counted: Transitions, groups: Mapping[str, str]) -> Any:
    """Return a figure: the transition matrix of each group, from rows to columns.

    Example:
        >>> import numpy as np
        >>> counted = Transitions(("anna", "ben"), ("bow", "rise"), np.ones((2, 2, 2)))
        >>> figure = plot_transitions(counted, {"anna": "old", "ben": "young"})
        >>> [axes.get_title() for axes in figure.axes[:2]]
        ['old', 'young']
    """
    names = sorted(set(groups.values()))
    size = 1.2 + 0.35 * len(counted.primitives)
    figure = _figure(size * len(names) + 1.0, size + 0.4)
    shown = None
    for g, group in enumerate(names):
        axes = figure.add_subplot(1, len(names), g + 1)
        units = [unit for unit in counted.units if groups.get(unit) == group]
        matrix = np.nan_to_num(counted.matrix(*units))
        shown = axes.imshow(matrix, vmin=0, vmax=1, cmap="magma_r")
        ticks = range(len(counted.primitives))
        axes.set_xticks(ticks, counted.primitives, rotation=90)
        axes.set_yticks(ticks, counted.primitives if g == 0 else [])
        axes.set_title(group)
    figure.colorbar(shown, ax=figure.axes, label="share of what follows")
    return figure


def plot_quality(shares: Mapping[str, FloatArray]) -> Any:
    """Return a figure: how many segments of each set are at most so usual (`quality`).

    Example:
        >>> import numpy as np
        >>> figure = plot_quality({"right": np.array([0.4, 0.7]), "wrong": np.array([0.01, 0.05])})
        >>> [text.get_text() for text in figure.axes[0].get_legend().get_texts()]
        ['right', 'wrong', 'like the reference']
    """
    figure = _figure(4.5, 3.6)
    axes = figure.add_subplot()
    for name, values in shares.items():
        known = np.sort(values[np.isfinite(values)])
        axes.step(known, np.arange(1, len(known) + 1) / max(1, len(known)), label=name)
    axes.plot([0, 1], [0, 1], ":", color="grey", label="like the reference")
    axes.set_xlabel("share of the reference at least as far out")
    axes.set_ylabel("share of the segments")
    axes.legend(frameon=False)
    return figure
