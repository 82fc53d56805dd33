"""A damaged state is refused with the place of the damage, or is the same all the same.

``python tests/state/test_damage.py 1500 7`` tries so many damages of learners, libraries and lives,
drawn with seed 7, and says what became of them.
"""

import hashlib
import math
import sys
import warnings
from collections import Counter
from dataclasses import fields, is_dataclass, replace
from typing import get_args, get_type_hints

import numpy as np
import pytest
from damage import damaged, same

from mplearn import LearnerConfig, MotionLearner, PrimitiveLibrary
from mplearn.demonstrator import Person, demonstrate
from mplearn.errors import LibraryError, StateError
from mplearn.evaluation.observing import observe
from mplearn.evaluation.streams import join_people
from mplearn.learner import LearnerState
from mplearn.learner.learner_state import FILES as LEARNER_FILES
from mplearn.library.content import FILES, LibraryState
from mplearn.state import checkpoint, from_bytes, from_plain, resumed, to_bytes, to_plain
from mplearn.state.checkpoint import _WHOLE
from mplearn.store import Freeze, LifelongLearner, Merge, Note, Rename
from mplearn.store.life_state import LifeState
from mplearn.tree import TreeConfig


def one_person() -> MotionLearner:
    """A learner of features, in the middle of a motion."""
    features = observe(demonstrate(("BAR", "BAL", "SQD", "SQR") * 6, seed=1).recording)
    learner = MotionLearner(LearnerConfig(features.channels, features.rate_hz))
    learner.learn_many(features.frames[:-100])
    return learner


def two_people() -> MotionLearner:
    """A learner of the markers of two people, in the middle of a motion."""
    people = (Person("small", 1.58), Person("tall", 1.84))
    script = ("BAR", "BAL") * 5
    takes = [demonstrate(script, seed=k, person=each).recording for k, each in enumerate(people)]
    stream = join_people(takes, np.random.default_rng(0), interleaved=True)
    learner = MotionLearner(LearnerConfig(stream.channels, stream.rate_hz))
    learner.learn_many(stream.frames[: int(0.93 * len(stream.frames))])
    return learner


def a_life() -> LifelongLearner:
    """A lifelong learner that did what people asked, and took one of it back."""
    life = LifelongLearner(one_person())
    first, second, third = life.learner.tree.leaves[:3]
    for command in (
        Rename(first, "bow"),
        Note("slow", second),
        Merge(second, third),
        Freeze(first),
    ):
        life.execute(command)
    life.undo()
    life.undo()
    return life


def tried(plain, load, save, n, seed):
    """Count what became of damages; return those that were taken for something else."""
    counts, silent = Counter(), []
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        for k in range(n):
            wrong, what = damaged(plain, np.random.default_rng((seed, k)))
            try:
                found = load(wrong)
            except StateError as error:
                assert error.place or "." not in what.place, (what, str(error))
                counts["refused"] += 1
            except LibraryError as error:
                assert "does not describe a library" in str(error), (what, str(error))
                counts["refused"] += 1
            else:
                equal = same(save(found), plain)
                counts["the same" if equal else "silent"] += 1
                silent += [] if equal else [what]
    return counts, silent


def tried_learner(learner, n, seed=0):
    return tried(
        to_plain(learner.state(), whole=True),
        lambda plain: MotionLearner.from_state(from_plain(LearnerState, plain, whole=True)),
        lambda found: to_plain(found.state(), whole=True),
        n,
        seed,
    )


def tried_checkpoint(life, n, seed=0):
    part = checkpoint(life.state()).new.__getitem__
    mark, plain = document_of(life.state())
    return tried(
        plain,
        lambda wrong: LifelongLearner.from_state(resumed(LifeState, to_bytes({mark: wrong}), part)),
        lambda found: document_of(found.state())[1],
        n,
        seed,
    )


def document_of(state):
    """Return what says that a checkpoint's document is whole, and what it holds."""
    ((mark, content),) = from_bytes(checkpoint(state).document).items()
    return mark, content


def tried_library(library, n, seed=0):
    return tried(
        to_content(library),
        lambda wrong: PrimitiveLibrary.from_state(from_plain(LibraryState, wrong, whole=True)),
        to_content,
        n,
        seed,
    )


@pytest.fixture(scope="module", params=[one_person, two_people])
def learner(request):
    return request.param()


def test_a_damaged_learner_is_refused_or_the_same(learner):
    counts, silent = tried_learner(learner, 400)
    assert not silent
    assert counts["refused"] > 360


def test_a_damaged_checkpoint_is_refused_or_the_same(life):
    counts, silent = tried_checkpoint(life, 300)
    assert not silent
    assert counts["refused"] > 260


def before_trees_knew_what_follows(content):
    """Take out of a whole learner what is in none that was kept before (`TreeState.follows`)."""
    for each in content["tree"]["trees"]:
        assert len(each["tree"].pop("follows"))


