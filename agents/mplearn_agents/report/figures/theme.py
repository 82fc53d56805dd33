"""How every figure of the report looks, and how it gets into the page."""

from __future__ import annotations

import base64
import io
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING

from mplearn.extras import require
from mplearn_agents.terminal.inert import printable

if TYPE_CHECKING:
    from matplotlib.figure import Figure

INK = "#1d2a38"
MUTED = "#66758a"
LINE = "#d5dce4"
PALE = "#eef2f6"
BLUE = "#1f5fa8"
LIGHT_BLUE = "#a9c6e6"
ORANGE = "#d2691e"
TEAL = "#17806d"
#: Colours of curves that share a panel.
CURVES = (BLUE, ORANGE, TEAL)


@contextmanager
def figure_style() -> Iterator[None]:
    """Set the report's style for the figures drawn inside.

    Raises:
        MissingDependencyError: matplotlib is not installed.

    Example:
        >>> import matplotlib
        >>> usual = matplotlib.rcParams["axes.spines.top"]
        >>> with figure_style():
        ...     matplotlib.rcParams["axes.spines.top"]
        False
        >>> matplotlib.rcParams["axes.spines.top"] == usual
        True
    """
    matplotlib = require("matplotlib", "report")
    with matplotlib.rc_context(
        {
            "figure.facecolor": "white",
            "savefig.facecolor": "white",
            "font.family": "sans-serif",
            "font.size": 9,
            "axes.edgecolor": LINE,
            "axes.labelcolor": MUTED,
            "axes.titlecolor": INK,
            "axes.titlesize": 9,
            "axes.titleweight": "bold",
            "axes.titlelocation": "left",
            "axes.spines.top": False,
            "axes.spines.right": False,
            "axes.linewidth": 0.8,
            "text.color": INK,
            "text.parse_math": False,  # a name may hold dollar signs
            "xtick.color": MUTED,
            "ytick.color": MUTED,
            "xtick.labelsize": 8,
            "ytick.labelsize": 8,
            "legend.frameon": False,
            "svg.hashsalt": "mplearn",
        }
    ):
        yield


def new_figure(width_in: float, height_in: float) -> Figure:
    """Return an empty figure that belongs to no window."""
    from matplotlib.figure import Figure
    from matplotlib.layout_engine import ConstrainedLayoutEngine

    spaced = ConstrainedLayoutEngine(wspace=0.05, hspace=0.08)
    return Figure(figsize=(width_in, height_in), layout=spaced)


def svg_uri(figure: Figure) -> str:
    """Return the figure as a data URI, for the ``src`` of an image.

    Example:
        >>> from matplotlib.figure import Figure
        >>> svg_uri(Figure((2.0, 1.0)))[:18]
        'data:image/svg+xml'
    """
    buffer = io.BytesIO()
    figure.savefig(buffer, format="svg", metadata={"Date": None})
    return data_uri(buffer.getvalue(), "image/svg+xml")


def save_png(figure: Figure, path: str | Path) -> None:
    """Write the figure as a PNG file, 150 dots an inch.

    Example:
        >>> from pathlib import Path
        >>> from matplotlib.figure import Figure
        >>> save_png(Figure((2.0, 1.0)), "empty.png")
        >>> Path("empty.png").read_bytes()[1:4]
        b'PNG'
    """
    figure.savefig(Path(path), format="png", dpi=150)


def data_uri(content: bytes, mime: str) -> str:
    """Return bytes as a data URI.

    Example:
        >>> data_uri(b"<svg/>", "image/svg+xml")
        'data:image/svg+xml;base64,PHN2Zy8+'
    """
    return f"data:{mime};base64,{base64.b64encode(content).decode('ascii')}"


def readable(name: str, limit: int = 28) -> str:
    """Return a primitive's or a joint's name as words, shortened where it is long.

    Example:
        >>> readable("both_arms_raise"), readable("a very long name of a primitive", limit=12)
        ('both arms raise', 'a very long…')
    """
    words = printable(name).replace("_", " ").strip()
    return words if len(words) <= limit else words[: limit - 1].rstrip() + "…"
