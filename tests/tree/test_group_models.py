"""Models of primitives: one chain, and more where it cannot tell neighbours apart."""

import numpy as np
import pytest
from motions import RATE_HZ, Motions

from mplearn.errors import InvalidValueError, UnknownPrimitiveError
from mplearn.hmm import FactorialHMM, LeftRightHMM, needs_more_chains
from mplearn.tree import PrimitiveTree, TreeConfig


def grown(seed, max_chains):
    """A tree of two motions that differ in one key posture."""
    motions = Motions(2, seed=seed)
    motions.keys[1] = motions.keys[0] + 1.5 * (np.arange(4) == 1)[:, None]
    tree = PrimitiveTree(TreeConfig(n_states=4, max_chains=max_chains), 6, RATE_HZ)
    for _, frames in motions.session(10):
        tree.insert(frames)
    assert len(tree.leaves) == 2
    return tree


@pytest.mark.parametrize(("seed", "asks"), [(1, True), (6, False)])
def test_a_chain_is_added_where_a_neighbour_cannot_be_told_apart(seed, asks):
    plain, tree = grown(seed, 1), grown(seed, 2)
    assert plain.leaves == tree.leaves  # chains describe primitives; they do not make them
    (a, b), models = plain.leaves, [plain.chains(leaf) for leaf in plain.leaves]
    assert all(isinstance(model, LeftRightHMM) for model in models)
    exemplars = [plain.exemplars(leaf) for leaf in (a, b)]
    assert needs_more_chains(models[0], exemplars[0], models[1], exemplars[1]) == asks
    for leaf, single, own in zip((a, b), models, exemplars, strict=True):
        model = tree.chains(leaf)
        assert isinstance(model, FactorialHMM) == asks
        if asks:
            assert len(model.chains) == 2
            assert sum(map(model.score, own)) > sum(map(single.score, own))


def test_what_several_chains_generate_is_one_chain_for_everyone_else():
    tree = grown(1, 2)
    leaf = tree.leaves[0]
    chains, one = tree.chains(leaf), tree.model(leaf)
    assert isinstance(one, LeftRightHMM) and one.n_states > max(c.n_states for c in chains.chains)
    assert tree.chains(leaf) is chains  # kept
    tree.remove(leaf)
    with pytest.raises(UnknownPrimitiveError):
        tree.chains(leaf)


def test_there_is_at_least_one_chain():
    with pytest.raises(InvalidValueError, match="max_chains"):
        TreeConfig(max_chains=0)