def test_what_was_whole_before_there_was_a_field_opens_without_it(life, learner, tmp_path):
    state = life.state()
    part = checkpoint(state).new.__getitem__
    mark, content = document_of(state)
    before_trees_knew_what_follows(content["learner"])
    with pytest.raises(StateError, match=r"tree\.follows: is missing"):
        resumed(LifeState, to_bytes({mark: content}), part)
    opened = LifelongLearner.from_state(resumed(LifeState, to_bytes({"$whole": content}), part))
    again = document_of(opened.state())[1]
    assert not any(len(each["tree"].pop("follows")) for each in again["learner"]["tree"]["trees"])
    assert same(again, content)
    plain = to_plain(learner.state(), whole=True)
    before_trees_knew_what_follows(plain)
    replace(LEARNER_FILES, schema=3, migrations={}).write(tmp_path / "old.mplearner", plain)
    loaded = MotionLearner.load(tmp_path / "old.mplearner")
    assert loaded.snapshot().version == learner.snapshot().version


def test_what_was_whole_before_births_were_bounded_goes_on_without_a_bound(life, learner, tmp_path):
    state = life.state()
    part = checkpoint(state).new.__getitem__
    mark, content = document_of(state)
    assert content["learner"]["config"]["tree"].pop("max_born") == 2
    with pytest.raises(StateError, match=r"tree\.max_born: is missing"):
        resumed(LifeState, to_bytes({mark: content}), part)
    opened = resumed(LifeState, to_bytes({"$whole 2": content}), part)
    assert opened.learner.config.tree.max_born == math.inf
    plain = to_plain(learner.state(), whole=True)
    assert plain["config"]["tree"].pop("max_born") == 2
    replace(LEARNER_FILES, schema=4, migrations={}).write(tmp_path / "old.mplearner", plain)
    assert MotionLearner.load(tmp_path / "old.mplearner").config.tree.max_born == math.inf
    config = LearnerConfig(("elbow",), tree=replace(TreeConfig(), max_born=math.inf))
    then = MotionLearner(config)
    then.learn_many(np.sin(np.arange(1200) / 30.0)[:, None])
    plain = to_plain(then.snapshot().state(), whole=True)
    assert plain["recogniser"]["config"].pop("max_born") == math.inf
    replace(FILES, schema=3, migrations={}).write(tmp_path / "old.mplearn", plain)
    assert PrimitiveLibrary.load(tmp_path / "old.mplearn").version == then.snapshot().version


def test_what_was_whole_before_primitives_were_formed_in_turn_has_nothing_to_form(life, tmp_path):
    state = life.state()
    part = checkpoint(state).new.__getitem__
    mark, content = document_of(state)
    inner = content["learner"]
    trees = [each["tree"] for each in inner["tree"]["trees"]]
    assert inner.pop("closing") is None
    assert [each.pop("to_form") for each in trees] == [0] * len(trees)
    with pytest.raises(StateError, match=r"to_form: is missing|closing: is missing"):
        resumed(LifeState, to_bytes({mark: content}), part)
    assert resumed(LifeState, to_bytes({"$whole 3": content}), part) == state
    plain = to_plain(state.learner, whole=True)
    for each in (plain, *(each["tree"] for each in plain["tree"]["trees"])):
        each.pop("closing", None), each.pop("to_form", None)
    replace(LEARNER_FILES, schema=5, migrations={}).write(tmp_path / "old.mplearner", plain)
    assert MotionLearner.load(tmp_path / "old.mplearner").state() == state.learner


def test_what_was_whole_before_parts_were_dropped_drops_none(life, learner, tmp_path):
    state = life.state()
    part = checkpoint(state).new.__getitem__
    mark, content = document_of(state)
    assert content["learner"]["config"]["tree"].pop("drop_fragments")
    with pytest.raises(StateError, match=r"tree\.drop_fragments: is missing"):
        resumed(LifeState, to_bytes({mark: content}), part)
    opened = resumed(LifeState, to_bytes({"$whole 4": content}), part)
    assert not opened.learner.config.tree.drop_fragments
    plain = to_plain(learner.state(), whole=True)
    assert plain["config"]["tree"].pop("drop_fragments")
    replace(LEARNER_FILES, schema=6, migrations={}).write(tmp_path / "old.mplearner", plain)
    assert not MotionLearner.load(tmp_path / "old.mplearner").config.tree.drop_fragments
    rules = replace(TreeConfig(), drop_fragments=False)
    then = MotionLearner(LearnerConfig(("elbow",), tree=rules))
    then.learn_many(np.sin(np.arange(1200) / 30.0)[:, None])
    plain = to_plain(then.snapshot().state(), whole=True)
    assert plain["recogniser"]["config"].pop("drop_fragments") is False
    replace(FILES, schema=4, migrations={}).write(tmp_path / "old.mplearn", plain)
    assert PrimitiveLibrary.load(tmp_path / "old.mplearn").version == then.snapshot().version


def fields_below(kind, found):
    """Note the fields of a type, and of all that it can hold."""
    names = [each.name for each in fields(kind)] if is_dataclass(kind) else []
    names += getattr(kind, "_fields", ())
    if names and kind.__name__ not in found:
        found[kind.__name__] = sorted(names)
        for each in get_type_hints(kind).values():
            fields_below(each, found)
    for each in get_args(kind):
        fields_below(each, found)
    return found


