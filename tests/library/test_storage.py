import json
import zipfile
from functools import cache

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp
from library_examples import CHANNELS, RATE, demonstrations, example_library

from mplearn import writing
from mplearn.errors import LibraryError, StoreError
from mplearn.graph import TransitionGraph
from mplearn.hmm import fit
from mplearn.library import Primitive, PrimitiveLibrary
from mplearn.library.content import FILES
from mplearn.state import files
from mplearn.tree import PrimitiveTree, TreeConfig


@cache
def named_library():
    return example_library().rename(0, "Bögen: hoch")


@pytest.fixture(scope="module")
def saved(tmp_path_factory):
    return named_library().save(tmp_path_factory.mktemp("library") / "a.mplearn")


def test_what_is_loaded_is_what_was_saved(saved):
    loaded = PrimitiveLibrary.load(saved)
    assert loaded.version == named_library().version
    assert (loaded.channels, loaded.rate_hz, loaded.body, loaded.tree) == (
        named_library().channels,
        named_library().rate_hz,
        named_library().body,
        named_library().tree,
    )
    for one, other in zip(loaded.primitives, named_library().primitives, strict=True):
        assert (one.id, one.name, one.parent) == (other.id, other.name, other.parent)
        for name in ("means", "variances", "log_stay"):
            np.testing.assert_array_equal(getattr(one.hmm, name), getattr(other.hmm, name))
        for a, b in zip(one.exemplars, other.exemplars, strict=True):
            np.testing.assert_array_equal(a, b)
        np.testing.assert_array_equal(one.dynamics.means, other.dynamics.means)
    assert loaded.graph.state() == named_library().graph.state()
    walk = named_library().walk(None, 5, np.random.default_rng(0))
    for style in ("deterministic", "smooth", "nearest"):
        np.testing.assert_array_equal(
            loaded.generate(walk, style=style).frames,
            named_library().generate(walk, style=style).frames,
        )


def test_a_recogniser_decides_the_same_after_loading(tmp_path):
    tree = PrimitiveTree(TreeConfig(cutoff=0.7), len(CHANNELS), RATE)
    pairs = ((0, 1), (1, 2), (2, 3), (3, 0))
    motions = [list(demonstrations(*pair, seed=k, n=9)) for k, pair in enumerate(pairs)]
    for turn in zip(*motions, strict=True):
        for frames in turn:
            tree.insert(frames)
    recogniser = tree.recogniser()
    assert recogniser.primitives
    primitives = [
        Primitive.from_exemplars(id, fit(motions[0], 8), motions[0], RATE)
        for id in recogniser.primitives
    ]
    library = PrimitiveLibrary(
        tuple(primitives), TransitionGraph(), CHANNELS, RATE, recogniser=recogniser
    )
    loaded = PrimitiveLibrary.load(library.save(tmp_path / "r.mplearn"))
    assert loaded.version == library.version
    for k, pair in enumerate(pairs):
        unseen = next(demonstrations(*pair, seed=100 + k))
        assert loaded.recognise(unseen) == library.recognise(unseen)
    assert loaded.recognise(unseen).primitive in loaded


def test_equal_libraries_are_equal_files(saved, tmp_path):
    other = PrimitiveLibrary.load(saved).save(tmp_path / "b.mplearn")
    assert other.read_bytes() == saved.read_bytes()


def test_saving_is_all_or_nothing(saved, tmp_path, monkeypatch):
    target = tmp_path / "kept.mplearn"
    target.write_bytes(b"precious")

    def fails(*_):
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(writing.os, "fsync", fails)
    with pytest.raises(LibraryError, match="No space left"):
        named_library().save(target)
    assert target.read_bytes() == b"precious"
    assert [path.name for path in tmp_path.iterdir()] == ["kept.mplearn"]
    with pytest.raises(LibraryError, match="cannot write"):
        named_library().save(tmp_path / "nowhere" / "x.mplearn")


@settings(max_examples=150, deadline=None)
@given(data=st.data())
def test_damage_anywhere_is_found(saved, tmp_path_factory, data):
    whole = saved.read_bytes()
    damaged = bytearray(whole)
    if data.draw(st.booleans()):
        for _ in range(data.draw(st.integers(1, 3))):
            place = data.draw(st.integers(0, len(whole) - 1))
            damaged[place] ^= data.draw(st.integers(1, 255))
    else:
        damaged = damaged[: data.draw(st.integers(0, len(whole) - 1))]
    path = tmp_path_factory.getbasetemp() / "damaged.mplearn"
    path.write_bytes(bytes(damaged))
    try:
        loaded = PrimitiveLibrary.load(path)
    except LibraryError as error:
        assert str(path) in str(error)
    else:  # a flip in the zip's own dates or the like
        assert loaded.version == named_library().version


SQLITE = b"SQLite format 3\x00"  # what begins like this is taken for a store


@settings(max_examples=50, deadline=None)
@given(content=st.binary(max_size=400))
@example(content=SQLITE)
def test_foreign_files_are_refused(tmp_path_factory, content):
    path = tmp_path_factory.getbasetemp() / "foreign.bin"
    path.write_bytes(content)
    with pytest.raises(StoreError if content.startswith(SQLITE) else LibraryError):
        PrimitiveLibrary.load(path)


