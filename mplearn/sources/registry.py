"""Sources by name: ``open_source("recording:walk.bvh")``."""

from __future__ import annotations

import inspect
import re
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from functools import cache
from typing import Any, Literal, TypeAlias, get_args

from ..arguments import is_one_of, require_kind
from ..errors import InvalidValueError
from ..mocap import Hints
from ..plugins import join_installed
from .source import Source

ENTRY_POINTS = "mplearn.sources"
"""Group of the entry points by which an installed package brings sources of its own."""

Observe: TypeAlias = Literal["robot", "positions", "channels"]


@dataclass(frozen=True)
class Wanted:
    """What is to be seen in a stream.

    Attributes:
        observe: ``"robot"``: a body, of which a robot's features are learned; ``"positions"`` of
            markers and joints; or the stream's own ``"channels"``.
        hints: What the stream does not say about itself, or says wrongly.
        names: Place of the body by marker or joint; see `mplearn.anatomy.recognise`.

    Example:
        >>> from mplearn.mocap import Hints
        >>> Wanted(observe="channels", hints=Hints(rate_hz=100.0)).hints.rate_hz
        100.0
    """

    observe: Observe = "robot"
    hints: Hints = field(default_factory=Hints)
    names: Mapping[str, str] | None = None

    def __post_init__(self) -> None:
        require_kind("hints", self.hints, Hints)
        if self.names is not None:
            require_kind("names", self.names, Mapping, "the place of the body by marker or joint")
        if not is_one_of(self.observe, get_args(Observe)):
            raise InvalidValueError(
                f"observe must be one of {', '.join(get_args(Observe))}, not {self.observe!r}"
            )


Factory: TypeAlias = Callable[..., Source]

_registered: dict[str, Factory] = {}


def register_source(kind: str, factory: Factory) -> None:
    """Let `open_source` and the ``mplearn`` command open one more kind of source.

    Args:
        kind: What stands before the colon, lower case; one that is there already is replaced.
        factory: Called as ``factory(address, wanted, **options)`` with what stands behind the
            colon, a `Wanted`, and the options given by name; returns the source as it comes: unit,
            axes and body are found by `open_source`. The first line of its docstring tells users
            what it is.

    Raises:
        InvalidValueError: The kind is no such name.

    Example:
        >>> from mplearn.sources import connect
        >>> def still(address, wanted, **options):
        ...     return connect("demonstrator:7", wanted, **options)
        >>> register_source("still", still)
        >>> "still" in source_kinds()
        True
    """
    if not isinstance(kind, str) or not re.fullmatch(r"[a-z][a-z0-9_-]*", kind):
        raise InvalidValueError(f"a kind of source is like 'my-suit', lower case, not {kind!r:.60}")
    if not callable(factory):
        raise InvalidValueError(f"factory must make a source when called, not be {factory!r:.60}")
    _registered[kind] = factory


def source_kinds() -> dict[str, str]:
    """Return the kinds of sources there are, each with a line about it.

    Example:
        >>> {"demonstrator", "recording", "udp"} <= set(source_kinds())
        True
    """
    _load_entry_points()
    return {
        kind: (inspect.getdoc(factory) or "").partition("\n")[0]
        for kind, factory in sorted(_registered.items())
    }


def connect(name: str, wanted: Wanted | None = None, **options: Any) -> Source:
    """Return a source as it comes: its own axes, unit and names; see `open_source`.

    Example:
        >>> from mplearn.sources import Block
        >>> with connect("demonstrator:7", speed=float("inf")) as source:
        ...     block = next(item for item in source if isinstance(item, Block))
        >>> block.rate_hz, len(block.channels)
        (100.0, 102)
    """
    _load_entry_points()
    require_kind("name", name, str, "as 'recording:walk.bvh' or 'demonstrator'")
    if wanted is not None:
        require_kind("wanted", wanted, Wanted)
    kind, _, address = name.partition(":")
    factory = _registered.get(kind)
    if factory is None:
        raise InvalidValueError(
            f"a source begins with one of {', '.join(f'{k}:' for k in source_kinds())} not {name!r}"
        )
    allowed = [*inspect.signature(factory).parameters][2:]
    for option in options:
        if option not in allowed:
            raise InvalidValueError(
                f"the source {kind!r} has no option {option!r}; it has "
                f"{', '.join(allowed) or 'none'}"
            )
    return factory(address, wanted or Wanted(), **options)


@cache
def _load_entry_points() -> None:
    join_installed(ENTRY_POINTS, register_source)
