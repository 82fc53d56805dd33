"""Two trees of several people that were learned apart, as one that goes on learning."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from typing import NamedTuple

from ..people import PeopleTree
from ..people.constraints import Key
from ..people.leaf import Leaf
from ..people.nodes import tidied
from ..people.sharing import Sharing
from ..tree import ROOT, Node
from .trees import merge_trees


class MergedPeople(NamedTuple):
    """Two trees of several people as one.

    Attributes:
        tree: The tree, which goes on learning.
        first: Its id of each primitive of the first tree; most keep theirs.
        second: Its id of each primitive of the second.
        new_number: How much its numbers of the second tree's segments are larger than they were.
        placed: Segments that neither tree had placed, and the primitive that each is in now.
        moved: Other segments that changed their primitive, unlike most of it; `ROOT` for none.
    """

    tree: PeopleTree
    first: dict[int, int]
    second: dict[int, int]
    new_number: int
    placed: dict[int, int]
    moved: dict[int, int]


def merge_people(first: PeopleTree, second: PeopleTree, people: Mapping[int, int]) -> MergedPeople:
    """Merge two trees of several people; neither changes.

    The trees of a person whom both know become one (`merge_trees`); then it is found again which
    leaves are one primitive. That depends on the order of the two only for the names of primitives.

    Args:
        first: One tree.
        second: The other.
        people: Number in the first of each person of the second, who may be new to the first.

    Raises:
        InvalidValueError: The trees have other rules, channels or rates.
    """
    return merged_into(first.copy(), second.copy(), people)


def merged_into(first: PeopleTree, second: PeopleTree, people: Mapping[int, int]) -> MergedPeople:
    """Merge two trees of several people, both of which are used up; see `merge_people`."""
    if not second.n_seen:
        return MergedPeople(first, {id: id for id in first.leaves}, {}, first.n_seen, {}, {})
    everyone = {*first.people, *(people[each] for each in second.people)}
    if everyone == {first.people[0]}:
        return _of_one_person(first, second)
    return _of_several(first, second, people)


def _of_one_person(first: PeopleTree, second: PeopleTree) -> MergedPeople:
    person, leaves, n_before = first.people[0], first.leaves, first.n_seen
    joined = merge_trees(first.of(person), second.of(second.people[0]))
    first.adopt({person: joined.tree}, n_before + second.n_seen)
    return MergedPeople(
        first,
        {id: id for id in leaves},
        {id: joined.new_id[id] for id in second.leaves},
        joined.new_number,
        dict(joined.change.moved),
        {},
    )


def _of_several(first: PeopleTree, second: PeopleTree, people: Mapping[int, int]) -> MergedPeople:
    before = first.leaves, second.leaves
    mine, theirs = first.sharing(), second.sharing()
    ids, numbers = mine.next_id - 1, mine.n_seen
    mine.next_id += theirs.next_id - 1
    mine.n_seen += theirs.n_seen
    new_key, placed = _join_trees(mine, theirs, people, numbers)
    origins = [_Origin.of(mine, leaf, 0, leaf.key) for leaf in mine.leaves]
    origins += [_Origin.of(theirs, leaf, ids, new_key[leaf.key]) for leaf in theirs.leaves]
    _join_leaves(mine, theirs, new_key, ids)
    mine.constraints = mine.constraints.merged(theirs.constraints.renamed(new_key))
    for each in theirs.provisional:
        shapes = {n + numbers: shape for n, shape in each.shapes.items()}
        mine.provisional.join(people[each.person], each.primitive + ids, shapes)
    for (person, _), number in placed:
        mine.provisional.leave(person, {number})
    for id, node in theirs.above.items():
        mine.above[id + ids] = Node(id + ids, None, node.born_at, history=list(node.history))
    mine.parents |= {
        id + ids: above + ids if above != ROOT else ROOT for id, above in theirs.parents.items()
    }
    heirs, moved = _regrouped(mine, origins)
    first.adopt(mine.trees, mine.n_seen)
    homes = {leaf.key: leaf.primitive for leaf in mine.leaves}
    return MergedPeople(
        first,
        {id: heirs[id] for id in before[0]},
        {id: heirs[id + ids] for id in before[1]},
        numbers,
        {number: homes[key] for key, number in placed},
        moved,
    )


class _Origin(NamedTuple):
    """A leaf as it was before: its primitive, its weight, and the leaf that it is a part of now."""

    primitive: int
    n_placed: int
    founder: bool
    key: Key

    @classmethod
    def of(cls, sharing: Sharing, leaf: Leaf, ids: int, key: Key) -> _Origin:
        n_placed = sharing.trees[leaf.person].node(leaf.local).n_placed
        return cls(leaf.primitive + ids, n_placed, leaf.founded == leaf.primitive, key)


def _join_trees(
    mine: Sharing, theirs: Sharing, people: Mapping[int, int], numbers: int
) -> tuple[dict[Key, Key], list[tuple[Key, int]]]:
    """Take over people's trees; return where leaves went, and what waited and is in one now."""
    new_key: dict[Key, Key] = {}
    placed: list[tuple[Key, int]] = []
    for person, own in theirs.trees.items():
        home, shift = people[person], 0
        moved: tuple[tuple[int, int], ...] = ()
        local = {node.id: node.id for node in own.nodes}
        if home in mine.trees:
            least = mine.rules.min_exemplars
            own, local, shift, change = merge_trees(mine.trees[home], own, least)
            moved = change.moved
        mine.trees[home] = own
        here = mine.numbers.setdefault(home, {})
        here |= {n + shift: number + numbers for n, number in theirs.numbers[person].items()}
        new_key |= {(person, old): (home, new) for old, new in local.items()}
        placed += [((home, leaf), here[n]) for n, leaf in moved]
    return new_key, placed


