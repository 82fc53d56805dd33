"""The tree of several people, on made motions."""

from collections import Counter
from dataclasses import replace

import numpy as np
import pytest

from mplearn.errors import InvalidValueError, UnknownPrimitiveError
from mplearn.people import PeopleConfig, PeopleTree
from mplearn.people.sharing import TIDY
from mplearn.tree import ROOT, MirrorMap, PrimitiveTree, TreeConfig

D, N_MOTIONS = 6, 5
RULES = PeopleConfig(repertoire=N_MOTIONS)
QUICK = TreeConfig(n_states=4, n_sampled=32)


class Teacher:
    """People who perform the same smooth motions, each in an own way."""

    def __init__(self, n_people: int, seed: int = 0, habit: float = 0.25) -> None:
        rng = np.random.default_rng(seed)
        self.rng = rng
        self.motions = rng.normal(size=(N_MOTIONS, 3, D))
        self.habits = habit * rng.normal(size=(n_people, D))
        self.sizes = 1 + 0.06 * rng.normal(size=(n_people, 3, D))

    def __call__(self, person: int, motion: int) -> np.ndarray:
        length = int(self.rng.integers(70, 130))
        t = np.linspace(0, 1, length)[:, None]
        a, b, c = self.motions[motion] * self.sizes[person]
        clean = a + b * np.sin(np.pi * t) + c * t**2
        return clean + self.habits[person] + 0.06 * self.rng.normal(size=D)


def learn(people: list[int], n_people: int, seed: int = 0):
    teacher = Teacher(n_people, seed)
    tree = PeopleTree(QUICK, D, 100.0, people=RULES)
    said = []
    for person in people:
        motion = int(teacher.rng.integers(N_MOTIONS))
        said.append((person, motion, tree.insert(teacher(person, motion), person)))
    return tree, said, teacher


BLOCKS = [0] * 45 + [1] * 45 + [2] * 45
MIXED = [int(p) for p in np.random.default_rng(1).integers(3, size=135)]


def meaning(said):
    """The motion of each primitive, by majority of what is in it."""
    home, shown = {}, {}
    for _, motion, placement in said:
        shown[placement.number] = motion
        home[placement.number] = placement.node_id
        home.update(placement.moved)
        for merge in placement.merges:
            home = {n: merge.kept if at == merge.absorbed else at for n, at in home.items()}
    votes: dict[int, Counter] = {}
    for number, at in home.items():
        votes.setdefault(at, Counter())[shown[number]] += 1
    return {at: counts.most_common(1)[0][0] for at, counts in votes.items() if at != ROOT}


@pytest.mark.parametrize("people", [BLOCKS, MIXED], ids=["blocks", "mixed"])
def test_one_primitive_a_motion_with_a_leaf_for_each_person(people):
    tree, said, _ = learn(people, 3)
    assert tree.people == tuple(dict.fromkeys(people))
    means = meaning(said)
    assert sorted(means[id] for id in tree.leaves) == list(range(N_MOTIONS))
    for id in tree.leaves:
        node = tree.node(id)
        assert len(node.children) >= 2
        assert len({tree.node(child).parent for child in node.children}) == 1
        assert sum(tree.node(child).n_placed for child in node.children) == node.n_placed
        assert tree.model(id).n_channels == D
        assert len(tree.exemplars(id)) == len(node.members)
    ids = [node.id for node in tree.nodes]
    assert len(set(ids)) == len(ids)


def test_a_newcomer_is_recognised_at_once():
    _, said, _ = learn(BLOCKS, 3)
    first = said[45:51]
    names = meaning(said)
    assert all(p.recognised and names[p.node_id] == motion for _, motion, p in first)


def test_what_nobody_else_does_is_a_primitive_of_its_own():
    teacher = Teacher(2)
    tree = PeopleTree(QUICK, D, 100.0, people=RULES)
    for _ in range(40):
        tree.insert(teacher(0, int(teacher.rng.integers(3))), 0)
    known = tree.leaves
    placements = [tree.insert(teacher(1, int(teacher.rng.integers(3, 5))), 1) for _ in range(16)]
    assert len(tree.leaves) == len(known) + 2
    assert sum(p.recognised and p.node_id in known for p in placements) == 0


