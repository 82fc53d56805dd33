"""Trees of one person that were learned apart, as one that goes on learning."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from ..errors import InvalidValueError
from ..recording import IntArray
from ..state import Blob
from ..tree import ROOT, Change, PrimitiveTree
from ..tree.exemplars.memory import FOLLOWING
from ..tree.exemplars.spread import SampleState, SpreadState
from ..tree.nodes.node import NodeState
from ..tree.nodes.search import mean_nearest
from ..tree.tree import TreeState

_REACH = 1.25  # radii of few exemplars are small
_FAR = 1.5  # times that, the most typical exemplars say enough


class MergedTree(NamedTuple):
    """Several trees as one.

    Attributes:
        tree: The tree, which goes on learning.
        new_ids: Its id of each node of each of the trees; those of the first keep theirs.
        new_numbers: How much its numbers of the segments of each are larger than they were.
        change: What became of segments that no tree alone had placed.
    """

    tree: PrimitiveTree
    new_ids: tuple[dict[int, int], ...]
    new_numbers: tuple[int, ...]
    change: Change


def merge_trees(trees: Sequence[PrimitiveTree], least: int = 2) -> MergedTree:
    """Merge some trees; none changes, and their exemplars are not copied.

    A leaf of one becomes one with a leaf of those before it if the distance from the exemplars of
    each to those of the other is, on average, hardly above its radius; one to one, the nearest
    pairs first. All others, and what is frozen, stay what they were. Statistics add up as if one
    tree had seen all segments; those that wait in the roots are placed where they fit now.

    Models are made once, and distances within nodes measured once, however many trees there are.

    Args:
        trees: The trees, at least one.
        least: Members from which on what waits becomes a primitive, if that is more than by the
            rules.

    Raises:
        InvalidValueError: The trees have other rules, channels or rates.

    Example:
        >>> import numpy as np
        >>> from mplearn.tree import PrimitiveTree, TreeConfig
        >>> trees = [PrimitiveTree(TreeConfig(), n_channels=2, rate_hz=100.0) for _ in range(2)]
        >>> lift = np.outer(np.sin(np.linspace(0, np.pi, 60)), [1.0, 0.5])
        >>> for tree in trees:
        ...     placed = [tree.insert(k * lift) for k in (1.0, -1.0, 1.01, -1.01)]
        >>> merged = merge_trees(trees)
        >>> len(merged.tree.leaves), merged.tree.n_seen
        (2, 8)
    """
    first, *others = trees
    for other in others:
        for name in ("config", "n_channels", "rate_hz", "groups"):
            one, two = getattr(first, name), getattr(other, name)
            if one != two:
                raise InvalidValueError(f"trees must agree in {name}, not {one} and {two}")
    tree = PrimitiveTree(first.config, first.n_channels, first.rate_hz, first.groups)
    state = first.state()
    new_ids, new_numbers = [{node.id: node.id for node in state.nodes}], [0]
    for other in others:
        more, shift = other.state(), state.next_id - 1
        new_id = {node.id: node.id + shift if node.id != ROOT else ROOT for node in more.nodes}
        new_ids.append(new_id)
        new_numbers.append(state.n_seen)
        state = _joined(tree, state, more, new_id)
    tree.load_state(state)
    tree.require_exemplars(least)
    tree.remeasure()
    mine, gone = list(first.leaves), dict[int, int]()
    for other, new_id in zip(others, new_ids[1:], strict=True):
        theirs = [new_id[id] for id in other.leaves]
        gone |= _merge(tree, mine, theirs)
        mine += [id for id in theirs if id not in gone]
    known = tuple({old: gone.get(new, new) for old, new in each.items()} for each in new_ids)
    return MergedTree(tree, known, tuple(new_numbers), _placed(tree, len(others)))


def _placed(tree: PrimitiveTree, most: int) -> Change:
    """Place what waits, so many times at most: leaves reach farther once they hold more."""
    born, moved = list[int](), dict[int, int]()
    for _ in range(most):
        older = tree.leaves
        change = tree.place_unplaced()
        late = _merge(tree, older, change.born)
        moved |= {number: late.get(id, id) for number, id in change.moved}
        born += [id for id in change.born if id not in late]
        if not change.moved:
            break
    return Change(born=tuple(born), moved=tuple(moved.items()))


def _merge(tree: PrimitiveTree, mine: Sequence[int], theirs: Sequence[int]) -> dict[int, int]:
    """Merge the leaves that are one primitive; return what absorbed each that is gone."""
    gone = {}
    for one, other in _matches(tree, mine, theirs):
        whole = tree.node(one).whole or tree.node(other).whole
        tree.merge(one, other)
        tree.node(one).whole = whole  # the rules made it one, they may split it
        gone[other] = one
    return gone


def _renumbered(node: NodeState, n_before: int, new_id: Mapping[int, int]) -> NodeState:
    """Return a node with other numbers of segments and other ids."""
    return replace(
        node,
        id=new_id[node.id],
        parent=None if node.parent is None else new_id[node.parent],
        members=node.members + n_before,
        settled=tuple(number + n_before for number in node.settled),
        stood_for=tuple(each._replace(number=each.number + n_before) for each in node.stood_for),
        children=tuple(new_id[child] for child in node.children),
        apart=tuple(new_id[id] for id in node.apart if id in new_id),
    )


def _joined(
    tree: PrimitiveTree, a: TreeState, b: TreeState, new_id: Mapping[int, int]
) -> TreeState:
    """Return the state of a tree that holds all nodes of two; distances are to be measured."""
    config = tree.config
    spread = _added(a.spread, b.spread)
    variances = spread.squares / np.maximum(spread.count, 1)
    groups = np.array(tree.groups)
    shared = np.bincount(groups, variances) / np.maximum(np.bincount(groups), 1)
    nodes = [_renumbered(node, a.n_seen, new_id) for node in b.nodes]
    return TreeState(
        n_seen=a.n_seen + b.n_seen,
        next_id=a.next_id + b.next_id - 1,
        floor=config.variance_floor**2 * np.maximum(shared[groups], 1e-18),
        spread=spread,
        sample=_sampled(a, b, config.n_sampled, config.seed),
        nodes=_with_one_root(a.nodes, nodes, config.max_unplaced),
        neighbours=a.neighbours + b.neighbours,
        follows=np.concatenate([a.follows, b.follows + a.n_seen])[-FOLLOWING:],
    )


def _added(a: SpreadState, b: SpreadState) -> SpreadState:
    """Return counts, means and sums of squares of two sets of values together [Chan1979]."""
    count = a.count + b.count
    share = b.count / np.maximum(count, 1)
    step = b.mean - a.mean
    squares = a.squares + b.squares + step**2 * a.count * share
    return SpreadState(count, a.mean + share * step, squares)


def _sampled(a: TreeState, b: TreeState, size: int, seed: int) -> SampleState:
    """Return a uniform sample of all segments from uniform samples of two parts of them."""
    mine, theirs = a.sample.numbers, b.sample.numbers + a.n_seen
    frames: dict[int, Blob] = dict(zip(mine.tolist(), a.sample.frames, strict=True))
    frames |= zip(theirs.tolist(), b.sample.frames, strict=True)
    rng = np.random.default_rng((seed, a.n_seen, b.n_seen))
    numbers = _drawn(mine, theirs, a.n_seen, b.n_seen, size, rng)
    return SampleState(
        numbers, tuple(frames[n] for n in numbers.tolist()), np.zeros((len(numbers),) * 2)
    )


def _drawn(
    a: IntArray, b: IntArray, n_a: int, n_b: int, size: int, rng: np.random.Generator
) -> IntArray:
    if len(a) + len(b) <= size:
        return np.concatenate([a, b]).astype(np.int64)
    from_a = int(rng.hypergeometric(n_a, n_b, size))
    from_a = min(max(from_a, size - len(b)), len(a))
    chosen = (rng.choice(a, from_a, replace=False), rng.choice(b, size - from_a, replace=False))
    return np.concatenate(chosen).astype(np.int64)


def _with_one_root(
    a: Sequence[NodeState], b: Sequence[NodeState], most: int
) -> tuple[NodeState, ...]:
    """Return the nodes of both, under one root in which at most so many segments wait."""
    mine, theirs = a[0], b[0]
    members = np.concatenate([mine.members, theirs.members])[-most:]
    frames = (*mine.frames, *theirs.frames)[-most:]
    root = replace(
        mine,
        members=members,
        frames=frames,
        matrix=np.zeros((len(members),) * 2),
        children=(*mine.children, *theirs.children),
        settled=tuple(n for n in (*mine.settled, *theirs.settled) if n in members),
        n_placed=mine.n_placed + theirs.n_placed,
        n_frames=mine.n_frames + theirs.n_frames,
    )
    return (root, *a[1:], *b[1:])


def _matches(
    tree: PrimitiveTree, mine: Sequence[int], theirs: Sequence[int]
) -> list[tuple[int, int]]:
    """Return the pairs of leaves that are one primitive.

    Of the pairs that are nearest by their mean trajectories those are compared whose most typical
    exemplars are not far from the other leaf. One that is frozen stays as it is.
    """
    mine, theirs = ([id for id in ids if not tree.node(id).frozen] for ids in (mine, theirs))
    if not (mine and theirs):
        return []
    config, bank = tree.config, tree.bank
    radii = {id: tree.radius(id) for id in (*mine, *theirs)}
    means = np.stack([bank.mean_profile(tree.node(id).members) for id in mine])
    near = []
    for other in theirs:
        offsets = means - bank.mean_profile(tree.node(other).members)
        closest = np.argsort((offsets**2).sum(axis=1), kind="stable")
        for one in [mine[k] for k in closest[: config.n_candidates or None]]:
            apart = [
                _away(tree, of, _typical(tree, to)) / radii[of]
                for of, to in ((one, other), (other, one))
            ]
            if sum(apart) > 2 * _REACH * _FAR:
                continue
            numbers = tree.node(other).members
            matrix = np.stack([bank.distances(bank[n], numbers) for n in tree.node(one).members])
            forth = mean_nearest(matrix, config.n_nearest).mean() / radii[one]
            back = mean_nearest(matrix.T, config.n_nearest).mean() / radii[other]
            if forth + back <= 2 * _REACH:
                near.append((float(forth + back), one, other))
    pairs: list[tuple[int, int]] = []
    for _, i, j in sorted(near):
        if all(i != one and j != other for one, other in pairs):
            pairs.append((i, j))
    return pairs


def _typical(tree: PrimitiveTree, id: int) -> int:
    """Return the number of the exemplar of a leaf that is nearest to all others of it."""
    node = tree.node(id)
    return node.members[int(node.matrix.sum(axis=1).argmin())]


def _away(tree: PrimitiveTree, id: int, number: int) -> float:
    """Return how far a segment is from the nearest exemplars of a leaf."""
    row = tree.bank.distances(tree.bank[number], tree.node(id).members)
    return float(mean_nearest(row, tree.config.n_nearest))
