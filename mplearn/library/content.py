"""A library as plain values and arrays, and back."""

from __future__ import annotations

from dataclasses import asdict
from typing import TYPE_CHECKING, Any

from ..errors import LibraryError, MPLearnError
from ..graph import TransitionGraph
from ..hmm import LeftRightHMM
from .compact import CompactMotion
from .primitive import Primitive

if TYPE_CHECKING:
    from .library import PrimitiveLibrary


def to_content(library: PrimitiveLibrary) -> dict[str, Any]:
    """Return all that a library holds as plain values and arrays."""
    return {
        "primitives": [asdict(primitive) for primitive in library.primitives],
        "graph": library.graph.state(),
        "channels": list(library.channels),
        "rate_hz": float(library.rate_hz),
        "body": library.body,
        "tree": [list(node) for node in library.tree],
        "recogniser": None if library.recogniser is None else library.recogniser.state(),
    }


def from_content(
    kind: type[PrimitiveLibrary], content: dict[str, Any], source: str
) -> PrimitiveLibrary:
    """Build the library that `to_content` described.

    Raises:
        LibraryError: The content, which came from ``source``, describes none.
    """
    try:
        recogniser = None
        if content["recogniser"] is not None:
            from ..tree import Recogniser

            recogniser = Recogniser.from_state(content["recogniser"])
        return kind(
            primitives=tuple(_primitive(item) for item in content["primitives"]),
            graph=TransitionGraph.from_state(content["graph"]),
            channels=tuple(content["channels"]),
            rate_hz=content["rate_hz"],
            body=content["body"],
            tree=tuple(content["tree"]),
            recogniser=recogniser,
        )
    except (MPLearnError, ValueError, TypeError, LookupError, AttributeError) as error:
        raise LibraryError(f"{source} does not describe a library: {error!r}") from error


def _primitive(item: dict[str, Any]) -> Primitive:
    parts = {"hmm": LeftRightHMM(**item["hmm"])}
    kept = tuple(CompactMotion(**motion) for motion in item["kept"])
    return Primitive(**(item | parts | {"kept": kept}))
