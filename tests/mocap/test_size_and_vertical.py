"""The unit of length and the vertical axis are found, and what cannot be told is not guessed."""

from __future__ import annotations

import numpy as np
import pytest
from data_folder import DATA, needs_data
from hypothesis import given, settings
from hypothesis import strategies as st

from mplearn.body import human_body
from mplearn.demonstrator import demonstrate
from mplearn.mocap import open_recording
from mplearn.mocap.placing.part_names import place_of
from mplearn.mocap.placing.size import CMU_UNIT_M, UNITS_M, find_unit, named_unit
from mplearn.mocap.placing.space import upright
from mplearn.mocap.placing.vertical import DIRECTIONS, find_vertical

RATE_HZ = 50.0
LEGS = ("KNE", "ANK", "HEE", "TOE", "MT5", "ASI", "PSI")
ARMS = ("SHO", "UPA", "ELB", "WRA", "WRB", "FIN", "CLAV", "STRN", "C7", "T10")
SITTING = {"Hips": "pelvis", "Spine": "abdomen", "Chest": "chest", "Head": "head"} | {
    f"{word}{joint}": f"{part}_{word[0].lower()}"
    for word in ("Left", "Right")
    for joint, part in (("UpLeg", "thigh"), ("Leg", "shank"), ("Foot", "foot"), ("Toe", "toes"))
}


@pytest.fixture(scope="module")
def standing() -> tuple[np.ndarray, tuple[str, ...]]:
    recording = demonstrate(
        ["BAR", "BAL", "SQD", "SQR", "LKR", "LKT"] * 2, 3, rate_hz=RATE_HZ
    ).recording
    return recording.markers, recording.marker_names


def only(
    points: np.ndarray, names: tuple[str, ...], wanted: tuple[str, ...]
) -> tuple[np.ndarray, tuple[str, ...]]:
    kept = [i for i, name in enumerate(names) if name.lstrip("LR") in wanted or name in wanted]
    return points[:, kept], tuple(names[i] for i in kept)


@pytest.mark.parametrize("up", ["y", "-y", "z"])
def test_points_counted_from_the_hips_show_no_floor(
    standing: tuple[np.ndarray, tuple[str, ...]], up: str
) -> None:
    points, names = standing
    hips = [i for i, name in enumerate(names) if name[1:] in ("ASI", "PSI")]
    own = (points - points[:, hips].mean(axis=1, keepdims=True)) @ upright(up)
    found = find_vertical(own, names, RATE_HZ, "z")
    assert (found.up, found.doubtful) == (up, False)


@pytest.mark.parametrize("up", DIRECTIONS)
@pytest.mark.parametrize("declared", DIRECTIONS)
def test_the_vertical_of_a_standing_person(
    standing: tuple[np.ndarray, tuple[str, ...]], up: str, declared: str
) -> None:
    points, names = standing
    in_file = points @ upright(up)  # the inverse turn
    found = find_vertical(in_file, names, RATE_HZ, declared)
    assert (found.up, found.contradicts, found.doubtful) == (up, up != declared, False)
    assert np.allclose(in_file @ upright(found.up).T, points, atol=1e-12, equal_nan=True)


@pytest.mark.parametrize("up", ["y", "z", "-z"])
@pytest.mark.parametrize("part", [LEGS, ARMS])
@pytest.mark.parametrize("origin_m", [0.0, -1.4])
def test_the_vertical_of_a_part_of_a_person(
    standing: tuple[np.ndarray, tuple[str, ...]], up: str, part: tuple[str, ...], origin_m: float
) -> None:
    points, names = only(*standing, part)
    moved = points + np.array([0.4, 0.7, origin_m])
    for declared in ("y", "z"):
        found = find_vertical(moved @ upright(up), names, RATE_HZ, declared)
        assert found.up == up or found.doubtful
        if part is LEGS:
            assert found.up == up


@needs_data
@pytest.mark.parametrize("part", [(), LEGS, ARMS, tuple(f"R{name}" for name in ARMS[:6])])
def test_real_people_are_never_turned_wrongly_without_a_warning(part: tuple[str, ...]) -> None:
    assert DATA is not None
    sure = settled = 0
    for take in ("m01_s01", "m02_s02", "m05_s03", "m06_s01", "m08_s04", "m09_s05"):
        recording = open_recording(DATA / "ui_prmd", take=take)
        points, names = recording.markers, recording.marker_names
        if part:
            points, names = only(points, names, part)
        for up in ("z", "y", "-z"):
            for origin_m in (0.0, -1.4):
                moved = (points + np.array([0.6, 1.3, origin_m])) @ upright(up)
                for declared in ("y", "z"):
                    found = find_vertical(moved, names, recording.rate_hz, declared)
                    assert found.up == up or found.doubtful
                    sure += not found.doubtful
                    # posture alone, against the format, may be somebody's who lies or hangs
                    settled += declared == up or (origin_m == 0.0 and part is not ARMS)
        for true_m in (1.0, 0.01, 0.001):
            for declared_m in (1.0, 0.01, 0.001):
                assert find_unit(points / true_m, names, declared_m).unit_m == true_m
    assert sure >= settled or len(names) < 8  # an arm alone tells nothing


