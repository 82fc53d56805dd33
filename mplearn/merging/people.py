"""Trees of several people that were learned apart, as one that goes on learning."""

from __future__ import annotations

from collections import Counter
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, field
from typing import NamedTuple

from ..people import PeopleTree
from ..people.constraints import Key
from ..people.leaf import Leaf
from ..people.nodes import tidied
from ..people.sharing import Sharing
from ..tree import ROOT, Node, PrimitiveTree
from .trees import merge_trees


class MergedPeople(NamedTuple):
    """Trees of several people as one.

    Attributes:
        tree: The tree, which goes on learning.
        new_ids: Its id of each primitive of each of the trees; most of the first keep theirs.
        new_numbers: How much its numbers of the segments of each are larger than they were.
        placed: Segments that no tree had placed, and the primitive that each is in now.
        moved: Other segments that changed their primitive, unlike most of it; `ROOT` for none.
    """

    tree: PeopleTree
    new_ids: tuple[dict[int, int], ...]
    new_numbers: tuple[int, ...]
    placed: dict[int, int]
    moved: dict[int, int]


def merge_people(trees: Sequence[PeopleTree], people: Sequence[Mapping[int, int]]) -> MergedPeople:
    """Merge trees of several people; none changes.

    The trees of each person are merged at once (`merge_trees`), and it is found once which leaves
    are one primitive. That depends on the order of the trees only for the names of primitives.

    Args:
        trees: The trees, at least one.
        people: For each of them, the number of each of its people in the merged one; those of the
            first keep theirs.

    Raises:
        InvalidValueError: The trees have other rules, channels or rates.

    Example:
        >>> import numpy as np
        >>> from mplearn.people import PeopleTree
        >>> from mplearn.tree import TreeConfig
        >>> trees = [PeopleTree(TreeConfig(), n_channels=2, rate_hz=100.0) for _ in range(2)]
        >>> lift = np.outer(np.sin(np.linspace(0, np.pi, 60)), [1.0, 0.5])
        >>> for tree in trees:
        ...     placed = [tree.insert(k * lift, 0) for k in (1.0, -1.0, 1.01, -1.01)]
        >>> merged = merge_people(trees, [{0: 0}, {0: 0}])  # both have watched one person
        >>> len(merged.tree.leaves), merged.tree.people
        (2, (0,))
    """
    return merged_people([tree.copy() for tree in trees], people)


def merged_people(trees: Sequence[PeopleTree], people: Sequence[Mapping[int, int]]) -> MergedPeople:
    """Return what `merge_people` makes of some trees, all of which are used up."""
    first = trees[0]
    seen = [k for k, tree in enumerate(trees) if tree.n_seen or k == 0]
    everyone = {people[k][person] for k in seen for person in trees[k].people}
    some = [trees[k] for k in seen]
    if len(seen) == 1:
        merged = MergedPeople(first, ({id: id for id in first.leaves},), (0,), {}, {})
    elif len(everyone) == 1:
        merged = _of_one_person(some)
    else:
        merged = _of_several(some, [people[k] for k in seen])
    ids = dict(zip(seen, merged.new_ids, strict=True))
    numbers = dict(zip(seen, merged.new_numbers, strict=True))
    n_trees = range(len(trees))  # what has seen nothing has no primitives and no numbers
    return merged._replace(
        new_ids=tuple(ids.get(k, {}) for k in n_trees),
        new_numbers=tuple(numbers.get(k, 0) for k in n_trees),
    )


def _of_one_person(trees: Sequence[PeopleTree]) -> MergedPeople:
    first, leaves = trees[0], [tree.leaves for tree in trees]
    joined = merge_trees([tree.of(tree.people[0]) for tree in trees])
    first.adopt({first.people[0]: joined.tree}, sum(tree.n_seen for tree in trees))
    new_ids = tuple(
        {id: new_id[id] for id in own} for own, new_id in zip(leaves, joined.new_ids, strict=True)
    )
    return MergedPeople(first, new_ids, joined.new_numbers, dict(joined.change.moved), {})


