"""What a room does by another that stands above it, which it neither names nor imports.

The lower room asks for what it needs by a word of its own; the front door (`mplearn/__init__.py`),
which stands above all, says who does it. That room is loaded when it is first asked.
"""

from __future__ import annotations

from importlib import import_module
from typing import Any

from .errors import InvalidValueError

_OFFERS: dict[str, str] = {}


def offer(task: str, by: str) -> None:
    """Say who does a task.

    Args:
        task: What is done, in the words of the room that asks for it.
        by: Module and function, ``"mplearn.store:library_of"``.
    """
    _OFFERS[task] = by


def ask(task: str) -> Any:
    """Return the function that does a task.

    Raises:
        InvalidValueError: Nobody does it.
    """
    if task not in _OFFERS:
        raise InvalidValueError(f"nobody does {task!r}; what is done: {sorted(_OFFERS)}")
    module, _, name = _OFFERS[task].partition(":")
    return getattr(import_module(module), name)
