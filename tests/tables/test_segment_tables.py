"""Tables of segments go into the formats of motion science, and come back as they were."""

import json
import math
from itertools import pairwise
from pathlib import Path

import numpy as np
import pandas
import pytest
import xarray
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from pympi.Elan import Eaf

from mplearn import LearnerConfig, MotionLearner, PrimitiveLibrary
from mplearn.demonstrator import demonstrate
from mplearn.errors import InvalidValueError, RecordingError
from mplearn.recording import Recording, marker_channels
from mplearn.tables import (
    FORMATS,
    RecognisedSegment,
    SegmentTable,
    as_dataset,
    from_dataset,
    read_segments,
    segments_of,
    write_segments,
)

NAME = st.text(st.characters(codec="utf-8", exclude_categories=["C", "Z"]), min_size=1, max_size=8)
SHARE = st.floats(1e-6, 1.0) | st.just(math.nan)


@st.composite
def tables(draw) -> SegmentTable:
    """Draw the segments of some takes, one after the other in each."""
    rows = []
    names = draw(st.dictionaries(st.integers(0, 99), NAME, min_size=1, max_size=4))
    for take in sorted(draw(st.sets(NAME, min_size=1, max_size=3))):
        person, time_s = draw(NAME | st.just("")), draw(st.floats(0, 10))
        for _ in range(draw(st.integers(1, 4))):
            start_s = time_s + draw(st.floats(0, 1))
            time_s = start_s + draw(st.floats(0.01, 3))
            id = draw(st.none() | st.sampled_from(sorted(names)))
            name = "" if id is None else names[id]
            near = draw(st.sampled_from(["", *names.values()]))
            distance, share = draw(st.floats(0, 1e6)), draw(SHARE)
            row = (take, start_s, time_s, id, name, near, distance, share, person, draw(SHARE))
            rows.append(RecognisedSegment(*row))
    return SegmentTable(rows)


@pytest.mark.parametrize("ending", FORMATS)
@settings(
    max_examples=25, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture]
)
@given(tables())
def test_what_is_written_is_read_again(ending: str, tmp_path: Path, table: SegmentTable) -> None:
    path = write_segments(table, tmp_path / f"table{ending}")
    assert read_segments(path) == table


ROWS = SegmentTable(
    [
        RecognisedSegment("walk", 0.51234, 1.2, 3, "step & turn", "step", 0.25, 0.5, "anna", 0.9),
        RecognisedSegment("walk", 1.2, 2.0, None, "", "step", 9.0, 0.001, "anna", 1.0),
        RecognisedSegment("\x1b[31mrun", 0.0, 0.75, 1, "bend", "bend", 0.1, 0.7, "", 0.5),
    ]
)


def test_tiers_of_elan_never_share_a_name(tmp_path: Path) -> None:
    takes = ("walk details", "walk", "walk details details")
    table = SegmentTable(
        RecognisedSegment(take, 0.0, 1.0, 1, "step", "step", 0.1, 0.5) for take in takes
    )
    path = write_segments(table, tmp_path / "a.eaf")
    assert read_segments(path) == table
    eaf = Eaf(str(path))
    assert len(eaf.get_tier_names()) == 6
    parents = {eaf.get_parameters_for_tier(tier).get("PARENT_REF") for tier in eaf.get_tier_names()}
    assert parents == {None, *takes}


def test_elan_as_another_reader_sees_it(tmp_path: Path) -> None:
    path = write_segments(ROWS, tmp_path / "a.eaf")
    eaf = Eaf(str(path))
    assert eaf.get_annotation_data_for_tier("walk") == [
        (512, 1200, "step & turn"),
        (1200, 2000, "unknown"),
    ]
    assert eaf.get_parameters_for_tier("walk details")["PARENT_REF"] == "walk"
    assert "\\x1b[31mrun" in eaf.get_tier_names()
    assert 'FORMAT="3.0"' in path.read_text(encoding="utf-8")
    assert read_segments(path) == ROWS


def test_what_a_person_changed_in_elan_counts(tmp_path: Path) -> None:
    path = write_segments(ROWS, tmp_path / "a.eaf")
    text = path.read_text(encoding="utf-8")
    text = text.replace(">step &amp; turn<", ">hop<").replace('"2000"', '"2100"')
    path.write_text(text, encoding="utf-8")
    first, second, _ = read_segments(path)
    assert (first.name, first.primitive, first.start_s) == ("hop", None, 0.51234)
    assert (second.end_s, second.name) == (2.1, "")


def test_boris_holds_state_events_of_each_observation(tmp_path: Path) -> None:
    path = write_segments(ROWS, tmp_path / "a.boris")
    project = json.loads(path.read_text(encoding="utf-8"))
    codes = {each["code"] for each in project["behaviors_conf"].values()}
    assert codes == {"step & turn", "unknown", "bend"}
    events = project["observations"]["walk"]["events"]
    assert [(e[0], e[1], e[2]) for e in events[:2]] == [
        (0.51234, "anna", "step & turn"),
        (1.2, "anna", "step & turn"),
    ]
    for e in events:
        e[4] = ""  # as somebody's own observation
    path.write_text(json.dumps(project), encoding="utf-8")
    row = read_segments(path)[0]
    assert (row.start_s, row.end_s, row.name, row.primitive) == (0.51234, 1.2, "step & turn", None)
    assert math.isnan(row.distance)


