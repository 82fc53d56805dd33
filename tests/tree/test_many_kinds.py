"""Many motions that lie near each other are told apart, and what was swallowed comes out."""

from collections import Counter
from dataclasses import replace

import numpy as np
import pytest

from mplearn.tree import ROOT, PrimitiveTree, TreeConfig
from mplearn.tree.exemplars.neighbours import Neighbours

RATE_HZ, T = 50.0, 40
BUMP = np.sin(np.linspace(0, np.pi, T))[:, None]
SIDE, TIMES = 8, 5


def learned(config: TreeConfig) -> tuple[PrimitiveTree, int, float]:
    """A tree that saw 64 motions of two joints, on a grid, in mixed order.

    Returns:
        The tree, how many motions own a primitive, and the share of placed segments in a wrong one.
    """
    rng = np.random.default_rng(0)
    kinds = np.stack(np.meshgrid(*[np.arange(SIDE)] * 2), axis=-1).reshape(-1, 2).astype(float)
    tree = PrimitiveTree(config, 2, RATE_HZ)
    kind_of, home = {}, {}
    for k in np.concatenate([rng.permutation(len(kinds)) for _ in range(TIMES)]):
        placed = tree.insert(BUMP * (kinds[k] + rng.normal(0, 0.15, 2)))
        kind_of[placed.number], home[placed.number] = int(k), placed.node_id
        assert placed.recognised <= (placed.node_id != ROOT)
        home.update(placed.moved)
        heirs = {merge.absorbed: merge.kept for merge in placed.merges}
        heirs |= dict.fromkeys(placed.removed, ROOT)
        home = {number: heirs.get(node, node) for number, node in home.items()}
    held = {
        number: node.id
        for node in tree.nodes
        if node.id == ROOT or node.is_leaf
        for number in node.members
    }
    assert held.items() <= home.items()  # what placements tell is where exemplars are
    votes: dict[int, Counter[int]] = {}
    for number, node in home.items():
        votes.setdefault(node, Counter())[kind_of[number]] += 1
    votes.pop(ROOT, None)
    best = [each.most_common(1)[0] for each in votes.values()]
    n_placed = sum(each.total() for each in votes.values())
    return tree, len({kind for kind, _ in best}), 1 - sum(count for _, count in best) / n_placed


def test_sixty_four_motions_on_a_grid_are_told_apart() -> None:
    tree, owned, wrong = learned(TreeConfig())
    assert owned >= 58 and wrong <= 0.2
    for node in tree.nodes[1:]:
        assert len(node.members) <= node.n_placed and node.matrix.shape == (len(node.members),) * 2
    state = tree.state()
    again = PrimitiveTree(tree.config, 2, RATE_HZ)
    again.load_state(state)
    assert again.limit == tree.limit
    _, owned, wrong = learned(replace(TreeConfig(), rise=np.inf))
    assert (
        owned <= 32 and wrong >= 0.4
    )  # leaves reach into others, and what lies inside never waits


@pytest.mark.parametrize(("own", "others"), [(0.1, 0.4), (0.1, 0.2), (0.2, 0.5)])
def test_the_valley_lies_between_own_executions_and_others(own: float, others: float) -> None:
    rng = np.random.default_rng(0)
    near = Neighbours()
    for _ in range(100):
        around = rng.uniform(0.5 * own, own, 5)
        beyond = others * rng.uniform(1, 30, 60) ** 0.5
        near.update(np.concatenate([around, beyond, [0.0]]))
    valley = near.valley(1.05)
    of_others = 60 * ((valley / others) ** 2 - 1) / 29
    assert own <= valley and of_others <= 0.5 * 5  # most of what lies within are its own


def test_no_valley_is_seen_before_enough_is_known() -> None:
    near = Neighbours()
    farthest = near.valley(1.05)
    near.update(np.array([0.0, 0.1, 0.2]))  # a copy is no neighbour
    assert near.counts.max() == 2 and near.valley(1.05) == farthest > TreeConfig().mean_share


def test_a_frozen_leaf_or_one_that_a_person_made_sheds_nothing() -> None:
    """What a person said is one motion stays one."""
    rng = np.random.default_rng(1)
    tree = PrimitiveTree(TreeConfig(), 2, RATE_HZ)
    kinds = np.stack(np.meshgrid(*[np.arange(5)] * 2), axis=-1).reshape(-1, 2).astype(float)
    for _ in range(6):
        for kind in kinds:
            tree.insert(BUMP * (kind + rng.normal(0, 0.1, 2)))
    first, second = tree.leaves[:2]
    tree.merge(first, second)
    frozen = tree.leaves[-1]
    tree.freeze(frozen)
    both = set(tree.node(first).members)
    seen = set(tree.node(frozen).members)
    for _ in range(2):
        for kind in kinds:
            tree.insert(BUMP * (kind + rng.normal(0, 0.1, 2)))
    assert set(tree.node(frozen).members) == seen
    kept = set(tree.node(first).members)
    assert tree.node(first).whole and (both <= kept or len(kept) == tree.config.max_exemplars)


def test_near_copies_change_no_scale() -> None:
    rng = np.random.default_rng(5)
    t = np.linspace(0, 1, 40)[:, None]
    kinds = rng.normal(0, 1, (8, 1, 4))
    shown = [
        np.sin(2 * np.pi * t * (1 + kinds[k % 8])) * (1 + rng.normal(0, 0.1, 4)) for k in range(24)
    ]
    tree = PrimitiveTree(TreeConfig(), 4, 50.0)
    for frames in shown:
        tree.insert(frames)
    before = tree._memory.scale()
    for frames in shown:  # played back, but for what a sensor adds
        tree.insert(frames + rng.normal(0, 1e-4, frames.shape))
    assert tree._memory.scale() == pytest.approx(before, rel=0.1)
