"""How far long work is, and how long it will take."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from typing import TypeVar

from rich.console import Console
from rich.progress import BarColumn, Progress, ProgressColumn, Task, TextColumn
from rich.text import Text

T = TypeVar("T")
_BAR = 12  # columns: what stands beside it fits a terminal of 80


def open_progress(console: Console | None, *more: str) -> Progress:
    """Return a bar for each task, its share and the time that is left; shown in a ``with``.

    Args:
        console: Where it is drawn; of what is no terminal only the end comes there, and that not to
            standard error. None draws nothing.
        more: What else is said between share and time, as rich's columns of text take it.
    """
    return Progress(
        TextColumn("[bold]{task.description}"),
        BarColumn(bar_width=_BAR),
        TextColumn("{task.percentage:3.0f} %"),
        *(TextColumn(text) for text in more),
        TimeLeft(),
        console=console,
        transient=console is not None and console.stderr,
        disable=console is None or (console.stderr and not console.is_terminal),
    )


def tracked(items: Iterable[T], total: int, name: str, console: Console) -> Iterator[T]:
    """Yield items, and show how many of how many were taken."""
    with open_progress(console, "{task.completed:.0f} of {task.total:.0f}") as bar:
        yield from bar.track(items, total=total, description=name)


class TimeLeft(ProgressColumn):
    """How long it will take; once it is done, how long it took."""

    max_refresh = 0.5

    def render(self, task: Task) -> Text:
        """Return that of a task."""
        if task.finished:
            return Text(duration(task.finished_time or 0.0), "dim")
        left = task.time_remaining
        return Text("" if left is None else f"{duration(left)} left", "dim")


def duration(seconds: float) -> str:
    """Return a time as people say it.

    >>> duration(42.0), duration(200.0), duration(7000.0)
    ('42 s', '3 min 20 s', '1 h 56 min')
    """
    minutes, rest = divmod(round(seconds), 60)
    hours, minutes = divmod(minutes, 60)
    if hours:
        return f"{hours} h {minutes} min"
    return f"{minutes} min {rest} s" if minutes else f"{rest} s"
