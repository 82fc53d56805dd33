"""What commands print: text that is text (`inert`), and tables that fit; nothing is markup."""

from __future__ import annotations

import math
import sys
from collections.abc import Iterable
from copy import copy
from dataclasses import replace
from typing import TextIO

from rich.console import Console, ConsoleOptions, RenderableType
from rich.measure import Measurement
from rich.segment import Segment
from rich.table import Table
from rich.text import Text

from mplearn_agents.terminal.inert import printable

_ENDLESS = 100_000  # columns where no terminal cuts or wraps
_LEAST_SHARE = 0.4  # of its width that a text in a table keeps: three lines at most, nearly always


class InertConsole(Console):
    """A console on which text is text, and tables are never cut.

    A table that is wider than the terminal has its texts in lines of words, where that does it, or
    else is turned: a block of lines for each of its rows. Where the output is no terminal, nothing
    is wrapped.
    """

    def render(
        self, renderable: RenderableType, options: ConsoleOptions | None = None
    ) -> Iterable[Segment]:
        """Render something, spelling out what is not printable in its text."""
        if isinstance(renderable, Table) and self.is_terminal:
            options = options or self.options
            if natural_width(self, renderable) > options.max_width:
                renderable = narrowed(self, renderable, options.max_width) or turned(renderable)
        encoding = self.encoding
        for text, style, control in super().render(renderable, options):
            if not control:
                text = printable(text, "\n").encode(encoding, "backslashreplace").decode(encoding)
            yield Segment(text, style, control)

    def on_broken_pipe(self) -> None:
        """Let the command see that nobody reads any more, instead of ending it with code 1."""
        self.quiet = True
        raise BrokenPipeError


def open_console(*, stderr: bool = False) -> Console:
    """Return the console of a command."""
    file: TextIO = sys.stderr if stderr else sys.stdout
    while (under := getattr(file, "rich_proxied_file", None)) is not None:
        file = under  # text is spelled out here: what moves a bar's cursor has to pass
    console = InertConsole(file=file, stderr=stderr, markup=False, highlight=False, emoji=False)
    if not console.is_terminal:
        console.width = _ENDLESS
    return console


def natural_width(console: Console, table: Table) -> int:
    """Return how many columns a table takes if no cell is wrapped."""
    wide = console.options.update(width=_ENDLESS, max_width=_ENDLESS)
    return table.__rich_measure__(console, wide).maximum


def narrowed(console: Console, table: Table, width: int) -> Table | None:
    """Return a table whose texts are wrapped between words, so that it fits.

    Args:
        console: Where it is printed.
        table: The table.
        width: Columns that there are.

    Returns:
        The table; None where a text would be less than `_LEAST_SHARE` as wide as it is, or narrower
        than its longest word. The widest is wrapped first.
    """
    wide = console.options.update(width=_ENDLESS, max_width=_ENDLESS)
    widths, least = {}, {}
    for at, column in enumerate(table.columns):
        if column.justify == "left":
            cells = (column.header, *column.cells)
            sizes = [Measurement.get(console, wide, cell) for cell in cells]
            widths[at] = max(size.maximum for size in sizes)
            longest_word = max(size.minimum for size in sizes)
            least[at] = max(longest_word, math.ceil(_LEAST_SHARE * widths[at]))
    for _ in range(natural_width(console, table) - width):
        free = [at for at in widths if widths[at] > least[at]]
        if not free:
            return None
        widths[max(free, key=widths.__getitem__)] -= 1
    out = copy(table)
    out.columns = [
        replace(column, width=widths.get(at), no_wrap=at not in widths)
        for at, column in enumerate(table.columns)
    ]
    return out


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
