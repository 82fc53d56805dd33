"""Map files: what a user says about points, and what is refused."""

import pytest
from rigs import Rig, write_rig

from mplearn.anatomy import read_map, recognise
from mplearn.errors import BodyError
from mplearn.mocap import Hints, open_recording


def test_lines_are_points_and_places(tmp_path):
    path = tmp_path / "map.txt"
    path.write_text("# ours\nLeft Up = hip_l  # the thigh\n\na=b = knee_r\nprop = -\n")
    assert read_map(path) == {"Left Up": "hip_l", "a=b": "knee_r", "prop": ""}


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("hip_l", "expected 'point = place'"),
        ("a = hip", "no place 'hip' on the body; there are hip_"),
        ("a = hip_l\na = hip_r", "second time"),
        ("a = hip_l\nb = hip_l", "second time"),
        (" = hip_l", "expected"),
    ],
)
def test_a_line_that_is_none_is_refused_by_its_number(tmp_path, text, said):
    path = tmp_path / "map.txt"
    path.write_text(text)
    with pytest.raises(BodyError, match=said) as caught:
        read_map(path)
    assert f"line {1 + text.count(chr(10))}" in str(caught.value)


def test_a_map_settles_sides_and_leaves_joints_out(tmp_path, truth):
    path = write_rig(tmp_path / "rig.bvh", truth.body, truth.postures[:60], 25.0, Rig())
    recording = open_recording(path, positions=True, hints=Hints(joint_axes=True))
    body = recognise(recording, names={"LeftFoot": "ankle_r", "Neck": ""})
    assert dict(body.parts)["knee_r"] == ("LeftLeg",)
    assert dict(body.parts)["wrist_r"] == ("LeftHand",)
    assert "neck" not in body.places
