"""Says which extra is missing, where a feature needs a package that is not installed."""

from __future__ import annotations

import importlib
from types import ModuleType

from .errors import MissingDependencyError


def require(module: str, extra: str) -> ModuleType:
    """Import a module of an optional extra.

    Args:
        module: Name of the module.
        extra: The extra of mplearn that brings it.

    Raises:
        MissingDependencyError: It is not installed; the message holds the command that installs it.
    """
    try:
        return importlib.import_module(module)
    except ModuleNotFoundError as error:
        raise MissingDependencyError(
            f"this needs the package {(error.name or module)!r}: pip install 'mplearn[{extra}]'"
        ) from error