def test_names_alone_are_not_believed_of_who_lies_or_stands_on_the_hands(
    standing: tuple[np.ndarray, tuple[str, ...]],
) -> None:
    points, names = standing
    for turn in (upright("x").T, upright("y").T):
        lying = points @ turn
        lying = lying - [0, 0, np.nanmin(lying[..., 2]) - 0.03]
        lying = lying + np.array([2.0, -1.5, 0.0])
        found = find_vertical(lying, names, RATE_HZ, "z")
        assert found.up == "z"
    noise = np.random.default_rng(0).normal(0.0, 0.002, (100, *points.shape[1:]))
    inverted = (points[:1] + noise) @ upright("-z")
    inverted = inverted - [0, 0, np.nanmin(inverted[..., 2])]
    found = find_vertical(inverted, names, RATE_HZ, "z")
    assert (found.up, found.doubtful) == ("z", True)


@pytest.mark.parametrize("declared", ["y", "z"])
@pytest.mark.parametrize("up", ["y", "z", "-z"])
@pytest.mark.parametrize("pose", ["x", "-x", "y", "-y", "-z"])
def test_who_lies_swims_or_stands_on_the_hands_is_not_turned_without_a_warning(
    standing: tuple[np.ndarray, tuple[str, ...]], pose: str, up: str, declared: str
) -> None:
    points, names = standing
    still = points[:1] + np.random.default_rng(1).normal(0.0, 0.002, (100, *points.shape[1:]))
    turned = still @ upright(pose)  # head towards x, y, or down
    on_floor = turned - [0.0, 0.0, np.nanmin(turned[..., 2]) - 0.03]
    far = np.array([1.7, -2.3, 0.0])
    at_walls = on_floor - np.minimum(np.nanmin(on_floor, axis=(0, 1)), 0.0) * (1.0, 1.0, 0.0)
    if up == "-z":
        at_walls = on_floor = on_floor + far  # which floor is one to stand on cannot be told
    ahead = np.arange(100)[:, None, None] * 0.02 * upright(pose)[2]  # through water
    for moved in (on_floor, on_floor + far, at_walls, turned + ahead, turned + far + ahead):
        found = find_vertical(moved @ upright(up), names, RATE_HZ, declared)
        assert found.up == up or found.doubtful


def test_who_sits_with_the_legs_ahead_is_not_tipped_over(
    standing: tuple[np.ndarray, tuple[str, ...]],
) -> None:
    body = human_body()
    q = np.repeat(body.rest[None], 50, axis=0)
    for side in "lr":
        q[:, 7 + body.joint_names.index(f"hip_pitch_{side}")] = -1.5
    bodies = [body.tree.body(part) for part in SITTING.values()]
    points = np.array([body.tree.forward(each)[0][bodies] for each in q])
    points = points - [0.0, 0.0, points[..., 2].min() - 0.03]
    for declared in ("y", "z"):
        for moved in (points + np.array([1.0, 2.0, 0.0]), points):
            found = find_vertical(moved, tuple(SITTING), RATE_HZ, declared)
            assert found.up == "z" or (found.doubtful and declared == "y")


def test_without_known_names_the_floor_tells(
    standing: tuple[np.ndarray, tuple[str, ...]],
) -> None:
    points, _ = standing
    numbered = tuple(f"M{i}" for i in range(points.shape[1]))
    for up in ("y", "z"):
        for declared in ("y", "z"):
            found = find_vertical(points @ upright(up), numbered, RATE_HZ, declared)
            assert (found.up, found.doubtful) == (up, False)


def test_a_cloud_tells_nothing() -> None:
    cloud = np.random.default_rng(0).normal(2.0, 0.5, (50, 8, 3))
    found = find_vertical(cloud, tuple("abcdefgh"), RATE_HZ, "y")
    assert (found.up, found.doubtful) == ("y", True)
    alone = find_vertical(cloud[:, :1], ("a",), RATE_HZ, "-x")
    assert (alone.up, alone.doubtful) == ("-x", True)
    nothing = find_vertical(np.full((4, 5, 3), np.nan), tuple("abcde"), RATE_HZ, "z")
    assert (nothing.up, nothing.doubtful) == ("z", True)


@pytest.mark.parametrize("true_m", [*UNITS_M.values(), CMU_UNIT_M])
@pytest.mark.parametrize("stature", [0.5, 1.0, 1.25])
@pytest.mark.parametrize("part", [LEGS, ARMS, LEGS + ARMS])
def test_a_wrong_unit_is_found_by_the_person(
    standing: tuple[np.ndarray, tuple[str, ...]],
    true_m: float,
    stature: float,
    part: tuple[str, ...],
) -> None:
    points, names = only(*standing, part)
    in_file = points * stature / true_m
    right = find_unit(in_file, names, true_m)
    assert (right.unit_m, right.fits, right.contradicts) == (true_m, True, False)
    if part is ARMS or stature == 0.5 or true_m not in (1.0, 0.001, 0.01):
        return
    for declared_m in (1.0, 0.001, 0.01):
        found = find_unit(in_file, names, declared_m)
        assert found.unit_m == true_m
        assert found.contradicts == (declared_m != true_m)


