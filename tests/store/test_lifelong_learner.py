"""Commands, undo and redo while learning goes on, and the log that does it all again."""

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from mplearn import LearnerConfig, MotionLearner, Recording
from mplearn.errors import InvalidValueError, MPLearnError, UnknownPrimitiveError
from mplearn.learner import Recognised
from mplearn.library import Primitive
from mplearn.recording import FloatArray
from mplearn.store import (
    Command,
    Delete,
    Freeze,
    LifelongLearner,
    Merge,
    Note,
    Pause,
    Rename,
    Resume,
    Split,
    Unfreeze,
)
from mplearn.store.life import LifeState
from mplearn.store.records import Record


class Written:
    """A log in memory."""

    def __init__(self) -> None:
        self.records: list[Record] = []

    def append(self, record: Record, state: Callable[[], LifeState]) -> None:
        self.records.append(record)


def life_of(learner: MotionLearner) -> LifelongLearner:
    return LifelongLearner(MotionLearner.from_state(learner.state()))


def placed(life: LifelongLearner) -> int:
    tree = life.learner.tree
    return sum(tree.n_placed(id) for id in tree.leaves)


def resumed(life: LifelongLearner) -> LifelongLearner:
    """The same, from its state: which must be whole, and the same again."""
    state = life.state()
    twin = LifelongLearner.from_state(state)
    assert twin.state() == state
    return twin


COMMANDS = [
    Rename(1, "bow"),
    Merge(1, 2),
    Split(1),
    Split(3, ((0, 1, 2), (3, 4, 5, 6, 7))),
    Delete(2),
    Freeze(4),
    Note("slow today", 1),
]


@pytest.mark.parametrize("command", COMMANDS, ids=lambda c: c.kind)
def test_undo_restores_the_library_to_the_bit_and_redo_does_it_again(
    taught: MotionLearner, command: Command
) -> None:
    life = life_of(taught)
    before, knew = life.snapshot().version, life.learner.graph.state()
    saw = life.learner.chain.state()
    life.execute(command, by="Anna")
    after, knows = life.snapshot().version, life.learner.graph.state()
    assert (before == after) == isinstance(command, (Freeze, Note))
    life.undo(by="Ben")
    assert life.snapshot().version == before
    assert life.learner.graph.state() == knew
    assert life.learner.chain.state() == saw
    resumed(life)
    life.redo(by="Ben")
    assert life.snapshot().version == after
    assert life.learner.graph.state() == knows
    resumed(life)
    log = [(each.command.kind, each.by, each.undone) for each in life.entries()]
    assert log == [(command.kind, "Anna", False), ("undo", "Ben", False), ("redo", "Ben", False)]


@pytest.mark.parametrize("command", [Merge(1, 2), Split(1), Split(3)], ids=str)
def test_what_was_learned_since_stays_when_a_command_is_undone(
    taught_unaided: MotionLearner, later: FloatArray, command: Command
) -> None:
    life, untouched = life_of(taught_unaided), life_of(taught_unaided)
    n_before = taught_unaided.tree.n_seen
    life.execute(command)
    for each in (life, untouched):
        each.learn_many(later)
    n, counted = placed(life), life.learner.graph.n_transitions
    life.undo()
    assert life.learner.tree.leaves == untouched.learner.tree.leaves
    assert placed(life) == n == placed(untouched)
    assert life.learner.graph.n_transitions == counted == untouched.learner.graph.n_transitions
    motions = {
        n: id
        for block in untouched.learner.chain.state().segments
        for n, id in zip(block.number.tolist(), block.primitive.tolist(), strict=True)
    }
    for id in life.learner.tree.leaves:  # the four motions are far apart: each got its own back
        mine, theirs = (each.learner.tree.node(id) for each in (life, untouched))
        assert (mine.n_placed, mine.n_frames) == (theirs.n_placed, theirs.n_frames)
        assert {motions[n] for n in mine.members} == {id}
        assert max(mine.members) >= n_before
    twin = resumed(life)
    for each in (life, twin):
        each.learn_many(later, np.arange(len(later)) / 100)
    assert life.state() == twin.state()
    life.redo()
    resumed(life)
    assert life.learner.graph.n_transitions >= counted


