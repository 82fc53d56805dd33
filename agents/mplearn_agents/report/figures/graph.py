"""The transition graph: primitives on an ellipse, likely successors close to each other."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import networkx as nx
import numpy as np

from mplearn.recording import FloatArray

from .theme import BLUE, INK, LIGHT_BLUE, new_figure, readable

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

_PILL = np.array([1.36, 0.46])  # width and height of a node [in]
_LABEL = np.array([0.32, 0.19])  # room of an edge's label [in]


def draw_graph(graph: nx.DiGraph[int], labels: Mapping[int, str], least: float = 0.04) -> Figure:
    """Draw the transition probabilities.

    Args:
        graph: Primitives as nodes, each edge with its ``"probability"``.
        labels: Text in a node.
        least: Transitions less probable than this are left out, so that the rest can be read.

    Example:
        >>> import networkx as nx
        >>> graph = nx.DiGraph()
        >>> graph.add_weighted_edges_from([(1, 2, 1.0), (2, 1, 0.9), (2, 2, 0.1)], "probability")
        >>> len(draw_graph(graph, {1: "up", 2: "down"}).axes)
        1
    """
    order = circular_order(graph)
    at, size = _places(len(order))
    places = dict(zip(order, at, strict=True))
    figure = new_figure(*(size + _PILL + 0.7))
    axes = figure.add_subplot()
    axes.set_aspect("equal")
    axes.set_xlim(*(np.array([-0.5, 0.5]) * (size[0] + _PILL[0] + 0.7)))
    axes.set_ylim(*(np.array([-0.5, 0.5]) * (size[1] + _PILL[1] + 0.7)))
    axes.axis("off")
    edges = sorted(
        (
            (probability, before, after)
            for before, after, probability in graph.edges(data="probability")
            if probability >= least
        ),
        reverse=True,
    )
    taken = [(place, _PILL) for place in at]
    for probability, before, after in reversed(edges):
        _draw_edge(axes, places, order, probability, before, after)
    for probability, before, after in edges:
        curve = _curve(places, order, before, after)
        _label_edge(axes, curve, probability, taken)
    for node in order:
        _draw_node(axes, places[node], labels.get(node, str(node)))
    return figure


def circular_order(graph: nx.DiGraph[int]) -> list[int]:
    """Order the nodes around a circle so that probable transitions are short.

    A local search over moves of one node, from the order in which the graph names them; the sum
    of probability times distance around the circle never grows, so it ends.
    """
    nodes = sorted(graph)
    weights = nx.to_numpy_array(graph, nodelist=nodes, weight="probability")
    weights = weights + weights.T
    order = list(range(len(nodes)))
    best, improved = _length(order, weights), True
    while improved:
        improved = False
        for i in range(len(order)):
            for j in range(len(order)):
                moved = order[:i] + order[i + 1 :]
                moved.insert(j, order[i])
                length = _length(moved, weights)
                if length < best - 1e-9:
                    order, best, improved = moved, length, True
    return [nodes[i] for i in order]


def _length(order: Sequence[int], weights: FloatArray) -> float:
    n = len(order)
    position = np.empty(n)
    position[order] = np.arange(n)
    apart = np.abs(position[:, None] - position[None, :])
    return float((weights * np.minimum(apart, n - apart)).sum())


def _places(n: int) -> tuple[FloatArray, FloatArray]:
    """Return n points (n, 2) evenly along an ellipse, and its width and height, all [in]."""
    perimeter = max(n, 6) * 1.72
    half_width = perimeter / 5.55  # of an ellipse 1.3 times as wide as high
    size = np.array([2 * half_width, 2 * half_width / 1.3])
    angle = np.linspace(0.0, 2 * math.pi, 2000)
    outline = 0.5 * size * np.column_stack([-np.cos(angle), np.sin(angle)])
    along = np.concatenate([[0], np.cumsum(np.linalg.norm(np.diff(outline, axis=0), axis=1))])
    wanted = (np.arange(n) + 0.5) / n * along[-1]
    return np.column_stack([np.interp(wanted, along, outline[:, k]) for k in (0, 1)]), size


def _curve(
    places: Mapping[int, FloatArray], order: Sequence[int], before: int, after: int
) -> FloatArray:
    """Return the control points of an edge's quadratic Bezier curve, shape (3, 2)."""
    start, end = places[before], places[after]
    if before == after:
        return np.repeat([_above(start, 0.42)], 3, axis=0)  # the label of a loop has one place
    return np.array([start, _control(places, order, before, after), end])


def _control(
    places: Mapping[int, FloatArray], order: Sequence[int], before: int, after: int
) -> FloatArray:
    start, end = places[before], places[after]
    bend = _bend(places, order, before, after)
    dx, dy = end - start
    middle: FloatArray = (start + end) / 2 + bend * np.array([dy, -dx])
    return middle


