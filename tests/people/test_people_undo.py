"""What a person asked of primitives that several people share is undone, and learning went on."""

import pytest
from test_people_editing import count, lasts, shared, sound
from test_people_tree import BLOCKS, QUICK, RULES, D, Teacher, learn, meaning

from mplearn.errors import InvalidValueError, UnknownPrimitiveError
from mplearn.people import PeopleEdit, PeopleTree
from mplearn.people.sharing import Sharing
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


def look(tree):
    """What there is: ids, parents, exemplars, counts."""
    nodes = {n.id: (n.parent, sorted(n.members), n.n_placed, n.n_frames) for n in tree.nodes}
    return nodes, tree.state().sharing.constraints


def edits(tree):
    """What can be asked, by name."""
    one, other = [id for id in tree.leaves if len(tree.node(id).children) == 3][:2]
    return {
        "merge": lambda: tree.merge(one, other),
        "split": lambda: tree.split(one),
        "halve": lambda: tree.split(
            one, [range(0, len(tree.exemplars(one)), 2), range(1, len(tree.exemplars(one)), 2)]
        ),
        "remove": lambda: tree.remove(one, forget=True),
        "move": lambda: tree.reparent(tree.node(one).children[0], other),
        "freeze": lambda: tree.freeze(one),
    }


def done(tree, name):
    before = tree.state()
    edits(tree)[name]()
    return PeopleEdit.between(before, tree.state())


NAMES = ["merge", "split", "halve", "remove", "move", "freeze"]


@pytest.mark.parametrize("name", NAMES)
def test_undo_and_redo_at_once(tree, learned, name):
    before = look(tree)
    edit = done(tree, name)
    after = look(tree)
    tree.exchange(edit.reversed())
    assert look(tree) == before
    sound(tree)
    tree.exchange(edit)
    assert look(tree) == after
    sound(tree)
    tree.exchange(edit.reversed())
    if name != "freeze":
        lasts(tree, learned, lambda _: None)


@pytest.mark.parametrize("name", NAMES)
def test_undo_and_redo_long_after(tree, learned, name):
    teacher = learned[2]
    ids = tree.leaves
    edit = done(tree, name)
    for i in range(45):
        tree.insert(teacher(i % 3, int(teacher.rng.integers(5))), i % 3)
    n = count(tree)
    tree.exchange(edit.reversed())
    sound(tree)
    assert set(ids) <= set(tree.leaves)
    assert count(tree) >= n if name == "remove" else count(tree) == n
    tree.exchange(edit)
    sound(tree)
    lasts(tree, learned, lambda _: None)


@pytest.mark.parametrize("name", ["merge", "split", "remove"])
def test_others_came_since(name):
    tree, teacher = PeopleTree(QUICK, D, 100.0, people=RULES), Teacher(2)
    for _ in range(40):
        tree.insert(teacher(0, int(teacher.rng.integers(5))), 0)
    one, other = tree.leaves[:2]
    before = tree.state()
    {
        "merge": lambda: tree.merge(one, other),
        "split": lambda: tree.split(one),
        "remove": lambda: tree.remove(one, forget=True),
    }[name]()
    edit = PeopleEdit.between(before, tree.state())
    for i in range(60):
        tree.insert(teacher(i % 2, int(teacher.rng.integers(5))), i % 2)
    n = count(tree)
    tree.exchange(edit.reversed())
    sound(tree)
    assert {one, other} <= set(tree.leaves)
    assert count(tree) >= n
    tree.exchange(edit)
    sound(tree)
    again = PeopleTree(QUICK, D, 100.0, people=RULES)
    again.load_state(tree.state())
    assert again.state() == tree.state()


def test_what_is_asked_of_many_primitives_at_once_is_looked_up_once(tree, monkeypatch):
    def asked():
        plain = [(n.id, n.parent, n.members, n.n_placed, n.frozen) for n in tree.nodes]
        of = [
            (id, tree.model(id), tree.n_placed(id), tree.radius(id), len(tree.exemplars(id)))
            for id in (*tree.leaves, *tree.node(tree.leaves[0]).children)
        ]
        return plain, of

    expected = asked()
    monkeypatch.setattr(Sharing, "leaves_of", None)  # goes through all leaves
    with tree.still():
        assert asked() == expected
        with pytest.raises(UnknownPrimitiveError, match="no primitive 99"):
            tree.model(99)
        with pytest.raises(UnknownPrimitiveError, match="no node 99"):
            tree.node(99)
    monkeypatch.undo()
    tree.freeze(tree.leaves[0])
    assert tree.node(tree.leaves[0]).frozen


def test_a_frozen_primitive_of_several_stays_what_it_is(tree, learned):
    teacher = learned[2]
    id = shared(tree)
    assert not tree.node(id).frozen
    tree.freeze(id)
    for each in (id, *tree.node(id).children):
        assert tree.node(each).frozen
    before = look(tree)[0]
    own = {each.key for each in tree.sharing().leaves_of(id)}
    for i in range(60):
        tree.insert(teacher(i % 3, int(teacher.rng.integers(5))), i % 3)
    tree.sharing().regroup()
    assert {each.key for each in tree.sharing().leaves_of(id)} >= own
    now = look(tree)[0]
    for child in tree.node(id).children:
        assert child not in before or now[child] == before[child]
    others = [other for other in tree.leaves if other != id]
    asked = [lambda: tree.merge(id, others[0]), lambda: tree.split(id), lambda: tree.remove(id)]
    for ask in asked:
        with pytest.raises(InvalidValueError, match=f"primitive {id} is frozen"):
            ask()
    assert ROOT not in tree.leaves
