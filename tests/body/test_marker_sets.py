"""Marker sets: found by their names, mirrored, on the skin of every body."""

import numpy as np
import pytest
from data_folder import DATA, needs_data

from mplearn.body import find_marker_set, human_body, marker_set, robot_body
from mplearn.body.marker_sets.tables import TABLES
from mplearn.errors import BodyError

UI_PRMD = [
    *("LFHD", "RFHD", "LBHD", "RBHD", "C7", "T10", "CLAV", "STRN", "RBAK", "LSHO"),
    *("LUPA", "LELB", "LFRM", "LWRA", "LWRB", "LFIN", "RSHO", "RUPA", "RELB", "RFRM"),
    *("RWRA", "RWRB", "RFIN", "LASI", "RASI", "LPSI", "RPSI", "LTHI", "LKNE", "LTIB"),
    *("LANK", "LHEE", "LTOE", "RTHI", "RKNE", "RTIB", "RANK", "RHEE", "RTOE"),
]


def test_sizes_and_order():
    assert len(marker_set("paper34").names) == 34
    assert list(marker_set("plug_in_gait39").names) == UI_PRMD
    assert len(marker_set("cmu41").names) == 41


@pytest.mark.parametrize("name", TABLES)
def test_a_set_is_found_by_its_names_in_any_order_case_and_with_a_prefix(name):
    names = [f"Subject 1:{marker.lower()}" for marker in reversed(marker_set(name).names)]
    assert find_marker_set(names).name == name
    chosen = marker_set(name).select(names)
    np.testing.assert_array_equal(chosen.offsets, marker_set(name).offsets[::-1])


@needs_data
def test_the_c3d_files_markers_are_the_cmu_set():
    ezc3d = pytest.importorskip("ezc3d")
    labels = ezc3d.c3d(str(DATA / "c3d" / "85_12.c3d"))["parameters"]["POINT"]["LABELS"]["value"]
    assert find_marker_set(labels).name == "cmu41"


@pytest.mark.parametrize("body", [human_body(), robot_body(), human_body(1.3)])
@pytest.mark.parametrize("name", TABLES)
def test_every_set_sits_on_every_body_between_floor_and_crown(body, name):
    bodies, offsets = marker_set(name).attach(body.tree)
    places = body.tree.points(body.rest, bodies, offsets)
    assert (places[:, 2] > 0).all() and (places[:, 2] < body.height_m).all()
    assert np.abs(places[:, :2]).max() < 0.2 * body.height_m


@pytest.mark.parametrize("name", ["paper34", "plug_in_gait39", "cmu41"])
def test_left_and_right_markers_mirror_each_other(name):
    chosen = marker_set(name)
    body = human_body()
    places = dict(
        zip(chosen.names, body.tree.points(body.rest, *chosen.attach(body.tree)), strict=True)
    )
    pairs = [n for n in chosen.names if n.startswith("L") and "R" + n[1:] in places]
    assert len(pairs) >= 14
    for left in pairs:
        np.testing.assert_allclose(places[left], places["R" + left[1:]] * (1, -1, 1), atol=1e-12)


def test_unknown_names():
    with pytest.raises(BodyError, match="paper34"):
        marker_set("paper35")
    with pytest.raises(BodyError, match="no marker set knows"):
        find_marker_set([f"M{i}" for i in range(40)])
    with pytest.raises(BodyError, match="more than once"):
        find_marker_set(["LSHO", "A:LSHO", *marker_set("cmu41").names[:20]])
    with pytest.raises(BodyError, match="NOSE"):
        marker_set("cmu41").select(["LSHO", "NOSE"])
