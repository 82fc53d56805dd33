"""How often a stranger is taken for something known, stated and measured."""

import sys
from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.distance import cdist

sys.path.insert(0, str(Path(__file__).parent))
from motions import RATE_HZ, Motions

from mplearn.errors import InvalidValueError
from mplearn.tree import PrimitiveTree, TreeConfig
from mplearn.tree.rejection import Impostors


def nearest_others(points):
    """Distance of each execution of each class to the nearest class but its own."""
    middles = points.mean(axis=1)
    found = []
    for k, own in enumerate(points):
        found.append(cdist(own, np.delete(middles, k, axis=0)).min(axis=1))
    return found


@pytest.mark.parametrize("rate", [0.02, 0.05, 0.1, 0.3])
@pytest.mark.parametrize("n_dimensions", [3, 8])
def test_no_more_strangers_are_accepted_than_stated(rate, n_dimensions):
    rng = np.random.default_rng(round(1000 * rate) + n_dimensions)
    n_known, shares = 12, []
    for _ in range(1500):
        middles = rng.normal(size=(n_known + 1, 1, n_dimensions))
        points = middles + rng.normal(0, 0.1, (n_known + 1, 8, n_dimensions))
        threshold = Impostors(nearest_others(points[:-1])).threshold(rate)
        stranger = cdist(points[-1], points[:-1].mean(axis=1)).min(axis=1)
        shares.append((stranger < threshold).mean())
    error = np.std(shares) / np.sqrt(len(shares))
    assert np.mean(shares) < rate + 2.5 * error
    assert np.mean(shares) > 0.25 * rate - 2.5 * error or n_dimensions > 3  # it is of use


def test_the_estimate_and_the_threshold_are_inverse():
    nobody = Impostors([])
    assert np.isnan(nobody.rate(1.0)) and nobody.threshold(0.01) == np.inf
    rng = np.random.default_rng(0)
    strangers = Impostors([rng.lognormal(k / 20, 0.2, 12) for k in range(30)])
    for rate in (0.001, 0.01, 0.05, 0.1, 0.5):
        assert rate / 2 < strangers.rate(strangers.threshold(rate)) <= rate * (1 + 1e-9)
    rates = [strangers.rate(t) for t in np.linspace(0, 20, 200)]
    assert rates == sorted(rates) and rates[0] == 0.0 and rates[-1] == pytest.approx(1.0)


def crowded(seed, n_motions, size=0.25):
    """Motions of few channels, so that some are as near to each other as executions of one."""
    motions = Motions(n_motions, 2, seed)
    motions.keys *= size
    return motions


WIDE = TreeConfig(
    reach=3.0,
    reach_cap=3.0,
    reach_limit=2.0,
    scale_power=0.0,
    scale_share=1.0,
    spread=6.0,
    mean_share=0.28,
    min_exemplars=4,
)


def test_a_recogniser_holds_the_rate_that_was_stated():
    accepted, missed = {}, {}
    for seed in range(3):
        known, strangers = crowded(seed, 24), crowded(100 + seed, 40)
        tree = PrimitiveTree(WIDE, 2, RATE_HZ)
        for _, frames in known.session(6):
            tree.insert(frames)
        strange = [strangers.perform(m) for m in range(40)]
        usual = [known.perform(m) for m in range(24)]
        for rate in (None, 0.2, 0.1):
            recogniser = tree.recogniser().calibrated(rate)
            accepted.setdefault(rate, []).extend(recogniser.recognise(x).primitive for x in strange)
            missed.setdefault(rate, []).extend(recogniser.recognise(x).primitive for x in usual)
            assert rate is None or recogniser.false_acceptance <= rate + 1e-9
    share = {rate: 1 - found.count(None) / len(found) for rate, found in accepted.items()}
    assert share[None] > 0.4  # these rules' own radii hold no rate
    for rate in (0.2, 0.1):
        assert share[rate] <= rate + 2 * np.sqrt(rate / 40)  # what so few known motions can tell
    assert missed[0.2].count(None) < 0.5 * len(missed[0.2])


@pytest.mark.parametrize("size", [0.25, 0.15])
def test_by_default_the_rate_holds_and_what_is_known_is_recognised(size):
    accepted, missed = {}, {}
    for seed in range(3):
        known, strangers = crowded(seed, 24, size), crowded(100 + seed, 40, size)
        tree = PrimitiveTree(TreeConfig(), 2, RATE_HZ)
        for _, frames in known.session(6):
            tree.insert(frames)
        strange = [strangers.perform(m) for m in range(40)]
        usual = [known.perform(m) for m in range(24)]
        for rate in (0.2, 0.1):
            recogniser = tree.recogniser().calibrated(rate)
            accepted.setdefault(rate, []).extend(recogniser.recognise(x).primitive for x in strange)
            missed.setdefault(rate, []).extend(recogniser.recognise(x).primitive for x in usual)
    for rate in (0.2, 0.1):
        share = 1 - accepted[rate].count(None) / len(accepted[rate])
        assert share <= rate + 2 * np.sqrt(rate / 40)
        assert missed[rate].count(None) <= 0.1 * len(missed[rate])


def test_a_stated_rate_changes_what_is_recognised_and_not_what_is_learned():
    trees = [PrimitiveTree(TreeConfig(false_acceptance=rate), 2, RATE_HZ) for rate in (None, 0.05)]
    for tree in trees:
        for _, frames in crowded(3, 10).session(7):
            tree.insert(frames)
    plain, stated = trees
    assert [node.members for node in plain.nodes] == [node.members for node in stated.nodes]
    assert plain.recogniser().false_acceptance > 0.05 >= stated.recogniser().false_acceptance
    frozen = stated.recogniser()
    again = type(frozen).from_state(frozen.state())
    later = plain.recogniser().calibrated(0.05)
    for m in range(10):
        frames = crowded(3, 10).perform(m)
        found = frozen.recognise(frames)
        assert again.recognise(frames) == found and later.recognise(frames) == found


def test_a_rate_must_be_a_share():
    with pytest.raises(InvalidValueError, match="false_acceptance"):
        TreeConfig(false_acceptance=1.5)
