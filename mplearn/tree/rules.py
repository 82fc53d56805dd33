"""The rules that change the tree by itself: births, forgetting, splits and merges.

A primitive is born where what waits in a node has a complete-link cluster [Kulic2012, eq. 7]; what
was learned is revised: chance ones are forgotten, leaves of several motions split, leaves of one
motion merged.
"""

from __future__ import annotations

from collections.abc import Sequence
from itertools import permutations
from typing import NamedTuple

import numpy as np

from ..recording import BoolArray, FloatArray, IntArray
from .config import TreeConfig
from .distance import Exemplar
from .exemplars.normalisation import normalised
from .exemplars.spread import moments
from .nodes.clustering import (
    clusters_below,
    gap,
    mean_between,
    nearest_usual,
    separation,
    two_branches,
)
from .nodes.node import Node
from .nodes.search import mean_nearest
from .nodes.structure import Structure
from .placement import ROOT, Change, Match, Split

_FAR = 1e12  # farther than any two segments
_AMONG = 10  # what waits and what is known: among few anything is somebody's nearest
_BY_FAR = 1.2  # how many times as far the next is
_PLAYED_BACK = 0.05  # over the scale: nobody hesitates again so exactly
_IN_SEQUENCE = 0.8  # of what tells two motions apart, for those that come beside two others
_SURELY = 1 - 1e-9  # whatever a mean is rounded to
_NEARER = 0.8  # of how far a part is from a whole: what it is a part of, at the most
_WELL_INSIDE = 0.8  # of its radius
_OFTEN = 5  # exemplars from which on a part is a motion of its own
_UNKNOWN = 3.0  # leaves that the scale of all motion counts for beside that of those


def form_primitives(structure: Structure, node: Node, when: int, most: float) -> Change:
    """Form a leaf of each cluster in a node that grew; what else waits in the root may join it.

    Of so many clusters at most, the tightest ones: the others wait. A leaf in which others are
    formed, as the rules are printed, is split: it is a leaf no more.

    Args:
        structure: The tree.
        node: The root; as printed, any node.
        when: Segments seen.
        most: Leaves that are formed at most.
    """
    config = structure.config
    was_leaf = node.id != ROOT and node.is_leaf
    change = Change()
    while len(change.born) < most:
        loose = [i for i, n in enumerate(node.members) if node.id == ROOT or n not in node.settled]
        matrix = node.matrix[np.ix_(loose, loose)]
        limit = cutoff(structure, node)
        groups = _clusters(structure, [node.members[i] for i in loose], matrix, limit)
        if not groups:
            break
        places = [loose[i] for i in groups[0]]
        members = [node.members[i] for i in places]
        fragments = _fragments(structure, node, members)
        if fragments:
            node.settled |= fragments
            continue
        same = None if config.local else _leaf_of(structure, members, limit)
        if same is not None:
            change = change.then(structure.take_in(same, members))
            continue
        rest = np.delete(np.arange(len(node.members)), places)
        row = mean_nearest(node.matrix[np.ix_(rest, places)], config.n_nearest)
        others = [node.members[i] for i in rest]
        child = structure.child(node, members, when)
        moved = tuple((number, child.id) for number in members)
        change = change.then(Change(born=(child.id,), moved=moved))
        if node.id == ROOT and not config.local:
            radius = structure.index.radius(child.id)
            inside = [n for n, distance in zip(others, row, strict=True) if distance <= radius]
            change = change.then(structure.take_in(child, inside))
    if was_leaf and change.born:
        node.history += (("split", when),)
        change = change._replace(splits=(Split(node.id, change.born),))
    return change


