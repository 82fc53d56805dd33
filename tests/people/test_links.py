"""Which leaves are one motion: made shapes whose answer is known."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from mplearn.errors import InvalidValueError
from mplearn.people import PeopleConfig
from mplearn.people.links import agglomerate, solve, tension, unit_of
from mplearn.people.shapes import Shape, distances, shape_of
from mplearn.tree import FormConfig

RULES = PeopleConfig(repertoire=5)
FORM = FormConfig()


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


@pytest.mark.parametrize("seed", range(4))
def test_what_is_the_same_motion_is_found_whoever_does_it(seed):
    shapes, people, motions = made(seed=seed)
    groups, offsets, unit = solve(shapes, people, 3, RULES)
    assert same_groups(groups, motions)
    assert np.isfinite(unit)
    assert offsets.shape == (3, 8)


def test_a_persons_habit_is_learned_from_what_is_shared():
    shapes, people, motions = made(habit=1.0, noise=0.01)
    _, offsets, _ = solve(shapes, people, 3, RULES)
    habits = [
        np.mean([shapes.posture[(people == p) & (motions == m)][0] for m in range(5)], axis=0)
        for p in range(3)
    ]
    share = 5 / (5 + RULES.offset_prior)
    found = offsets[0] - offsets[1]
    assert np.allclose(found, share * (habits[0] - habits[1]), atol=0.02)


@settings(max_examples=25, deadline=None)
@given(seed=st.integers(0, 10_000))
def test_the_order_of_leaves_does_not_matter(seed):
    shapes, people, _ = made(seed=seed, noise=0.4)
    order = np.random.default_rng(seed).permutation(len(people))
    matrix = distances(shapes, shapes, RULES.posture)
    matrix /= unit_of(matrix, people, 2)
    groups = agglomerate(matrix, people, RULES)
    shuffled = agglomerate(matrix[np.ix_(order, order)], people[order], RULES)
    assert same_groups(groups[order], shuffled)


def test_two_motions_of_one_person_stay_two():
    shapes, people, _ = made(n_people=1, n_motions=4)
    groups, _, _ = solve(shapes, people, 1, RULES)
    assert len(set(groups.tolist())) == 4


def test_left_and_right_stay_apart():
    rng = np.random.default_rng(3)
    left = rng.normal(size=40)
    right = np.concatenate((left[20:], left[:20]))  # the other side's channels
    shapes = Shape(np.zeros((4, 8)), np.stack((left, right, left + 0.1, right + 0.1)))
    groups, _, _ = solve(shapes, np.array([0, 0, 1, 1]), 2, replace(RULES, repertoire=2))
    assert same_groups(groups, np.array([0, 1, 0, 1]))


def test_the_unit_is_how_far_a_persons_own_motions_lie_apart():
    at = np.array([0.0, 1.0, 4.0, 10.0, 13.0])
    people = np.array([0, 0, 0, 1, 1])
    matrix = np.abs(at[:, None] - at)
    assert unit_of(matrix, people, 2) == np.median([1, 1, 3, 3, 3])
    assert unit_of(matrix, people, 20) == pytest.approx(3 * (2.6 / 20) ** (1 / 3))
    assert unit_of(np.zeros((1, 1)), np.array([0]), 20) == np.inf


def test_a_clear_winner_may_be_farther_off():
    assert tension(np.array(1.1), np.array(3.0), 1.5) < tension(np.array(1.0), np.array(1.05), 1.5)
    assert tension(np.array(1.0), np.array(np.inf), 1.5) == pytest.approx(1 / 1.5)


def test_a_shape_is_posture_and_movement():
    t = np.linspace(0, 1, 60)[:, None]
    frames = np.concatenate((np.sin(3 * t), 0 * t + 2.0), axis=1)
    shape, higher = (shape_of([f], FORM) for f in (frames, frames + np.array((0.0, 1.0))))
    assert np.allclose(higher.posture - shape.posture, (0.0, 1.0))
    assert np.allclose(higher.movement, shape.movement)
    stretched = shape_of([np.repeat(frames, 2, axis=0)], FORM)
    assert np.allclose(stretched.movement, shape.movement, atol=0.02)
    one = Shape(shape.posture[None], shape.movement[None])
    two = Shape(higher.posture[None], higher.movement[None])
    assert distances(one, two, 0.5)[0, 0] == pytest.approx(np.sqrt(0.5))


@pytest.mark.parametrize("wrong", [{"link": 0.0}, {"posture": 2.0}, {"join": np.nan}])
def test_rules_out_of_range_are_refused(wrong):
    with pytest.raises(InvalidValueError, match=next(iter(wrong))):
        PeopleConfig(**wrong)