def test_a_deleted_primitive_comes_back_beside_what_was_learned_since(
    taught: MotionLearner, later: FloatArray
) -> None:
    life = life_of(taught)
    life.execute(Rename(2, "raise"))
    mine = life.snapshot()[2]
    life.execute(Delete(2))
    assert 2 not in life.snapshot()
    life.learn_many(later)
    n, counted = placed(life), life.learner.graph.n_transitions
    life.undo()
    back = life.snapshot()["raise"]
    assert back.id == 2
    assert np.array_equal(back.hmm.means, mine.hmm.means)
    assert placed(life) == n + mine.n_exemplars
    assert life.learner.graph.n_transitions > counted
    resumed(life)


def test_a_frozen_primitive_does_not_change(taught: MotionLearner, motions: Recording) -> None:
    life, free = life_of(taught), life_of(taught)
    life.execute(Freeze(1))
    before = life.snapshot()[1]
    rng = np.random.default_rng(0)
    for each in (life, free):
        events = each.learn_many(motions.frames)
        each.end_stream()
        wide = 2.0 * motions.frames + 0.02 * rng.standard_normal(motions.frames.shape[1])
        each.learn_many(wide)  # what all motion varies by changes, and with it all models
    assert any(isinstance(e, Recognised) and e.primitive == 1 for e in events)
    after, other = life.snapshot()[1], free.snapshot()[1]
    assert after.n_exemplars == before.n_exemplars < other.n_exemplars
    for name in ("means", "variances", "log_stay"):
        assert np.array_equal(getattr(after.hmm, name), getattr(before.hmm, name))
    assert not np.array_equal(other.hmm.variances, before.hmm.variances)
    for one, two in zip(after.exemplars, before.exemplars, strict=True):
        assert np.array_equal(one, two)
    for command in (Delete(1), Split(1), Merge(1, 2)):
        with pytest.raises(InvalidValueError, match="primitive 1 is frozen"):
            life.execute(command)
    twin = resumed(life)
    assert twin.snapshot().version == life.snapshot().version
    thawed = [(lambda: life.execute(Unfreeze(1)), life.undo), (life.undo, life.redo)]
    for thaw, freeze in thawed:
        thaw()
        life.learn_many(motions.frames)
        assert life.snapshot()[1].n_exemplars > before.n_exemplars
        freeze()
        assert life.snapshot()[1].n_exemplars == before.n_exemplars


def test_what_a_command_leaves_as_it_was_is_not_undone(taught: MotionLearner) -> None:
    life = life_of(taught)
    life.execute(Unfreeze(1))  # which is not frozen
    assert life.reversible() == ()
    life.execute(Rename(1, "bow"))
    life.execute(Unfreeze(1))
    assert life.reversible() == (2,)


def test_paused_learning_recognises_and_learns_nothing(
    taught: MotionLearner, later: FloatArray
) -> None:
    life = life_of(taught)
    before = life.snapshot().version
    life.execute(Pause())
    events = life.learn_many(later)
    assert {e.primitive for e in events if isinstance(e, Recognised)} == {1, 2, 3, 4}
    assert life.snapshot().version == before
    twin = resumed(life)
    for each in (life, twin):
        each.execute(Resume(), when=5.0)
        each.learn_many(later, np.arange(len(later)) / 100)
    assert life.state() == twin.state()
    assert life.snapshot().version != before
    life.undo(), life.undo()
    assert not life.learner.paused


def test_the_log_does_all_again_to_the_bit(motions: Recording) -> None:
    rng = np.random.default_rng(3)
    life = LifelongLearner(MotionLearner(LearnerConfig(motions.channels, motions.rate_hz)))
    life.store = log = Written()
    at = 0
    while at < len(motions.frames):
        n = int(rng.integers(1, 400))
        part = motions.frames[at : at + n]
        life.learn_many(part, 1e9 + np.arange(at, at + len(part)) / 100)
        at += n
        act_at_random(life, rng)
    life.end_stream()
    for part in (motions, motions):
        for _ in life.learn_recording(part, 300):
            pass
    assert life.learner.n_frames == 2 * len(motions.frames)
    twin = LifelongLearner(MotionLearner(LearnerConfig(motions.channels, motions.rate_hz)))
    for k, record in enumerate(log.records):
        twin.replay(record)
        if k % 25 == 7:
            twin = resumed(twin)
    assert twin.state() == life.state()
    assert twin.snapshot().version == life.snapshot().version


