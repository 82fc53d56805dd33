"""Two trees that were learned apart, as one that goes on learning."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np

from ..errors import InvalidValueError
from ..recording import FloatArray, IntArray
from .bank import ExemplarBank
from .births import form_primitives
from .placement import ROOT, Change
from .search import mean_nearest
from .tree import PrimitiveTree

_REACH = 1.25  # radii of few exemplars are small


class Union(NamedTuple):
    """Two trees as one.

    Attributes:
        tree: The tree, which goes on learning.
        new_id: Its id of each node of the second tree; those of the first keep theirs.
        new_number: How much its numbers of the second tree's segments are larger than they were.
        change: What became of segments that neither tree alone had placed.
    """

    tree: PrimitiveTree
    new_id: dict[int, int]
    new_number: int
    change: Change


def union(first: PrimitiveTree, second: PrimitiveTree) -> Union:
    """Join two trees; neither changes.

    A leaf of the second becomes one with a leaf of the first if the distance from the exemplars of
    each to those of the other is, on average, hardly above its radius; one to one, the nearest
    pairs first. All others stay what they were. Statistics add up as if one tree had seen all
    segments; those that wait in the roots are placed where they fit now.

    Raises:
        InvalidValueError: The trees have other rules, channels or rates.
    """
    for name in ("config", "n_channels", "rate_hz", "groups"):
        mine, other = getattr(first, name), getattr(second, name)
        if mine != other:
            raise InvalidValueError(f"trees must agree in {name}, not {mine} and {other}")
    a, b = first.state(), second.state()
    shift = int(a["next_id"]) - 1
    new_id = {node.id: node.id + shift if node.id != ROOT else ROOT for node in second.nodes}
    tree = PrimitiveTree(first.config, first.n_channels, first.rate_hz, first.groups)
    state = _joined(tree, a, _renumbered(b, int(a["n_seen"]), new_id))
    tree.load_state(state)
    bank = ExemplarBank.from_state(tree.config, state["bank"])
    gone = _merge(tree, bank, first.leaves, [new_id[id] for id in second.leaves])
    older = tree.leaves
    change = _placed(tree)
    late = _merge(tree, bank, older, change.born)
    moved = tuple((number, late.get(id, id)) for number, id in change.moved)
    born = tuple(id for id in change.born if id not in late)
    known = {old: gone.get(new, new) for old, new in new_id.items()}
    return Union(tree, known, first.n_seen, Change(born=born, moved=moved))


def _merge(
    tree: PrimitiveTree, bank: ExemplarBank, mine: Sequence[int], theirs: Sequence[int]
) -> dict[int, int]:
    """Merge the leaves that are one primitive; return what absorbed each that is gone."""
    gone = {}
    for one, other in _matches(tree, bank, mine, theirs):
        whole = tree.node(one).whole or tree.node(other).whole
        tree.merge(one, other)
        tree.node(one).whole = whole  # the rules made it one, they may split it
        gone[other] = one
    return gone


def _placed(tree: PrimitiveTree) -> Change:
    """Place what waits in the root of a tree, where it fits, or in primitives of its own."""
    structure, bank = tree._structure, tree._memory.bank
    found = [(n, structure.index.search(bank[n], bank)[:1]) for n in structure.root.members]
    change = Change()
    for number, best in found:  # all are compared first: their order must not matter
        if best and best[0].ratio <= 1 and best[0].node in tree.leaves:
            leaf = structure.nodes[best[0].node]
            change = change.then(structure.take_in(leaf, [number]))
    if not tree.config.local:
        change = change.then(form_primitives(structure, structure.root, tree.n_seen))
    structure.tune()
    return change


def _renumbered(state: dict[str, Any], n_before: int, new_id: Mapping[int, int]) -> dict[str, Any]:
    """Return a tree's state with other numbers of segments and other ids."""
    nodes = [
        node
        | {
            "id": new_id[node["id"]],
            "parent": None if node["parent"] is None else new_id[node["parent"]],
            "members": [number + n_before for number in node["members"]],
            "settled": [number + n_before for number in node["settled"]],
            "children": [new_id[child] for child in node["children"]],
            "apart": [new_id[id] for id in node["apart"] if id in new_id],
        }
        for node in state["nodes"]
    ]
    bank = state["bank"] | {"numbers": state["bank"]["numbers"] + n_before}
    sample = state["sample"] | {"numbers": state["sample"]["numbers"] + n_before}
    return state | {"nodes": nodes, "bank": bank, "sample": sample}


