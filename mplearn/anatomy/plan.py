"""Which branches of a skeleton are legs, arms, trunk and head: by symmetry, lengths and bends.

A person is built of two pairs of limbs, bone for bone alike, that part from the two ends of a
spine. What is not paired in this way (weapons, tails, hair) or hangs on a limb's end (fingers) or
the head (face) is no limb. Names only settle what is nearly a tie.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import combinations, pairwise

import numpy as np

from ..recording import FloatArray
from .joint_tree import JointTree
from .name_hints import says_head, says_leg
from .proportions import ARM, LEG, STRANGE, LimbLaw, fit_limb

SHORTEST_PAIR = 0.18  # of the longest way: fingers and eyes are shorter pairs than limbs
MOST_NODES = 16  # of a limb that are looked at
NAMED = 2.0  # what a name is worth, in the logarithm of odds
CARRIED, RIGID = 6.0, 0.004  # what it costs never to move, as wings; of the longest way
UPRIGHT = 2.0  # what it is worth that arms are above legs
NECK, AS_LIKELY = 0.5, 0.25  # how high a neck is, how far beside it ways may begin: of the trunk
PAIRED, SIDEWAYS = 1.0, 0.8  # what it costs a head to come in two, side by side: cosine
EVEN = 0.25  # of the way between two sides that each of them is off their middle, at least


@dataclass(frozen=True)
class LimbPair:
    """Two limbs that are alike; which is the left one is not known yet.

    Attributes:
        root: Node at which they part.
        nodes: First, middle and last joint (hip, knee, ankle; shoulder, elbow, wrist) of each.
        inner: Nodes between the root and the first joint of each, such as clavicles.
        outer: Nodes after the last joint of each, on the way on which both are alike.
        cost: Minus the logarithm of its likelihood.
    """

    root: int
    nodes: tuple[tuple[int, int, int], tuple[int, int, int]]
    inner: tuple[tuple[int, ...], tuple[int, ...]]
    outer: tuple[tuple[int, ...], tuple[int, ...]]
    cost: float

    @property
    def one_root(self) -> bool:
        """Whether both limbs begin at one point."""
        return self.nodes[0][0] == self.nodes[1][0]


@dataclass(frozen=True)
class Plan:
    """The body that a skeleton is.

    Attributes:
        legs: The legs, or None.
        arms: The arms, or None.
        spine: Nodes from the legs' root to the arms', both included; where one is missing, from or
            to the end of the trunk.
        head: Nodes beyond the arms' root on the way to the top of the head; empty where none.
        cost: Minus the logarithm of its likelihood, relative to a person's.
    """

    legs: LimbPair | None
    arms: LimbPair | None
    spine: tuple[int, ...]
    head: tuple[int, ...]
    cost: float


def find_plan(tree: JointTree) -> Plan | None:
    """Find the likeliest body in a skeleton; None if there are no legs and arms in it."""
    pairs = _pairs(tree)
    plans = [
        plan
        for (one, reach_one), (other, reach_other) in combinations(pairs, 2)
        if _apart(tree, one, other)
        for plan in (
            _plan(tree, one, other, reach_one + reach_other),
            _plan(tree, other, one, reach_one + reach_other),
        )
    ]
    return min(plans, key=lambda plan: plan.cost, default=None)


def find_half(tree: JointTree) -> Plan | None:
    """Find the likeliest pair of legs, or of arms, in a skeleton that has only those.

    By geometry many things have two branches that are alike: names must call them legs or arms.
    """
    halves = []
    for pair, reach in _pairs(tree):
        named = says_leg([name for nodes in pair[1] for node in nodes for name in tree.names[node]])
        if named:
            legs, arms = (pair, None) if named > 0 else (None, pair)
            halves.append(_plan(tree, legs, arms, reach))
    found = [plan for plan in halves if plan.legs is not None or plan.arms is not None]
    return min(found, key=lambda plan: plan.cost, default=None)


_Ways = tuple[int, tuple[tuple[int, int], ...]]  # where they part, and the nodes on both


def _pairs(tree: JointTree) -> list[tuple[_Ways, float]]:
    """Return the pairs of branches that are long enough for limbs, the longest first."""
    found = []
    for node, edges in enumerate(tree.edges):
        for a, b in combinations(edges, 2):
            reach, ways = tree.paired(node, a, b)
            if reach > SHORTEST_PAIR * tree.extent and len(ways) >= 2:
                found.append(((node, ways), reach))
    found.sort(key=lambda pair: -pair[1])
    return found[:12]


def _apart(tree: JointTree, one: _Ways, other: _Ways) -> bool:
    """Whether two pairs of branches share no node, but perhaps the one where they part."""
    return not (_region(tree, one) & _region(tree, other)) and not (
        _region(tree, one) & {other[0]} or _region(tree, other) & {one[0]}
    )


def _region(tree: JointTree, pair: _Ways) -> frozenset[int]:
    node, ways = pair
    return tree.beyond(ways[0][0], node) | tree.beyond(ways[0][1], node)


def _plan(tree: JointTree, legs: _Ways | None, arms: _Ways | None, reach: float) -> Plan:
    """Return the plan in which certain branches are the legs and the arms."""
    cost = -4.0 * reach / tree.extent  # longer pairs explain more of the skeleton
    found_legs = _limbs(tree, legs, LEG, 1)
    found_arms = _limbs(tree, arms, ARM, -1)
    cost += sum(pair.cost if pair else 0.5 * STRANGE for pair in (found_legs, found_arms))
    cost += sum(CARRIED for ways in (legs, arms) if ways is not None and _is_rigid(tree, ways))
    spine: tuple[int, ...] = ()
    head: tuple[int, ...] = ()
    if legs is not None and arms is None:
        spine = (legs[0], *_trunk(tree, legs, up=1))
    if arms is not None and legs is None:
        spine = (*reversed(_trunk(tree, arms, up=-1)), arms[0])
    if legs is not None and arms is not None:
        spine = tree.way(legs[0], arms[0])
        rise = tree.points[:, arms[0], 2] - tree.points[:, legs[0], 2]
        bone = np.linalg.norm(tree.points[:, arms[0]] - tree.points[:, legs[0]], axis=1)
        cost -= UPRIGHT * float(np.median(rise / np.maximum(bone, 1e-9)))
    if arms is not None:
        head = _head(tree, arms, spine)
        cost -= NAMED if head and says_head([n for h in head for n in tree.names[h]]) else 0.0
        cost -= 2.0 if head else 0.0
    return Plan(found_legs, found_arms, spine, head, cost)


def _limbs(tree: JointTree, pair: _Ways | None, law: LimbLaw, legs: int) -> LimbPair | None:
    if pair is None:
        return None
    root, ways = pair
    ways = ways[: MOST_NODES - 1]
    chains = [(root, *(nodes[side] for nodes in ways)) for side in (0, 1)]
    if len(chains[0]) < 3:
        return None
    both = np.concatenate([tree.points[:, list(chain)] for chain in chains])
    edges = np.array([[len(tree.edges[node]) for node in chain] for chain in chains])
    limb = fit_limb(both, law, np.asarray(edges.min(axis=0) > 3))
    first, middle, last = limb.places
    names = [name for chain in chains for node in chain[1:] for name in tree.names[node]]
    return LimbPair(
        root=root,
        nodes=_sides(chains, lambda c: (c[first], c[middle], c[last])),
        inner=_sides(chains, lambda c: c[1:first]),
        outer=_sides(chains, lambda c: c[last + 1 :]),
        cost=limb.cost - NAMED * legs * says_leg(names),
    )


def _is_rigid(tree: JointTree, pair: _Ways) -> bool:
    """Whether two branches never move, neither against each other nor against where they part."""
    root, ways = pair
    points = tree.points[:, [root, *ways[0], *ways[-1]]]
    between = np.linalg.norm(points[:, :, None] - points[:, None], axis=3)
    return bool(np.ptp(between, axis=0).max() < RIGID * tree.extent)


def _sides(chains: Sequence[tuple[int, ...]], part):  # type: ignore[no-untyped-def]
    return part(chains[0]), part(chains[1])


def _trunk(tree: JointTree, pair: _Ways, up: int) -> tuple[int, ...]:
    """Return the nodes of the trunk beyond the root of the only limbs: above legs, below arms."""
    root, ways = pair
    best: tuple[float, tuple[int, ...]] = (0.02 * tree.extent, ())
    for branch in tree.edges[root]:
        if branch in ways[0]:
            continue
        length, way = tree.longest(branch, root)
        rise = float(np.median(tree.points[:, way[-1], 2] - tree.points[:, root, 2]))
        if length + tree.length(root, branch) > best[0] and up * rise > 0:
            best = (length + tree.length(root, branch), way)
    return best[1]


def _head(tree: JointTree, arms: _Ways, spine: tuple[int, ...]) -> tuple[int, ...]:
    """Return the nodes on the way from the arms' root that is neither limb nor spine to the top.

    Of several, hair and what is carried among them, it is the way that names call a head's, else
    the highest of those that begin like a neck; where no trunk is known, the longest.
    """
    root, ways = arms
    taken = {*ways[0], *spine}
    along = tree.points[:, root] - tree.points[:, spine[0]] if len(spine) > 1 else None
    across = tree.points[:, ways[1][0]] - tree.points[:, ways[1][1]]
    # where the neck hangs one joint below the arms' root, the way starts there
    for start in (root, *spine[-2:-1]):
        branches = [
            branch
            for branch in tree.edges[start]
            if branch not in taken and branch != root and (start == root or branch not in spine)
        ]
        found = [way for branch in branches for way in _ways_to_ends(tree, branch, start)]
        named = [way for way in found if says_head([n for h in way for n in tree.names[h]])]
        lengths = {way: _length(tree, (start, *way)) for way in named or found}
        lengths = {way: length for way, length in lengths.items() if length > 0.02 * tree.extent}
        if not lengths:
            continue
        if along is None or len(lengths) == 1:
            return max(lengths, key=lambda way: lengths[way])
        odd = {way: _unlike_head(tree, start, way, along, across) for way in lengths}
        like = [way for way in lengths if odd[way] <= min(odd.values()) + AS_LIKELY]
        ends = [tree.points[:, way[-1]] - tree.points[:, start] for way in like]
        rises = [float(np.median(_along(end, along))) for end in ends]
        return like[int(np.argmax(rises))]
    return ()


def _ways_to_ends(tree: JointTree, node: int, away_from: int) -> list[tuple[int, ...]]:
    """Return the ways from a node to all ends that do not go by another."""
    beyond = [other for other in tree.edges[node] if other != away_from]
    ways = [way for other in beyond for way in _ways_to_ends(tree, other, node)]
    return [(node, *way) for way in ways] or [(node,)]


def _length(tree: JointTree, way: tuple[int, ...]) -> float:
    return sum(tree.length(a, b) for a, b in pairwise(way))


def _unlike_head(
    tree: JointTree, start: int, way: tuple[int, ...], along: FloatArray, across: FloatArray
) -> float:
    """Return how little like a neck and a head a way is: wings, ears and packs are less so.

    Args:
        tree: The skeleton.
        start: The node where the way leaves the trunk.
        way: Its nodes.
        along: The trunk from below, shape (T, 3).
        across: From one side of the body to the other, shape (T, 3).
    """
    size = np.linalg.norm(along, axis=1)
    neck = []
    for node in way:
        end = tree.points[:, node] - tree.points[:, start]
        rise = _along(end, along)
        off = np.sqrt(np.maximum((end * end).sum(axis=1) - rise**2, 0.0))
        neck.append(float(np.median(off / size)))
        if np.median(rise / size) > NECK:
            break
    nodes = (start, *way)
    pairs = [
        (node, other)
        for before, node in pairwise(nodes)
        for other in tree.edges[before]
        if other not in nodes and _on_both_sides(tree, before, node, other, across)
    ]
    return max(neck) + (PAIRED if pairs else 0.0)


def _along(ways: FloatArray, along: FloatArray) -> FloatArray:
    """Return how far vectors lead along others, shapes (T, 3) to (T,)."""
    far: FloatArray = (ways * along).sum(axis=1) / np.linalg.norm(along, axis=1)
    return far


def _on_both_sides(tree: JointTree, root: int, one: int, other: int, across: FloatArray) -> bool:
    """Whether two branches that part at a node are alike, one on each side of the body."""
    reach, ways = tree.paired(root, one, other)
    if not reach:
        return False
    ends = [tree.points[:, node] - tree.points[:, root] for node in ways[-1]]
    apart = ends[0] - ends[1]
    lengths = np.linalg.norm(apart, axis=1)
    one_far, other_far = (float(np.median(_along(end, across))) for end in ends)
    even = min(one_far, -other_far) if one_far > 0 else min(-one_far, other_far)
    sideways = np.median(np.abs(_along(apart, across)) / np.maximum(lengths, 1e-9))
    return bool(sideways > SIDEWAYS and even > EVEN * float(np.median(lengths)))
