"""What commands say: text that nobody's name can turn into anything else, and tables that fit.

Names come from anywhere: files, people, the network. All that is printed passes through here, where
what would steer a terminal is spelled out, and nothing is markup.
"""

from __future__ import annotations

import re
import sys
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from typing import Any, TextIO

from rich.console import Console, ConsoleOptions, RenderableType
from rich.segment import Segment
from rich.table import Table
from rich.text import Text

_UNUSUAL = re.compile(r"[^ -~]")
_ENDLESS = 100_000  # columns where no terminal cuts or wraps


def printable(text: str, keep: str = "") -> str:
    """Return a text in which what would steer a terminal, in names of a file, is spelled out.

    Control characters and escapes, lone surrogates, and controls of the writing's direction become
    what Python writes for them; characters of ``keep`` stay.
    """

    def spelled(found: re.Match[str]) -> str:
        c = found.group()
        return c if c.isprintable() or c in keep else ascii(c)[1:-1]

    return _UNUSUAL.sub(spelled, text)


class InertStream:
    """A text stream on which only lines of printable text come out.

    Args:
        stream: Where they go; what it cannot encode is spelled out.
    """

    def __init__(self, stream: TextIO) -> None:
        self.rich_proxied_file = stream  # rich writes past this: `InertConsole` cleans its text

    def write(self, text: str) -> int:
        """Write a text, spelling out what is not printable."""
        stream = self.rich_proxied_file
        encoding = stream.encoding or "utf-8"
        plain = printable(text, "\n").encode(encoding, "backslashreplace").decode(encoding)
        stream.write(plain)
        return len(text)

    def writelines(self, lines: Iterable[str]) -> None:
        """Write texts one after the other."""
        for line in lines:
            self.write(line)

    def __getattr__(self, name: str) -> Any:
        return getattr(self.rich_proxied_file, name)


@contextmanager
def inert_output() -> Iterator[None]:
    """Let nothing printed inside steer the terminal."""
    before = sys.stdout, sys.stderr
    sys.stdout, sys.stderr = InertStream(before[0]), InertStream(before[1])
    try:
        yield
    finally:
        sys.stdout, sys.stderr = before


class InertConsole(Console):
    """A console on which text is text, and tables are never cut.

    A table that is wider than the terminal is turned: a block of lines for each of its rows. Where
    the output is no terminal, nothing is wrapped.
    """

    def render(
        self, renderable: RenderableType, options: ConsoleOptions | None = None
    ) -> Iterable[Segment]:
        """Render something, spelling out what is not printable in its text."""
        if isinstance(renderable, Table) and self.is_terminal:
            options = options or self.options
            if natural_width(self, renderable) > options.max_width:
                renderable = turned(renderable)
        encoding = self.encoding
        for text, style, control in super().render(renderable, options):
            if not control:
                text = printable(text, "\n").encode(encoding, "backslashreplace").decode(encoding)
            yield Segment(text, style, control)


def open_console(*, stderr: bool = False) -> Console:
    """Return the console of a command."""
    console = InertConsole(stderr=stderr, markup=False, highlight=False, emoji=False)
    if not console.is_terminal:
        console = InertConsole(
            stderr=stderr, markup=False, highlight=False, emoji=False, width=_ENDLESS
        )
    return console


def natural_width(console: Console, table: Table) -> int:
    """Return how many columns a table takes if no cell is wrapped."""
    wide = console.options.update(width=_ENDLESS, max_width=_ENDLESS)
    return table.__rich_measure__(console, wide).maximum


def turned(table: Table) -> Table:
    """Return a table with a line for each cell: what the column is called, and the cell."""
    out = Table.grid(padding=(0, 2))
    out.title, out.title_justify, out.caption = table.title, "left", table.caption
    out.caption_justify = "left"
    out.add_column(style="dim", no_wrap=True)
    out.add_column(overflow="fold")
    columns = [(column.header, list(column.cells)) for column in table.columns]
    for row in range(table.row_count):
        for header, cells in columns:
            out.add_row(header, cells[row])
        out.add_row("", "")
    return out


def new_table(title: str, *columns: str, right: Iterable[str] = ()) -> Table:
    """Return an empty table; the columns in ``right`` are aligned there."""
    table = Table(title=title, title_justify="left")
    for name in columns:
        table.add_column(
            name, justify="right" if name in right else "left", no_wrap=False, overflow="fold"
        )
    return table


def heading(word: str, text: str) -> Text:
    """Return a line that begins with a word in bold."""
    return Text.assemble((f"{word:8s}", "bold"), " ", text)