def act_at_random(life: LifelongLearner, rng: np.random.Generator) -> None:
    leaves = [int(id) for id in life.learner.tree.leaves] or [1]
    one, two = int(rng.choice(leaves)), int(rng.choice(leaves))
    name = str(rng.integers(100)) + " times"
    every = [Rename(one, name), Merge(one, two), Split(one), Delete(one), Freeze(one)]
    every += [Unfreeze(one), Note(name, one)]
    numbers = [entry.number for entry in life.entries()] or [1]
    acts: list[Callable[[], object]] = [
        lambda: life.execute(every[int(rng.integers(len(every)))], by="Anna", when=float(one)),
        lambda: life.undo(by="Ben"),
        lambda: life.redo(by="Ben"),
        lambda: life.undo(number=int(rng.choice(numbers))),
        lambda: life.redo(number=int(rng.choice(numbers))),
    ]
    n, version = placed(life), life.snapshot().version
    k = int(rng.choice(5, p=[0.5, 0.2, 0.1, 0.1, 0.1]))
    try:
        acts[k]()
    except MPLearnError:
        assert life.snapshot().version == version
    else:
        kinds = {life.entries()[-1].command.kind}
        if kinds <= {"rename", "merge", "freeze", "note", "unfreeze"}:
            assert placed(life) == n


@pytest.mark.parametrize("seed", range(2))
def test_any_commands_in_any_order_leave_it_whole(
    taught: MotionLearner, later: FloatArray, seed: int
) -> None:
    rng = np.random.default_rng(seed)
    life = life_of(taught)
    for at in range(0, len(later), 120):
        life.learn_many(later[at : at + 120])
        for _ in range(3):
            act_at_random(life, rng)
    twin = resumed(life)
    for each in (life, twin):
        each.learn_many(later, np.arange(len(later)) / 100)
    assert life.state() == twin.state()
    for entry in reversed(life.entries()):  # all can be undone
        if not entry.undone and entry.command.kind not in ("undo", "redo"):
            kept = life._journal.kept(entry.number)
            assert kept is not None
            if kept.effect is not None:
                life.undo(number=entry.number)
    resumed(life)


def test_later_commands_that_build_on_one_are_undone_first(taught: MotionLearner) -> None:
    life = life_of(taught)
    life.execute(Merge(1, 2))
    life.execute(Rename(3, "turn"))
    life.execute(Split(1))
    with pytest.raises(InvalidValueError, match="command 1 cannot be undone before"):
        life.undo(number=1)
    life.undo(number=3)
    life.undo(number=1)
    assert life.learner.tree.leaves == (1, 2, 3, 4)
    assert life.snapshot()["turn"].id == 3
    with pytest.raises(InvalidValueError, match="command 1 is undone already"):
        life.undo(number=1)
    with pytest.raises(InvalidValueError, match="those that can be are"):
        life.undo(number=77)
    life.redo(number=1)
    assert life.learner.tree.leaves == (1, 3, 4)


def test_the_last_hundred_can_be_undone(taught: MotionLearner) -> None:
    life = life_of(taught)
    for k in range(130):
        life.execute(Rename(1, f"name {k}"))
    with pytest.raises(InvalidValueError, match="command 30 cannot be undone"):
        life.undo(number=30)
    for _ in range(100):
        life.undo()
    assert life.snapshot()[1].name == "name 29"
    with pytest.raises(InvalidValueError, match="no command that can be undone"):
        life.undo()
    for _ in range(100):
        life.redo()
    assert life.snapshot()[1].name == "name 129"