def altered(saved, path, change, blob=None):
    with zipfile.ZipFile(saved) as archive:
        header, arrays = json.loads(archive.read("header.json")), archive.read("arrays.bin")
    arrays = arrays if blob is None else blob
    header = change(header)
    if isinstance(header, dict) and "content" in header:
        header["sha256"] = files.checksum(header["content"], arrays)
    with zipfile.ZipFile(path, "w") as archive:
        archive.writestr("header.json", json.dumps(header))
        archive.writestr("arrays.bin", arrays)
    return path


def content_with(**changes):
    return lambda header: header | {"content": header["content"] | changes}


def without(key):
    return lambda header: (
        header | {"content": {k: v for k, v in header["content"].items() if k != key}}
    )


@pytest.mark.parametrize(
    ("change", "match"),
    [
        (lambda header: header | {"schema": FILES.schema + 1}, "newer mplearn"),
        (lambda header: header | {"schema": "x"}, "damaged"),
        (lambda header: header | {"format": "other"}, "not an mplearn library"),
        (lambda header: [1, 2], "not an mplearn library"),
        (lambda header: header | {"content": 3}, "does not describe"),
        (without("graph"), "does not describe"),
        (content_with(primitives=[1]), "does not describe"),
        (content_with(primitives=[{}]), "does not describe"),
        (content_with(channels=["a"]), "does not describe"),
        (content_with(channels=None), "does not describe"),
        (content_with(rate_hz="fast"), "does not describe"),
        (content_with(tree=[[1]]), "does not describe"),
        (content_with(graph={"$array": [0, "<f8", "<f8", [10**12]]}), "malformed"),
        (content_with(graph={"$array": [0, "|O", "|O", [1]]}), "malformed"),
        (content_with(graph={"$array": [-8, "<f8", "<f8", [1]]}), "malformed"),
        (content_with(graph={"$array": ["a"]}), "malformed"),
        (content_with(graph={"$array": [0, "<f8", "<f8", [-1, -2]]}), "malformed"),
    ],
)
def test_well_formed_files_of_the_wrong_content_are_refused(saved, tmp_path, change, match):
    path = altered(saved, tmp_path / "altered.mplearn", change)
    with pytest.raises(LibraryError, match=match):
        PrimitiveLibrary.load(path)


def test_other_files_are_named(saved, tmp_path):
    with pytest.raises(LibraryError, match="there is no file"):
        PrimitiveLibrary.load(tmp_path / "none.mplearn")
    with pytest.raises(LibraryError, match="cannot be read"):
        PrimitiveLibrary.load(tmp_path)
    with zipfile.ZipFile(tmp_path / "other.zip", "w") as archive:
        archive.writestr("readme.txt", "hello")
    with pytest.raises(LibraryError, match=r"header\.json"):
        PrimitiveLibrary.load(tmp_path / "other.zip")
    bomb = tmp_path / "bomb.zip"
    with zipfile.ZipFile(bomb, "w", zipfile.ZIP_DEFLATED) as archive:
        archive.writestr("header.json", "{}")
        with archive.open("arrays.bin", "w", force_zip64=True) as entry:
            for _ in range(1100):
                entry.write(bytes(1 << 20))
    with pytest.raises(LibraryError, match="more than"):
        PrimitiveLibrary.load(bomb)


def test_a_large_file_may_hold_what_is_as_large(saved, monkeypatch):
    monkeypatch.setattr(files, "_MAX_BYTES", saved.stat().st_size // 2)
    assert PrimitiveLibrary.load(saved).version == named_library().version


plain = st.recursive(
    st.none() | st.booleans() | st.integers(-(2**60), 2**60) | st.floats() | st.text(max_size=8),
    lambda inner: st.lists(inner, max_size=3) | st.dictionaries(st.text(max_size=4), inner),
    max_leaves=8,
)
arrays = hnp.arrays(
    st.sampled_from([np.float64, np.float32, np.int64, np.int32, np.int16, np.bool_]),
    hnp.array_shapes(min_dims=0, max_dims=3, min_side=0, max_side=4),
)


def same(a, b):
    if isinstance(a, np.ndarray) and a.ndim:
        return a.dtype == b.dtype and a.shape == b.shape and a.tobytes() == b.tobytes()
    if isinstance(a, dict):
        return a.keys() == b.keys() and all(same(a[key], b[key]) for key in a)
    if isinstance(a, (list, tuple)):
        return len(a) == len(b) and all(map(same, a, b))
    return a == b or (np.isnan(a) and np.isnan(b))


@settings(max_examples=150, deadline=None)
@given(st.dictionaries(st.text(max_size=5).filter(lambda key: key[:1] != "$"), plain | arrays))
def test_any_plain_values_and_arrays_survive(tmp_path_factory, content):
    path = tmp_path_factory.getbasetemp() / "values.zip"
    FILES.write(path, content)
    assert same(content, FILES.read(path))


def test_what_is_no_plain_value_is_refused(tmp_path):
    for wrong in (object(), {1: 2}, np.array(["a"]), np.array([None]), 1 + 2j):
        with pytest.raises(LibraryError, match=r"cannot hold|keys must be"):
            FILES.write(tmp_path / "x", [wrong])
    assert not list(tmp_path.iterdir())
