"""What people showed too seldom while each was alone waits again when they are merged."""

import pytest
from test_people_editing import sound
from test_people_tree import QUICK, RULES, D, Teacher

from mplearn.merging import merge_people
from mplearn.people import PeopleTree
from mplearn.tree import ROOT

COMMON, BOTH, ONE = (0, 1, 2), 3, 4  # shown often; twice by each; twice by the first alone


@pytest.fixture(scope="module")
def shards():
    """A shard a person, whose number in it is 0."""
    teacher = Teacher(2)
    found = []
    for person, rare in enumerate(([BOTH, BOTH, ONE, ONE], [BOTH, BOTH])):
        tree = PeopleTree(QUICK, D, 100.0, people=RULES)
        shows = {}
        for motion in [*COMMON * 5, *rare, *COMMON]:
            shows[tree.insert(teacher(person, motion)).number] = motion
        found.append((tree, shows))
    assert [len(tree.leaves) for tree, _ in found] == [5, 4]  # all of it is known alone
    return found, teacher


def united(shards):
    (one, shown), (two, also) = shards
    tree, _, (_, new_number), *_ = merge_people([one, two], [{0: 0}, {0: 1}])
    return tree, shown | {n + new_number: motion for n, motion in also.items()}


def meanings(tree, shows):
    return sorted({shows[n] for n in tree.node(id).members}.pop() for id in tree.leaves)


def test_what_one_person_showed_twice_waits_and_what_two_did_stays(shards):
    tree, shows = united(shards[0])
    assert meanings(tree, shows) == [*COMMON, BOTH, ONE]
    (gone,) = (id for id in tree.leaves if shows[tree.node(id).members[0]] == ONE)
    members = tree.node(gone).members
    change = tree.prune()
    assert change.removed == (gone,) and not change.born
    assert sorted(change.moved) == sorted((n, ROOT) for n in members)
    assert meanings(tree, shows) == [*COMMON, BOTH]
    assert set(members) <= set(tree.node(ROOT).members)
    assert not tree.prune().removed
    sound(tree)


def test_what_waits_is_a_primitive_once_it_is_shown_as_often_as_several_people_need(shards):
    tree, shows = united(shards[0])
    tree.prune()
    said = [tree.insert(shards[1](0, ONE), 0) for _ in range(2)]
    assert [len(placement.born) for placement in said] == [0, 1]
    shows |= {placement.number: ONE for placement in said}
    assert meanings(tree, shows) == [*COMMON, BOTH, ONE]


def test_what_a_person_had_a_hand_in_and_who_is_alone_stay(shards):
    tree, _ = united(shards[0])
    (young,) = (id for id in tree.leaves if tree.n_placed(id) < RULES.min_exemplars)
    tree.freeze(young)
    assert not tree.prune().removed
    assert young in tree.leaves
    alone = shards[0][0][0].copy()
    assert not alone.prune().removed
    alone.sharing()
    assert not alone.prune().removed


def test_where_nothing_was_shown_often_all_waits_and_learning_goes_on(shards):
    tree, shows = united(shards[0])
    for id in tree.leaves:
        tree.remove(id)
    assert not tree.leaves
    for person in (0, 1) * RULES.min_exemplars:
        placement = tree.insert(shards[1](person, COMMON[0]), person)
        shows[placement.number] = COMMON[0]
    assert COMMON[0] in meanings(tree, shows)
    sound(tree)
