"""Joint curves of primitives: the demonstrations in light, the generated motion in strong."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from mplearn.recording import FloatArray

from .theme import CURVES, MUTED, PALE, new_figure, readable

if TYPE_CHECKING:
    from matplotlib.figure import Figure

_COLUMNS = 4


@dataclass(frozen=True, eq=False)
class PrimitiveCurves:
    """What one panel shows.

    Attributes:
        title: Name of the primitive.
        channels: Name of each channel, length D.
        exemplars: Demonstrations, each (L, D), their lengths differ.
        generated: The primitive's own motion, shape (T, D).
        duration_s: How long it usually takes [s].

    Example:
        >>> import numpy as np
        >>> t = np.linspace(0, np.pi, 50)
        >>> swing = np.stack((0.1 * np.sin(t), np.sin(t)), axis=1)
        >>> curves = PrimitiveCurves("swing", ("hip", "knee"), (swing,), swing, duration_s=1.0)
        >>> [curves.channels[i] for i in curves.most_active]
        ['knee', 'hip']
    """

    title: str
    channels: tuple[str, ...]
    exemplars: tuple[FloatArray, ...]
    generated: FloatArray
    duration_s: float

    @property
    def most_active(self) -> list[int]:
        """The three channels that move most in the generated motion, most active first."""
        return [int(k) for k in np.argsort(-np.ptp(self.generated, axis=0), kind="stable")[:3]]


def draw_curves(primitives: Sequence[PrimitiveCurves]) -> Figure:
    """Draw a panel for each primitive, with its three most active joints.

    All motions of a panel are stretched to the primitive's mean duration.

    Example:
        >>> import numpy as np
        >>> t = np.linspace(0, np.pi, 50)
        >>> swing = np.stack((0.1 * np.sin(t), np.sin(t)), axis=1)
        >>> curves = PrimitiveCurves("swing", ("hip", "knee"), (swing,), swing, duration_s=1.0)
        >>> len(draw_curves([curves]).axes[0].lines) > 0
        True
    """
    rows = -(-len(primitives) // _COLUMNS)
    figure = new_figure(11.5, 2.35 * rows)
    for k, primitive in enumerate(primitives):
        axes = figure.add_subplot(rows, _COLUMNS, k + 1)
        axes.set_title(readable(primitive.title))
        axes.grid(True, color=PALE, linewidth=0.8)
        for channel, colour in zip(primitive.most_active, CURVES, strict=False):
            for exemplar in primitive.exemplars:
                axes.plot(
                    np.linspace(0, primitive.duration_s, len(exemplar)),
                    exemplar[:, channel],
                    color=colour,
                    alpha=0.22,
                    linewidth=0.9,
                )
            axes.plot(
                np.linspace(0, primitive.duration_s, len(primitive.generated)),
                primitive.generated[:, channel],
                color=colour,
                linewidth=2.2,
                label=readable(primitive.channels[channel]),
            )
        axes.margins(x=0, y=0.12)
        axes.legend(fontsize=7, handlelength=1.0, borderaxespad=0.1, labelspacing=0.25, loc="best")
        if k >= len(primitives) - _COLUMNS:
            axes.set_xlabel("time [s]", fontsize=8, color=MUTED)
        if k % _COLUMNS == 0:
            axes.set_ylabel("angle [rad]", fontsize=8, color=MUTED)
    return figure
