"""States as plain values, bytes and files, and back: nothing is lost, what is wrong is named."""

import json
from dataclasses import dataclass, field, fields, replace
from typing import Annotated, Literal, NamedTuple

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from mplearn.errors import InvalidValueError, LibraryError, MPLearnError, StateError
from mplearn.learner import LearnerConfig
from mplearn.recording import FloatArray, IntArray
from mplearn.state import (
    Array,
    Blob,
    Count,
    FileFormat,
    Range,
    SharedState,
    State,
    checkpoint,
    from_plain,
    require,
    resumed,
    to_bytes,
    to_plain,
    validated,
)
from mplearn.tree import NormalisationConfig, TreeConfig


class Pair(NamedTuple):
    id: int
    parent: int | None


@dataclass(frozen=True, eq=False)
class Part(SharedState):
    numbers: Annotated[IntArray, Array("n", low=0)]
    frames: tuple[Annotated[Blob, Array(None, "d", nan=True)], ...]
    matrix: Annotated[FloatArray, Array("n", "n", low=0.0)]

    def check(self) -> None:
        require(len(self.frames) == len(self.numbers), "frames", "must be as many")


@dataclass(frozen=True, eq=False)
class Whole(State):
    n_seen: Count
    share: Annotated[float, Range(0.0, 1.0)]
    limit: float
    kind: Literal["one", "other"]
    clock: float | None
    fresh: bool
    name: str
    pairs: tuple[Pair, ...]
    history: tuple[tuple[str, Count], ...]
    parts: tuple[Part, ...]
    form: NormalisationConfig = field(default_factory=NormalisationConfig)


def part(seed, n=3, d=2):
    rng = np.random.default_rng(seed)
    frames = tuple(Blob(rng.normal(size=(5 + k, d))) for k in range(n))
    return Part(np.arange(n), frames, np.abs(rng.normal(size=(n, n))))


MANY = tuple(part(k, 1) for k in range(40))


def whole(seed=0, **changes):
    parts = (part(seed), part(seed + 1, 2))
    values = Whole(3, 0.5, np.inf, "one", None, True, "ä", (Pair(1, None),), (("a", 1),), parts)
    return replace(values, **changes)


@given(st.integers(0, 50), st.floats(0, 1), st.text(st.characters(exclude_categories=["Cs"])))
def test_a_state_survives_plain_values_checkpoints_and_files(seed, share, name):
    state = whole(seed, share=share, name=name)
    assert from_plain(Whole, to_plain(state)) == state
    kept = checkpoint(state)
    assert resumed(Whole, kept.document, kept.new.__getitem__) == state
    assert state != whole(seed, share=share, name=name + "x")
    assert state != whole(seed + 1, share=share, name=name)


def test_a_file_is_a_state(tmp_path):
    kind = FileFormat("test", "test", LibraryError)
    kind.write(tmp_path / "a", to_plain(whole()))
    assert from_plain(Whole, kind.read(tmp_path / "a")) == whole()


def test_a_checkpoint_writes_only_what_is_new():
    state = whole()
    first = checkpoint(state)
    assert set(first.new) == set(first.parts)
    assert len(first.parts) == 2 + 3 + 2  # parts, and the frames of each
    assert not checkpoint(state, first.parts).new
    frames = Blob(np.ones((4, 2)))
    changed = replace(state.parts[0], frames=(*state.parts[0].frames[1:], frames))
    second = checkpoint(replace(state, n_seen=4, parts=(changed, state.parts[1])), first.parts)
    assert len(second.new) == 2  # the part that changed, and its new frames
    everything = dict(first.new) | second.new
    back = resumed(Whole, second.document, everything.__getitem__)
    assert (back.n_seen, back.parts[0]) == (4, changed)


@pytest.mark.parametrize("n", [31, 32, 33, 400])
def test_a_long_row_of_parts_costs_what_changes_in_it(n):
    row = tuple(part(k, 1) for k in range(n))
    first = checkpoint(whole(parts=row))
    kept = dict(first.new)
    assert resumed(Whole, first.document, kept.__getitem__) == whole(parts=row)
    if n == 400:  # it names rows
        assert len(first.document) - len(checkpoint(whole(parts=row[:1])).document) < 32 * 40
    other = part(n, 1)
    for now, n_new in (
        ((*row[:7], other, *row[8:]), 2),
        ((*row, other), 2),
        ((other, *row), 2),
        (row[:3] + row[4:], 0),
    ):
        later = checkpoint(whole(parts=now), first.parts)
        rows = [key for key in later.new if b"$rows" in later.new[key]]
        assert len(later.new) - len(rows) == n_new and len(rows) <= 2
        held = {key: (kept | later.new)[key] for key in later.parts}  # no other part is needed
        asked: list[str] = []
        back = resumed(
            Whole,
            later.document,
            lambda key, held=held, asked=asked: asked.append(key) or held[key],
        )
        assert back == whole(parts=now) and set(asked) == set(later.parts)


