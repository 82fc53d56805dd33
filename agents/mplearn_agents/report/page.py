"""The page itself: plain values in, one self-contained HTML text out."""

from __future__ import annotations

from dataclasses import dataclass, field
from importlib.resources import files
from typing import Literal

from mplearn.extras import require
from mplearn_agents.terminal.inert import printable


@dataclass(frozen=True)
class Number:
    """A headline number: its value, what it means, and what to hold it against."""

    value: str
    meaning: str
    beside: str = ""


@dataclass(frozen=True)
class Rate:
    """A row of the table against the paper."""

    name: str
    here: str
    paper: str
    verdict: Literal["better", "worse", ""] = ""


@dataclass(frozen=True)
class Column:
    """A column of the table of primitives."""

    name: str
    numeric: bool = False


@dataclass(frozen=True)
class Row:
    """A row of the table of primitives; absent where the motion was performed but not learned."""

    cells: tuple[str, ...]
    absent: bool = False


@dataclass(frozen=True)
class Shown:
    """A figure: its data URI and one sentence that explains it."""

    uri: str
    caption: str


@dataclass(frozen=True)
class Still:
    """A picture of the film strip: its data URI, what is performed, and when [s]."""

    uri: str
    name: str
    at_s: float


@dataclass(frozen=True)
class Step:
    """A step of the walk."""

    name: str
    duration_s: float
    fell: bool = False


@dataclass(frozen=True)
class Walk:
    """What the section on the walk shows.

    Attributes:
        summary: A sentence or two.
        steps: The primitives in order.
        video: The video as a data URI; empty where there is none.
        video_caption: What the video shows.
        film: Pictures of the film strip.
        missing: Why there are no pictures; empty where there are.
    """

    summary: str
    steps: tuple[Step, ...]
    video: str = ""
    video_caption: str = ""
    film: tuple[Still, ...] = ()
    missing: str = ""


@dataclass(frozen=True)
class Page:
    """All that the report says; sections without content are left out.

    Attributes:
        figures: Any of "progress", "stream", "curves", "tree" and "graph".

    Example:
        >>> page = Page("Swings", "What one arm did.", numbers=(), footer="mplearn")
        >>> page.walk is None, page.figures
        (True, {})
    """

    title: str
    lead: str
    numbers: tuple[Number, ...]
    learned_summary: str = ""
    rates: tuple[Rate, ...] = ()
    rates_note: str = ""
    primitive_columns: tuple[Column, ...] = ()
    primitives: tuple[Row, ...] = ()
    figures: dict[str, Shown] = field(default_factory=dict)
    walk: Walk | None = None
    footer: str = ""


_SPACES = "\n\t\u00a0\u2009\u202f"  # which are not printable, and stay


def render_page(page: Page) -> str:
    """Return the page as one HTML text that refers to nothing outside itself.

    Raises:
        MissingDependencyError: jinja2 is not installed.

    Example:
        >>> html = render_page(Page("Swings", "What one arm did.", numbers=()))
        >>> "What one arm did." in html, "http://" in html.replace("http://www.w3.org", "")
        (True, False)
    """
    jinja2 = require("jinja2", "report")
    template = jinja2.Environment(autoescape=True, undefined=jinja2.StrictUndefined).from_string(
        (files(__package__) / "report.html.j2").read_text(encoding="utf-8")
    )
    present = {
        "walk": page.walk is not None,
        "learned": bool(page.rates or page.primitives),
        "segmentation": "stream" in page.figures,
        "curves": "curves" in page.figures,
        "tree": "tree" in page.figures,
        "graph": "graph" in page.figures,
    }
    names = {
        "walk": "The walk",
        "learned": "What was learned",
        "segmentation": "Segmentation",
        "curves": "Primitives",
        "tree": "Tree",
        "graph": "Graph",
    }
    sections = [(key, names[key]) for key, shown in present.items() if shown]
    text = str(template.render(page=page, sections=sections))
    return printable(text, keep=_SPACES)
