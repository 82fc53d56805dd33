"""The result of an experiment: a table with a title, and what the numbers mean."""

from __future__ import annotations

import json
from dataclasses import asdict, dataclass

from ..errors import InvalidValueError


@dataclass(frozen=True)
class Table:
    """Rows of text under a title.

    Attributes:
        title: What was measured.
        columns: Heads of the columns, length k.
        rows: Cells, each row of length k.
        note: How to read it: protocol, matching rule, tolerance.

    Example:
        >>> found = Table("Primitives", ("person", "found"), (("s01", "22"), ("s02", "21")))
        >>> found.rows[1]
        ('s02', '21')
    """

    title: str
    columns: tuple[str, ...]
    rows: tuple[tuple[str, ...], ...]
    note: str = ""

    def __post_init__(self) -> None:
        for row in self.rows:
            if len(row) != len(self.columns):
                raise InvalidValueError(
                    f"table {self.title!r} has {len(self.columns)} columns, a row has {len(row)}"
                )

    def to_json(self) -> str:
        """Return the table as a JSON object of one line, with its attributes."""
        return json.dumps(asdict(self))

    def to_markdown(self) -> str:
        """Return the table as Markdown."""
        lines = [f"### {self.title}", ""]
        lines += [_row(self.columns), _row(("---",) * len(self.columns))]
        lines += [_row(row) for row in self.rows]
        return "\n".join([*lines, "", self.note, ""] if self.note else [*lines, ""])


def _row(cells: tuple[str, ...]) -> str:
    return "| " + " | ".join(cell.replace("|", "\\|") for cell in cells) + " |"


def percent(share: float, digits: int = 1) -> str:
    """Return a share as a percentage, ``"3.5 %"``; a dash where it is not defined."""
    return "-" if share != share else f"{100 * share:.{digits}f} %"
