"""Which leaves are one motion: made shapes whose answer is known."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from mplearn.errors import InvalidValueError
from mplearn.people import PeopleConfig
from mplearn.people.matching import Known, agglomerate, solve, tension, unit_of
from mplearn.people.shapes.offsets import offsets_of
from mplearn.people.shapes.shape import Shape, mirrored, shape_of
from mplearn.people.shapes.shape_table import ShapeTable
from mplearn.tree import MirrorMap, NormalisationConfig

RULES = PeopleConfig(repertoire=5)
FORM = NormalisationConfig()


def made(n_people=3, n_motions=5, seed=0, habit=0.3, noise=0.1):
    """Shapes of motions that lie far apart, of people who deviate from them."""
    rng = np.random.default_rng(seed)
    postures, movements = rng.normal(size=(n_motions, 8)), rng.normal(size=(n_motions, 40))
    people = np.repeat(np.arange(n_people), n_motions)
    motions = np.tile(np.arange(n_motions), n_people)
    habits = habit * rng.normal(size=(n_people, 8))
    shapes = Shape(
        postures[motions] + habits[people] + noise * rng.normal(size=(len(people), 8)),
        movements[motions] + noise * rng.normal(size=(len(people), 40)),
    )
    return shapes, people, motions


def same_groups(a, b):
    return np.array_equal(a[:, None] == a, b[:, None] == b)


def known_of(people, together=(), apart=()):
    n = len(people)
    pairs = np.zeros((2, n, n), dtype=bool)
    for matrix, listed in zip(pairs, (together, apart), strict=True):
        for i, j in listed:
            matrix[i, j] = matrix[j, i] = True
    return Known(np.arange(n), people, np.ones(n, dtype=bool), *pairs)


def table_of(shapes, mirror=None):
    table = ShapeTable(mirror)
    for row in zip(shapes.posture, shapes.movement, strict=True):
        table.add(Shape(*row))
    return table


def found(shapes, people, n_people, rules=RULES, mirror=None, **pins):
    return solve(table_of(shapes, mirror), known_of(people, **pins), n_people, rules)


def distances(shapes, posture):
    table = table_of(shapes)
    return table.distances(shapes.posture, np.arange(len(shapes.posture)), posture)[0]


@pytest.mark.parametrize("seed", range(4))
def test_what_is_the_same_motion_is_found_whoever_does_it(seed):
    shapes, people, motions = made(seed=seed)
    groups, offsets, unit = found(shapes, people, 3)
    assert same_groups(groups, motions)
    assert np.isfinite(unit)
    assert offsets.shape == (3, 8)


def test_a_persons_habit_is_learned_from_what_is_shared():
    shapes, people, motions = made(habit=1.0, noise=0.01)
    _, offsets, _ = found(shapes, people, 3)
    habits = [
        np.mean([shapes.posture[(people == p) & (motions == m)][0] for m in range(5)], axis=0)
        for p in range(3)
    ]
    share = 5 / (5 + RULES.offset_prior)
    assert np.allclose(offsets[0] - offsets[1], share * (habits[0] - habits[1]), atol=0.02)


@settings(max_examples=25, deadline=None)
@given(seed=st.integers(0, 10_000))
def test_the_order_of_leaves_does_not_matter(seed):
    shapes, people, _ = made(seed=seed, noise=0.4)
    order = np.random.default_rng(seed).permutation(len(people))
    matrix = distances(shapes, RULES.posture)
    matrix /= unit_of(matrix, people, replace(RULES, repertoire=2))
    never = np.full_like(matrix, np.inf)
    groups = agglomerate(matrix, never, known_of(people), RULES)
    shuffled = agglomerate(matrix[np.ix_(order, order)], never, known_of(people[order]), RULES)
    assert same_groups(groups[order], shuffled)


def test_two_motions_of_one_person_stay_two():
    shapes, people, _ = made(n_people=1, n_motions=4)
    groups, _, _ = found(shapes, people, 1)
    assert len(set(groups.tolist())) == 4


def test_left_and_right_stay_apart():
    rng = np.random.default_rng(3)
    mirror = MirrorMap((1, 0, 3, 2), (1, 1, -1, -1))
    shared, own = rng.normal(size=(2, 40))
    left = Shape(np.zeros(4), 2 * mirrored(Shape(np.zeros(4), shared), mirror).movement)
    left = Shape(left.posture, left.movement + 2 * shared + 0.4 * own)  # a side, but hardly so
    right = mirrored(left, mirror)
    others = rng.normal(size=(2, 40)) * 3
    movements = [left.movement, others[0], others[1], right.movement + 0.01, *(others + 0.01)]
    shapes, people = Shape(np.zeros((6, 4)), np.array(movements)), np.repeat([0, 1], 3)
    blind = found(shapes, people, 2).groups
    assert same_groups(blind, np.array([0, 1, 2, 0, 1, 2]))
    groups = found(shapes, people, 2, mirror=mirror).groups
    assert same_groups(groups, np.array([0, 1, 2, 3, 1, 2]))


def brute_force(matrix, image, barred, rules, pinned=()):
    """Average link over all pairs of groups, with nothing kept from one step to the next."""
    groups = [[i] for i in range(len(matrix))]
    for i, j in pinned:
        one, other = (next(group for group in groups if k in group) for k in (i, j))
        if one is not other:
            groups.remove(other)
            one += other
    while True:
        mean, mirrored = (
            np.array([[each[np.ix_(a, b)].mean() for b in groups] for a in groups])
            for each in (matrix, image)
        )
        np.fill_diagonal(mean, np.inf)
        best = (np.inf, None)
        for i in range(len(groups)):
            for j in range(i):
                sided = mirrored[i, j] < rules.sided * mean[i, j]
                if not (sided or barred[np.ix_(groups[i], groups[j])].any()):
                    rest = np.concatenate((np.delete(mean[i], j), np.delete(mean[j], i)))
                    doubt = mean[i, j] ** 2 / min(rest.min(initial=np.inf), rules.reach)
                    best = min(best, (doubt, (j, i)))
        if not best[0] <= rules.link:
            return groups
        j, i = best[1]
        groups[j] += groups.pop(i)


@pytest.mark.parametrize(
    "mirror", [None, MirrorMap((1, 0, 2, 4, 3, 5, 6, 7), (1, 1, -1, 1, 1) + 3 * (1,))]
)
def test_many_shapes_lie_as_far_apart_as_one_after_the_other(mirror):
    shapes, _, _ = made(seed=4)
    at_once, one_by_one = ShapeTable(mirror), ShapeTable(mirror)
    each = [Shape(*parts) for parts in zip(*shapes, strict=True)] * 3
    slots = [np.array(at_once.add_all(each)), np.array([one_by_one.add(shape) for shape in each])]
    levels = np.array([shape.posture for shape in each])
    found = [
        table.distances(levels, own, 0.5)
        for table, own in zip((at_once, one_by_one), slots, strict=True)
    ]
    assert len(set(slots[0].tolist())) == len(each)
    for one, other in zip(*found, strict=True):
        assert np.array_equal(one, other)
    assert at_once.add_all(each[:2]) == [one_by_one.add(shape) for shape in each[:2]]


@settings(max_examples=25, deadline=None)
@given(seed=st.integers(0, 10_000))
def test_leaves_are_joined_as_by_brute_force(seed):
    shapes, people, _ = made(2 + seed % 4, n_motions=3 + seed % 2, seed=seed, noise=0.6)
    rng, n = np.random.default_rng(seed), len(people)
    matrix = distances(shapes, RULES.posture)
    matrix /= unit_of(matrix, people, RULES)
    pinned, apart = (
        [(i, j) for i, j in rng.integers(n, size=(k, 2)).tolist() if i != j]
        for k in (seed % 3, seed % 5)
    )
    known = known_of(people, pinned, apart)
    image = matrix * rng.uniform(0.5, 2.0, size=matrix.shape) if seed % 2 else matrix + np.inf
    image = np.maximum(image, image.T)
    groups = agglomerate(matrix, image, known, RULES)
    barred = (people[:, None] == people) & (matrix > RULES.link_own) | known.apart
    wanted = np.empty(len(people), dtype=int)
    found = brute_force(matrix, image, barred, RULES, pinned)
    for k, group in enumerate(found):
        wanted[group] = k
    assert same_groups(groups, wanted)


def test_one_pair_near_its_mirror_image_parts_no_groups():
    people = np.array([0, 1, 2, 3])
    matrix = np.full((4, 4), 0.5)
    matrix[[0, 1, 2, 3], [1, 0, 3, 2]] = 0.2
    image = np.ones_like(matrix)
    image[1, 2] = image[2, 1] = 0.3  # by chance: the others' say that it is the same side
    assert len(set(agglomerate(matrix, image, known_of(people), RULES).tolist())) == 1
    image[:2, 2:] = image[2:, :2] = 0.3
    groups = agglomerate(matrix, image, known_of(people), RULES)
    assert same_groups(groups, np.array([0, 0, 2, 2]))


def test_what_a_person_said_counts_more():
    shapes, people, _ = made()
    groups = found(shapes, people, 3, together=[(0, 6)], apart=[(2, 7)]).groups
    assert groups[0] == groups[6]
    assert groups[2] != groups[7]


def test_offsets_are_deviations_from_the_mean_of_who_shares():
    postures = np.array([[1.0], [3.0], [10.0], [12.0], [50.0]])
    people, groups = np.array([0, 1, 0, 1, 1]), np.array([7, 7, 4, 4, 9])
    offsets = offsets_of(postures, people, 3, groups, 1e-9)
    assert offsets[1, 0] - offsets[0, 0] == pytest.approx(2.0)
    assert offsets[2, 0] == 0.0
    assert not offsets_of(postures[:1], people[:1], 2, groups[:1], 1.0).any()


def test_the_unit_is_how_far_a_persons_own_motions_lie_apart():
    at = np.array([0.0, 1.0, 4.0, 10.0, 13.0])
    people = np.array([0, 0, 0, 1, 1])
    matrix = np.abs(at[:, None] - at)
    assert unit_of(matrix, people, replace(RULES, repertoire=2)) == np.median([1, 1, 3, 3, 3])
    assert unit_of(matrix, people, replace(RULES, repertoire=20)) == pytest.approx(
        3 * (2.6 / 20) ** (1 / 3)
    )
    assert unit_of(np.zeros((1, 1)), np.array([0]), RULES) == np.inf


def test_a_clear_winner_may_be_farther_off():
    assert tension(1.1, 3.0, 1.5) < tension(1.0, 1.05, 1.5)
    assert tension(1.0, np.inf, 1.5) == pytest.approx(1 / 1.5)


def test_a_shape_is_posture_and_movement():
    t = np.linspace(0, 1, 60)[:, None]
    frames = np.concatenate((np.sin(3 * t), 0 * t + 2.0), axis=1)
    shape, higher = (shape_of([f], FORM) for f in (frames, frames + np.array((0.0, 1.0))))
    assert np.allclose(higher.posture - shape.posture, (0.0, 1.0))
    assert np.allclose(higher.movement, shape.movement)
    stretched = shape_of([np.repeat(frames, 2, axis=0)], FORM)
    assert np.allclose(stretched.movement, shape.movement, atol=0.02)
    both = Shape(*(np.stack(parts) for parts in zip(shape, higher, strict=True)))
    assert distances(both, 0.5)[0, 1] == pytest.approx(np.sqrt(0.5))


@pytest.mark.parametrize("wrong", [{"link": 0.0}, {"posture": 2.0}, {"join": np.nan}])
def test_rules_out_of_range_are_refused(wrong):
    with pytest.raises(InvalidValueError, match=next(iter(wrong))):
        PeopleConfig(**wrong)


def test_what_waits_does_not_bar_the_leaf_that_it_is_most_like():
    rng = np.random.default_rng(5)
    movements = 3 * rng.normal(size=(3, 40))
    new = movements[0] + 0.3 * rng.normal(size=40)  # a leaf of the second person, and what waits
    rows = [*movements, new, movements[1] + 0.1, 0.5 * (new + movements[0])]
    shapes = Shape(np.zeros((6, 4)), np.array(rows))
    known = known_of(np.array([0, 0, 0, 1, 1, 1]))
    rules = replace(RULES, link_own=1e-6)
    for firm, wanted in ((True, [0, 1, 2, 3, 1, 0]), (False, [0, 1, 2, 0, 1, 5])):
        known = known._replace(firm=np.array([True] * 5 + [firm]))
        movement = shapes.movement.copy()
        movement[5] += 0.02 * (1 if firm else -1) * (movements[0] - new)
        groups = solve(table_of(Shape(shapes.posture, movement)), known, 2, rules).groups
        assert same_groups(groups, np.array(wanted))
