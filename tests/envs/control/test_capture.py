"""Where to step: closed forms and brute force."""

import itertools

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from mplearn_envs.control.capture import (
    BEHIND,
    BESIDE,
    DOWN,
    IN_FRONT,
    Falling,
    OnItsWay,
    Reach,
    Step,
    choose_step,
    landing_place,
    nearest_inside,
    support_hull,
    way_round,
)
from mplearn_envs.mechanics import reference_robot
from mplearn_envs.mechanics.support import convex_hull, support_margin
from mplearn_envs.robot import humanoid

RATE = 3.2
REACH = Reach(0.5, 0.4, 0.16, 0.62, 1.9, 0.24)


@pytest.fixture(scope="module")
def corners():
    return reference_robot(humanoid()).corners


FEET = np.array([[0.0, 0.09, 0.0], [0.0, -0.09, 0.0]])


def step_of(corners, feet, dcm, reach, only, **foot) -> Step:
    """Choose a step, with a foot that was just lifted."""
    lifted = OnItsWay(since_s=0.0, crosses=True, high_m=0.0, sinks=0.0)
    return choose_step(Falling(corners, feet, dcm, RATE), reach, only, lifted._replace(**foot))


def test_nearest_point_of_a_polygon_is_that_of_many():
    rng = np.random.default_rng(0)
    hull = convex_hull(rng.normal(size=(12, 2)))
    x = np.linspace(0.0, 1.0, 2001)[:, None]
    edges = np.concatenate(
        [a * (1 - x) + b * x for a, b in zip(hull, np.roll(hull, 1, 0), strict=True)]
    )
    for point in 3.0 * rng.normal(size=(50, 2)):
        found = np.array(nearest_inside(hull, *point))
        if support_margin(hull, point) >= 0.0:
            assert np.array_equal(found, point)
        else:
            least = np.linalg.norm(edges - point, axis=1).min()
            assert np.linalg.norm(found - point) == pytest.approx(least, abs=1e-4)


def test_support_hull_is_that_of_all_corners(corners):
    hull = support_hull(corners, FEET, -1, 0.0)
    points = np.concatenate([corners[s, :, :2] + FEET[s, :2] for s in (0, 1)])
    assert support_margin(hull, points).min() == pytest.approx(0.0, abs=1e-12)
    assert np.ptp(hull, axis=0) == pytest.approx(np.ptp(points, axis=0))
    one = support_hull(corners, FEET, 0, 0.01)
    assert np.ptp(one, axis=0) == pytest.approx(np.ptp(corners[1, :, :2], axis=0) - 0.02)


@pytest.mark.parametrize("dcm", [(0.2, 0.0), (0.17, 0.1), (-0.15, 0.05)])
def test_foot_lands_where_the_pendulum_will_be(corners, dcm):
    """The DCM's differential equation, integrated, ends over the new soles."""
    dcm, time_s, side = np.array(dcm), 0.3, 0
    sole = support_hull(corners, FEET, side, 0.008)
    zmp = np.array(nearest_inside(sole, *dcm))
    end = solve_ivp(lambda _, x: RATE * (x - zmp), (0.0, time_s), dcm, rtol=1e-10).y[:, -1]
    place, missing = landing_place(Falling(corners, FEET, dcm, RATE), side, time_s, REACH, BESIDE)
    both = support_hull(corners, np.stack((place, FEET[1])), -1, 0.008)
    assert max(0.0, -support_margin(both, end)) == pytest.approx(missing, abs=1e-6)
    assert missing < 0.05


@pytest.mark.parametrize("angle", np.arange(8) * np.pi / 4)
def test_step_goes_where_the_push_goes_and_legs_do_not_cross(corners, angle):
    dcm = np.array([0.03, 0.0]) + 0.2 * np.array([np.cos(angle), np.sin(angle)])
    step = step_of(corners, FEET, dcm, REACH, -1)
    moved = step.place[:2] - FEET[step.side, :2]
    assert moved @ [np.cos(angle), np.sin(angle)] > 0.0
    aside = (step.place[1] - FEET[1 - step.side, 1]) * (1 if step.side == 0 else -1)
    assert aside >= REACH.narrow - 1e-12
    if abs(np.sin(angle)) > 0.5:  # to the side that foot steps
        assert step.side == (0 if np.sin(angle) > 0 else 1)