def test_motion_bids_events_say_what_they_are(tmp_path: Path) -> None:
    path = write_segments(ROWS[:2], tmp_path / "sub-1_task-walk_tracksys-vicon_events.tsv")
    frame = pandas.read_csv(path, sep="\t")
    assert list(frame.columns[:3]) == ["onset", "duration", "trial_type"]
    assert frame["onset"].is_monotonic_increasing
    assert frame["duration"][1] == pytest.approx(0.8)
    sidecar = json.loads(path.with_suffix(".json").read_text(encoding="utf-8"))
    assert set(sidecar) == set(frame.columns)
    other = tmp_path / "other_events.tsv"
    other.write_text("onset\tduration\ttrial_type\n1.5\t0.5\twalk\n", encoding="utf-8")
    (row,) = read_segments(other)
    assert (row.start_s, row.end_s, row.name) == (1.5, 2.0, "walk")


def test_pandas_and_arrow_have_types() -> None:
    frame = ROWS.to_pandas()
    assert list(frame["primitive"].isna()) == [False, True, False]
    assert str(frame["primitive"].dtype) == "Int64"
    assert ROWS.to_arrow().to_pydict() == ROWS.columns()
    assert SegmentTable.of_columns(ROWS.to_arrow().to_pydict()) == ROWS


def test_a_data_set_in_the_dimensions_of_movement(tmp_path: Path) -> None:
    frames = np.arange(60.0).reshape(10, 6)
    frames[3, 2] = np.nan
    recording = Recording(frames, 5.0, marker_channels(("head", "hand")), "walk", "anna")
    data = as_dataset(recording, ROWS[:2])
    assert data["position"].dims == ("time", "space", "keypoints", "individuals")
    hand = data["position"].sel(keypoints="hand", space="y", individuals="anna")
    np.testing.assert_array_equal(hand.values, frames[:, 4])
    assert data["primitive"].values[:, 0].tolist() == [-1] * 3 + [3] * 3 + [-1] * 4
    data.to_netcdf(tmp_path / "a.nc")
    with xarray.open_dataset(tmp_path / "a.nc") as loaded:
        same, table = from_dataset(loaded.load())
    assert table == ROWS[:2]
    np.testing.assert_array_equal(same.frames, frames)
    assert (same.channels, same.rate_hz, same.name, same.person) == (
        recording.channels, 5.0, "walk", "anna",
    )  # fmt: skip
    with pytest.raises(RecordingError, match="no data set"):
        from_dataset(xarray.Dataset())


@pytest.mark.parametrize("axes", [("ahead", "left"), ("ahead", "left", "up")])
def test_key_points_seen_from_the_body_are_a_data_set(axes: tuple[str, ...]) -> None:
    pytest.importorskip("xarray")
    channels = tuple(f"{name}.{axis}" for name in ("snout", "tail.base") for axis in axes)
    frames = np.arange(10.0 * len(channels)).reshape(10, -1)
    recording = Recording(frames, 5.0, channels, "mouse", "ind1")
    data = as_dataset(recording, ROWS[:2])
    assert data["space"].values.tolist() == list(axes)
    tail = data["position"].sel(keypoints="tail.base", space="left", individuals="ind1")
    np.testing.assert_array_equal(tail.values, frames[:, len(axes) + 1])
    same, table = from_dataset(data)
    assert (same.channels, table) == (channels, ROWS[:2])
    np.testing.assert_array_equal(same.frames, frames)
    angles = Recording(frames[:, :2], 5.0, ("hip", "knee"))
    with pytest.raises(RecordingError, match="no markers"):
        as_dataset(angles, ROWS[:2])


@pytest.mark.parametrize("ending", FORMATS)
def test_what_is_no_table_is_refused(ending: str, tmp_path: Path) -> None:
    path = tmp_path / f"no{ending}"
    with pytest.raises(RecordingError, match="no"):
        read_segments(path)
    for text in ("{", "<a>", "take,start_s\nx,y\n", "onset\nx\n"):
        path.write_text(text, encoding="utf-8")
        with pytest.raises(RecordingError):
            read_segments(path)
    with pytest.raises(InvalidValueError, match="eaf"):
        write_segments(ROWS, tmp_path / "a.xlsx")


@pytest.fixture(scope="module")
def learned() -> tuple[Recording, PrimitiveLibrary]:
    take = demonstrate(["BAR", "BAL"] * 6, seed=1, rate_hz=50.0).recording
    learner = MotionLearner(LearnerConfig(take.channels, take.rate_hz))
    for _ in learner.learn_recording(take, 100):
        pass
    return take, learner.snapshot()


def test_a_recording_of_markers_is_segmented_as_it_was_learned(learned) -> None:
    take, library = learned
    table = library.segments(take)
    assert table == segments_of(library, take)
    assert len(table) >= 10
    known = [row for row in table if row.primitive is not None]
    assert len(known) >= 0.8 * len(table)
    for row in known:
        assert library[row.primitive].name == row.name == row.nearest
        assert 0 < row.p_value <= 1
    assert all(0 <= row.confidence <= 1 for row in table)
    assert all(a.end_s <= b.start_s for a, b in pairwise(table))
    assert table[-1].end_s <= take.duration_s