def test_ids_are_for_life():
    _, said, _ = learn(MIXED, 3)
    seen: set[int] = set()
    for _, _, placement in said:
        assert not seen & set(placement.born)
        seen |= set(placement.born)
    numbers = [placement.number for _, _, placement in said]
    assert numbers == list(range(len(said)))


def test_with_one_person_all_is_as_in_a_tree_alone():
    teacher = Teacher(1)
    many, one = PeopleTree(QUICK, D, 100.0, people=RULES), PrimitiveTree(QUICK, D, 100.0)
    for _ in range(50):
        frames = teacher(0, int(teacher.rng.integers(N_MOTIONS)))
        assert many.insert(frames, 3) == one.insert(frames)
    assert many.leaves == one.leaves
    assert repr(many.nodes) == repr(one.nodes)
    assert many.recogniser().state() == one.recogniser().state()
    assert many.of(3).state() == one.state()


@pytest.mark.parametrize("at", [20, 60])
def test_a_saved_tree_goes_on_bit_for_bit(at):
    teacher = Teacher(3)
    script = [(p, int(teacher.rng.integers(N_MOTIONS))) for p in BLOCKS[:90]]
    segments = [(p, teacher(p, m)) for p, m in script]
    tree = PeopleTree(QUICK, D, 100.0, people=RULES)
    for person, frames in segments[:at]:
        tree.insert(frames, person)
    other = PeopleTree(QUICK, D, 100.0, people=RULES)
    other.load_state(tree.state())
    for person, frames in segments[at:]:
        assert repr(tree.insert(frames, person)) == repr(other.insert(frames, person))
    assert tree.state() == other.state()


def test_one_recogniser_knows_everybody():
    tree, said, teacher = learn(BLOCKS, 3)
    recogniser, names = tree.recogniser(), meaning(said)
    right = 0
    for person in range(3):
        for motion in range(N_MOTIONS):
            found = recogniser.recognise(teacher(person, motion)).primitive
            right += found is not None and names[found] == motion
    assert right >= 13
    again = type(recogniser).from_state(recogniser.state())
    frames = teacher(0, 0)
    assert again.recognise(frames) == recogniser.recognise(frames)


def test_memory_does_not_grow_with_the_stream():
    teacher = Teacher(2)
    tree = PeopleTree(replace(QUICK, max_unplaced=40), D, 100.0, people=RULES)
    most = 40 + N_MOTIONS * QUICK.max_exemplars + TIDY  # waiting, kept, and not yet forgotten
    for i in range(320):
        tree.insert(teacher(i % 2, int(teacher.rng.integers(N_MOTIONS))), i % 2)
    kept = tree.state().sharing
    assert all(len(own.here) <= most < 160 for own in kept.numbers)
    assert sum(len(each.numbers) for each in kept.provisional) <= 2 * most


def test_what_is_unknown_is_named():
    tree, _, _ = learn(MIXED, 3)
    with pytest.raises(UnknownPrimitiveError, match="999"):
        tree.node(999)
    with pytest.raises(UnknownPrimitiveError, match="999"):
        tree.exemplars(999)
    with pytest.raises(InvalidValueError, match="person 7"):
        tree.of(7)


@pytest.mark.parametrize("sided", [False, True])
def test_left_is_not_right_if_it_is_known_which_is_which(sided):
    rng = np.random.default_rng(4)
    mirror = MirrorMap((1, 0, 3, 2, 4, 5), (1, 1, 1, 1, 1, 1))
    tree = PeopleTree(QUICK, D, 100.0, people=RULES, mirror=mirror if sided else None)
    motions = rng.normal(size=(3, 2, D))
    motions = 0.5 * (motions + mirror.apply(motions)) + 0.12 * (motions - mirror.apply(motions))

    def perform(motion: int, side: int) -> np.ndarray:
        t = np.linspace(0, 1, int(rng.integers(70, 130)))[:, None]
        a, b = motions[motion] + 0.02 * rng.normal(size=(2, D))
        frames = a + b * np.sin(np.pi * t)
        return frames if side == 0 else mirror.apply(frames)

    for i in range(30):
        tree.insert(perform(i % 3, 0), 0)
    known = tree.leaves
    assert len(known) == 3
    others = [tree.insert(perform(i % 3, int(i % 3 == 0)), 1) for i in range(18)]
    assert others[0].recognised != sided
    assert others[1].recognised
    assert (set(tree.leaves) > set(known)) == sided
    assert tree.insert(perform(0, 0), 2).node_id in known