def _bend(places: Mapping[int, FloatArray], order: Sequence[int], before: int, after: int) -> float:
    """Return matplotlib's ``rad``: near nodes bend to the middle, far ones keep to their right."""
    n = len(order)
    apart = abs(order.index(before) - order.index(after))
    apart = min(apart, n - apart)
    if apart > n / 4:
        return 0.12
    start, end = places[before], places[after]
    dx, dy = end - start
    inward = -math.copysign(1.0, float(np.dot((start + end) / 2, [dy, -dx])))
    first = order.index(before) < order.index(after)
    return inward * (0.14 if first else 0.5)


def _draw_edge(
    axes: Axes,
    places: Mapping[int, FloatArray],
    order: Sequence[int],
    probability: float,
    before: int,
    after: int,
) -> None:
    from matplotlib.colors import LinearSegmentedColormap
    from matplotlib.patches import FancyArrowPatch, Rectangle

    colour = LinearSegmentedColormap.from_list("edges", [LIGHT_BLUE, BLUE])(probability)
    style: dict[str, Any] = {
        "arrowstyle": "-|>,head_length=5,head_width=2.4",
        "color": colour,
        "linewidth": 0.7 + 2.1 * probability,
        "capstyle": "butt",
        "joinstyle": "miter",
        "mutation_scale": 1.0 + 0.25 * probability,
        "zorder": 1 + probability,
    }
    if before == after:
        foot = _above(places[before], 0.0)
        side = np.array([math.copysign(0.16, -foot[1]), 0.0])
        axes.add_patch(
            FancyArrowPatch(
                _xy(foot - side), _xy(foot + side), connectionstyle="arc3,rad=1.8", **style
            )
        )
        return
    pills = [
        Rectangle(_xy(places[node] - _PILL / 2), *_PILL, visible=False) for node in (before, after)
    ]
    for pill in pills:
        axes.add_patch(pill)
    axes.add_patch(
        FancyArrowPatch(
            _xy(places[before]),
            _xy(places[after]),
            connectionstyle=f"arc3,rad={_bend(places, order, before, after)}",
            patchA=pills[0],
            patchB=pills[1],
            shrinkA=0,
            shrinkB=1,
            **style,
        )
    )


def _label_edge(
    axes: Axes,
    curve: FloatArray,
    probability: float,
    taken: list[tuple[FloatArray, FloatArray]],
) -> None:
    """Write the probability on its curve, at the first place where it covers nothing else."""
    for t in (0.42, 0.5, 0.34, 0.58, 0.28, 0.66, 0.22, 0.74, 0.8, 0.85):
        at = (1 - t) ** 2 * curve[0] + 2 * t * (1 - t) * curve[1] + t**2 * curve[2]
        if all((np.abs(at - other) > (size + _LABEL) / 2).any() for other, size in taken):
            taken.append((at, _LABEL))
            axes.text(
                at[0],
                at[1],
                f"{100 * probability:.0f}",
                ha="center",
                va="center",
                fontsize=9,
                color=INK,
                zorder=5,
                bbox={"boxstyle": "round,pad=0.12", "facecolor": "white", "linewidth": 0},
            )
            return


def _draw_node(axes: Axes, place: FloatArray, label: str) -> None:
    from matplotlib.patches import FancyBboxPatch

    axes.add_patch(
        FancyBboxPatch(
            _xy(place - _PILL / 2 + 0.1),
            width=_PILL[0] - 0.2,
            height=_PILL[1] - 0.2,
            boxstyle="round,pad=0.1,rounding_size=0.16",
            facecolor="white",
            edgecolor=BLUE,
            linewidth=1.1,
            zorder=6,
        )
    )
    words = readable(label, 34).split()
    half = max(range(len(words) + 1), key=lambda k: -_widest(words, k)) if len(words) > 1 else 1
    text = " ".join(words[:half]) + ("\n" + " ".join(words[half:]) if words[half:] else "")
    size = 10 if _widest(words, half) <= 14 else 8
    axes.text(
        place[0], place[1], text, ha="center", va="center", fontsize=size, linespacing=1.05,
        zorder=7, color=INK,
    )  # fmt: skip


def _widest(words: Sequence[str], at: int) -> int:
    return max(len(" ".join(words[:at])), len(" ".join(words[at:])))


def _above(place: FloatArray, gap: float) -> FloatArray:
    """Return a point outside the ellipse, above or below a node, so far from its rim [in]."""
    up = math.copysign(0.5 * float(_PILL[1]) + gap, place[1])
    return np.array([place[0], place[1] + up])


def _xy(point: FloatArray) -> tuple[float, float]:
    return float(point[0]), float(point[1])