@pytest.mark.parametrize("true_m", [0.0254, CMU_UNIT_M])
def test_inches_and_the_unit_of_cmus_conversions(
    standing: tuple[np.ndarray, tuple[str, ...]], true_m: float
) -> None:
    points, names = standing
    assert find_unit(points / true_m, names, 1.0).unit_m == true_m


def test_numbers_that_no_one_measured_have_no_unit(
    standing: tuple[np.ndarray, tuple[str, ...]],
) -> None:
    points, names = standing
    with np.errstate(all="ignore"):
        found = find_unit(points * 1e308, names, 1.0, says_so=False)
    assert not found.fits


@settings(max_examples=60, deadline=None)
@given(
    seed=st.integers(0, 10_000),
    n_points=st.integers(8, 60),
    true_m=st.sampled_from([1.0, 0.01, 0.001]),
    declared_m=st.sampled_from([1.0, 0.01, 0.001]),
)
def test_without_names_the_spread_tells_what_is_far_off(
    seed: int, n_points: int, true_m: float, declared_m: float
) -> None:
    rng = np.random.default_rng(seed)
    body = rng.uniform([-0.3, -0.4, 0.0], [0.3, 0.4, 1.8], (n_points, 3))
    in_file = np.repeat(body[None], 5, axis=0) / true_m
    found = find_unit(in_file, ("?",) * n_points, declared_m)
    if abs(np.log10(declared_m / true_m)) in (0.0, 2.0, 3.0):
        assert found.unit_m == true_m
    assert found.contradicts == (found.unit_m != declared_m)


@pytest.mark.parametrize(
    ("text", "unit_m"),
    [
        *(("mm", 0.001), ("MM", 0.001), ("[mm]", 0.001), ("Millimeters", 0.001), ("mill", 0.001)),
        *(("m", 1.0), ("mete", 1.0), ("metres", 1.0), ("cm", 0.01), ("cent", 0.01), ("dm", 0.1)),
        *(("inches", 0.0254), ("in", 0.0254), ("ft", 0.3048), ("feet", 0.3048)),
        *(("parsec", None), ("", None), ("x", None), ("mi", None)),
    ],
)
def test_units_as_files_write_them(text: str, unit_m: float | None) -> None:
    assert named_unit(text) == unit_m


@pytest.mark.parametrize(
    ("name", "part", "side"),
    [
        *(("LFHD", "head", "l"), ("Anna:RBHD", "head", "r"), ("Head", "head", "")),
        *(("R.ASIS", "pelvis", "r"), ("L_IAS", "pelvis", "l"), ("V.Sacral", "pelvis", "")),
        *(("LeftUpLeg", "thigh", "l"), ("LeftLeg", "knee", "l"), ("RKNE", "knee", "r")),
        *(("LeftForeArm", "elbow", "l"), ("RFRM", "arm", "r"), ("LFIN", "arm", "l")),
        *(("L_FCC", "heel", "l"), ("RHEE", "heel", "r"), ("LHeel", "heel", "l")),
        *(("RBigToe", "toe", "r"), ("L_FM5", "toe", "l"), ("LeftToeBase", "toe", "l")),
        *(("Anna_T10", "trunk", ""), ("joint14", "", ""), ("Point 12", "", "")),
        *(("L_FAL", "ankle", "l"), ("RAnkle", "ankle", "r"), ("left ankle", "ankle", "l")),
        *(("C7", "shoulder", ""), ("LSHO", "shoulder", "l"), ("Neck", "shoulder", "")),
        *(("T10", "trunk", ""), ("Spine1", "trunk", ""), ("STRN", "trunk", "")),
        *(("nose", "head", ""), ("left_ear", "head", "l"), ("M7", "", ""), ("", "", "")),
    ],
)
def test_what_names_tell(name: str, part: str, side: str) -> None:
    place = place_of(name)
    assert (place.part, place.side) == (part, side)


def test_who_lies_with_the_feet_at_a_wall_is_believed_to_lie(
    standing: tuple[np.ndarray, tuple[str, ...]],
) -> None:
    points, names = standing
    still = points[:1] + np.random.default_rng(0).normal(0.0, 0.002, (100, *points.shape[1:]))
    for turn in (upright("x").T, upright("y").T):
        lying = still @ turn
        lying = lying - [0, 0, np.nanmin(lying[..., 2]) - 0.02]
        found = find_vertical(lying, names, RATE_HZ, "z", says_so=True)
        assert (found.up, found.doubtful) == ("z", True)
    for up in ("y", "z"):  # and who stands, is not
        found = find_vertical(still @ upright(up), names, RATE_HZ, "z", says_so=True)
        assert found.up == up
