"""What a library holds, as figures and as a page of its own."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING

from mplearn_agents.terminal.tables import most_active

from .figures import (
    PrimitiveCurves,
    draw_curves,
    draw_graph,
    draw_tree,
    figure_style,
    readable,
    save_png,
    svg_uri,
)
from .page import Column, Number, Page, Row, Shown

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from mplearn.library import PrimitiveLibrary

CAPTIONS = {
    "curves": (
        "The three joints that each primitive moves most: its demonstrations in light, the motion "
        "that its model generates in strong, all stretched to its mean duration."
    ),
    "tree": (
        "General motions at the left, primitives at the right; the bars show how many "
        "demonstrations each was learned from."
    ),
    "graph": (
        "An arrow leads to what came next, its number is the probability in per cent and its width "
        "grows with it; transitions below 4 % are left out."
    ),
}
_PANELS = 12


def library_figures(
    library: PrimitiveLibrary,
    labels: Mapping[int, str],
    folder: Path | None = None,
) -> dict[str, Shown]:
    """Draw the curves, the tree and the graph.

    Args:
        library: What was learned.
        labels: What each primitive is called in the figures.
        folder: Where PNG files of the figures go; None writes none.

    Example:
        >>> import numpy as np
        >>> from mplearn import LearnerConfig, MotionLearner
        >>> t = np.arange(800) / 100.0
        >>> swing = np.where(t % 2 < 1, np.sin(np.pi * t) ** 2, 0.0)[:, None]  # up, down, a rest
        >>> learner = MotionLearner(LearnerConfig(("elbow",), segmenter="zero-velocity"))
        >>> events = learner.learn_many(swing)
        >>> sorted(library_figures(learner.snapshot(), {1: "up", 2: "down"}))
        ['curves', 'graph', 'tree']
    """
    if not len(library):
        return {}
    shown = sorted(library.primitives, key=lambda p: (-p.n_exemplars, p.id))[:_PANELS]
    curves = [
        PrimitiveCurves(
            title=labels[primitive.id],
            channels=library.channels,
            exemplars=primitive.exemplars,
            generated=library.generate([primitive.id]).frames,
            duration_s=primitive.mean_duration_s,
        )
        for primitive in shown
    ]
    with figure_style():
        figures = {
            "curves": draw_curves(curves),
            "tree": draw_tree(
                {node.id: node.parent for node in library.tree},
                labels,
                {node.id: node.n_exemplars for node in library.tree},
            ),
            "graph": draw_graph(library.graph.to_networkx(), labels),
        }
        return {
            name: show(figure, name, CAPTIONS[name], folder) for name, figure in figures.items()
        }


def show(figure: Figure, name: str, caption: str, folder: Path | None) -> Shown:
    """Return a figure for the page, and write it as a PNG file too where a folder is given."""
    if folder is not None:
        save_png(figure, folder / f"{name}.png")
    return Shown(svg_uri(figure), caption)


def library_page(library: PrimitiveLibrary, source: str) -> Page:
    """Return the page that shows a library by itself.

    Args:
        library: What was learned.
        source: Name of the file it came from.

    Example:
        >>> import numpy as np
        >>> from mplearn import LearnerConfig, MotionLearner
        >>> t = np.arange(800) / 100.0
        >>> swing = np.where(t % 2 < 1, np.sin(np.pi * t) ** 2, 0.0)[:, None]  # up, down, a rest
        >>> learner = MotionLearner(LearnerConfig(("elbow",), segmenter="zero-velocity"))
        >>> events = learner.learn_many(swing)
        >>> page = library_page(learner.snapshot(), "swings.mplearn")
        >>> sorted(page.figures), len(page.primitives)
        (['curves', 'graph', 'tree'], 2)
    """
    n_edges = library.graph.to_networkx().number_of_edges()
    return Page(
        title=f"{len(library)} motion primitives in {source}",
        lead=(
            "Motion primitives and their order, learned on-line by watching a person: each is a "
            "hidden Markov model, and a graph says which one follows which, and how often."
        ),
        numbers=(
            Number(str(len(library)), "primitives"),
            Number(str(sum(p.n_exemplars for p in library.primitives)), "demonstrations"),
            Number(str(n_edges), "transitions"),
            Number(str(len(library.channels)), "channels", f"at {library.rate_hz:g} Hz"),
        ),
        learned_summary="Durations are means over all demonstrations of a primitive.",
        primitive_columns=(
            Column("id", numeric=True),
            Column("name"),
            Column("demonstrations", numeric=True),
            Column("duration", numeric=True),
            Column("most active"),
        ),
        primitives=tuple(
            Row(
                (
                    str(primitive.id),
                    primitive.name,
                    str(primitive.n_exemplars),
                    f"{primitive.mean_duration_s:.2f} s",
                    ", ".join(map(readable, most_active(primitive, library.channels))),
                )
            )
            for primitive in library.primitives
        ),
        figures=library_figures(library, {p.id: p.name for p in library.primitives}),
        footer=f"Library version {library.version}, body {library.body or 'none'}.",
    )