def test_only_one_foot_may_step(corners):
    for side in (0, 1):
        assert step_of(corners, FEET, np.array([0.2, 0.0]), REACH, side).side == side


CROSSING = REACH._replace(across=0.3)


def walled(a, b, half):
    """Whether a way between points leads through a box around the origin: by many points."""
    x = np.linspace(0.0, 1.0, 4001)[:, None]
    return bool((np.abs(a * (1 - x) + b * x) < half - 1e-9).all(axis=1).any())


def test_way_round_the_other_foot_is_the_shortest_and_hits_nothing():
    """Against all ways over up to three corners."""
    rng = np.random.default_rng(3)
    stands = np.array([0.3, -0.2, 0.7])
    c, s = np.cos(0.7), np.sin(0.7)
    turn = np.array([[c, -s], [s, c]])
    half = np.array([CROSSING.clear, CROSSING.apart]) - 0.02
    corners = [np.array([i * CROSSING.clear, j * CROSSING.apart]) for i in (1, -1) for j in (1, -1)]
    n_round = 0
    while n_round < 40:
        a, b = rng.uniform(-0.6, 0.6, (2, 2))
        if (np.abs(a) < half + 1e-3).all() or (np.abs(b) < half + 1e-3).all():
            continue
        lengths = [
            sum(np.linalg.norm(q - p) for p, q in itertools.pairwise((a, *way, b)))
            for n in range(4)
            for way in itertools.permutations(corners, n)
            if not any(walled(p, q, half) for p, q in itertools.pairwise((a, *way, b)))
        ]
        here, place = turn @ a + stands[:2], turn @ b + stands[:2]
        x, y, far = way_round(stands, here, np.append(place, 0.0), CROSSING)
        assert far == pytest.approx(min(lengths), abs=1e-9)
        first = turn.T @ (np.array([x, y]) - stands[:2])
        assert not walled(a, first, half)
        straight = far == pytest.approx(np.linalg.norm(b - a))
        assert straight == np.allclose(first, b)
        n_round += not straight


@pytest.mark.parametrize("y", [0.02, 0.45])
def test_who_lands_where_the_other_foot_is_near_goes_straight(y):
    """Soles may be wider than feet are apart, and feet that are turned may stand nearer."""
    here, place = np.array([0.0, 0.3]), np.array([0.0, y, 0.0])
    x, y, far = way_round(np.zeros(3), here, place, CROSSING)
    assert (x, y) == (place[0], place[1])
    assert far == pytest.approx(abs(place[1] - here[1]))


@pytest.mark.parametrize("side", [0, 1])
@pytest.mark.parametrize("angle", [30.0, 60.0, 90.0, 120.0, 150.0])
def test_who_stands_on_one_foot_and_falls_beyond_it_crosses_it(corners, side, angle):
    beyond = -1.0 if side == 0 else 1.0  # the side of the foot that stands
    a = np.radians(angle)
    dcm = FEET[1 - side, :2] + 0.17 * np.array([np.cos(a), beyond * np.sin(a)])
    feet = FEET.copy()
    feet[side, 0] += 0.1 if angle <= 90 else -0.1
    step = step_of(corners, feet, dcm, CROSSING, side)
    across = beyond * (step.place[1] - FEET[1 - side, 1])
    if angle in (60.0, 90.0, 120.0):
        assert step.way == (IN_FRONT if angle <= 90 else BEHIND)
        assert 0.0 < across <= CROSSING.across + 1e-12
    if step.way != BESIDE:  # it does not land upon the other foot
        assert abs(step.place[0]) >= CROSSING.clear - 1e-12
    without = step_of(corners, feet, dcm, REACH, side)
    assert without.way == BESIDE and step.missing_m <= without.missing_m
    either = step_of(corners, feet, dcm, CROSSING, -1)
    assert either.way == BESIDE


