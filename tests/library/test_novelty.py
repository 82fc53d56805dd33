from itertools import product

import numpy as np
import pytest
from library_examples import CHANNELS, RATE, demonstrations, example_library

from mplearn.errors import InvalidValueError, UnknownPrimitiveError
from mplearn.graph import TransitionGraph
from mplearn.hmm import fit
from mplearn.library import MotionNovelty, Primitive, PrimitiveLibrary
from mplearn.tree import PrimitiveTree, TreeConfig

KINDS = (((0, 1), 5), ((1, 2), 2), ((2, 3), 14), ((3, 0), 3))
PAIRS = ((0, 1), (1, 2), (2, 3), (3, 0))


def matrix_of(points):
    return np.linalg.norm(points[:, None] - points, axis=2)


@pytest.fixture(scope="module")
def library():
    tree = PrimitiveTree(TreeConfig(cutoff=0.7), len(CHANNELS), RATE)
    motions = [list(demonstrations(*pair, seed=k, n=12)) for k, pair in enumerate(PAIRS)]
    for turn in zip(*motions, strict=True):
        for frames in turn:
            tree.insert(frames)
    graph = TransitionGraph()
    primitives = []
    for id in tree.leaves:
        graph.add_node(id)
        exemplars = tree.exemplars(id)
        primitives.append(Primitive.from_exemplars(id, fit(exemplars, 8), exemplars, RATE))
    order = [*tree.leaves] * 10
    for t in range(1, len(order)):
        graph.observe(order[t - 1], order[t], 1.0, before=order[max(t - 2, 0) : t - 1])
    return PrimitiveLibrary(tuple(primitives), graph, CHANNELS, RATE, recogniser=tree.recogniser())


def test_p_values_of_a_like_motion_are_uniform_at_worst():
    p = []
    for seed in range(40):  # the ranks of one library hang together
        rng = np.random.default_rng(seed)
        clouds = {id: rng.normal(0, 0.5 + id, (10, 6)) for id in range(8)}
        novelty = MotionNovelty({id: matrix_of(each) for id, each in clouds.items()}, 2)
        for id, cloud in clouds.items():
            for _ in range(15):
                new = rng.normal(0, 0.5 + id, 6)
                nearest = np.sort(np.linalg.norm(cloud - new, axis=1))[:2].mean()
                p.append(novelty.score([(id, nearest)]).p_value)
    for rate in (0.05, 0.2, 0.6):
        assert 0.5 * rate <= np.mean(np.array(p) <= rate) <= 1.1 * rate


def test_scores_by_hand():
    line = np.array([[0.0], [1.0], [3.0]])  # nearest others: 1, 1, 2
    novelty = MotionNovelty({4: matrix_of(line), 7: 10 * matrix_of(line), 9: np.zeros((1, 1))}, 1)
    shared = (4 / 3 + 40 / 3) / 2
    usual = {4: (4 + 6 * shared) / 9, 7: (40 + 6 * shared) / 9, 9: shared}
    for id, scale in usual.items():
        assert novelty.score([(id, 5.0)]).score == pytest.approx(5.0 / scale)
    both = novelty.score([(4, 5.0), (7, 5.0)])
    assert both.score == pytest.approx(5.0 / usual[7])  # the one where it is most usual
    assert novelty.score([(4, 1e9)]).p_value == pytest.approx(1 / 7)
    assert novelty.score([(4, 0.0)]).p_value == 1.0
    ranks = [
        d / ((total - d + 6 * shared) / 8)
        for total, ds in ((4, (1, 1, 2)), (40, (10, 10, 20)))
        for d in ds
    ]
    middle = novelty.score([(4, 1.2 * usual[4])])
    assert middle.p_value == pytest.approx((1 + sum(r >= 1.2 for r in ranks)) / 7)
    nothing = MotionNovelty({}, 2).score([])
    assert (nothing.score, nothing.p_value) == (np.inf, 1.0)


def test_a_learner_scores_by_the_same_as_the_matrices_of_its_primitives():
    tree = PrimitiveTree(TreeConfig(cutoff=0.7), len(CHANNELS), RATE)
    motions = [list(demonstrations(*pair, seed=k, n=n)) for k, (pair, n) in enumerate(KINDS)]
    for frames in (each for motion in motions for each in motion):
        tree.insert(frames)
    tree.merge(*tree.leaves[:2])
    matrices = {id: tree.node(id).matrix for id in tree.leaves}
    expected = MotionNovelty(matrices, tree.config.n_nearest)
    found = MotionNovelty.of(np.array(tree.leaves), tree.nearest_others())
    for id, distance in [*product((*tree.leaves, 99), (0.1, 0.4, 0.8, 3.0))]:
        one, other = expected.score([(id, distance)]), found.score([(id, distance)])
        assert one.score == pytest.approx(other.score, rel=1e-12)
        assert one.p_value == other.p_value


def test_wrong_motions_score_higher_than_right_ones(library):
    right, wrong = [], []
    for k, pair in enumerate(PAIRS):
        for frames in demonstrations(*pair, seed=50 + k, n=8):
            right.append(library.score_motion(frames))
            wrong.append(library.score_motion(frames[::-1]))
    wrong += [library.score_motion(frames) for frames in demonstrations(0, 2, seed=99, n=8)]
    assert max(each.score for each in right) < min(each.score for each in wrong)
    assert np.mean([each.p_value <= 0.05 for each in right]) <= 0.2
    assert all(each.p_value <= 0.05 for each in wrong)


def test_wrong_orders_score_higher_than_right_ones(library):
    a, b, c, d = library.ids
    right = library.score_order([a, b, c, d, a, b])
    assert len(right) == 5
    assert all(each.p_value > 0.05 for each in right)
    wrong = library.score_order([a, b, d])[1]
    assert wrong.score > max(each.score for each in right)
    assert wrong.p_value < min(each.p_value for each in right)
    lost = library.score_order([a, None, c, d])
    assert [np.isnan(each.p_value) for each in lost] == [True, True, False]
    assert library.score_order([library.names[0], b]) == library.score_order([a, b])
    with pytest.raises(UnknownPrimitiveError, match="nobody"):
        library.score_order([a, "nobody"])


def test_scoring_changes_nothing_and_survives_saving(library, tmp_path):
    version = library.version
    frames = next(demonstrations(0, 1, seed=7))
    scores = library.score_motion(frames), library.score_order(library.ids)
    assert library.score_recognised(library.recognise(frames)) == scores[0]
    assert library.version == version
    loaded = PrimitiveLibrary.load(library.save(tmp_path / "scored.mplearn"))
    assert (loaded.score_motion(frames), loaded.score_order(loaded.ids)) == scores
    with pytest.raises(InvalidValueError, match="no recogniser"):
        example_library().score_motion(frames)
    with pytest.raises(InvalidValueError, match="shape"):
        library.score_motion(frames[:, :2])


def test_a_library_is_searched_level_by_level():
    library = example_library()
    found = library.levels.path(0, 5)
    assert found.nodes[0] == 0
    assert found.nodes[-1] == 5
    assert library.graph.log_probability(found.nodes) == pytest.approx(-found.cost)
    quick = library.path(0, 5, by="duration")
    assert len(library.path("P0", 5, duration_s=(3.0, 9.0))) > len(quick)
