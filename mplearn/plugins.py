"""What installed packages bring: readers, sources, segmenters, distances, formats of their own."""

from __future__ import annotations

from collections.abc import Callable
from importlib.metadata import entry_points
from typing import Any

from .errors import MPLearnError


def join_installed(
    group: str, join: Callable[[str, Any], None], kind: type[MPLearnError] = MPLearnError
) -> None:
    """Let what installed packages bring join what is there.

    Args:
        group: Group of their entry points, as ``"mplearn.readers"``.
        join: Called with the name of each entry point and what stands there.
        kind: Which error it is where that fails.

    Raises:
        MPLearnError: One of them cannot be loaded, or does not fit.
    """
    for point in entry_points(group=group):
        try:
            join(point.name, point.load())
        except Exception as error:
            what = group.rpartition(".")[2].removesuffix("s")
            raise kind(
                f"the {what} {point.name!r} of an installed package cannot be loaded: {error!r}"
            ) from error
