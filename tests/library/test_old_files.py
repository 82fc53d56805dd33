"""Library files that older code wrote still open, and say what they said then."""

import json
import zipfile
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import mplearn_envs
from mplearn import PrimitiveLibrary
from mplearn.errors import LibraryError
from mplearn.library.content import FILES
from mplearn.state import to_plain
from mplearn.state.packing import packed
from mplearn.tree import TreeConfig

OLD = Path(__file__).parent / "data" / "people-schema-1.mplearn"  # five motions by three people
YOUNG = OLD.with_name("young-schema-2.mplearn")  # four motions, before `sequence_extent` was there
GROWN = OLD.with_name("grown-schema-2.mplearn")  # and after
EMBEDDED = Path(mplearn_envs.__file__).parent / "data" / "default.mplearn"


def test_a_library_of_several_people_says_what_it_said():
    library = PrimitiveLibrary.load(OLD)
    assert library.version == "adc83cf7521edfd7"
    assert library.names == ("Bögen: hoch", "P2", "P3", "P4", "P5")
    assert len(library.tree) == 17
    assert library.walk(None, 5, np.random.default_rng(0)) == (4, 3, 2, 1, 5)
    distances = (0.003547056, 0.003915958, 0.001819743, 0.001887716, 0.001404298)
    scores = (0.489337, 0.495932, 0.39865, 0.352748, 0.318466)
    for id, distance, score in zip(library.ids, distances, scores, strict=True):
        motion = library[id].exemplars[0]
        said = library.recognise(motion)
        assert said.primitive == id
        assert said.distance == pytest.approx(distance, abs=1e-8)
        assert library.score_motion(motion).score == pytest.approx(score, abs=1e-5)


@pytest.mark.parametrize("path", [OLD, EMBEDDED])
def test_what_is_read_is_written_again(path, tmp_path):
    library = PrimitiveLibrary.load(path)
    copy = library.save(tmp_path / "copy.mplearn")
    again = PrimitiveLibrary.load(copy)
    assert again.version == library.version
    assert again.save(tmp_path / "again.mplearn").read_bytes() == copy.read_bytes()
    with zipfile.ZipFile(path) as archive:
        header, blob = json.loads(archive.read("header.json")), archive.read("arrays.bin")
    assert header["schema"] == 1
    lean = packed(to_plain(replace(again.state(), version="")))  # as the older code wrote it
    assert lean == (header["content"], blob)


@pytest.mark.parametrize(
    ("path", "version", "lacking"),
    [
        (YOUNG, "2037f0f68582a0de", {"sequence_extent", "max_born", "drop_fragments"}),
        (GROWN, "b0e36102be391f0e", {"max_born", "drop_fragments"}),
    ],
)
def test_a_whole_file_opens_whether_or_not_it_has_the_newest_setting(path, version, lacking):
    with zipfile.ZipFile(path) as archive:
        header = json.loads(archive.read("header.json"))
    assert header["schema"] == 2
    known = header["content"]["recogniser"]["config"].keys()
    newest = to_plain(TreeConfig(), whole=True).keys()
    assert newest - known == lacking
    library = PrimitiveLibrary.load(path)
    assert library.version == version
    assert library.names == ("P1", "P2", "P3", "P4")
    for id in library.ids:
        assert library.recognise(library[id].exemplars[0]).primitive == id
    distances = [library.recognise(library[id].exemplars[0]).distance for id in library.ids]
    assert distances == pytest.approx([1.490466e-3, 1.4685e-5, 2.81136e-4, 4.2871e-5], abs=1e-8)


def test_an_older_file_that_is_damaged_is_refused_with_the_place(tmp_path):
    content = FILES.read(OLD)
    del content["version"]
    content["primitives"][1]["rate_hz"] = "fast"
    replace(FILES, schema=1, migrations={}).write(tmp_path / "old.mplearn", content)
    with pytest.raises(LibraryError, match=r"old\.mplearn cannot be .*primitives\[1\]\.rate_hz: "):
        PrimitiveLibrary.load(tmp_path / "old.mplearn")