def _clusters(
    structure: Structure, members: Sequence[int], matrix: FloatArray, limit: float
) -> list[IntArray]:
    """Return the clusters among what waits, tightest first, as positions.

    Executions of one motion are nearer to each other than they are to no motion at all. Two that
    are near each other say less than three that are: pairs count only where there is no larger
    cluster, and must be the nearer. Pairs may be farther apart where a sequence came twice, so that
    each is the other's nearest, one after the other, and they are nothing that is known. Fragments
    of what is known count only where they are played back.

    Args:
        structure: The tree.
        members: Numbers of the segments that wait.
        matrix: Distances among them, shape (n, n).
        limit: Largest distance inside a cluster.
    """
    config, least = structure.config, structure.least
    extents = np.minimum(structure.memory.bank.extents(members), _FAR)
    sizes = np.sqrt(np.multiply.outer(extents, extents))
    fragments = np.array([number in structure.root.settled for number in members], bool)
    exactly = np.where(fragments[:, None] | fragments, _PLAYED_BACK * limit, np.inf)
    alike = np.minimum(np.minimum(config.extent_share * sizes, limit), exactly)

    def found(most: FloatArray, least: int) -> list[IntArray]:
        return clusters_below(matrix / np.minimum(np.maximum(most, 1e-12), _FAR), 1.0, least)

    groups = found(alike, max(least, 3))
    if groups or least > 2:
        return groups
    most = np.minimum(np.minimum(config.pair_extent * sizes, config.pair_share * limit), exactly)
    farther = np.minimum(config.sequence_extent * sizes, config.sequence_share * limit)
    among = len(members) + int(structure.index.leaves.sum())
    pairs = _each_others_nearest(matrix) & (matrix <= np.minimum(farther, exactly))
    pairs &= among >= _AMONG
    farther_apart = pairs & (matrix > most)
    if farther_apart.any():
        farther_apart &= _came_in_sequence(structure, members, pairs)
        for i in np.flatnonzero(farther_apart.any(axis=0)).tolist():
            if not _is_new(structure, members[i], limit):
                farther_apart[i], farther_apart[:, i] = False, False
        most = np.where(farther_apart, farther, most)
    return found(most, least)


def _each_others_nearest(matrix: FloatArray) -> BoolArray:
    """Return which two are nearer to each other than either is to any third, by far, (n, n)."""
    n = len(matrix)
    pairs = np.zeros((n, n), bool)
    if n < 3:
        return pairs
    apart = matrix + np.diag(np.full(n, np.inf))
    nearest = apart.argmin(axis=1)
    first, second = np.partition(apart, 1, axis=1)[:, :2].T
    clear = (nearest[nearest] == np.arange(n)) & (_BY_FAR * first < second)
    one = np.flatnonzero(clear & clear[nearest])
    pairs[one, nearest[one]] = True
    return pairs


def _came_in_sequence(structure: Structure, members: Sequence[int], alike: BoolArray) -> BoolArray:
    """Return which two of what waits belong to a sequence that came twice, shape (n, n).

    What came just before both, or just after both, waits too and is alike, or is in one leaf. What
    follows itself is no sequence.

    Args:
        structure: The tree.
        members: Numbers of the segments that wait, as they came.
        alike: Which two of them may be one motion, shape (n, n).
    """
    numbers = np.asarray(members, np.int64)
    places = {number: i for i, number in enumerate(members)}
    apart = np.abs(numbers[:, None] - numbers) > 1
    twice = np.zeros_like(apart)
    beside = [*(numbers - 1).tolist(), *(numbers + 1).tolist()]
    waits = np.array([places.get(number, -1) for number in beside], np.int64).reshape(2, -1)
    for at, home in zip(waits, structure.homes(beside).reshape(2, -1), strict=True):
        twice |= (at >= 0)[:, None] & (at >= 0) & alike[np.ix_(at, at)]
        twice |= (home != ROOT)[:, None] & (home[:, None] == home)
    return np.asarray(apart & twice)


def _is_new(structure: Structure, number: int, limit: float) -> bool:
    """Return whether a segment that waits is farther than a limit from what it fits best."""
    matches = structure.index.search(structure.memory.bank[number], structure.memory.bank)
    return not matches or matches[0].ratio * structure.index.radius(matches[0].node) > limit


def settle_fragments(structure: Structure, number: int, longest: int) -> None:
    """Let no primitive be made of what is only a part of a known one.

    People hesitate: now and then a known motion is cut in two. What waits, and is an execution of a
    sure primitive together with what came right before or after it, is a fragment of that.

    Args:
        structure: The tree.
        number: The segment that came now; the one before it ended where it begins.
        longest: Most frames of a motion.
    """
    root, pair = structure.root, {number - 1, number}
    if pair.isdisjoint(root.members) or not structure.memory.goes_on(number - 1):
        return
    if sum(map(structure.length_of, pair)) > longest:
        return
    if _sure_of(structure, _joined(structure, [number - 1]), 1.0) != [None]:
        root.settled |= pair.intersection(root.members)