def test_a_hundred_commands_of_every_kind_are_undone_to_the_bit_and_done_again(
    taught: MotionLearner,
) -> None:
    life, rng = life_of(taught), np.random.default_rng(0)

    def known() -> tuple[object, ...]:
        learner = life.learner
        labels = dict(life.labels.names), dict(life.labels.notes)
        frozen = {each.id for each in learner.tree.nodes if each.frozen}
        graph, seen = learner.graph.state(), learner.chain.state().segments
        return life.snapshot().version, graph, seen, labels, frozen, learner.paused

    moments = [known()]
    while len(moments) <= 100:
        leaves = life.learner.tree.leaves
        one, two = (int(id) for id in rng.choice(leaves, 2))
        name = f"name {len(moments)}"
        cold = life.learner.tree.node(one).frozen
        kinds = [Rename(one, name), Merge(one, two), Split(one), Delete(one)]
        kinds += [Unfreeze(one) if cold else Freeze(one), Note(name, one)]
        kinds += [Resume() if life.learner.paused else Pause()]
        kind = rng.choice(len(kinds), p=[0.2, 0.15, 0.23, 0.02, 0.2, 0.1, 0.1])
        try:
            life.execute(kinds[kind])
        except MPLearnError:  # frozen, or too few to be split, or merged with itself
            continue
        moments.append(known())
    said = {entry.command.kind for entry in life.entries()}
    assert {"merge", "split", "delete", "freeze", "rename", "note"} <= said
    for moment in reversed(moments[:-1]):
        life.undo()
        assert known() == moment
    for moment in moments[1:]:
        life.redo()
        assert known() == moment


def test_names_follow_what_becomes_of_primitives(taught: MotionLearner) -> None:
    life = life_of(taught)
    life.execute(Rename(2, "wave"))
    life.execute(Merge(1, 2))  # the older one has no name
    assert life.snapshot()[1].name == "wave"
    life.undo()
    assert life.snapshot().names[:2] == ("P1", "wave")
    life.execute(Delete(2))
    life.execute(Rename(1, "wave"))
    life.undo(number=4)
    assert life.snapshot().names[:2] == ("wave", "wave (2)")
    for bad in ("", " ", "a\nb", "P4", "wave (2)", "\x1b[2J"):
        with pytest.raises(InvalidValueError, match="name"):
            life.execute(Rename(3, bad))
    with pytest.raises(UnknownPrimitiveError, match=r"no primitive 9; known are \[1, 2, 3, 4\]"):
        life.execute(Rename(9, "x"))


def test_a_primitive_that_has_a_name_is_no_chance(taught: MotionLearner) -> None:
    life = life_of(taught)
    nodes = life.learner.tree.node
    assert not nodes(2).by_hand
    life.execute(Rename(2, "raise"))
    assert nodes(2).by_hand and not nodes(1).by_hand
    life.execute(Freeze(2))
    life.undo(number=1)  # who is about the name only is undone whenever
    assert life.snapshot()[2].name == "P2" and nodes(2).frozen
    resumed(life)


def test_the_history_of_a_primitive(taught: MotionLearner, motions: Recording) -> None:
    life = LifelongLearner(MotionLearner(LearnerConfig(motions.channels, motions.rate_hz)))
    life.learn_many(motions.frames, 1e9 + np.arange(len(motions.frames)) / motions.rate_hz)
    life.execute(Rename(2, "raise"), by="Anna")
    born, confirmed, *_, named = life.history(2)
    assert (born.what, confirmed.what, named.what) == ("born", "confirmed", "command")
    assert 1e9 < born.when < confirmed.when < 1e9 + len(motions.frames) / motions.rate_hz
    assert abs(born.when - 1e9 - born.frame / motions.rate_hz) < 1e-6
    assert life.entries()[named.entry - 1].by == "Anna"
    revision = life.revision
    assert life.snapshot() is life.snapshot()
    life.learn_many(np.repeat(motions.frames[-1:], 10, axis=0))
    assert life.revision == revision


def test_a_snapshot_can_be_prepared_a_primitive_at_a_time(
    taught: MotionLearner, later: FloatArray, monkeypatch: pytest.MonkeyPatch
) -> None:
    """What is left to do is little then, and what comes out is the same."""
    made = [0]
    from_exemplars = Primitive.from_exemplars

    def counted(*args: Any, **kwargs: Any) -> Primitive:
        made[0] += 1
        return from_exemplars(*args, **kwargs)

    monkeypatch.setattr(Primitive, "from_exemplars", counted)
    life, other = life_of(taught), life_of(taught)
    for part in (later[:1], later[1:]):
        for each in (life, other):
            each.learn_many(part)
        at_once = other.snapshot()
        while True:
            before = made[0]
            ready = life.prepare_snapshot()
            assert made[0] - before == (0 if ready else 1)
            if ready:
                break
        before = made[0]
        assert life.snapshot().version == at_once.version
        assert made[0] == before
        assert life.prepare_snapshot()
