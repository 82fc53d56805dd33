"""Labels in files beside a recording."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from mocap_writers import amc_values, write_amc, write_asf

from mplearn.errors import RecordingError
from mplearn.mocap import open_recording
from mplearn.mocap.labels import CMU13_EXERCISES


@pytest.fixture
def take(tmp_path: Path) -> Path:
    """Half a second and a frame: 61 frames at 120 Hz."""
    write_asf(tmp_path / "13.asf")
    return write_amc(tmp_path / "13_29.amc", amc_values(61))


def test_a_class_each_tenth_of_a_second(take: Path) -> None:
    take.with_suffix(".txt").write_text("1 1 6 6 3 3\n")
    labels = open_recording(take).labels
    assert [(s.start, s.end, s.label, s.person) for s in labels] == [
        (0, 24, "JumpJack", "13"),
        (24, 48, "Twist", "13"),
        (48, 61, "Squat", "13"),
    ]
    at_60 = open_recording(take, rate_hz=60.0).labels
    assert [(s.start, s.end) for s in at_60] == [(0, 12), (12, 24), (24, 31)]
    assert len(CMU13_EXERCISES) == 12


def test_of_other_subjects_the_number_is_the_label(tmp_path: Path) -> None:
    write_asf(tmp_path / "14.asf")
    path = write_amc(tmp_path / "14_01.amc", amc_values(48))
    path.with_suffix(".txt").write_text("2 2 2 40")
    assert [s.label for s in open_recording(path).labels] == ["2", "40"]


@pytest.mark.parametrize("text", ["1 1", "1 " * 50, "1 1 1 jump 1 1", "", "1.0 1 1 1 1"])
def test_a_track_that_does_not_fit(take: Path, text: str) -> None:
    take.with_suffix(".txt").write_text(text)
    with pytest.raises(RecordingError, match=r"13_29\.txt.*expected"):
        open_recording(take)


def test_table_of_ends(take: Path) -> None:
    entries = [{"label": "walk", "end_nominal": 20}, {"label": "jump", "end_nominal": 61}]
    table = take.parent / "labels_parsed.json"
    table.write_text(json.dumps({"13_29": entries, "99_01": []}))
    labels = open_recording(take, positions=True).labels
    assert [(s.start, s.end, s.label) for s in labels] == [(0, 20, "walk"), (20, 61, "jump")]
    other = write_amc(take.with_name("13_30.amc"), amc_values(5))
    assert open_recording(other).labels == ()


@pytest.mark.parametrize(
    "table",
    [
        "{",
        "[]",
        '{"13_29": 3}',
        '{"13_29": [{"label": "walk"}]}',
        '{"13_29": [{"label": "walk", "end_nominal": "soon"}]}',
        '{"13_29": [{"label": "walk", "end_nominal": 62}]}',
        '{"13_29": [{"label": "a", "end_nominal": 9}, {"label": "b", "end_nominal": 9}]}',
    ],
)
def test_a_table_that_does_not_fit(take: Path, table: str) -> None:
    (take.parent / "labels_parsed.json").write_text(table)
    with pytest.raises(RecordingError, match=r"labels_parsed\.json.*expected"):
        open_recording(take)


def test_labels_do_not_change_the_frames(take: Path) -> None:
    plain = open_recording(take)
    take.with_suffix(".txt").write_text("1 1 1 1 1")
    assert np.array_equal(open_recording(take).frames, plain.frames)