def _fragments(structure: Structure, node: Node, members: Sequence[int]) -> set[int]:
    """Return what waits and is only a part of something that was performed whole, too.

    Together with what came before or after it, it is nearer by far to what it is like, or, where
    that went on without a rest, an execution of a primitive that has become sure since. Two that
    are alike are few to tell; where there are more, the others outvote a part, and what is played
    back counts nevertheless.

    Args:
        structure: The tree.
        node: Where they wait.
        members: Numbers of the segments that are about to become a node.
    """
    found: set[int] = set()
    if (
        not structure.config.ignore_fragments
        or node.id != ROOT
        or len(members) != 2
        or not node.settled.isdisjoint(members)
    ):
        return found
    memory, bank = structure.memory, structure.memory.bank
    alone = node.matrix[tuple(map(node.members.index, members))]
    parts = [
        (other, first)
        for number, other in permutations(members)
        for first in (number - 1, number)
        if other not in (first, first + 1) and {first, first + 1} <= memory.frames.keys()
    ]
    asked: dict[int, Exemplar] = {}  # what goes on without a rest, by its first segment
    wholes = _joined(structure, [first for _, first in parts])
    for (other, first), whole in zip(parts, wholes, strict=True):
        together = bank.distances(whole, [other])[0]
        if together < _NEARER * alone:
            found |= {first, first + 1}
        elif memory.goes_on(first):
            asked[first] = whole
    for first, home in zip(
        asked, _sure_of(structure, list(asked.values()), _WELL_INSIDE), strict=True
    ):
        if home is not None:
            found |= {first, first + 1}
    return found.intersection(node.members)


def _sure_of(structure: Structure, wholes: Sequence[Exemplar], most: float) -> list[int | None]:
    """Return the sure primitive that each segment lies in, at most so far out, 1 being its radius.

    It is None where there is none.
    """
    found: list[int | None] = []
    for matches in structure.index.search_each(wholes, structure.memory.bank):
        home = structure.nodes[matches[0].node] if matches and matches[0].ratio <= most else None
        sure = home and home.is_leaf and home.n_placed >= structure.config.confirmed
        found.append(home.id if home and sure else None)
    return found


def _joined(structure: Structure, firsts: Sequence[int]) -> list[Exemplar]:
    """Return models of some segments and the next of each, which follows it, as one."""
    frames, config = structure.memory.frames, structure.config.normalisation
    joined = [np.concatenate([frames[first], frames[first + 1]]) for first in firsts]
    seen = [normalised(each, config) for each in joined]
    return structure.memory.bank.models(seen, list(map(len, joined)))


def _leaf_of(structure: Structure, members: Sequence[int], limit: float) -> Node | None:
    """Return the leaf that a cluster is one motion with: all of both lie within the limit.

    A motion must not become a primitive twice.
    """
    bank = structure.memory.bank
    first, *others = members
    leaves = [structure.nodes[id] for id in structure.index.near(bank[first], bank)]
    if not leaves:
        return None
    sizes = np.array([len(leaf.members) for leaf in leaves])
    row = bank.distances(bank[first], [number for leaf in leaves for number in leaf.members])
    best, found = limit, None
    for leaf, far in zip(leaves, np.maximum.reduceat(row, np.cumsum(sizes) - sizes), strict=True):
        for number in others:
            if far > best:
                break
            far = max(far, bank.distances(bank[number], leaf.members).max())
        if far <= best:
            best, found = far, leaf
    return found


def forget_chances(structure: Structure, when: int) -> Change:
    """Forget the provisional primitives that nothing has joined for long: they came by chance.

    Args:
        structure: The tree.
        when: Segments seen.
    """
    config = structure.config
    few = (structure.nodes[id] for id in structure.index.leaves_below(config.confirmed))
    young = [leaf for leaf in few if leaf.n_placed < config.confirmed]
    patience = max(config.patience, 4 * int(structure.index.leaves.sum()))
    change = Change()
    for leaf in young:
        if when - leaf.born_at > patience and not leaf.by_hand:
            change = change.then(structure.remove(leaf, when, forget=True))
    return change


