"""A recording of several people is a recording of each, whoever wrote it how."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from mocap_writers import mvnx_motion, write_mvnx

from mplearn.anatomy import recognise
from mplearn.demonstrator import demonstrate
from mplearn.errors import RecordingWarning
from mplearn.mocap import each_person, open_recording, open_recordings
from mplearn.recording import Recording, Skeleton, marker_channels

NAMES = tuple(f"M{k}" for k in range(12))


def of_markers(names: tuple[str, ...]) -> Recording:
    return Recording(np.zeros((4, 3 * len(names))), 50.0, marker_channels(names), "take")


@pytest.mark.parametrize("between", [":", "_", ".", "-", " "])
@pytest.mark.parametrize(
    "people", [("Anna", "Ben"), ("Skeleton_001", "Skeleton_002", "Ball"), ("a b_0", "a b_1")]
)
def test_prefixes_tell_people_apart(between: str, people: tuple[str, ...]) -> None:
    names = tuple(f"{who}{between}{name}" for who in people[:2] for name in NAMES)
    names += tuple(f"{who}{between}tip{k}" for who in people[2:] for k in range(4))
    both = of_markers(names)
    both = replace(both, frames=both.frames + np.arange(both.frames.shape[1]))
    found = each_person(both)
    assert [each.person for each in found] == list(people[:2])
    assert [each.name for each in found] == [f"take ({who})" for who in people[:2]]
    for k, each in enumerate(found):
        assert len(each.marker_names) == len(NAMES)
        assert np.array_equal(each.frames, both.frames[:, 36 * k : 36 * (k + 1)])
        assert each.report is not None and "--person" not in each.report.notes[0]
        assert len(each.report.left_out) == 4 * len(people[2:])


@pytest.mark.parametrize(
    "names",
    [
        tuple(f"{side}_{name}" for side in ("left", "right") for name in NAMES),
        tuple(f"{side}Hand:{name}" for side in ("L", "R") for name in NAMES),
        tuple(f"{name}_{side}" for side in ("l", "r") for name in NAMES),
        tuple(f"{part}:Marker{k}" for part in ("ArmL", "ArmR", "Head") for k in range(6)),
        NAMES,
    ],
)
def test_sides_hands_and_rigid_bodies_are_no_people(names: tuple[str, ...]) -> None:
    recording = of_markers(names)
    assert each_person(recording) == (recording,)


def skeletons(*roots: str, held: bool = False) -> Recording:
    """People of 15 joints each, who walk away from the origin; all on one root, where held."""
    names, parents, places = (["World"], [-1], [np.zeros((40, 3))]) if held else ([], [], [])
    for k, root in enumerate(roots):
        first = len(names)
        way = np.linspace(0, 1 + k, 40)[:, None] * [1.0, 0.3, 0.0]
        for joint in range(15):
            names.append(root if joint == 0 else f"{root}.{joint}")
            parents.append((0 if held else -1) if joint == 0 else first + joint - 1)
            places.append(way + np.array((0.0, 2.0 * k, 0.1 * joint)))
    points = np.stack(places, axis=1)
    skeleton = Skeleton(tuple(names), tuple(parents), np.zeros((len(names), 3)))
    frames = points.reshape(40, -1)
    return Recording(frames, 50.0, marker_channels(tuple(names)), "take", skeleton=skeleton)


@pytest.mark.parametrize("held", [False, True])
def test_trees_of_joints_tell_people_apart(held: bool) -> None:
    both = skeletons("Hips", "Hips_2", held=held)
    found = each_person(both)
    assert [each.person for each in found] == ["Hips", "Hips_2"]
    for each in found:
        assert each.skeleton is not None and each.skeleton.parents == (-1, *range(14))
        assert each.marker_names == each.skeleton.names
    assert each_person(skeletons("Hips", held=held))[0].name == "take"


@pytest.mark.parametrize("positions", [False, True])
def test_subjects_of_an_mvnx_file_stand_side_by_side(tmp_path: Path, positions: bool) -> None:
    motions = [mvnx_motion(40, seed) for seed in (1, 2)]
    alone = []
    for who, motion in zip(("Anna", "Ben"), motions, strict=True):
        subject = f'label="{who}" frameRate="100" segmentCount="23"'
        path = write_mvnx(tmp_path / f"{who}.mvnx", motion, subject=subject)
        alone.append(open_recording(path, positions=positions))
    texts = [(tmp_path / f"{who}.mvnx").read_text() for who in ("Anna", "Ben")]
    second = texts[1][texts[1].index("<subject") : texts[1].index("</mvnx>")]
    (tmp_path / "duet.mvnx").write_text(texts[0].replace("</mvnx>", f"{second}</mvnx>"))
    both = open_recording(tmp_path / "duet.mvnx", positions=positions)
    assert np.array_equal(both.frames, np.hstack([each.frames for each in alone]))
    assert both.channels[0] == f"Anna:{alone[0].channels[0]}"
    if positions:
        found = each_person(both)
        assert [each.person for each in found] == ["Anna", "Ben"]
        for each, one in zip(found, alone, strict=True):
            assert np.array_equal(each.frames, one.frames)
            assert each.skeleton is not None and one.skeleton is not None
            assert each.skeleton.parents == one.skeleton.parents


@pytest.mark.parametrize("end", ['<subject label="Ben"/></mvnx>', '<subject label="Ben"><segm'])
def test_a_subject_without_frames_costs_no_other(tmp_path: Path, end: str) -> None:
    path = write_mvnx(tmp_path / "a.mvnx")
    one = open_recording(path)
    path.write_text(path.read_text().replace("</mvnx>", end))
    with pytest.warns(RecordingWarning):
        take = open_recording(path)
    assert np.array_equal(take.frames, one.frames)
    assert take.report is not None and "'Ben' has no frames" in take.report.warnings[-1]


def test_subjects_of_one_name_are_told_apart(tmp_path: Path) -> None:
    text = write_mvnx(tmp_path / "a.mvnx").read_text()
    subject = text[text.index("<subject") : text.index("</mvnx>")]
    others = subject.replace("Anna", "Anna_1") + subject
    (tmp_path / "a.mvnx").write_text(text.replace("</mvnx>", f"{others}</mvnx>"))
    found = open_recordings(tmp_path / "a.mvnx", positions=True)
    assert len({each.person for each in found}) == len(found) == 3


@pytest.mark.filterwarnings("ignore::mplearn.errors.RecordingWarning")
def test_a_file_of_two_is_two_takes_and_each_is_recognised(tmp_path) -> None:
    shown = [demonstrate(["BAR", "BAL"], seed, rate_hz=25.0).recording for seed in (1, 2)]
    n = min(map(len, shown))
    names = [f"{who}:{name}" for who in ("Anna", "Ben") for name in shown[0].marker_names]
    frames = np.hstack([shown[0].frames[:n], shown[1].frames[:n] + np.tile([0.0, 2.0, 0.0], 34)])
    path = tmp_path / "duet.csv"
    header = ",".join(["time", *marker_channels(tuple(names))])
    rows = np.column_stack([np.arange(n) / 25.0, frames])
    np.savetxt(path, rows, delimiter=",", fmt="%.5f", header=header, comments="")
    path.write_text(path.read_text().replace("nan", ""))
    found = open_recordings(path)
    assert [each.person for each in found] == ["Anna", "Ben"]
    for each, one in zip(found, shown, strict=True):
        body = recognise(each)
        assert body.confidence == 1.0 and not body.warnings
        assert np.nanmax(np.abs(np.ptp(each.frames, 0) - np.ptp(one.frames[:n], 0))) < 1e-4
