"""Help in lines that fit the terminal."""

from __future__ import annotations

import argparse
import textwrap
from collections.abc import Callable

_LONGEST = 24  # letters of choices that stand for a value itself


class HelpThatFits(argparse.HelpFormatter):
    """Wraps all but examples, which are indented and can be copied as they are.

    Many choices do not stand where their option is named, where they could not be wrapped, but
    follow what is said of it.
    """

    def _fill_text(self, text: str, width: int, indent: str) -> str:
        return "\n".join(
            line if line.startswith(" ") else textwrap.fill(line, width, subsequent_indent=indent)
            for line in text.splitlines()
        )

    def _metavar_formatter(
        self, action: argparse.Action, default_metavar: str
    ) -> Callable[[int], tuple[str, ...]]:
        if action.metavar is None and _has_many_choices(action):
            return lambda n: (default_metavar,) * n
        return super()._metavar_formatter(action, default_metavar)

    def _get_help_string(self, action: argparse.Action) -> str | None:
        if not _has_many_choices(action):
            return action.help
        return f"{action.help or 'one'}: %(choices)s"


def _has_many_choices(action: argparse.Action) -> bool:
    if action.choices is None:
        return False
    times = 2 if action.nargs in ("+", "*") else 1
    return times * len(",".join(map(str, action.choices))) > _LONGEST