@pytest.mark.parametrize("n", [2, 40])
def test_what_was_lost_of_a_part_that_is_kept_is_written_again(n):
    """As where parts were being deleted when the process ended, and an undo brings them back."""
    state = whole(parts=tuple(part(k, 2) for k in range(n)))
    first = checkpoint(state)
    for gone in range(0, len(first.parts), 7):
        key = first.parts[gone]
        assert set(checkpoint(state, set(first.parts) - {key}).new) == {key}


def test_equal_content_has_one_key_whoever_made_it():
    assert checkpoint(whole(3)).document == checkpoint(whole(3)).document
    assert checkpoint(whole(3)).parts != checkpoint(whole(4)).parts


@pytest.mark.parametrize("named", [3, None, ["a"], {"a": 1}, "none", "none none"])
def test_a_row_that_names_no_parts_is_named(named):
    document = to_bytes({"$whole 5": to_plain(whole(), whole=True) | {"parts": {"$rows": named}}})
    with pytest.raises(StateError, match=r"^parts: "):
        resumed(Whole, document, {}.__getitem__)


def test_parts_that_are_lost_or_damaged_are_named():
    kept = checkpoint(whole())
    key = kept.parts[0]
    lost = {name: data for name, data in kept.new.items() if name != key}
    with pytest.raises(StateError, match=f"{key} is missing"):
        resumed(Whole, kept.document, lost.__getitem__)
    flipped = bytearray(kept.new[key])
    flipped[-1] ^= 1
    with pytest.raises(StateError, match=f"{key} is damaged"):
        resumed(Whole, kept.document, (lost | {key: bytes(flipped)}).__getitem__)


@pytest.mark.parametrize(
    ("changes", "place", "said"),
    [
        ({"n_seen": -1}, "n_seen", "not -1"),
        ({"n_seen": 1.0}, "n_seen", "whole number"),
        ({"n_seen": True}, "n_seen", "whole number"),
        ({"n_seen": None}, "n_seen", "None"),
        ({"share": 1e300}, "share", "1e+300"),
        ({"share": float("nan")}, "share", "nan"),
        ({"limit": 1e300}, "limit", "1e+300"),
        ({"kind": "third"}, "kind", "one"),
        ({"clock": "now"}, "clock", "now"),
        ({"fresh": 1}, "fresh", "true or false"),
        ({"name": "\ud800"}, "name", "Unicode"),
        ({"pairs": [[1]]}, "pairs[0]", "list of 2"),
        ({"pairs": [[1, "x"]]}, "pairs[0].parent", "'x'"),
        ({"pairs": 7}, "pairs", "list"),
        ({"history": [["a", -1]]}, "history[0][1]", "-1"),
        ({"parts": [None]}, "parts[0]", "dictionary"),
        ({"strange": 1}, "", "strange"),
        ({"form": {"head": 2.0}}, "form", "head"),
        ({"form": {"tail": 2.0}}, "form", "tail"),
    ],
)
def test_what_is_wrong_is_named_with_its_place(changes, place, said):
    with pytest.raises(StateError) as caught:
        from_plain(Whole, to_plain(whole()) | changes)
    assert caught.value.place == place
    assert said in str(caught.value)
    assert isinstance(caught.value, MPLearnError)


def test_a_field_that_is_newer_than_a_file_takes_its_default():
    older = to_plain(whole())
    del older["form"]
    assert from_plain(Whole, older) == whole()
    del older["n_seen"]
    with pytest.raises(StateError, match="n_seen: is missing"):
        from_plain(Whole, older)


def bad_part(**changes):
    return to_plain(whole()) | {"parts": [to_plain(part(0)), to_plain(part(1)) | changes]}


@pytest.mark.parametrize(
    ("changes", "place"),
    [
        ({"matrix": np.zeros((3, 2))}, "parts[1].matrix"),
        ({"matrix": np.full((3, 3), np.nan)}, "parts[1].matrix"),
        ({"matrix": np.full((3, 3), -1.0)}, "parts[1].matrix"),
        ({"matrix": np.full((3, 3), 1e300)}, "parts[1].matrix"),
        ({"matrix": np.zeros((3, 3), np.float32)}, "parts[1].matrix"),
        ({"matrix": [[0.0]]}, "parts[1].matrix"),
        ({"numbers": np.arange(3.0)}, "parts[1].numbers"),
        ({"frames": [np.zeros((2, 2)), np.zeros((2, 3)), np.zeros((2, 2))]}, "parts[1].frames[1]"),
        ({"frames": [np.zeros((2, 2))]}, "parts[1].frames"),
        ({"frames": [np.full((2, 2), np.inf)] * 3}, "parts[1].frames[0]"),
    ],
)
def test_arrays_are_checked(changes, place):
    with pytest.raises(StateError) as caught:
        from_plain(Whole, bad_part(**changes))
    assert caught.value.place == place


