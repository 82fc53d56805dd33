"""How often a stranger is taken for something known, stated and measured."""

import sys
from pathlib import Path

import numpy as np
import pytest
from scipy.stats import binom

sys.path.insert(0, str(Path(__file__).parent))
from motions import RATE_HZ, Motions

from mplearn.errors import InvalidValueError
from mplearn.tree import PrimitiveTree, TreeConfig
from mplearn.tree.rejection import Strangers


@pytest.mark.parametrize("rate", [0.05, 0.2])
def test_the_stated_rate_is_the_measured_one_on_any_distribution(rate):
    rng = np.random.default_rng(1)
    hits = 0
    for _ in range(400):
        strangers = Strangers()
        for ratio in rng.lognormal(0.5, 0.7, 99):
            strangers.add(ratio)
        hits += (rng.lognormal(0.5, 0.7, 10) < strangers.threshold(rate)).sum()
    low, high = binom.ppf([1e-4, 1 - 1e-4], 1000, rate) / 1000
    assert low <= hits / 4000 <= high


def test_the_estimate_and_the_threshold_are_inverse():
    strangers = Strangers()
    assert np.isnan(strangers.rate(1.0)) and strangers.threshold(0.01) == 1.0
    for ratio in np.arange(1, 100) / 10:
        strangers.add(ratio)
    for rate in (0.05, 0.1, 0.5):
        assert strangers.rate(strangers.threshold(rate) - 1e-9) == pytest.approx(rate, abs=0.011)
    for _ in range(2000):
        strangers.add(5.0)
    assert len(strangers) == 512


def crowded(seed, n_motions=40):
    """Motions of few channels, so that some are as near to each other as executions of one."""
    motions = Motions(n_motions, 2, seed)
    motions.keys *= 0.25
    return motions


def test_strangers_are_accepted_as_often_as_stated():
    rate = 0.15
    tree = PrimitiveTree(TreeConfig(false_acceptance=rate), 2, RATE_HZ)
    known = crowded(0, 60)
    for _, frames in known.session(9):
        tree.insert(frames)
    assert len(tree.leaves) > 20
    assert tree.false_acceptance == pytest.approx(rate, abs=0.01)
    recogniser = tree.recogniser()
    strangers = crowded(77, 300)
    accepted = sum(
        recogniser.recognise(strangers.perform(m)).primitive is not None for m in range(300)
    )
    low, high = binom.ppf([1e-3, 1 - 1e-3], 60, rate) / 60  # what 60 known motions can tell
    assert low <= accepted / 300 <= high
    again = type(recogniser).from_state(recogniser.state())
    frames = strangers.perform(3)
    assert again.recognise(frames) == recogniser.recognise(frames)


def test_a_rate_must_be_a_share():
    with pytest.raises(InvalidValueError, match="false_acceptance"):
        TreeConfig(false_acceptance=1.5)
