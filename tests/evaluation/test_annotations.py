"""Tables of labels beside recordings."""

import json

import numpy as np
import pytest

from mplearn.errors import RecordingError
from mplearn.evaluation import read_annotations
from mplearn.recording import Recording


def write(path, content):
    path.write_text(content if isinstance(content, str) else json.dumps(content))
    return path


def test_stretches_by_take_and_activity(tmp_path):
    content = {"86_01": {"kick": [[3, 6], [8, 10]], "turn": [[5, 9]]}, "02_05": {"punch": []}}
    table = read_annotations(write(tmp_path / "second.json", content))
    assert table is not None and table.name == "second"
    assert table.stretches["86_01"] == ((3, 6, "kick"), (8, 10, "kick"), (5, 9, "turn"))
    take = Recording(np.zeros((10, 1)), 120.0, ("x",), name="86_01", person="86")
    labelled = table.label(take)
    assert [(s.start, s.end, s.label, s.person) for s in labelled.labels] == [
        (3, 6, "kick", "86"),
        (8, 10, "kick", "86"),
        (5, 9, "turn", "86"),
    ]
    with pytest.raises(RecordingError, match="ends at frame 10, and the recording at 9"):
        table.label(Recording(np.zeros((9, 1)), 120.0, ("x",), name="86_01"))
    for name in ("02_05", "13_29"):
        with pytest.raises(RecordingError, match=f"no labels of '{name}'"):
            table.label(Recording(np.zeros((9, 1)), 120.0, ("x",), name=name))


@pytest.mark.parametrize("content", [[], {}, 3, {"86_01": [{"label": "walk"}]}, {"a": {"b": 3}}])
def test_another_file_is_none(tmp_path, content):
    assert read_annotations(write(tmp_path / "other.json", content)) is None


@pytest.mark.parametrize(
    "stretch", [[5], [5, 5], [-1, 5], [1, "x"], [1.5, 3], "ab", [True, False], {}]
)
def test_a_stretch_is_two_frames_in_order(tmp_path, stretch):
    with pytest.raises(RecordingError, match=r"86_01, kick: .* is no stretch; expected"):
        read_annotations(write(tmp_path / "t.json", {"86_01": {"kick": [[1, 2], stretch]}}))


def test_a_damaged_file_is_named(tmp_path):
    with pytest.raises(RecordingError, match=r"t\.json: no JSON file"):
        read_annotations(write(tmp_path / "t.json", "{"))