def _joined(tree: PrimitiveTree, a: dict[str, Any], b: dict[str, Any]) -> dict[str, Any]:
    """Return the state of a tree that holds all nodes of two, all segments measured anew."""
    config = tree.config
    spread = _added(a["spread"], b["spread"])
    variances = spread["squares"] / np.maximum(spread["count"], 1)
    groups = np.array(tree.groups)
    shared = np.bincount(groups, variances) / np.maximum(np.bincount(groups), 1)
    floor = config.variance_floor**2 * np.maximum(shared[groups], 1e-18)
    points = {
        name: np.concatenate([a["bank"][name], b["bank"][name]])
        for name in ("numbers", "columns", "duration")
    }
    n_a, n_b = int(a["n_seen"]), int(b["n_seen"])
    rng = np.random.default_rng((config.seed, n_a, n_b))
    numbers = _drawn(
        a["sample"]["numbers"], b["sample"]["numbers"], n_a, n_b, config.n_sampled, rng
    )
    frames = [*a["frames"], *b["frames"]]
    nodes = _with_one_root(a["nodes"], b["nodes"], config.max_unplaced)
    held = {number for node in nodes for number in node["members"]} | set(numbers.tolist())
    kept = np.isin(points["numbers"], sorted(held))
    bank = ExemplarBank.from_points(
        config, {"floor": floor} | {name: rows[kept] for name, rows in points.items()}
    )
    for node in nodes:
        node["matrix"] = bank.matrix(node["members"])
    return {
        "n_seen": n_a + n_b,
        "next_id": int(b["next_id"]) + int(a["next_id"]) - 1,
        "spread": spread,
        "sample": {"numbers": numbers, "matrix": bank.matrix(numbers.tolist(), forms_only=True)},
        "bank": bank.state(),
        "frames": [each for each, keep in zip(frames, kept, strict=True) if keep],
        "nodes": nodes,
    }


def _added(a: Mapping[str, FloatArray], b: Mapping[str, FloatArray]) -> dict[str, FloatArray]:
    """Return counts, means and sums of squares of two sets of values together [Chan1979]."""
    count = a["count"] + b["count"]
    share = b["count"] / np.maximum(count, 1)
    step = b["mean"] - a["mean"]
    squares = a["squares"] + b["squares"] + step**2 * a["count"] * share
    return {"count": count, "mean": a["mean"] + share * step, "squares": squares}


def _drawn(a: Any, b: Any, n_a: int, n_b: int, size: int, rng: np.random.Generator) -> IntArray:
    """Return a uniform sample of all segments from uniform samples of two parts of them."""
    if len(a) + len(b) <= size:
        return np.concatenate([a, b]).astype(np.int64)
    from_a = int(rng.hypergeometric(n_a, n_b, size))
    from_a = min(max(from_a, size - len(b)), len(a))
    chosen = (rng.choice(a, from_a, replace=False), rng.choice(b, size - from_a, replace=False))
    return np.concatenate(chosen).astype(np.int64)


def _with_one_root(
    a: list[dict[str, Any]], b: list[dict[str, Any]], most: int
) -> list[dict[str, Any]]:
    """Return the nodes of both, under one root in which at most so many segments wait."""
    roots = [next(node for node in nodes if node["id"] == ROOT) for nodes in (a, b)]
    waiting = [number for root in roots for number in root["members"]]
    root = dict(roots[0]) | {
        "members": waiting[-most:],
        "children": [child for each in roots for child in each["children"]],
    }
    for name in ("n_placed", "n_frames"):
        root[name] = sum(each[name] for each in roots)
    return [root, *(dict(node) for node in (*a, *b) if node["id"] != ROOT)]


def _matches(
    tree: PrimitiveTree, bank: ExemplarBank, mine: Sequence[int], theirs: Sequence[int]
) -> list[tuple[int, int]]:
    """Return the pairs of leaves that are one primitive."""
    if not (mine and theirs):
        return []
    config = tree.config
    means = np.stack([bank.mean_profile(tree.node(id).members) for id in mine])
    near = []
    for other in theirs:
        offsets = means - bank.mean_profile(tree.node(other).members)
        closest = np.argsort((offsets**2).sum(axis=1), kind="stable")
        for k in closest[: config.n_candidates or None]:
            matrix = np.stack(
                [
                    bank.distances(bank[n], tree.node(other).members)
                    for n in tree.node(mine[k]).members
                ]
            )
            forth = mean_nearest(matrix, config.n_nearest).mean() / tree.radius(mine[k])
            back = mean_nearest(matrix.T, config.n_nearest).mean() / tree.radius(other)
            if forth + back <= 2 * _REACH:
                near.append((float(forth + back), mine[k], other))
    pairs: list[tuple[int, int]] = []
    for _, i, j in sorted(near):
        if all(i != one and j != other for one, other in pairs):
            pairs.append((i, j))
    return pairs
