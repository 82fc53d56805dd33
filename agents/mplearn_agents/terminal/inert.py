"""Text that nobody's name can turn into anything else.

Names come from anywhere: files, people, the network. All that is printed passes through here, where
what would steer a terminal is spelled out.
"""

from __future__ import annotations

import os
import re
import sys
from collections.abc import Iterable, Iterator
from contextlib import ExitStack, contextmanager
from pathlib import Path
from typing import Any, TextIO

_NOWHERE = Path(os.devnull)
_RESET = "\x1b[0m"
_UNUSUAL = re.compile(r"[^ -~]")


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
        self.rich_proxied_file = (
            stream  # rich writes past this: `console.InertConsole` cleans its text
        )

    def write(self, text: str) -> int:
        """Write a text, spelling out what is not printable."""
        if text == _RESET:  # colorama's, when Python ends: nothing was coloured through this
            return len(text)
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
    """Let nothing printed inside steer the terminal; where a stream is closed, it is nowhere."""
    before = sys.stdout, sys.stderr
    with ExitStack() as opened:
        sys.stdout, sys.stderr = (
            InertStream(opened.enter_context(_NOWHERE.open("w")) if stream is None else stream)
            for stream in before
        )
        try:
            yield
        finally:
            sys.stdout, sys.stderr = before
