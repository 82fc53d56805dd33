"""What is remembered of several people."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated

from ..state import Count, Range, State, require
from ..tree import ROOT
from ..tree.tree import TreeState
from .sharing_state import SharingState


@dataclass(frozen=True, eq=False)
class PersonState(State):
    """A person's own tree."""

    person: Count
    tree: TreeState


@dataclass(frozen=True, eq=False)
class PeopleState(State):
    """The trees of several people.

    Attributes:
        n_seen: Segments seen, of all people.
        next_id: First id that was never used, as long as there is one person.
        trees: Each person's tree, in the order of their coming.
        sharing: What they share; None as long as there is one person.

    Example:
        >>> import numpy as np
        >>> from mplearn.people import PeopleTree
        >>> from mplearn.tree import TreeConfig
        >>> tree = PeopleTree(TreeConfig(), n_channels=1, rate_hz=100.0)
        >>> placed = tree.insert(np.sin(np.linspace(0, np.pi, 60))[:, None], person=0)
        >>> state = tree.state()
        >>> state.n_seen, len(state.trees), state.sharing is None
        (1, 1, True)
    """

    n_seen: Count
    next_id: Annotated[int, Range(1)]
    trees: tuple[PersonState, ...]
    sharing: SharingState | None

    @property
    def free_id(self) -> int:
        """First id that was never used."""
        return self.next_id if self.sharing is None else self.sharing.next_id

    @property
    def primitives(self) -> set[int]:
        """Ids of the primitives."""
        if self.sharing is not None:
            return {leaf.primitive for leaf in self.sharing.leaves}
        nodes = self.trees[0].tree.nodes
        return {node.id for node in nodes if node.id != ROOT and not node.children}

    def check(self) -> None:
        """Check that what is shared is what the trees hold."""
        trees = {each.person: each.tree for each in self.trees}
        require(len(trees) == len(self.trees) > 0, "trees", "must be of different people")
        n_seen = sum(tree.n_seen for tree in trees.values())
        require(self.n_seen == n_seen, "n_seen", f"must be {n_seen} as in the trees")
        sharing = self.sharing
        if sharing is None:
            require(len(trees) == 1, "sharing", f"is needed for {len(trees)} people")
            largest = max(node.id for node in self.trees[0].tree.nodes)
            most = self.trees[0].tree.next_id
            require(
                largest < self.next_id <= most, "next_id", f"must lie in [{largest + 1}, {most}]"
            )
            return
        require(sharing.n_seen == n_seen, "sharing.n_seen", f"must be {n_seen} as in the trees")
        leaves = {
            (person, node.id)
            for person, tree in trees.items()
            for node in tree.nodes
            if node.id != ROOT and not node.children
        }
        named = {(leaf.person, leaf.local) for leaf in sharing.leaves}
        require(leaves == named, "sharing.leaves", f"must be those of the trees, {sorted(leaves)}")
        numbers = {own.person: set(own.there.tolist()) for own in sharing.numbers}
        for person, tree in trees.items():
            held = {n for node in tree.nodes for n in node.members.tolist()}
            require(
                numbers.get(person, set()) >= held,
                "sharing.numbers",
                f"must name the segments of person {person}",
            )
        for name in ("numbers", "offsets", "provisional"):
            for k, each in enumerate(getattr(sharing, name)):
                require(each.person in trees, f"sharing.{name}[{k}].person", f"is {each.person}")
