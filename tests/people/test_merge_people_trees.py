"""Trees of several people that were learned apart, joined."""

from collections import Counter

import pytest
from test_people_editing import sound
from test_people_tree import N_MOTIONS, QUICK, RULES, D, Teacher

from mplearn.merging import merge_people
from mplearn.people import PeopleTree
from mplearn.tree import ROOT


class Shard:
    """A tree, and which motion each of its segments shows."""

    def __init__(self, teacher: Teacher, people: dict[int, int], script: list[tuple[int, int]]):
        self.tree = PeopleTree(QUICK, D, 100.0, people=RULES)
        self.shows = {}
        for person, motion in script:
            frames = teacher(people[person], motion)
            self.shows[self.tree.insert(frames, person).number] = motion


def script(people, n, seed, motions=N_MOTIONS):
    teacher = Teacher(1, seed)
    return [(people[i % len(people)], int(teacher.rng.integers(motions))) for i in range(n)]


@pytest.fixture(scope="module")
def shards():
    """Two of three people each, who have other numbers there; the middle one is in both."""
    teacher = Teacher(3)
    one = Shard(teacher, {0: 0, 1: 1}, script([0, 1], 80, 1))
    two = Shard(teacher, {0: 2, 1: 1}, script([1, 0], 80, 2))
    return one, two, teacher


FORTH, BACK = {1: 1, 0: 2}, {1: 1, 0: 2}  # the first of each is new to the other


def merged(one, two, people):
    """Merge two trees, given the number in the first of each person of the second."""
    return merge_people([one, two], [{person: person for person in one.people}, people])


def meanings(united, one, two):
    """The motion of each primitive, by what it holds."""
    shows = one.shows | {n + united.new_numbers[1]: motion for n, motion in two.shows.items()}
    held = {
        id: Counter(shows[n] for n in united.tree.node(id).members) for id in united.tree.leaves
    }
    return {id: counts.most_common(1)[0][0] for id, counts in held.items()}


def test_who_is_in_both_has_one_tree_and_each_motion_one_primitive(shards):
    one, two, _ = shards
    united = merged(one.tree, two.tree, FORTH)
    tree = united.tree
    assert tree.people == (0, 1, 2)
    assert tree.n_seen == one.tree.n_seen + two.tree.n_seen
    assert tree.of(1).n_seen == one.tree.of(1).n_seen + two.tree.of(1).n_seen
    assert sorted(meanings(united, one, two).values()) == list(range(N_MOTIONS))
    for id in tree.leaves:
        assert len(tree.node(id).children) == 3
    placed = sum(tree.node(id).n_placed for id in tree.leaves) + len(tree.node(ROOT).members)
    assert placed == tree.n_seen
    sound(tree)


def test_primitives_keep_their_names_and_their_meaning(shards):
    one, two, _ = shards
    united = merged(one.tree, two.tree, FORTH)
    names = meanings(united, one, two)
    assert united.new_ids[0] == {id: id for id in one.tree.leaves}
    for shard, new_id in zip((one, two), united.new_ids, strict=True):
        assert set(new_id) == set(shard.tree.leaves)
        for old, new in new_id.items():
            shown = Counter(shard.shows[n] for n in shard.tree.node(old).members)
            assert shown.most_common(1)[0][0] == names[new]


def test_the_order_of_the_two_changes_names_only(shards):
    one, two, _ = shards
    forth, back = merged(one.tree, two.tree, FORTH), merged(two.tree, one.tree, BACK)

    def content(united, first, second, people):
        return {
            motion: sorted(
                (people[person], united.tree.of(person).node(leaf).n_placed)
                for person, leaf in [each.key for each in united.tree.sharing().leaves_of(id)]
            )
            for id, motion in meanings(united, first, second).items()
        }

    same = content(forth, one, two, {0: 0, 1: 1, 2: 2})
    assert same == content(back, two, one, {0: 2, 1: 1, 2: 0})


def test_a_united_tree_goes_on_and_is_kept(shards):
    one, two, teacher = shards
    tree = merged(one.tree, two.tree, FORTH).tree
    again = PeopleTree(QUICK, D, 100.0, people=RULES)
    again.load_state(tree.state())
    before, known = tree.n_seen, tree.leaves
    said = []
    for i in range(30):
        frames = teacher(i % 3, i % N_MOTIONS)
        said.append(tree.insert(frames, i % 3))
        assert repr(said[-1]) == repr(again.insert(frames, i % 3))
    assert [placement.number for placement in said] == list(range(before, before + 30))
    assert sum(placement.recognised for placement in said) >= 27
    assert tree.leaves == known
    sound(tree)


def test_people_who_are_strangers_are_kept_apart_and_yet_share(shards):
    one, two, _ = shards
    before = one.tree.state(), two.tree.state()
    tree = merged(one.tree, two.tree, {0: 2, 1: 3}).tree
    assert tree.people == (0, 1, 2, 3) or tree.people == (0, 1, 3, 2)
    assert len(tree.leaves) == N_MOTIONS
    sound(tree)
    assert (one.tree.state(), two.tree.state()) == before


def test_what_a_person_said_holds_in_the_union(shards):
    one, two, _ = shards
    tree = PeopleTree(QUICK, D, 100.0, people=RULES)
    tree.load_state(two.tree.state())
    first, second = tree.leaves[:2]
    tree.merge(first, second)
    id = next(id for id in tree.leaves if id != first)
    tree.split(id)
    united = merged(one.tree, tree, {1: 3, 0: 2}).tree
    sound(united)
    keys = [{each.key for each in united.sharing().leaves_of(id)} for id in united.leaves]
    assert sum(len({key for key in group if key[0] in (2, 3)}) > 1 for group in keys) == len(
        [id for id in tree.leaves if len([each.key for each in tree.sharing().leaves_of(id)]) > 1]
    )


def test_nothing_learned_adds_nothing(shards):
    one, _, _ = shards
    empty = PeopleTree(QUICK, D, 100.0, people=RULES)
    for united in (
        merged(one.tree, empty, {0: 0}),
        merged(empty, one.tree, {0: 0, 1: 1}),
    ):
        assert len(united.tree.leaves) == len(one.tree.leaves)
        assert united.tree.n_seen == one.tree.n_seen
        sound(united.tree)
