"""What commands print: text that is text (`inert`), and tables that fit; nothing is markup."""

from __future__ import annotations

from collections.abc import Iterable

from rich.console import Console, ConsoleOptions, RenderableType
from rich.segment import Segment
from rich.table import Table
from rich.text import Text

from mplearn_agents.terminal.inert import printable

_ENDLESS = 100_000  # columns where no terminal cuts or wraps


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