def _join_leaves(mine: Sharing, theirs: Sharing, new_key: Mapping[Key, Key], ids: int) -> None:
    """Bring the leaves of all people up to date; those of the first keep their names."""
    known = {leaf.key for leaf in mine.leaves}
    for leaf in mine.leaves:
        mine.look_again(leaf)
    for leaf in theirs.leaves:
        key = new_key[leaf.key]
        if key not in known:
            known.add(key)
            new = mine.new_leaf(*key)
            new.id, new.primitive = leaf.id + ids, leaf.primitive + ids
            new.founded = leaf.founded + ids if leaf.founded != ROOT else ROOT
    for person, tree in mine.trees.items():
        for local in tree.leaves:
            if (person, local) not in known:
                mine.new_leaf(person, local)


def _regrouped(
    sharing: Sharing, origins: Sequence[_Origin]
) -> tuple[dict[int, int], dict[int, int]]:
    """Find again which leaves are one primitive.

    Returns:
        The primitive that most of each old one is in now; and segments that are in another one
        than that.
    """
    before = {leaf.key: leaf.primitive for leaf in sharing.leaves}
    of_leaves, of_provisional = sharing.regroup()
    groups = dict(zip(before, of_leaves, strict=True))
    held: dict[int, Counter[int]] = {}
    for origin in origins:
        held.setdefault(origin.primitive, Counter())[groups[origin.key]] += origin.n_placed
    for origin in origins:
        if origin.founder:
            counts = held[origin.primitive]
            counts[groups[origin.key]] += counts.total()
    heir = {id: counts.most_common(1)[0][0] for id, counts in held.items()}
    ids: dict[int, int] = {}
    for id in sorted(heir):
        ids.setdefault(heir[id], id)
    new = {id: ids[group] for id, group in heir.items()}
    for leaf in sharing.leaves:
        group = groups[leaf.key]
        if group not in ids:
            ids[group] = sharing.found([leaf])
        leaf.primitive = ids[group]
    moved = {
        number: leaf.primitive
        for leaf in sharing.leaves
        if new.get(before[leaf.key], leaf.primitive) != leaf.primitive
        for number in sharing.members(leaf)
    }
    homes = [ids.get(group, ROOT) for group in of_provisional]
    moved |= dict(sharing.provisional.move(homes, new, sharing.own()))
    sharing.name_leaves()
    tidied(sharing.above, sharing.parents, sharing.primitives)
    return new, moved
