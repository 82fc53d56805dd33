"""How an option is called in the interface that is in use: in Python, or on the command line."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from contextvars import ContextVar

_COMMAND_LINE = {
    "unit_m": "--unit",
    "up_axis": "--up",
    "rate_hz": "--rate",
    "skeleton": "--skeleton",
    "angle_unit": "--angles",
    "mirrored": "--mirrored",
    "level": "--level",
    "names": "--map",
    "person": "--person",
    "jobs": "--jobs",
}
_PYTHON = {  # what is no hint, or takes one value alone
    "names": "names={...}",
    "person": "Recording.person",
    "level": "Hints(level=True)",
    "jobs": "find_takes",
}
_on_command_line: ContextVar[bool] = ContextVar("_on_command_line", default=False)


@contextmanager
def command_line() -> Iterator[None]:
    """While this lasts, messages name the options of the ``mplearn`` command.

    Example:
        >>> from mplearn.option_names import option
        >>> option("unit_m")
        'Hints(unit_m=...)'
        >>> with command_line():
        ...     option("unit_m")
        '--unit'
    """
    token = _on_command_line.set(True)
    try:
        yield
    finally:
        _on_command_line.reset(token)


def option(hint: str, value: str = "...") -> str:
    """Return how to give a hint: ``Hints(unit_m=...)``, or ``--unit ...`` on the command line.

    Args:
        hint: Name of an attribute of `Hints`.
        value: A value to name, where one is known.
    """
    if _on_command_line.get():
        return _COMMAND_LINE[hint] + ("" if value == "..." else f" {value}")
    return _PYTHON.get(hint, f"Hints({hint}={value})")
