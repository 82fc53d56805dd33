"""The primitive tree: its leaves are the primitives, the nodes above them more general motions."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING

from .theme import BLUE, INK, LIGHT_BLUE, LINE, MUTED, new_figure, readable

if TYPE_CHECKING:
    from matplotlib.figure import Figure

_ROW_IN = 0.27
_LEVEL = 0.55  # width of a level, the text beside a leaf being 1.15 wide


def draw_tree(
    parents: Mapping[int, int | None], labels: Mapping[int, str], exemplars: Mapping[int, int]
) -> Figure:
    """Draw the tree from its root at the left to the primitives at the right.

    Args:
        parents: The parent of each node; None for the root and for what has no parent.
        labels: Text beside a leaf.
        exemplars: How many demonstrations a leaf holds; a bar shows them.

    Example:
        >>> parents = {0: None, 1: 0, 2: 0}
        >>> figure = draw_tree(parents, {1: "bow", 2: "wave"}, {1: 7, 2: 4})
        >>> {"bow", "wave"} <= {text.get_text().strip() for text in figure.axes[0].texts}
        True
    """
    children: dict[int | None, list[int]] = {}
    for node, parent in parents.items():
        children.setdefault(parent, []).append(node)
    rows: dict[int | None, float] = {}
    depth: dict[int | None, float] = {None: -_LEVEL}

    def place(node: int | None) -> None:
        below = sorted(children.get(node, ()), key=lambda n: (n in children, labels.get(n, "")))
        for child in below:
            depth[child] = depth[node] + _LEVEL
            place(child)
        if below:
            rows[node] = (rows[below[0]] + rows[below[-1]]) / 2
        elif node is not None:
            rows[node] = sum(1 for n in rows if n not in children)

    place(None)
    roots = children.get(None, [])
    leaves = [node for node in parents if node not in children]
    levels = max((depth[leaf] for leaf in leaves), default=0.0)
    figure = new_figure(9.0, max(1.6, _ROW_IN * (len(leaves) + 1.5)))
    axes = figure.add_subplot()
    for node, parent in parents.items():
        if parent is None:
            continue
        x = levels if node not in children else depth[node]
        axes.plot(
            [depth[parent], depth[parent], x],
            [rows[parent], rows[node], rows[node]],
            color=LINE,
            linewidth=1.4,
            solid_joinstyle="round",
            zorder=1,
        )
    inner = [node for node in parents if node in children]
    axes.scatter([depth[n] for n in inner], [rows[n] for n in inner], s=26, color=MUTED, zorder=3)
    for node in inner:
        if node not in roots:
            axes.annotate(
                f"{node}", (depth[node], rows[node]), (0, 5), textcoords="offset points",
                ha="center", fontsize=7, color=MUTED,
            )  # fmt: skip
    axes.scatter([levels] * len(leaves), [rows[n] for n in leaves], s=30, color=BLUE, zorder=3)
    most = max((exemplars.get(n, 0) for n in leaves), default=1) or 1
    for leaf in leaves:
        row, count = rows[leaf], exemplars.get(leaf, 0)
        axes.text(levels + 0.06, row, readable(labels.get(leaf, str(leaf))), va="center", color=INK)
        axes.barh(row, 0.9 * count / most, left=levels + 1.15, height=0.5, color=LIGHT_BLUE)
        axes.text(
            levels + 1.18 + 0.9 * count / most, row, str(count), va="center", fontsize=8,
            color=MUTED,
        )  # fmt: skip
    axes.text(levels + 1.15, -1.0, "demonstrations", fontsize=8, color=MUTED, va="center")
    axes.set_xlim(-0.1, levels + 2.3)
    axes.set_ylim(len(leaves) - 0.4, -1.5)
    axes.axis("off")
    return figure
