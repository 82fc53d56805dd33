"""What a person asks of primitives that several people share; it is checked before it is done."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence

import numpy as np

from ..errors import InvalidValueError, UnknownPrimitiveError
from ..tree import ROOT, Change, Merge, Reparent, Split
from ..tree.nodes.clustering import two_branches
from .leaf import Leaf
from .nodes import tidied
from .sharing import Sharing


def split(sharing: Sharing, id: int, groups: Sequence[Sequence[int]] | None) -> Change:
    """Split a primitive: each person's leaf goes to one side, or is split itself.

    Args:
        sharing: The primitives of all.
        id: The primitive.
        groups: Positions in its exemplars, leaf after leaf, that belong together; the two main
            branches of complete-link clustering, of its leaves if there are several, where not
            given.

    Raises:
        UnknownPrimitiveError: There is no such primitive.
        InvalidValueError: The groups are wrong, or there are too few exemplars; it is frozen.
    """
    leaves = _primitive(sharing, id)
    if groups is None and len(leaves) == 1:
        parts: list[list[list[int]] | None] = [None]
        sides = [[0, 1]]
    else:
        wanted = _branches(sharing, leaves) if groups is None else groups
        sides, parts = _sides(sharing, id, leaves, wanted)
    into: list[list[Leaf]] = [[] for _ in range(1 + max(side for own in sides for side in own))]
    for leaf, own, part in zip(leaves, sides, parts, strict=True):
        if len(own) == 1:
            into[own[0]].append(leaf)
            continue
        change = sharing.trees[leaf.person].split(leaf.local, part)
        heirs = [sharing.new_leaf(leaf.person, local) for local in change.splits[0].into]
        sharing.constraints.follow({leaf.key: [heir.key for heir in heirs]})
        sharing.drop_leaf(leaf)
        for side, heir in zip(own, heirs, strict=True):
            into[side].append(heir)
    _part(sharing, into)
    into.sort(key=lambda group: -sum(len(sharing.members(leaf)) for leaf in group))
    born = []
    moved: list[tuple[int, int]] = []
    for group in into:
        born.append(sharing.found(group))
        moved += [(n, born[-1]) for leaf in group for n in sharing.members(leaf)]
    sharing.put_above(id, born)
    return settled(sharing, Change(tuple(born), (Split(id, tuple(born)),), moved=tuple(moved)))


def merge(sharing: Sharing, first: int, second: int) -> Change:
    """Merge two primitives into the older one; a person who has a leaf in both keeps one of them.

    Raises:
        UnknownPrimitiveError: There is no such primitive.
        InvalidValueError: They are the same.
    """
    leaves = {id: _primitive(sharing, id) for id in (first, second)}
    if first == second:
        raise InvalidValueError(f"primitive {first} cannot be merged with itself")
    older, younger = sorted(leaves)
    for leaf in leaves[younger]:
        _join(sharing, leaf, older)
    sharing.constraints.must_link(leaf.key for leaf in sharing.leaves_of(older))
    return settled(sharing, Change(merges=(Merge(older, younger),)))


def move(sharing: Sharing, id: int, parent: int) -> Change:
    """Hang a person's leaf below another primitive, or below an inner node as a primitive.

    What is a primitive already can be hung below an inner node, too; below another primitive only
    if it is a single leaf.

    Raises:
        UnknownPrimitiveError: There is no such node.
        InvalidValueError: It would lie below itself, or be a primitive below a primitive.
    """
    inner = {ROOT, *sharing.above}
    for each in (id, parent):
        if each not in inner and not sharing.leaves_of(each):
            known = sorted({*inner, *sharing.primitives})
            raise UnknownPrimitiveError(f"no node {each} in the tree; it holds {known}")
    if parent not in inner and parent not in sharing.primitives:
        raise InvalidValueError(f"a parent must be a primitive or a node above, not leaf {parent}")
    if id in inner or (id in sharing.primitives and parent in inner):
        _check_above(sharing, id, parent)
        sharing.parents[id] = parent
        return settled(sharing, Change(reparented=(Reparent(id, parent),)))
    leaves = sharing.leaves_of(id)
    if len(leaves) > 1 or parent == leaves[0].primitive:
        raise InvalidValueError(
            f"node {id} cannot be hung below {parent}: it must be one person's leaf, of another "
            "primitive; merge joins primitives"
        )
    leaf = leaves[0]
    left = leaf.primitive
    for each in {left, parent} - inner:
        _primitive(sharing, each)
    staying = [each for each in sharing.leaves_of(left) if each is not leaf]
    _part(sharing, [[leaf], staying])
    moved = sharing.members(leaf)
    if parent in inner:
        home = sharing.found([leaf], below=parent)
        change = Change(born=(home,), moved=tuple((n, home) for n in moved))
        return settled(sharing, change)
    _join(sharing, leaf, parent)
    sharing.constraints.must_link(each.key for each in sharing.leaves_of(parent))
    if not staying:
        return settled(sharing, Change(merges=(Merge(parent, left),)))
    change = Change(
        moved=tuple((n, parent) for n in moved), reparented=(Reparent(leaf.id, parent),)
    )
    return settled(sharing, change)


def remove(sharing: Sharing, id: int, *, forget: bool) -> Change:
    """Take a primitive out, or one person's leaf of it; the exemplars wait again.

    Raises:
        UnknownPrimitiveError: There is no such primitive.
    """
    leaves = sharing.leaves_of(id) or _primitive(sharing, id)
    _primitive(sharing, leaves[0].primitive)
    moved: list[tuple[int, int]] = []
    for leaf in leaves:
        moved += [(n, ROOT) for n in sharing.members(leaf)]
        sharing.trees[leaf.person].remove(leaf.local, forget=forget)
        sharing.constraints.follow({leaf.key: ()})
        sharing.drop_leaf(leaf)
    gone = [id, *(leaf.primitive for leaf in leaves)]
    removed = tuple(dict.fromkeys(each for each in gone if each not in sharing.primitives))
    return settled(sharing, Change(moved=() if forget else tuple(moved), removed=removed))


def prune(sharing: Sharing) -> Change:
    """Let what is no primitive by the rules of several people wait until it is shown more often.

    Its leaves were born while each person was alone. What a person had a hand in stays.
    """
    shown = Counter(each.primitive for each in sharing.provisional for _ in each.shapes)
    by_hand: set[int] = set()
    asked = sharing.constraints.keys()
    for leaf in sharing.leaves:
        node = sharing.trees[leaf.person].node(leaf.local)
        shown[leaf.primitive] += node.n_placed
        if node.by_hand or leaf.key in asked:
            by_hand.add(leaf.primitive)
    change = Change()
    for id in sharing.primitives:
        if shown[id] < sharing.rules.min_exemplars and id not in by_hand:
            change = change.then(remove(sharing, id, forget=False))
    return change


def keep(sharing: Sharing, id: int) -> Change:
    """Let the rules neither forget nor drop any leaf of a primitive.

    Raises:
        UnknownPrimitiveError: There is no such primitive.
    """
    for leaf in _known(sharing, id):
        sharing.trees[leaf.person].keep(leaf.local)
    return Change()


def freeze(sharing: Sharing, id: int, frozen: bool) -> Change:
    """Let all leaves of a primitive stay as they are, or change again.

    Raises:
        UnknownPrimitiveError: There is no such primitive.
    """
    for leaf in _known(sharing, id):
        sharing.trees[leaf.person].freeze(leaf.local, frozen)
    return Change()


def _known(sharing: Sharing, id: int) -> list[Leaf]:
    if id not in sharing.primitives:
        raise UnknownPrimitiveError(f"no primitive {id}; known are {list(sharing.primitives)}")
    return sharing.leaves_of(id)


def _primitive(sharing: Sharing, id: int) -> list[Leaf]:
    """Return the leaves of a primitive that may change."""
    leaves = _known(sharing, id)
    if any(sharing.frozen(leaf) for leaf in leaves):
        raise InvalidValueError(f"primitive {id} is frozen; unfreeze it first")
    return leaves


def _branches(sharing: Sharing, leaves: Sequence[Leaf]) -> list[list[int]]:
    """Return the positions of the exemplars of the two main branches of some leaves."""
    branches = two_branches(sharing.distances(leaves), 1)
    assert branches is not None
    sizes = [len(sharing.members(leaf)) for leaf in leaves]
    ends = np.cumsum(sizes)
    return [[n for i in branch for n in range(ends[i] - sizes[i], ends[i])] for branch in branches]


def _sides(
    sharing: Sharing, id: int, leaves: Sequence[Leaf], groups: Sequence[Sequence[int]]
) -> tuple[list[list[int]], list[list[list[int]] | None]]:
    """Return for each leaf the sides that it goes to, and its own positions on each of them."""
    sizes = [len(sharing.members(leaf)) for leaf in leaves]
    _check_groups(id, groups, sum(sizes), 1)
    sides: list[list[int]] = []
    parts: list[list[list[int]] | None] = []
    first = 0
    for size, leaf in zip(sizes, leaves, strict=True):
        mine = range(first, first + size)
        found = {k: [int(n) - first for n in g if n in mine] for k, g in enumerate(groups)}
        found = {k: positions for k, positions in found.items() if positions}
        if len(found) > 1:
            _check_groups(leaf.id, list(found.values()), size, 2)
        sides.append(sorted(found, key=lambda k: (-len(found[k]), k)))
        parts.append([found[k] for k in sides[-1]])
        first += size
    return sides, parts


def _check_groups(id: int, groups: Sequence[Sequence[int]], n: int, least: int) -> None:
    at = sorted(int(i) for group in groups for i in group)
    if len(groups) < 2 or min(map(len, groups)) < least or at != list(range(n)):
        raise InvalidValueError(
            f"groups must hold each of the positions 0 to {n - 1} of node {id} once, in 2 groups "
            f"or more, of at least 2 of a leaf, not {[[int(i) for i in g] for g in groups]}"
        )


def _check_above(sharing: Sharing, id: int, parent: int) -> None:
    at = parent
    while at != ROOT and at != id:
        at = sharing.parents[at]
    if at == id:
        raise InvalidValueError(f"node {parent} lies below {id} and cannot be above it")


def _join(sharing: Sharing, leaf: Leaf, primitive: int) -> None:
    """Put a leaf into a primitive; a person's leaves there become one."""
    others = [each for each in sharing.leaves if each.primitive == primitive]
    leaf.primitive = primitive
    for other in others:
        if other.person == leaf.person:
            change = sharing.trees[leaf.person].merge(other.local, leaf.local)
            kept, gone = other, leaf
            if change.merges[0].kept == leaf.local:
                kept, gone = leaf, other
            sharing.constraints.follow({gone.key: [kept.key]})
            sharing.drop_leaf(gone)
            sharing.look_again(kept)
            leaf = kept


def _part(sharing: Sharing, sides: Sequence[Sequence[Leaf]]) -> None:
    """Keep leaves on different sides apart; a person's own in that person's tree, too."""
    sharing.constraints.cannot_link([[leaf.key for leaf in side] for side in sides])
    for side in sides:
        for leaf in side:
            others = [each for other in sides if other is not side for each in other]
            own = {each.local for each in others if each.person == leaf.person}
            sharing.trees[leaf.person].node(leaf.local).apart |= own


def settled(sharing: Sharing, change: Change) -> Change:
    """Let what waits, names and nodes above follow a change."""
    absorbed = {merge.absorbed: merge.kept for merge in change.merges}
    known = set(sharing.primitives)
    wanted = [absorbed.get(each.primitive, each.primitive) for each in sharing.provisional]
    homes = [id if id in known else ROOT for id in wanted]
    moved = sharing.provisional.move(homes, absorbed, sharing.own())
    sharing.name_leaves()
    change = change.then(Change(moved=tuple(moved)))
    return change.then(tidied(sharing.above, sharing.parents, sharing.primitives))