def _of_several(trees: Sequence[PeopleTree], people: Sequence[Mapping[int, int]]) -> MergedPeople:
    leaves = [tree.leaves for tree in trees]
    parts = []
    ids = numbers = 0
    for tree, numbered in zip(trees, people, strict=True):
        part = _Part(tree.sharing(), numbered, ids, numbers)
        parts.append(part)
        ids += part.sharing.next_id - 1
        numbers += part.sharing.n_seen
    mine, *others = parts
    sharing = mine.sharing
    sharing.next_id, sharing.n_seen = ids + 1, numbers
    before = [(part, leaf) for part in parts for leaf in part.sharing.leaves]
    placed, both = _join_trees(parts)
    origins = [_Origin.of(part, leaf, part.new_key[leaf.key]) for part, leaf in before]
    _join_leaves(parts, both)
    sharing.constraints = sharing.constraints.renamed(mine.new_key)
    for part in others:
        theirs = part.sharing
        sharing.constraints = sharing.constraints.merged(theirs.constraints.renamed(part.new_key))
        for each in theirs.provisional:
            shapes = {n + part.numbers: shape for n, shape in each.shapes.items()}
            sharing.provisional.join(part.people[each.person], each.primitive + part.ids, shapes)
        for id, node in theirs.above.items():
            new = id + part.ids
            sharing.above[new] = Node(new, None, node.born_at, history=node.history)
        sharing.parents |= {
            id + part.ids: above + part.ids if above != ROOT else ROOT
            for id, above in theirs.parents.items()
        }
    for (person, _), number in placed:
        sharing.provisional.leave(person, {number})
    heirs, moved = _regrouped(sharing, origins)
    trees[0].adopt(sharing.trees, sharing.n_seen)
    homes = {leaf.key: leaf.primitive for leaf in sharing.leaves}
    return MergedPeople(
        trees[0],
        tuple(
            {id: heirs[id + part.ids] for id in own}
            for own, part in zip(leaves, parts, strict=True)
        ),
        tuple(part.numbers for part in parts),
        {number: homes[key] for key, number in placed},
        moved,
    )


@dataclass
class _Part:
    """What is shared by the people of one of the trees, and its names in the merged one.

    Attributes:
        sharing: That.
        people: The number of each of its people.
        ids: How much larger ids are.
        numbers: How much larger numbers of segments are.
        new_key: Where each of its leaves is.
        own: The tree of each of its people, and how much each weighs, as it was.
    """

    sharing: Sharing
    people: Mapping[int, int]
    ids: int
    numbers: int
    new_key: dict[Key, Key] = field(default_factory=dict)
    own: dict[int, PrimitiveTree] = field(default_factory=dict)

    def __post_init__(self) -> None:
        """Note the trees, which become others."""
        self.own = dict(self.sharing.trees)


class _Origin(NamedTuple):
    """A leaf as it was before: its primitive, its weight, and the leaf that it is a part of now."""

    primitive: int
    n_placed: int
    founder: bool
    key: Key

    @classmethod
    def of(cls, part: _Part, leaf: Leaf, key: Key) -> _Origin:
        n_placed = part.own[leaf.person].node(leaf.local).n_placed
        return cls(leaf.primitive + part.ids, n_placed, leaf.founded == leaf.primitive, key)


def _join_trees(parts: Sequence[_Part]) -> tuple[list[tuple[Key, int]], list[int]]:
    """Merge the trees of each person into the first part's.

    Returns:
        What waited and is in a leaf now; and the people who had several trees.
    """
    sharing = parts[0].sharing
    trees: dict[int, list[tuple[_Part, int]]] = {}
    for part in parts:
        for person in part.own:
            trees.setdefault(part.people[person], []).append((part, person))
    numbers: dict[int, dict[int, int]] = {}
    placed: list[tuple[Key, int]] = []
    for home, own in trees.items():
        tree, moved = own[0][0].own[own[0][1]], tuple[tuple[int, int], ...]()
        new_ids: Sequence[Mapping[int, int]] = [{node.id: node.id for node in tree.nodes}]
        shifts: Sequence[int] = [0]
        if len(own) > 1:
            least = sharing.rules.min_exemplars
            merged = merge_trees([part.own[person] for part, person in own], least)
            tree, new_ids, shifts, moved = *merged[:3], merged.change.moved
        here = numbers[home] = {}
        for (part, person), new_id, shift in zip(own, new_ids, shifts, strict=True):
            known = part.sharing.numbers.get(person, {})
            here |= {n + shift: number + part.numbers for n, number in known.items()}
            part.new_key |= {(person, old): (home, new) for old, new in new_id.items()}
        placed += [((home, leaf), here[n]) for n, leaf in moved]
        sharing.trees[home] = tree
    sharing.numbers = numbers
    return placed, [home for home, own in trees.items() if len(own) > 1]


def _join_leaves(parts: Sequence[_Part], both: Collection[int]) -> None:
    """Bring the leaves of all people up to date; those of the first keep their names."""
    sharing = parts[0].sharing
    known = {leaf.key for leaf in sharing.leaves}
    for leaf in sharing.leaves:
        if leaf.person in both:
            sharing.look_again(leaf)
    come: dict[Key, tuple[_Part, Leaf]] = {}
    for part in parts[1:]:
        for leaf in part.sharing.leaves:
            come.setdefault(part.new_key[leaf.key], (part, leaf))
    come = {key: of for key, of in come.items() if key not in known}
    shapes = [
        None if key[0] in both else part.sharing.table[leaf.slot]
        for key, (part, leaf) in come.items()
    ]
    leaves = sharing.new_leaves(list(zip(come, shapes, strict=True)))
    for new, (part, leaf) in zip(leaves, come.values(), strict=True):
        new.id, new.primitive = leaf.id + part.ids, leaf.primitive + part.ids
        new.founded = leaf.founded + part.ids if leaf.founded != ROOT else ROOT
    own = [(person, local) for person in both for local in sharing.trees[person].leaves]
    found = known | come.keys()
    sharing.new_leaves([(key, None) for key in own if key not in found])


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