def drop_fragments(
    structure: Structure, number: int, longest: int, when: int, most: float
) -> Change:
    """Drop a primitive that was born of parts of a motion, once that is known whole.

    Who hesitates at the same place again makes a primitive of a part. It goes if each of its few
    exemplars is an execution of another, sure primitive that came as often, together with the one
    right before or after it, without a rest; but not where it is played back. Where one of the two
    that it was born of is so a part of what came to it later, all wait again and become what
    they are: a primitive of the others. With each segment one primitive is looked at, in turn.

    Args:
        structure: The tree.
        number: The segment that came now; what it went to is left for another turn.
        longest: Most frames of a motion.
        when: Segments seen.
        most: Leaves that are formed at most.
    """
    few = structure.index.leaves_below(_OFTEN)
    if not few:
        return Change()
    leaf = structure.nodes[few[when % len(few)]]
    if leaf.by_hand or number in leaf.members:
        return Change()
    first, later = leaf.members[:2], leaf.members[2:]
    wholes: dict[int, list[_Whole]] = {}
    for member in first:
        wholes[member] = _wholes(structure, member, longest)
        if not wholes[member] and len(later) < 2:
            return Change()
    of_all = set.intersection(*({each.home for each in found} for found in wholes.values()))
    of_all -= {leaf.id}
    for member in later:
        if of_all:
            of_all &= {each.home for each in _wholes(structure, member, longest)}
    if of_all and structure.nodes[min(of_all)].n_placed >= leaf.n_placed:
        if leaf.diameter <= _PLAYED_BACK * cutoff(structure, structure.root):
            return Change()
        return structure.remove(leaf, when, forget=True)._replace(parts=(leaf.id,))
    if len(later) < 2:
        return Change()
    own = ((part, each) for part in first for each in wholes[part] if each.home == leaf.id)
    parts = {part for part, whole in own if _is_rather(structure, whole, part, later)}
    if not parts:
        return Change()
    change = structure.remove(leaf, when, forget=False)._replace(parts=(leaf.id,))
    structure.root.settled |= parts
    return change.then(form_primitives(structure, structure.root, when, most))


class _Whole(NamedTuple):
    """A segment and the next as one: the sure primitive that it lies in, and its frames."""

    home: int
    model: Exemplar
    length: int


def _wholes(structure: Structure, number: int, longest: int) -> list[_Whole]:
    """Return what a segment is a part of, with the one before it or after it, of what is sure."""
    memory, found = structure.memory, []
    firsts = [first for first in (number - 1, number) if memory.goes_on(first)]
    lengths = [structure.length_of(first) + structure.length_of(first + 1) for first in firsts]
    for model, length in zip(_joined(structure, firsts), lengths, strict=True):
        home = _sure_of(structure, [model], 1.0)[0] if length <= longest else None
        if home is not None:
            found.append(_Whole(home, model, length))
    return found


def _is_rather(structure: Structure, whole: _Whole, part: int, others: Sequence[int]) -> bool:
    """Return whether a whole is more like others than its part is, in motion and in length."""
    bank, length = structure.memory.bank, structure.length_of
    nearer = bank.distances(whole.model, others).mean() < bank.distances(bank[part], others).mean()
    usual = float(np.mean([length(other) for other in others]))
    off, alone = abs(np.log(whole.length / usual)), abs(np.log(length(part) / usual))
    return bool(nearer and off < alone)


def cutoff(structure: Structure, node: Node) -> float:
    """Return the largest distance inside a cluster that becomes a node, D_cutoff.

    It is the scale of all motion, which is large as long as little of it has come again, and the
    more that of what is known by now, the more that is.
    """
    config = structure.config
    if config.local:
        mu, sigma = moments(node.matrix)
        return mu - config.cutoff * sigma
    scale = structure.memory.scale()
    n_leaves = int(structure.index.leaves.sum())
    if not n_leaves or not np.isfinite(config.birth_cap):
        return scale
    known = min(scale, config.birth_cap * structure.index.scale())
    return (_UNKNOWN * scale + n_leaves * known) / (_UNKNOWN + n_leaves)


def split_mixed(structure: Structure, leaf: Node, when: int) -> Change:
    """Split a leaf if its two branches lie too far apart.

    On average, by what is inside them and by how wide other leaves are; and with a break between
    them. Few exemplars look like two groups by chance, so the leaf must keep all that it may; but
    not where they come after, or before, two primitives, and each of the two groups beside one.

    Args:
        structure: The tree.
        leaf: The leaf that grew.
        when: Segments seen.
    """
    if leaf.whole or leaf.frozen:
        return Change()
    beside = _beside_two(structure, leaf) if structure.config.sequence_share else None
    full = len(leaf.members) >= structure.config.max_exemplars
    width = structure.config.split_scale * structure.index.scale(but=leaf.id)
    least = width if beside is None else _IN_SEQUENCE * width
    if not (full or beside) or leaf.diameter <= _SURELY * least:  # without tempo nothing is farther
        return Change()
    matrix = structure.memory.bank.without_tempo(leaf.members, leaf.matrix)
    branches = None
    if beside is not None:
        share = 1.0 if min(map(len, beside)) == 2 else _IN_SEQUENCE
        groups = _with_the_nearer(matrix, *beside)
        branches = _if_apart(structure.config, matrix, groups, share * width, share)
    if branches is None and full:
        halves = two_branches(matrix, structure.config.min_branch)
        branches = _if_apart(structure.config, matrix, halves, width, 1.0)
    if branches is None:
        return Change()
    return structure.split(leaf, [[leaf.members[i] for i in branch] for branch in branches], when)


