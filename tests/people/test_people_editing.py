"""What a person asks of primitives that several people share."""

import pytest
from test_people_tree import BLOCKS, QUICK, RULES, D, learn, meaning

from mplearn.errors import InvalidValueError, UnknownPrimitiveError
from mplearn.people import PeopleTree
from mplearn.tree import ROOT


@pytest.fixture(scope="module")
def learned():
    """A tree of three people, as it was saved, and the motion of each primitive."""
    tree, said, teacher = learn(BLOCKS, 3)
    return tree.state(), meaning(said), teacher


@pytest.fixture
def tree(learned):
    tree = PeopleTree(QUICK, D, 100.0, people=RULES)
    tree.load_state(learned[0])
    return tree


def shared(tree, n=3):
    return next(id for id in tree.leaves if len(tree.node(id).children) == n)


def count(tree):
    """Segments in primitives, and those that wait."""
    return sum(tree.node(id).n_placed for id in tree.leaves)


def sound(tree):
    """Every node has its parent, every exemplar one primitive, every leaf one name."""
    nodes = {node.id: node for node in tree.nodes}
    assert len(nodes) == len(tree.nodes)
    for node in nodes.values():
        assert all(nodes[child].parent == node.id for child in node.children)
        assert node.parent is None or node.id in nodes[node.parent].children
        assert node.id == ROOT or node.is_leaf or len(node.children) > 0
    members = [number for id in tree.leaves for number in tree.node(id).members]
    assert len(members) == len(set(members))
    inner = [n for n in nodes.values() if n.id not in (ROOT, *tree.leaves) and n.children]
    assert all(len(node.children) > 1 for node in inner)
    assert tree.recogniser().primitives == tree.leaves


def people_of(tree, id):
    return sorted(person for person, _ in [each.key for each in tree.sharing().leaves_of(id)])


def lasts(tree, learned, check):
    """Learn on, and over a save: what was asked for holds, however often all is solved again."""
    teacher = learned[2]
    again = PeopleTree(QUICK, D, 100.0, people=RULES)
    again.load_state(tree.state())
    for i in range(24):
        frames = teacher(i % 3, int(teacher.rng.integers(5)))
        assert repr(tree.insert(frames, i % 3)) == repr(again.insert(frames, i % 3))
        check(tree)
    tree.sharing().regroup()
    sound(tree)
    check(again)


def test_split_sends_each_persons_leaf_to_one_side(tree, learned):
    id = shared(tree)
    before, exemplars = count(tree), len(tree.exemplars(id))
    own = [
        len(tree.of(person).exemplars(leaf))
        for person, leaf in [each.key for each in tree.sharing().leaves_of(id)]
    ]
    groups = [range(own[0]), range(own[0], exemplars)]
    change = tree.split(id, [list(group) for group in groups])
    assert change.splits[0].node == id
    assert set(change.born) == set(change.splits[0].into)
    assert sorted(people_of(tree, into) for into in change.splits[0].into) == [[0], [1, 2]]
    assert {to for _, to in change.moved} == set(change.born)
    assert tree.node(id).children == tuple(sorted(change.born))
    assert count(tree) == before
    sound(tree)
    one, two = change.born

    def apart(tree):
        assert {one, two} <= set(tree.leaves)
        assert not set(people_of(tree, one)) & set(people_of(tree, two))

    lasts(tree, learned, apart)


def test_split_alone_finds_the_two_branches(tree):
    id = shared(tree)
    change = tree.split(id)
    sides = [people_of(tree, into) for into in change.splits[0].into]
    assert sorted(sides[0] + sides[1]) == [0, 1, 2]
    assert len(sides[0]) == 2
    sound(tree)


def test_split_goes_through_leaves(tree):
    id = shared(tree)
    n = len(tree.exemplars(id))
    change = tree.split(id, [list(range(0, n, 2)), list(range(1, n, 2))])
    assert [people_of(tree, into) for into in change.born] == [[0, 1, 2], [0, 1, 2]]
    sound(tree)
    with pytest.raises(InvalidValueError, match="at least 2 of a leaf"):
        tree.split(change.born[0], [[0], list(range(1, len(tree.exemplars(change.born[0]))))])
    sound(tree)


