"""The page is whole and refers to nothing outside; the graph's drawing puts neighbours together."""

import re
from dataclasses import replace
from itertools import permutations

import networkx as nx
import numpy as np
import pytest

from mplearn_agents.report import Page, library_page, render_page
from mplearn_agents.report.figures.graph import circular_order
from mplearn_agents.report.page import Column, Number, Rate, Row, Step, Still, Walk

pytest.importorskip("matplotlib")
pytest.importorskip("jinja2")


@pytest.fixture(scope="module")
def page(library):
    return library_page(library, "small.mplearn")


def referred(html):
    """Return whatever the page would fetch."""
    return re.findall(r"""(?:src|href|poster|action)\s*=\s*["']([^"']*)|url\(([^)]*)\)""", html)


def test_a_librarys_page_shows_all_of_it(library, page):
    html = render_page(page)
    for primitive in library.primitives:
        assert f"<td>{primitive.name}</td>" in html
    for section in ("learned", "curves", "tree", "graph"):
        assert f'<section id="{section}">' in html
        assert f'href="#{section}"' in html
    assert html.count("data:image/svg+xml;base64,") == 3
    assert library.version in html


def test_a_page_refers_to_nothing_outside(page):
    walk = Walk(
        "A walk.",
        (Step("squat", 1.5), Step("bow", 2.5, fell=True)),
        video="data:video/mp4;base64,AAAA",
        video_caption="A film.",
        film=(Still("data:image/jpeg;base64,AAAA", "squat", 0.75),),
    )
    rate = Rate("false positives", "1 %", "3.5 %", "better")
    html = render_page(replace(page, walk=walk, rates=(rate,)))
    found = [a or b for a, b in referred(html)]
    assert len(found) > 8
    assert all(each.startswith(("data:", "#")) for each in found)
    assert "<script" not in html
    assert "<link" not in html
    for said in ("false positives", "3.5 %", "squat", "A film.", 'class="fell"', "<video", "0.8 s"):
        assert said in html


def test_sections_without_content_are_left_out():
    html = render_page(Page("Title", "Lead.", (Number("1", "thing"),)))
    assert "<section" not in html
    assert "Title" in html
    missing = Walk("A walk.", (Step("bow", 2.0),), missing="No renderer here.")
    html = render_page(Page("Title", "Lead.", (), walk=missing))
    assert "No renderer here." in html
    assert "<video" not in html


def test_names_cannot_break_the_page():
    html = render_page(
        Page(
            "Title", "Lead.", (), primitive_columns=(Column("name"),),
            primitives=(Row(("<script>alert(1)</script>",)),),
        )
    )  # fmt: skip
    assert "<script" not in html
    assert "&lt;script&gt;" in html


def test_figures_are_written_beside_the_page(library, tmp_path):
    from mplearn_agents.report import library_figures

    shown = library_figures(library, {p.id: p.name for p in library.primitives}, tmp_path)
    assert set(shown) == {"curves", "tree", "graph"}
    for name in shown:
        assert (tmp_path / f"{name}.png").read_bytes().startswith(b"\x89PNG")


@pytest.mark.parametrize("seed", range(4))
def test_the_order_around_the_circle_is_locally_best(seed):
    rng = np.random.default_rng(seed)
    graph = nx.DiGraph()
    graph.add_nodes_from(range(7))
    for i in range(7):
        for j in rng.choice(7, 2, replace=False):
            graph.add_edge(i, int(j), probability=0.5)

    def length(order):
        at = {node: k for k, node in enumerate(order)}
        apart = [abs(at[a] - at[b]) for a, b in graph.edges]
        return sum(0.5 * min(d, 7 - d) for d in apart)

    found = circular_order(graph)
    assert sorted(found) == list(range(7))
    assert length(found) <= length(range(7))
    best = min(length((0, *rest)) for rest in permutations(range(1, 7)))
    assert length(found) <= 1.25 * best


def test_a_ring_is_drawn_as_a_ring():
    nodes = [5, 2, 9, 4, 7, 1]
    graph = nx.DiGraph()
    for a, b in zip(nodes, nodes[1:] + nodes[:1], strict=True):
        graph.add_edge(a, b, probability=1.0)
    order = circular_order(graph)
    assert all(
        order[(order.index(a) + step) % 6] == b
        for step in [1 if graph.has_edge(order[0], order[1]) else -1]
        for a, b in graph.edges
    )