def _if_apart(
    config: TreeConfig,
    matrix: FloatArray,
    groups: tuple[IntArray, IntArray] | None,
    width: float,
    share: float,
) -> tuple[IntArray, IntArray] | None:
    """Return two groups if they lie too far apart to be one motion, by a share of the limits."""
    if (
        groups is None
        or mean_between(matrix, *groups) <= width
        or separation(matrix, *groups) <= share * config.split_ratio
        or gap(matrix, *groups) <= share * config.split_gap
    ):
        return None
    return groups


def _beside_two(structure: Structure, leaf: Node) -> tuple[IntArray, IntArray] | None:
    """Return the positions of the exemplars right after, or else right before, two primitives.

    None where those that are known came beside one, or too few for a node beside another, or half
    as many as beside that beside others; or where either of the two does not mostly come with the
    leaf: what comes beside it by chance differs by what came by chance. What follows its own kind
    is no sequence.
    """
    for step in (-1, 1):
        homes = structure.homes([number + step for number in leaf.members])
        kinds, counts = np.unique(homes[(homes != ROOT) & (homes != leaf.id)], return_counts=True)
        if len(kinds) < 2:
            continue
        *others, second, first = np.argsort(counts, kind="stable").tolist()
        if counts[second] < structure.least or 2 * counts[others].sum() >= counts[second]:
            continue
        beside = kinds[[first, second]].tolist()
        back = [structure.homes([n - step for n in structure.nodes[id].members]) for id in beside]
        if all(2 * (here == leaf.id).sum() > (here != ROOT).sum() for here in back):
            return np.flatnonzero(homes == beside[0]), np.flatnonzero(homes == beside[1])
    return None


def _with_the_nearer(
    matrix: FloatArray, first: IntArray, second: IntArray
) -> tuple[IntArray, IntArray]:
    """Return two groups, each with those of the rest that are nearer to it on average."""
    rest = np.setdiff1d(np.arange(len(matrix)), np.concatenate([first, second]))
    to_first, to_second = (matrix[np.ix_(rest, group)].mean(axis=1) for group in (first, second))
    nearer = to_first <= to_second
    return np.union1d(first, rest[nearer]), np.union1d(second, rest[~nearer])


def shed_outliers(structure: Structure, leaf: Node, when: int, most: float) -> Change:
    """Let a leaf keep its core only where it is wider than motions lie apart.

    While little was known its radius reached other motions, which it took in. What is no part of
    its largest cluster, and lies off that by a gap, waits again to become what it is: one of so
    many primitives, at most, that are formed.
    """
    config, limit = structure.config, structure.memory.valley()
    if leaf.whole or leaf.frozen or leaf.diameter <= limit:
        return Change()
    matrix = structure.memory.bank.without_tempo(leaf.members, leaf.matrix)
    groups = clusters_below(matrix, limit, 1)
    core = max(groups, key=len, default=np.zeros(0, np.int64))
    if len(core) < 2 or len(groups) < 2:
        return Change()
    usual = nearest_usual(matrix[np.ix_(core, core)])
    away = [g for g in groups if matrix[np.ix_(g, core)].min() > config.split_gap * usual]
    outliers = [leaf.members[i] for group in away for i in group]
    if not outliers:
        return Change()
    shed = structure.shed(leaf, outliers)
    return shed.then(form_primitives(structure, structure.root, when, most))


def merge_duplicates(structure: Structure, matches: Sequence[Match], when: int) -> Change:
    """Merge the two leaves that a segment lies in, if they are no farther apart than inside."""
    nodes = structure.nodes  # a search from the root compares with those above leaves, too
    inside = [each.node for each in matches if each.ratio <= 1 and nodes[each.node].is_leaf]
    if len(inside) < 2:
        return Change()
    older, younger = sorted((structure.nodes[id] for id in inside[:2]), key=lambda node: node.id)
    if older.frozen or younger.frozen:
        return Change()
    if older.id in younger.apart or younger.id in older.apart:
        return Change()
    joint = structure.joint(older, younger)
    first, second = np.split(np.arange(len(joint)), [len(older.members)])
    if separation(joint, first, second) >= structure.config.merge_ratio:
        return Change()
    return structure.merge(older, younger, joint, when)
