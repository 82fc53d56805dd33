"""Pictures of what was measured (extra ``report``)."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from ..extras import require
from ..recording import FloatArray
from .measures import Measure
from .transitions import Transitions

_COLUMNS = 40  # of groups and primitives, that stand beside each other
_LONGEST = 22  # characters of a name
_CELL_IN, _SMALLEST_CELL_IN, _MATRIX_IN = 0.35, 0.095, 7.0


def _figure(width: float, height: float) -> Any:
    return require("matplotlib.figure", "report").Figure((width, height), layout="constrained")


def _shown(names: Sequence[str]) -> list[str]:
    """Return names as they stand in a picture: none longer than there is room for."""
    return [name if len(name) <= _LONGEST else name[: _LONGEST - 1] + "…" for name in names]


def _add_legend(where: Any, **place: Any) -> None:
    for text in where.legend(frameon=False, **place).get_texts():
        text.set_parse_math(False)


def plot_measure(measure: Measure, groups: Mapping[str, str]) -> Any:
    """Return a figure: a column for each primitive and group, with a dot for each unit.

    Args:
        measure: What was measured.
        groups: Group of each unit, by its name.

    Returns:
        A `matplotlib.figure.Figure`; bars are the groups' medians. Of many primitives some stand
        below others.

    Example:
        >>> import numpy as np
        >>> tempo = Measure("duration [s]", ("anna", "ben"), ("bow",), np.array([[1.2], [0.9]]))
        >>> figure = plot_measure(tempo, {"anna": "old", "ben": "young"})
        >>> figure.axes[0].get_ylabel()
        'duration [s]'
    """
    names = sorted(set(groups.values()))
    chosen = [[k for k, unit in enumerate(measure.units) if groups.get(unit) == g] for g in names]
    n = len(measure.primitives)
    beside = max(1, _COLUMNS // max(1, len(names)))
    n_rows = max(1, -(-n // beside))
    beside = max(1, -(-n // n_rows))
    step = min(0.5, 14.0 / (beside * max(1, len(names)))) if n_rows > 1 else 0.5
    figure = _figure(2.0 + step * max(1, len(names)) * beside, 3.6 * n_rows)
    panels = figure.subplots(n_rows, 1, sharey=True, squeeze=False)[:, 0]
    for row, axes in enumerate(panels):
        columns = np.arange(row * beside, min((row + 1) * beside, n))
        for g in range(len(names)):
            _add_group(axes, measure.values[chosen[g]][:, columns], g, len(names))
        labels = _shown([measure.primitives[k] for k in columns])
        axes.set_xticks(range(len(labels)), labels, rotation=45, ha="right", parse_math=False)
        axes.set_xlim(-0.6, beside - 0.4)
        axes.set_ylabel(measure.name)
    for g, group in enumerate(_shown(names)):
        panels[0].plot([], [], "o", color=f"C{g}", label=group)
    _add_legend(figure, loc="outside upper right", ncols=len(names))
    return figure


def _add_group(axes: Any, values: FloatArray, g: int, n_groups: int) -> None:
    """Draw a group's values, shape (U, P), as the g-th of so many."""
    at = np.arange(values.shape[1]) + (g - 0.5 * (n_groups - 1)) * 0.7 / n_groups
    spread = np.linspace(-0.1, 0.1, len(values)) if len(values) > 1 else np.zeros(len(values))
    units, columns = np.nonzero(np.isfinite(values))
    axes.plot(at[columns] + spread[units], values[units, columns], "o", ms=3, alpha=0.6, c=f"C{g}")
    for k in np.unique(columns):
        median = np.median(values[units[columns == k], k])
        axes.hlines(median, at[k] - 0.14, at[k] + 0.14, color=f"C{g}", lw=2)


def plot_transitions(counted: Transitions, groups: Mapping[str, str]) -> Any:
    """Return a figure: the transition matrix of each group, from rows to columns.

    What never follows is white. Of many primitives the matrices stand below each other, with a line
    after each ten.

    Example:
        >>> import numpy as np
        >>> counted = Transitions(("anna", "ben"), ("bow", "rise"), np.ones((2, 2, 2)))
        >>> figure = plot_transitions(counted, {"anna": "old", "ben": "young"})
        >>> [axes.get_title() for axes in figure.axes[:2]]
        ['old', 'young']
    """
    names = sorted(set(groups.values()))
    n = len(counted.primitives)
    cell = np.clip(_MATRIX_IN / max(1, n), _SMALLEST_CELL_IN, _CELL_IN)
    labels, points = _shown(counted.primitives), min(10.0, 60.0 * cell)
    margin = 0.6 + 0.01 * points * max(map(len, labels), default=0)
    size, below = margin + cell * n, cell * n > _MATRIX_IN
    shape = (len(names), 1) if below else (1, len(names))
    figure = _figure(size * shape[1] + 1.0, size * shape[0] + 0.4)
    norm = require("matplotlib.colors", "report").PowerNorm(0.5, 0.0, 1.0)  # what is rare shows
    shown = None
    for g, group in enumerate(names):
        axes = figure.add_subplot(*shape, g + 1)
        units = [unit for unit in counted.units if groups.get(unit) == group]
        matrix = counted.matrix(*units)
        matrix[matrix == 0.0] = np.nan
        shown = axes.imshow(matrix, norm=norm, cmap="magma_r", interpolation="nearest")
        look = {"fontsize": points, "parse_math": False}
        axes.set_xticks(range(n), labels, rotation=90, **look)
        axes.set_yticks(range(n), labels if g == 0 or below else [""] * n, **look)
        axes.set_title(_shown([group])[0], parse_math=False)
        if n > 30:
            axes.tick_params(length=1.5, pad=1)
            lines = {"color": "0.8", "lw": 0.5}
            for after in np.arange(9.5, n - 1, 10):
                axes.axhline(after, **lines), axes.axvline(after, **lines)
    figure.colorbar(shown, ax=figure.axes, label="share of what follows", shrink=0.5)
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
    _add_legend(axes)
    return figure