@pytest.mark.parametrize(
    ("kind", "version", "known"),
    [
        (LearnerState, LEARNER_FILES.schema, (7, "3eb3a54fe3bc")),
        (LibraryState, FILES.schema, (5, "7714125999c2")),
        (LifeState, _WHOLE, ("$whole 5", "faa178397182")),
    ],
)
def test_who_adds_a_field_says_how_what_was_kept_without_it_opens(kind, version, known):
    """With other fields the version is another, and a migration, or a mark of then, knows this."""
    text = repr(sorted(fields_below(kind, {}).items()))
    assert (version, hashlib.sha256(text.encode()).hexdigest()[:12]) == known


def test_an_older_document_may_leave_out_what_is_newer(life):
    state = life.state()
    part = checkpoint(state).new.__getitem__
    mark, content = document_of(state)
    del content["learner"]["config"]["scaffolding"]
    with pytest.raises(StateError, match=r"learner\.config\.scaffolding: is missing"):
        resumed(LifeState, to_bytes({mark: content}), part)
    older = resumed(LifeState, to_bytes(content), part)
    config = replace(state.learner.config, scaffolding=False)
    assert older == replace(state, learner=replace(state.learner, config=config))


def test_what_a_learner_holds_is_refused_where_it_is_damaged(learner):
    state = learner.state()
    first = state.tree.trees[0].tree
    wrong = replace(first.nodes[2], matrix=first.nodes[2].matrix[:-1])
    nodes = (*first.nodes[:2], wrong, *first.nodes[3:])
    person = replace(state.tree.trees[0], tree=replace(first, nodes=nodes))
    trees = (person, *state.tree.trees[1:])
    with pytest.raises(StateError) as caught:
        MotionLearner.from_state(replace(state, tree=replace(state.tree, trees=trees)))
    assert caught.value.place == "tree.trees[0].tree.nodes[2].matrix"


def test_a_learner_goes_on_from_a_file_bit_for_bit(learner, tmp_path):
    path = learner.save(tmp_path / "half.learner")
    again = MotionLearner.load(path)
    assert again.state() == learner.state()
    assert again.snapshot().version == learner.snapshot().version
    frames = np.resize(np.asarray(learner.state().absurd.last), (1, len(learner.config.channels)))
    frames = np.nan_to_num(frames)
    assert again.learn_many(frames) == MotionLearner.load(path).learn_many(frames)
    damaged_file = bytearray(path.read_bytes())
    damaged_file[len(damaged_file) // 2] ^= 1
    path.write_bytes(bytes(damaged_file))
    with pytest.raises(StateError, match=r"half\.learner"):
        MotionLearner.load(path)
    with pytest.raises(StateError, match="not an mplearn learner"):
        MotionLearner.load(learner.snapshot().save(tmp_path / "a.mplearn"))


@pytest.fixture(scope="module")
def life():
    return a_life()


@pytest.fixture(scope="module")
def library():
    return two_people().snapshot()


def test_a_damaged_library_is_refused_or_the_same(library):
    counts, silent = tried_library(library, 400)
    assert not silent
    assert counts["refused"] > 360


def to_content(library):
    return to_plain(library.state(), whole=True)


def changed(library, **changes):
    return to_content(library) | changes


@pytest.mark.parametrize(
    ("place", "change"),
    [
        ("channels[0]", lambda content: content["channels"].__setitem__(0, 7)),
        ("primitives[0]", lambda content: content["primitives"][0].update(mean_duration_s=1e300)),
        ("primitives[0]", lambda content: content["primitives"][0].update(mean_duration_s=9e4)),
        ("primitives[0].name", lambda content: content["primitives"][0].update(name="\ud800")),
        (
            "tree[1].parent",
            lambda content: content["tree"][1].__setitem__(1, content["tree"][1][0]),
        ),
        ("rate_hz", lambda content: content.update(rate_hz=float("nan"))),
        ("graph.ids", lambda content: content["graph"].update(ids=np.array([1, 1]))),
    ],
)
def test_what_used_to_get_past_the_reader(library, tmp_path, place, change):
    content = to_content(library)
    change(content)
    if place == "primitives[0].name":  # no file can hold it
        with pytest.raises(StateError, match="name"):
            from_plain(LibraryState, content)
        return
    FILES.write(tmp_path / "wrong.mplearn", content)
    with pytest.raises(LibraryError) as caught:
        PrimitiveLibrary.load(tmp_path / "wrong.mplearn")
    assert place in str(caught.value)


if __name__ == "__main__":
    n, seed = int(sys.argv[1]), int(sys.argv[2])
    for name, (found, taken) in {
        "one person": tried_learner(one_person(), n, seed),
        "two people": tried_learner(two_people(), n, seed),
        "library": tried_library(two_people().snapshot(), n, seed),
        "checkpoint": tried_checkpoint(a_life(), n, seed),
    }.items():
        print(f"{name}: {dict(found)} {taken}")
