"""What a library's file holds."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, Any

from ..errors import LibraryError
from ..graph import GraphState
from ..state import (
    FileFormat,
    Range,
    State,
    from_plain,
    newer,
    require,
    require_no_cycle,
    to_plain,
)
from ..tree.recogniser import RecogniserState
from .primitive import Primitive, TreeNode


@dataclass(frozen=True, eq=False)
class LibraryState(State):
    """All that a library holds; attributes are those of `PrimitiveLibrary`.

    Attributes:
        version: Of the library that it was; empty where nobody said.
    """

    primitives: tuple[Primitive, ...]
    graph: GraphState
    channels: tuple[str, ...]
    rate_hz: Annotated[float, Range(1e-3, 1e6)]
    body: str
    tree: tuple[TreeNode, ...]
    recogniser: RecogniserState | None
    version: str = newer("", absent="")

    def check(self) -> None:
        """Check that the nodes make one tree, in which each primitive has its place."""
        parents = {node.id: node.parent for node in self.tree}
        require(len(parents) == len(self.tree), "tree", "must have different ids")
        for k, node in enumerate(self.tree):
            require(
                node.parent is None or node.parent in parents,
                f"tree[{k}].parent",
                f"must be a node, not {node.parent}",
            )
            for name in ("id", "n_exemplars"):
                low = getattr(node, name) >= 0
                require(low, f"tree[{k}].{name}", "must be at least 0")
        require_no_cycle(parents, lambda id: f"tree[{list(parents).index(id)}].parent")
        if not parents:
            return
        roots = [id for id, parent in parents.items() if parent is None]
        require(len(roots) == 1, "tree", f"must have one root, not {roots}")
        for k, primitive in enumerate(self.primitives):
            require(primitive.id in parents, f"primitives[{k}].id", "must be a node of the tree")
            parent = parents[primitive.id]
            above = primitive.parent == parent
            require(above, f"primitives[{k}].parent", f"must be {parent}, not {primitive.parent}")
        if self.recogniser is not None:
            index = self.recogniser.index
            ids = {primitive.id for primitive in self.primitives}
            leaves = index.ids[index.leaves].tolist()
            require(ids.issuperset(leaves), "recogniser.index.ids", "must be primitives")
            above = parents.keys() >= set(index.parents.tolist())
            require(above, "recogniser.index.parents", "must be nodes of the tree")


def _whole(content: Any) -> Any:
    """Bring the content of a file up to date that lacks what has a usual value."""
    return to_plain(from_plain(LibraryState, content), whole=True)


FILES = FileFormat(
    "mplearn-library",
    "library",
    LibraryError,
    5,
    migrations={1: _whole, 2: _whole, 3: _whole, 4: _whole},
)