def test_typed_states_are_checked_as_well_and_shared_parts_stay_the_same_objects():
    state = whole()
    assert validated(state).parts[0] is state.parts[0]
    with pytest.raises(StateError, match=r"parts\[0\].matrix"):
        validated(replace(state, parts=(replace(part(0), matrix=np.zeros((2, 2))),)))


@settings(max_examples=200, deadline=None)
@given(data=st.data(), parts=st.sampled_from([(), MANY]))
def test_damaged_checkpoints_never_end_in_a_raw_error(data, parts):
    kept = checkpoint(whole(parts=parts) if parts else whole())
    parts = dict(kept.new) | {"": kept.document}
    name = data.draw(st.sampled_from(sorted(parts)))
    damaged = bytearray(parts[name])
    for _ in range(data.draw(st.integers(1, 3))):
        damaged[data.draw(st.integers(0, len(damaged) - 1))] ^= data.draw(st.integers(1, 255))
    parts[name] = bytes(damaged)
    try:
        back = resumed(Whole, parts[""], parts.__getitem__)
    except StateError:
        return
    assert validated(back) == back


def test_older_files_are_brought_up_to_date(tmp_path):
    old = FileFormat("test", "test", LibraryError, schema=1)
    old.write(tmp_path / "a", {"seen": 3, "form": {}})

    def renamed(content):
        return {"n_seen": content.pop("seen")} | content

    def wider(content):
        return content | {"width": 2}

    new = FileFormat("test", "test", LibraryError, schema=3, migrations={1: renamed, 2: wider})
    assert new.read(tmp_path / "a") == {"n_seen": 3, "form": {}, "width": 2}
    new.write(tmp_path / "b", {"n_seen": 3})
    assert new.read(tmp_path / "b") == {"n_seen": 3}
    with pytest.raises(LibraryError, match="newer mplearn"):
        old.read(tmp_path / "b")
    with pytest.raises(LibraryError, match="up to date"):
        replace(new, migrations={1: lambda content: content["gone"]}).read(tmp_path / "a")


def test_configurations_are_read_by_the_same_rules():
    config = LearnerConfig(("a", "b"), 50.0, tree=replace(TreeConfig.printed(), n_states=4))
    assert LearnerConfig.from_dict(config.to_dict()) == config
    assert LearnerConfig.from_dict({"channels": ["a"]}) == LearnerConfig(("a",))
    for wrong, place in (
        ({"chanels": ["a"]}, ""),
        ({"channels": [3]}, "channels[0]"),
        ({"channels": ["a"], "tree": {"form": {"n_points": "8"}}}, "tree.form.n_points"),
        ({"channels": ["a"], "tree": {"reech": 2.0}}, "tree"),
        ({"channels": ["a"], "rate_hz": 5000.0}, ""),
    ):
        with pytest.raises(InvalidValueError) as caught:
            LearnerConfig.from_dict(wrong)
        assert caught.value.place == place


def test_a_field_with_a_new_name_keeps_the_old_one_in_files():
    config = TreeConfig(normalisation=NormalisationConfig(head=0.1))
    plain = to_plain(config)
    assert "normalisation" not in plain and plain["form"]["head"] == 0.1
    assert from_plain(TreeConfig, plain) == config
    plain["normalisation"] = plain.pop("form")
    assert from_plain(TreeConfig, plain) == config
    plain["normalisation"]["head"] = "0.1"
    with pytest.raises(StateError) as caught:
        from_plain(TreeConfig, plain)
    assert caught.value.place == "normalisation.head"
    with pytest.raises(StateError, match="'normalisation' twice, also as 'form'"):
        from_plain(TreeConfig, plain | {"form": {}})


@pytest.mark.parametrize("tree", [{}, {"normalisation": {"head": 0.1}}, {"form": {"head": 0.1}}])
def test_settings_that_are_not_named_take_their_default_at_any_depth(tree):
    config = LearnerConfig.from_dict({"channels": ["a"], "tree": tree})
    head = 0.1 if tree else NormalisationConfig().head
    assert config.tree == TreeConfig(normalisation=NormalisationConfig(head=head))
    assert config.scaffolding == LearnerConfig(("a",)).scaffolding


def test_all_settings_survive_a_way_through_json():
    config = LearnerConfig(("a",), tree=TreeConfig.printed(), scaffolding=False)
    assert LearnerConfig.from_dict(json.loads(json.dumps(config.to_dict()))) == config
    for name in ("scaffolding", "tree", "people"):
        assert name in config.to_dict()
    assert set(config.to_dict()["tree"]) == {each.name for each in fields(TreeConfig)}


@pytest.mark.parametrize("value", [0, 1, 2, "on", None, 1.0])
def test_a_setting_of_several_kinds_takes_what_is_named_and_nothing_equal_to_it(value):
    with pytest.raises(StateError) as caught:
        LearnerConfig.from_dict({"channels": ["a"], "scaffolding": value})
    assert caught.value.place == "scaffolding"
