"""The skeleton that comes with a recording: the tree of the joints, and the bones' lengths."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from mocap_writers import BVH_HIERARCHY, bvh_values, write_amc, write_asf, write_bvh

from mplearn.errors import RecordingError
from mplearn.mocap import open_recording
from mplearn.recording import Skeleton


def test_bones_keep_the_lengths_of_the_offsets(tmp_path: Path) -> None:
    write_asf(tmp_path / "take.asf")
    for path in (write_amc(tmp_path / "take.amc"), write_bvh(tmp_path / "dance.bvh")):
        recording = open_recording(path, positions=True)
        skeleton = recording.skeleton
        assert skeleton is not None
        assert skeleton.names == recording.marker_names
        for joint, parent in enumerate(skeleton.parents):
            if parent >= 0 and skeleton.names[joint] != "Head":  # which moves by itself
                bone = recording.markers[:, joint] - recording.markers[:, parent]
                length = np.linalg.norm(skeleton.offsets[joint])
                assert np.linalg.norm(bone, axis=1) == pytest.approx(length, abs=1e-9)


def test_positions_and_angles_have_the_same_skeleton(tmp_path: Path) -> None:
    path = write_bvh(tmp_path / "dance.bvh")
    of_angles, of_positions = (open_recording(path, positions=p).skeleton for p in (False, True))
    assert of_angles is not None
    assert of_positions is not None
    assert of_angles.names == of_positions.names
    assert of_angles.offsets == pytest.approx(of_positions.offsets)
    assert len(of_angles) == BVH_HIERARCHY.count("OFFSET")
    ends = [name for name, end in zip(of_angles.names, of_angles.ends, strict=True) if end]
    assert ends == ["Arm_end", "Head_end", "Leg_end"]
    at = dict(zip(of_angles.names, of_angles.offsets, strict=True))
    assert at["Spine"] == pytest.approx([0.01, 0.0, 0.25])  # z up, x forward
    assert at["Head"] == pytest.approx(np.median(bvh_values()[:, 12:15], axis=0)[[2, 0, 1]] / 100)
    hips = of_angles.names.index("Hips")
    assert [of_angles.names[i] for i in of_angles.children(hips)] == ["Spine", "Leg"]


def test_markers_have_none(tmp_path: Path) -> None:
    from mocap_writers import write_trc

    assert open_recording(write_trc(tmp_path / "walk.trc")).skeleton is None


def test_a_skeleton_is_a_tree_with_parents_first() -> None:
    with pytest.raises(RecordingError, match="before their children"):
        Skeleton(("knee", "hip"), (1, -1), np.zeros((2, 3)))
    with pytest.raises(RecordingError, match="2 joints need as many"):
        Skeleton(("hip", "knee"), (-1, 0), np.zeros((3, 3)))
