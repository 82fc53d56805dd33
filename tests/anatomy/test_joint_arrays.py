"""Arrays of joints without names: which ones they are, by their number and their bones."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from known_person import RATE_HZ, Truth
from rigs import Rig, write_rig
from scipy.spatial.transform import Rotation

from mplearn.anatomy import recognise
from mplearn.body import human_body, marker_set
from mplearn.errors import BodyError, RecordingError
from mplearn.mocap import Hints, open_recording, open_recordings
from mplearn.mocap.placing.space import upright
from mplearn.mocap.skeletons.joint_arrays import LAYOUTS

pytestmark = pytest.mark.filterwarnings("ignore::mplearn.errors.RecordingWarning")
# where joints are that are not called as the place is
PLACES = {
    **dict.fromkeys(("mid_hip", "spine_base", "pelvis"), ("pelvis",)),
    **dict.fromkeys(("thorax", "spine_shoulder"), ("shoulder_l", "shoulder_r")),
    "hip": ("pelvis",),
    "head": ("head_top",),
    "big_toe": ("toe_tip",),
    "small_toe": ("metatarsal5",),
    "heel": ("heel_back",),
    "foot_index": ("toe_tip",),
    "foot": ("ball",),
    "toe": ("ball",),
    "index": ("knuckle_index",),
    "pinky": ("knuckle_little",),
    "thumb": ("thumb_side",),
}


@pytest.fixture(scope="module")
def landmarks(truth: Truth) -> dict[str, np.ndarray]:
    table = marker_set("landmarks")
    bodies, offsets = table.attach(truth.body.tree, human_body().tree)
    points = np.array([truth.body.tree.points(q, bodies, offsets) for q in truth.postures])
    return dict(zip(table.names, points.swapaxes(0, 1), strict=True))


def joints(layout: str, landmarks: dict[str, np.ndarray]) -> np.ndarray:
    """Joints of a layout, NaN where the body has no such place."""
    found = []
    for name in LAYOUTS[layout].split():
        word, _, rest = name.partition("_")
        sided = word in ("left", "right")
        part, end = (rest, f"_{word[0]}") if sided else (name, "")
        middle = (part,) if sided and part == "hip" else PLACES.get(part, (part,))
        if "Kinect" in layout and part == "foot":
            middle = ("toe_tip",)
        places = [place if sided is False else f"{place}{end}" for place in middle]
        at = [landmarks[place] for place in places if place in landmarks]
        found.append(np.mean(at, axis=0) if at else np.full_like(landmarks["nose"], np.nan))
    return np.stack(found, axis=1)


@pytest.mark.parametrize("layout", LAYOUTS)
def test_the_joints_of_a_layout_are_the_persons(
    tmp_path: Path, truth: Truth, landmarks: dict[str, np.ndarray], layout: str
) -> None:
    points = joints(layout, landmarks)
    more = {"COCO-WholeBody": 110, "SMPL": 2}.get(layout, 0)  # of hands and face
    whole = np.concatenate([points, np.repeat(points[:, :1], more, axis=1)], axis=1)
    np.save(
        tmp_path / f"walk_{RATE_HZ:g}hz.npy", 1000.0 * whole[..., [0, 2, 1]] * (1, 1, -1)
    )  # y up
    take = open_recording(tmp_path / f"walk_{RATE_HZ:g}hz.npy")
    assert take.report is not None and f"those of {layout}" in " ".join(take.report.notes)
    assert (take.report.unit_m, take.report.up, take.rate_hz) == (0.001, "y", RATE_HZ)
    needed = [k for k, name in enumerate(LAYOUTS[layout].split()) if name != "-"]
    assert take.markers == pytest.approx(points[:, needed], abs=1e-9, nan_ok=True)
    angles, off_mm = truth.errors(recognise(take).apply(take))
    assert np.median(angles) < 3.0 and np.median(off_mm) < 15.0


@pytest.mark.parametrize("layout", LAYOUTS)
def test_joints_in_another_order_are_refused(
    tmp_path: Path, landmarks: dict[str, np.ndarray], layout: str
) -> None:
    points = joints(layout, landmarks)
    more = {"COCO-WholeBody": 110}.get(layout, 0)
    points = np.concatenate([points, np.repeat(points[:, :1], more, axis=1)], axis=1)
    for seed in range(5):
        np.save(tmp_path / "a.npy", np.random.default_rng(seed).permutation(points, axis=1))
        with pytest.raises(RecordingError, match="would not be a person's"):
            open_recording(tmp_path / "a.npy", hints=Hints(rate_hz=RATE_HZ))


def test_coco_with_feet_alone(
    tmp_path: Path, truth: Truth, landmarks: dict[str, np.ndarray]
) -> None:
    """Body and feet without hands and face: as many as Xsens has segments."""
    points = joints("COCO-WholeBody", landmarks)
    assert points.shape[1] == 23
    np.save(tmp_path / "a.npy", points)
    take = open_recording(tmp_path / "a.npy", hints=Hints(rate_hz=RATE_HZ))
    assert take.markers == pytest.approx(points)
    angles, off_mm = truth.errors(recognise(take).apply(take))
    assert np.median(angles) < 3.0 and np.median(off_mm) < 15.0


def test_an_archive_with_batch_confidence_and_rate(
    tmp_path: Path, landmarks: dict[str, np.ndarray]
) -> None:
    points = joints("COCO", landmarks)
    sure = np.concatenate([points, np.ones((*points.shape[:2], 1))], axis=2)
    np.savez(tmp_path / "a.npz", keypoints_3d=sure[None], fps=np.array(f"{RATE_HZ:g}"))
    take = open_recording(tmp_path / "a.npz")
    assert take.rate_hz == RATE_HZ
    assert take.markers == pytest.approx(points)


def test_the_only_array_of_joints_of_an_archive(
    tmp_path: Path, landmarks: dict[str, np.ndarray]
) -> None:
    points = joints("COCO", landmarks)
    np.savez(tmp_path / "a.npz", reconstruction=points, losses=np.ones(len(points)), fps=25.0)
    assert open_recording(tmp_path / "a.npz").markers == pytest.approx(points)
    np.savez(tmp_path / "b.npz", one=points, two=points, fps=25.0)
    with pytest.raises(RecordingError, match="arrays one, two"):
        open_recording(tmp_path / "b.npz")


@pytest.mark.parametrize("n_frames", [17, 22, 25, 60])
@pytest.mark.parametrize("axes", [(2, 0, 1), (0, 2, 1), (1, 2, 0)])
def test_numbers_of_frames_are_not_taken_for_those_of_joints(
    tmp_path: Path, landmarks: dict[str, np.ndarray], axes: tuple[int, ...], n_frames: int
) -> None:
    """(3, T, J), (T, 3, J) and (J, 3, T); 22 and 25 joints are those of other layouts."""
    points = joints("COCO", landmarks)[:n_frames]
    np.save(tmp_path / "a.npy", points.transpose(axes))
    take = open_recording(tmp_path / "a.npy", hints=Hints(rate_hz=RATE_HZ))
    assert take.markers == pytest.approx(points)


@pytest.mark.parametrize(
    "shape",
    [
        *((5, 9, 3), (5, 17, 2), (5, 321), (0, 17, 3), (17, 3), (40, 50, 17, 3)),
        *((0, 263), (17, 3, 0), (5, 3, 9), ()),
    ],
)
def test_what_is_no_array_of_joints(tmp_path: Path, shape: tuple[int, ...]) -> None:
    np.save(tmp_path / "a.npy", np.ones(shape))
    with pytest.raises(RecordingError, match="frames"):
        open_recording(tmp_path / "a.npy", hints=Hints(rate_hz=RATE_HZ))


ORDERS = {
    "(T, P, J, 3)": (0, 1, 2, 3),
    "(P, T, J, 3)": (1, 0, 2, 3),
    "(3, T, J, P)": (3, 0, 2, 1),
    "(1, 3, T, J, P)": (3, 0, 2, 1),
    "(T, J, 3, P)": (0, 2, 3, 1),
}


def test_joints_before_frames(tmp_path: Path, landmarks: dict[str, np.ndarray]) -> None:
    points = joints("COCO", landmarks)
    np.save(tmp_path / "a.npy", points.swapaxes(0, 1))
    take = open_recording(tmp_path / "a.npy", hints=Hints(rate_hz=RATE_HZ))
    assert take.markers == pytest.approx(points)


def test_turns_of_joints_are_no_people(tmp_path: Path) -> None:
    np.save(tmp_path / "a.npy", np.tile(np.eye(3), (40, 17, 1, 1)))
    with pytest.raises(RecordingError, match=r"\(3, frames, joints, people\)"):
        open_recording(tmp_path / "a.npy", hints=Hints(rate_hz=RATE_HZ))


@pytest.mark.parametrize("order", ORDERS)
def test_people_of_an_array_are_takes_of_their_own(
    tmp_path: Path, landmarks: dict[str, np.ndarray], order: str
) -> None:
    one = joints("COCO", landmarks)
    other = one[::-1] + np.array([0.0, 2.0, 0.0])
    nobody = np.zeros_like(one)
    people = np.stack([one, other, *([] if "3" in order[:8] else [nobody])], axis=1)
    array = people.transpose(ORDERS[order])
    np.save(tmp_path / "a.npy", array[None] if order[1] == "1" else array)
    found = open_recordings(tmp_path / "a.npy", hints=Hints(rate_hz=RATE_HZ))
    assert [each.person for each in found] == ["person0", "person1"]
    for k, each in enumerate(found):
        assert each.markers == pytest.approx(people[:, k])


@pytest.mark.parametrize("layout", ["SMPL", "KIT-ML"])
def test_features_of_motion_are_joints_again(
    tmp_path: Path, landmarks: dict[str, np.ndarray], layout: str
) -> None:
    points = joints(layout, landmarks)[:, :22][..., [1, 2, 0]]  # x left, y up, z ahead
    points = np.where(np.isnan(points), points[:, :1], points)
    n_frames, n_joints = points.shape[:2]
    heading = 0.02 * np.arange(n_frames)
    turned = np.einsum(
        "tjk,tkl->tjl", points, Rotation.from_euler("y", -heading[:, None]).as_matrix()
    )
    turned += 0.01 * np.arange(n_frames)[:, None, None] * [1.0, 0.0, 0.5]
    whole = np.zeros((n_frames, 12 * (n_joints + 1) - 13))
    whole[:-1, 0] = -np.diff(heading) / 2.0  # features turn the other way round
    to_person = Rotation.from_euler("y", -heading[:, None])
    steps = np.diff(turned[:, 0], axis=0)
    whole[:-1, 1:3] = to_person[1:].apply(steps)[:, [0, 2]]
    whole[:, 3] = turned[:, 0, 1]
    seen = turned[:, 1:] - turned[:, :1] * [1.0, 0.0, 1.0]
    seen = np.stack([to_person.apply(each) for each in seen.swapaxes(0, 1)], axis=1)
    whole[:, 4 : 4 + seen[0].size] = seen.reshape(n_frames, -1)
    np.save(tmp_path / "a.npy", whole)
    take = open_recording(tmp_path / "a.npy")
    assert take.report is not None
    assert (take.rate_hz, take.report.up) == ({"SMPL": 20.0, "KIT-ML": 12.5}[layout], "y")
    kept = [k for k, name in enumerate(LAYOUTS[layout].split()[:22]) if name != "-"]
    expected = (turned - turned[:1, :1] * [1.0, 0.0, 1.0])[:, kept]
    found = take.markers @ upright("y")
    assert found == pytest.approx(expected, abs=1e-9)
    whole[:, -4:] = 0.3
    np.save(tmp_path / "a.npy", whole)
    with pytest.raises(RecordingError, match="normalised"):
        open_recording(tmp_path / "a.npy")


def in_a_picture(points: np.ndarray, size: float) -> np.ndarray:
    """Where points that are 3 m before a camera are in a picture, shape (T, J, 2), y down."""
    depth = 3.0 - points[..., 0] + np.nanmean(points[..., 0], axis=1, keepdims=True)
    across = points[..., 1] - np.nanmean(points[..., 1], axis=1, keepdims=True)
    return size * np.stack([0.5 + across / depth, 0.5 + (1.0 - points[..., 2]) / depth], axis=2)


def test_pixels_with_confidences_are_no_places(
    tmp_path: Path, landmarks: dict[str, np.ndarray]
) -> None:
    flat = in_a_picture(joints("COCO", landmarks), 1080.0)
    sure = np.random.default_rng(0).uniform(0.6, 1.0, size=(*flat.shape[:2], 1))
    np.save(tmp_path / "a.npy", np.concatenate([flat, sure], axis=2))
    with pytest.raises(RecordingError, match="how sure each is"):
        open_recording(tmp_path / "a.npy", hints=Hints(rate_hz=RATE_HZ))


def test_shares_of_a_picture_are_told(tmp_path: Path, landmarks: dict[str, np.ndarray]) -> None:
    points = joints("MediaPipe", landmarks)
    depth = 0.3 * (points[..., :1] - np.nanmean(points[..., 0], axis=1)[:, None, None])
    np.save(tmp_path / "a.npy", np.concatenate([in_a_picture(points, 1.0), depth], axis=2))
    take = open_recording(tmp_path / "a.npy", hints=Hints(rate_hz=RATE_HZ))
    assert take.report is not None
    assert any("landmarks in a picture" in text for text in take.report.warnings)


def test_without_a_rate_the_option_is_named(
    tmp_path: Path, landmarks: dict[str, np.ndarray]
) -> None:
    np.save(tmp_path / "a.npy", joints("COCO", landmarks))
    with pytest.raises(RecordingError, match="rate_hz"):
        open_recording(tmp_path / "a.npy")


def test_left_handed_axes_are_turned_round_where_that_is_said(
    tmp_path: Path, truth: Truth, landmarks: dict[str, np.ndarray]
) -> None:
    path = tmp_path / "a.npy"
    np.save(path, joints("MediaPipe", landmarks) * (1.0, -1.0, 1.0))
    with pytest.raises(BodyError, match=r"left-handed \(Hints\(mirrored="):
        recognise(open_recording(path, hints=Hints(rate_hz=RATE_HZ)))
    right = open_recording(path, hints=Hints(rate_hz=RATE_HZ, mirrored=True))
    angles, off_mm = truth.errors(recognise(right).apply(right))
    assert np.median(angles) < 3.0 and np.median(off_mm) < 15.0


def test_a_skeleton_is_turned_round_as_a_whole(tmp_path: Path, truth: Truth) -> None:
    path = write_rig(tmp_path / "a.bvh", truth.body, truth.postures[:60], RATE_HZ, Rig())
    hints = Hints(joint_axes=True)
    plain = open_recording(path, positions=True, hints=hints)
    turned = open_recording(path, positions=True, hints=replace(hints, mirrored=True))
    assert turned.markers == pytest.approx(plain.markers * (1.0, -1.0, 1.0))
    assert plain.skeleton is not None and turned.skeleton is not None
    assert turned.skeleton.offsets == pytest.approx(plain.skeleton.offsets * (1.0, -1.0, 1.0))
    with pytest.raises(BodyError, match=r"left-handed \(Hints\(mirrored="):
        recognise(turned)


def test_angles_are_not_mirrored(tmp_path: Path, truth: Truth) -> None:
    path = write_rig(tmp_path / "a.bvh", truth.body, truth.postures[:5], RATE_HZ, Rig())
    with pytest.raises(RecordingError, match="left-handed"):
        open_recording(path, hints=Hints(mirrored=True))
