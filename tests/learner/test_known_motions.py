"""How far a known motion has come: against forward variables of models fitted here, at any time."""

import numpy as np
import pytest

from mplearn import LearnerConfig, MotionLearner, Recording
from mplearn.hmm import fit
from mplearn.learner.known_motions import KnownMotions
from mplearn.recording import FloatArray
from mplearn.tree import PrimitiveTree, TreeConfig

RATE_HZ = 50.0
CHANNELS = 5


def motion(kind: int, rng: np.random.Generator, seconds: float = 1.2) -> FloatArray:
    """A way from posture to posture, each kind its own, at a pace that varies."""
    postures = np.random.default_rng(kind).normal(size=(3, CHANNELS))
    x = np.linspace(0, 2, round(rng.uniform(0.9, 1.1) * seconds * RATE_HZ))
    way = [np.interp(x, [0, 1, 2], postures[:, d]) for d in range(CHANNELS)]
    return np.stack(way, axis=1) + rng.normal(0, 0.02, (len(x), CHANNELS))


def tree_of(n_kinds: int, times: int, rng: np.random.Generator) -> PrimitiveTree:
    tree = PrimitiveTree(TreeConfig(), CHANNELS, RATE_HZ)
    for _ in range(times):
        for kind in range(n_kinds):
            tree.insert(motion(kind, rng))
    return tree


def plainly(tree: PrimitiveTree, known: KnownMotions, frames: FloatArray) -> float:
    """What `ending` says, from nothing but whole models and whole sequences."""
    looks = frames[:: known.every]
    if len(looks) < 3:
        return 0.5
    best, ending = -np.inf, 0.5
    for leaf in tree.leaves:
        exemplars = tree.exemplars(leaf)
        if len(exemplars) < 3:
            continue
        n = max(n for n in (3, 4, 6, 8) if n <= len(exemplars))
        shown = [each[:: known.every] for each in exemplars[:n]]
        n_states = min(8, *map(len, shown))
        model = fit(shown, n_states, n_steps=0, variance_floor=tree.bank.floor)
        least = min(model.score(each, complete=False) / len(each) for each in shown)
        above = model.score(looks, complete=False) / len(looks) - least + 0.3 * CHANNELS
        if above > best:
            best, ending = above, float(model.posteriors(looks, complete=False)[-1, -1])
    return ending if best >= 0 else 0.5


@pytest.mark.parametrize("times", [2, 3, 7])
def test_it_is_the_posterior_of_the_last_state_in_the_best_model(times: int) -> None:
    rng = np.random.default_rng(times)
    tree, known = tree_of(4, times, rng), KnownMotions(CHANNELS, RATE_HZ)
    said = []
    for shown in (motion(2, rng), motion(7, rng), motion(0, rng)):  # 7 is none that is known
        known.forget()
        for t in range(1, len(shown) + 1, known.every):
            said.append(known.ending(tree, shown[:t]))
            assert said[-1] == pytest.approx(plainly(tree, known, shown[:t]), abs=1e-9)
    assert (min(said) < 0.01 and max(said) > 0.8) == (times >= 3)


def test_it_does_not_matter_when_it_was_asked_before() -> None:
    rng = np.random.default_rng(0)
    tree, often = tree_of(3, 4, rng), KnownMotions(CHANNELS, RATE_HZ)
    for kind in (0, 1, 2, 0):
        shown = motion(kind, rng)
        often.forget()
        for t in range(1, len(shown) + 1, often.every):
            said = often.ending(tree, shown[:t])
            assert said == KnownMotions(CHANNELS, RATE_HZ).ending(tree, shown[:t])
        tree.insert(shown)  # models change


def test_of_many_those_are_followed_that_start_nearest() -> None:
    rng = np.random.default_rng(3)
    tree = PrimitiveTree(TreeConfig(), CHANNELS, RATE_HZ)
    for kind in range(60):
        for _ in range(4):
            tree.insert(motion(kind, rng))
    assert len(tree.leaves) > 45
    known = KnownMotions(CHANNELS, RATE_HZ)
    for kind in (5, 31, 58, 5):
        shown = motion(kind, rng)
        known.forget()
        ends = [known.ending(tree, shown[:t]) for t in range(1, len(shown) + 1, known.every)]
        assert ends[:2] == [0.5, 0.5]
        assert min(ends) < 0.05
        assert ends[-1] > 0.8
        assert ends[-1] == KnownMotions(CHANNELS, RATE_HZ).ending(tree, shown)


def test_what_a_person_changes_counts_at_once_and_resumes_bit_for_bit(
    features: Recording,
) -> None:
    config = LearnerConfig(features.channels, features.rate_hz, scaffolding=True)
    learner = MotionLearner(config)
    at = 4520  # in the middle of a known motion
    learner.learn_many(features.frames[:at])
    learner.remove(learner.tree.leaves[1])
    resumed = MotionLearner.from_state(learner.state())
    rest = features.frames[at:]
    assert resumed.learn_many(rest) == learner.learn_many(rest)
    assert resumed.snapshot().version == learner.snapshot().version


def test_without_scaffolding_the_segmenter_is_told_nothing(features: Recording) -> None:
    endings = {}
    for scaffolding in (False, True):
        learner = MotionLearner(
            LearnerConfig(features.channels, features.rate_hz, scaffolding=scaffolding)
        )
        said = []
        for start in range(0, 3000, 10):
            learner.learn_many(features.frames[start : start + 10])
            said.append(float(learner.state().segmenter.arrays["state.ending"][0]))
        endings[scaffolding] = said
    assert set(endings[False]) == {0.5}
    assert min(endings[True]) < 0.1
    assert max(endings[True]) > 0.9


def test_by_default_only_that_a_motion_is_not_at_its_end_is_told(features: Recording) -> None:
    said = {}
    for scaffolding in ("inside", True):
        learner = MotionLearner(
            LearnerConfig(features.channels, features.rate_hz, scaffolding=scaffolding)
        )
        said[scaffolding] = []
        for start in range(0, 3000, 10):
            learner.learn_many(features.frames[start : start + 10])
            said[scaffolding].append(float(learner.state().segmenter.arrays["state.ending"][0]))
    assert LearnerConfig(features.channels).scaffolding == "inside"
    assert max(said["inside"]) == 0.5
    first = next(k for k, each in enumerate(said[True]) if each != 0.5)  # the cuts are the same yet
    assert said["inside"][first] == pytest.approx(0.5 - 0.4 * max(0.5 - said[True][first], 0.0))
    assert 0.3 - 1e-9 <= min(said["inside"]) < 0.35
