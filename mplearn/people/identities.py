"""Which primitive each group of leaves is: ids are for life, whatever leaves come and go."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence

from ..tree import Placement, PrimitiveTree
from .leaf import Leaf


def executions_held(
    leaves: Sequence[Leaf],
    groups: Sequence[int],
    before: Mapping[tuple[int, int], int],
    trees: Mapping[int, PrimitiveTree],
    numbers: Mapping[int, Mapping[int, int]],
    joined: Mapping[int, int],
    person: int,
    placement: Placement,
) -> dict[int, Counter[int]]:
    """Return how many executions of each old primitive are in each group of leaves.

    The group of the leaf that a primitive was born with counts for as many as all others.

    Args:
        leaves: Of all people.
        groups: The group of each.
        before: Primitive of each leaf before, by person and id in that person's tree.
        trees: Each person's tree.
        numbers: Number here of each segment of a person's tree, by person.
        joined: Primitives that segments had joined while they waited, by number here.
        person: Whose tree changed.
        placement: What changed there.
    """
    held: dict[int, Counter[int]] = {}
    founders: dict[int, int] = {}
    for leaf, group in zip(leaves, groups, strict=True):
        counts = held.setdefault(group, Counter())
        node = trees[leaf.person].node(leaf.local)
        old = before.get((leaf.person, leaf.local))
        if old is not None:
            counts[old] += node.n_placed
            if leaf.founded == old:
                founders[old] = group
            continue
        for n in node.members:
            old = joined.get(numbers[leaf.person][n])
            if old is not None:
                counts[old] += 1
    for merge in placement.merges:  # what was absorbed counts where it went
        lost = before.get((person, merge.absorbed))
        for leaf, group in zip(leaves, groups, strict=True):
            if lost is not None and (leaf.person, leaf.local) == (person, merge.kept):
                held[group][lost] += 1
    for old, group in founders.items():
        held[group][old] += sum(counts[old] for counts in held.values())
    return held


def identities(held: Mapping[int, Counter[int]]) -> dict[int, int]:
    """Return which group keeps the id of which primitive: most executions first."""
    pairs = [(-count, id, group) for group, ids in held.items() for id, count in ids.items()]
    kept: dict[int, int] = {}
    for _, id, group in sorted(pairs):
        if group not in kept and id not in kept.values():
            kept[group] = id
    return kept


def split_into(
    id: int,
    leaves: Sequence[Leaf],
    groups: Sequence[int],
    ids: Mapping[int, int],
    before: Mapping[tuple[int, int], int],
    person: int,
    placement: Placement,
) -> tuple[int, ...]:
    """Return what a primitive was split into by its only person's tree; empty if it was not."""
    for split in placement.splits:
        if before.get((person, split.node)) == id:
            return tuple(
                ids[group]
                for leaf, group in zip(leaves, groups, strict=True)
                if leaf.person == person and leaf.local in split.into
            )
    return ()


def recognised_as(placement: Placement) -> int:
    """Return the leaf that a segment was recognised as, which it may have split or merged."""
    for split in placement.splits:
        if placement.node_id in split.into:
            return split.node
    return placement.node_id
