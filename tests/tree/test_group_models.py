"""Models of primitives: one chain, and more where it cannot tell neighbours apart."""

import numpy as np
import pytest
from motions import RATE_HZ, Motions

from mplearn.errors import InvalidValueError, UnknownPrimitiveError
from mplearn.hmm import FactorialHMM, LeftRightHMM, SemiMarkovHMM, needs_more_chains
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
    (a, b), models = plain.leaves, [plain.motion_model(leaf) for leaf in plain.leaves]
    assert all(isinstance(model, LeftRightHMM) for model in models)
    exemplars = [plain.exemplars(leaf) for leaf in (a, b)]
    assert needs_more_chains(models[0], exemplars[0], models[1], exemplars[1]) == asks
    for leaf, single, own in zip((a, b), models, exemplars, strict=True):
        model = tree.motion_model(leaf)
        assert isinstance(model, FactorialHMM) == asks
        if asks:
            assert len(model.chains) == 2
            assert sum(map(model.score, own)) > sum(map(single.score, own))


def test_what_several_chains_generate_is_one_chain_for_everyone_else():
    tree = grown(1, 2)
    leaf = tree.leaves[0]
    chains, one = tree.motion_model(leaf), tree.model(leaf)
    assert isinstance(one, LeftRightHMM) and one.n_states > max(c.n_states for c in chains.chains)
    assert tree.motion_model(leaf) is chains  # kept
    tree.remove(leaf)
    with pytest.raises(UnknownPrimitiveError):
        tree.motion_model(leaf)


def test_there_is_at_least_one_chain():
    with pytest.raises(InvalidValueError, match="max_chains"):
        TreeConfig(max_chains=0)


def test_explicit_durations_make_semi_markov_models():
    motions = Motions(2, seed=6)
    trees = [
        PrimitiveTree(TreeConfig(n_states=4, durations=durations), 6, RATE_HZ)
        for durations in ("geometric", "explicit")
    ]
    for _, frames in motions.session(10):
        for tree in trees:
            tree.insert(frames)
    plain, tree = trees
    assert plain.leaves == tree.leaves and len(tree.leaves) == 2
    for leaf, other in zip(tree.leaves, tree.leaves[::-1], strict=True):
        model, own = tree.motion_model(leaf), tree.exemplars(leaf)
        assert isinstance(model, SemiMarkovHMM)
        rival = tree.motion_model(other)
        assert all(model.score(frames) > rival.score(frames) for frames in own)
        one = tree.model(leaf)  # what libraries keep: the same postures, as long on average
        assert np.array_equal(one.means, model.means)
        assert one.durations_frames == pytest.approx(model.durations_frames[:-1])


def test_explicit_durations_have_one_chain():
    with pytest.raises(InvalidValueError, match="max_chains"):
        TreeConfig(durations="explicit", max_chains=2)
    with pytest.raises(InvalidValueError, match="'geometric' or 'explicit'"):
        TreeConfig(durations="long")