def test_merge_joins_leaf_by_leaf_and_undoes_a_split(tree, learned):
    first, second = tree.leaves[:2]
    before = count(tree)
    change = tree.merge(second, first)
    assert change.merges[0] == (first, second)
    assert people_of(tree, first) == sorted(set(people_of(tree, first)))
    assert second not in tree.leaves
    assert count(tree) == before
    sound(tree)
    lasts(tree, learned, lambda tree: tree.leaves.index(first) + 1)
    id = next(id for id in tree.leaves if id != first and len(tree.node(id).children) > 1)
    people = people_of(tree, id)
    one, two = tree.split(id).born
    change = tree.merge(one, two)
    assert people_of(tree, one) == people
    assert tree.node(one).parent == ROOT
    assert set(change.removed) == {id}
    sound(tree)


def test_a_leaf_moves_from_one_primitive_to_another(tree, learned):
    source, target = [id for id in tree.leaves if len(tree.node(id).children) == 3][:2]
    leaf = tree.node(source).children[1]
    person = next(p for p, _ in [each.key for each in tree.sharing().leaves_of(leaf)])
    members = set(tree.node(leaf).members)
    change = tree.reparent(leaf, target)
    assert {number for number, to in change.moved if to == target} == members
    assert person not in people_of(tree, source)
    assert people_of(tree, target) == [0, 1, 2]
    sound(tree)

    def holds(tree):
        assert person not in people_of(tree, source)
        assert {source, target} <= set(tree.leaves)

    lasts(tree, learned, holds)


def test_a_leaf_becomes_a_primitive_of_its_own_and_joins_again(tree):
    source = shared(tree)
    leaf = tree.node(source).children[0]
    change = tree.reparent(leaf, ROOT)
    (born,) = change.born
    assert tree.node(born).parent == ROOT
    assert len(people_of(tree, born)) == 1
    sound(tree)
    back = tree.reparent(born, source)
    assert back.merges == ((source, born),)
    assert people_of(tree, source) == [0, 1, 2]
    sound(tree)


def test_a_primitive_or_a_leaf_of_it_is_removed(tree):
    id = shared(tree)
    leaf = tree.node(id).children[0]
    gone = set(tree.node(leaf).members)
    change = tree.remove(leaf)
    assert change.removed == (leaf,)
    assert {number for number, to in change.moved if to == ROOT} >= gone
    assert id in tree.leaves
    waiting = len(tree.node(ROOT).members)
    change = tree.remove(id, forget=True)
    assert change.removed == (id,)
    assert id not in tree.leaves
    assert len(tree.node(ROOT).members) == waiting
    sound(tree)


def test_what_cannot_be_asked_changes_nothing(tree):
    id, other = tree.leaves[:2]
    leaf = tree.node(id).children[0]
    before = tree.state()
    wrong = [
        (UnknownPrimitiveError, lambda: tree.split(999)),
        (UnknownPrimitiveError, lambda: tree.merge(id, leaf)),
        (UnknownPrimitiveError, lambda: tree.remove(999)),
        (UnknownPrimitiveError, lambda: tree.reparent(999, ROOT)),
        (InvalidValueError, lambda: tree.merge(id, id)),
        (InvalidValueError, lambda: tree.reparent(id, other)),
        (InvalidValueError, lambda: tree.reparent(leaf, id)),
        (InvalidValueError, lambda: tree.reparent(ROOT, ROOT)),
        (InvalidValueError, lambda: tree.split(id, [[0, 1], [2, 3]])),
    ]
    for error, ask in wrong:
        with pytest.raises(error):
            ask()
    assert tree.state() == before


def test_what_a_person_keeps_is_kept_in_everybodys_tree_and_over_a_save(tree):
    id = shared(tree)
    others = [each for each in tree.leaves if each != id]
    leaves = tree.sharing().leaves_of
    tree.keep(id)
    again = PeopleTree(QUICK, D, 100.0, people=RULES)
    again.load_state(tree.state())
    for each in (tree, again):
        of = each.sharing().trees
        assert all(of[leaf.person].node(leaf.local).by_hand for leaf in leaves(id))
        assert not any(of[x.person].node(x.local).by_hand for one in others for x in leaves(one))
    state = tree.state()
    tree.keep(id)  # once is enough
    assert tree.state() == state
    with pytest.raises(UnknownPrimitiveError, match="no primitive 999"):
        tree.keep(999)