@pytest.mark.parametrize("side", [0, 1])
def test_who_crosses_lands_on_the_side_of_the_foot_that_crosses(corners, side):
    """So that what is left drives the robot to where the other foot can step."""
    own = 1.0 if side == 0 else -1.0
    dcm = FEET[1 - side, :2] + np.array([-0.17, 0.02 * own])
    falling = Falling(corners, FEET, dcm, RATE)
    places = [
        landing_place(falling, side, 0.3, CROSSING._replace(inwards=x), BEHIND) for x in (0.0, 0.05)
    ]
    (straight, _), (inwards, missing) = places
    assert own * (inwards[1] - straight[1]) == pytest.approx(0.05)
    assert inwards[0] == straight[0] and missing < 0.02


COMING_DOWN = CROSSING._replace(soonest=0.2, close=0.12)


@pytest.mark.parametrize("side", [0, 1])
def test_who_falls_beyond_the_foot_that_stands_comes_down_for_it_to_step(corners, side):
    """No single step reaches there: two do, by the pendulum's differential equation."""
    beyond = -1.0 if side == 0 else 1.0
    dcm = FEET[1 - side, :2] + np.array([0.05, 0.09 * beyond])
    step = step_of(corners, FEET, dcm, COMING_DOWN, side)
    assert step.way == DOWN
    assert beyond * (FEET[1 - side, 1] - step.place[1]) >= COMING_DOWN.close - 1e-12
    sole = support_hull(corners, FEET, side, 0.008)
    zmp = np.array(nearest_inside(sole, *dcm))
    then = solve_ivp(lambda _, x: RATE * (x - zmp), (0.0, step.time_s), dcm, rtol=1e-10).y[:, -1]
    feet = FEET.copy()
    feet[side] = step.place
    second = step_of(corners, feet, then, COMING_DOWN, -1)
    assert second.side == 1 - side and second.missing_m < 0.01
    single = step_of(corners, FEET, dcm, COMING_DOWN, side, crosses=False)
    assert single.missing_m > 0.05 and single.way == BESIDE


@pytest.mark.parametrize("sinks", [-0.5, 0.0, 1.0])
def test_a_foot_comes_down_as_gently_as_told(corners, sinks):
    """By the cubic from its height and velocity to rest, whose end is the hardest."""
    dcm = FEET[0, :2] + np.array([0.05, 0.09])
    hard = step_of(corners, FEET, dcm, COMING_DOWN, 1, high_m=0.18, sinks=sinks)
    gentle = COMING_DOWN._replace(gently=80.0)
    soft = step_of(corners, FEET, dcm, gentle, 1, high_m=0.18, sinks=sinks)
    assert hard.way == soft.way == DOWN and hard.time_s == COMING_DOWN.down_s

    def ends(time_s):
        times = np.array([[0.0, 0.0, 0.0, 1.0], [0.0, 0.0, 1.0, 0.0]])
        times = np.vstack((times, time_s ** np.arange(3.0, -1.0, -1.0)))
        times = np.vstack((times, [3.0 * time_s**2, 2.0 * time_s, 1.0, 0.0]))
        cubic = np.linalg.solve(times, [0.18, -sinks, 0.0, 0.0])
        return 6.0 * cubic[0] * time_s + 2.0 * cubic[1]

    assert ends(soft.time_s) == pytest.approx(80.0, rel=1e-9)
    assert ends(hard.time_s) > 80.0


def test_a_foot_on_its_way_is_sooner_there(corners):
    dcm = np.array([0.2, 0.0])
    on_its_way = step_of(corners, FEET, dcm, REACH, 0, since_s=0.1)
    assert on_its_way.time_s < step_of(corners, FEET, dcm, REACH, 0, since_s=0.0).time_s


@pytest.mark.parametrize("side", [0, 1])
def test_the_pendulum_is_wanted_well_inside_the_soles(corners, side):
    within = REACH._replace(inside=0.01)
    for x in (0.1, 0.3, 0.6):
        falling = Falling(corners, FEET, np.array([x, 0.0]), RATE)
        (place, missing), (same, more) = (
            landing_place(falling, side, 0.3, reach, BESIDE) for reach in (REACH, within)
        )
        assert np.array_equal(place, same)
        assert 0.0 <= more - missing <= 0.01 + 1e-12
    assert missing > 0.0 and more - missing == pytest.approx(0.01)  # that cannot be caught
