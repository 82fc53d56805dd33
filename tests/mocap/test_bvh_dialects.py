"""BVH as tools bend it: each dialect holds the same motion as the plain file, or says why not."""

from __future__ import annotations

import re
import warnings
from collections.abc import Callable
from functools import partial
from itertools import permutations
from pathlib import Path

import numpy as np
import pytest
from calls import count_calls
from data_folder import CASES, DATA, needs_cases, needs_data
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from mocap_writers import BVH_HIERARCHY, bvh_values, write_bvh
from scipy.spatial.transform import Rotation

from mplearn.errors import MPLearnError, RecordingError, RecordingWarning
from mplearn.mocap import Hints, open_recording

FOLDER = CASES or Path()
NAMES = ("Hips", "Spine", "Arm", "Head", "Leg")


def points_of(path: Path, hints: Hints | None = None) -> np.ndarray:
    return open_recording(path, positions=True, hints=hints).markers


def plain(folder: Path) -> tuple[str, np.ndarray]:
    path = write_bvh(folder / "plain.bvh")
    return path.read_text(), points_of(path)


def in_lines(text: str, change: Callable[[str], str]) -> str:
    head, _, rows = text.partition("Frame Time: 0.01\n")
    return f"{head}Frame Time: 0.01\n{change(rows)}"


def wrapped(text: str) -> str:
    return in_lines(text, lambda rows: re.sub(r"((?:\S+ ){7})", r"\1\n", rows))


def glued(text: str) -> str:
    return in_lines(text, lambda rows: re.sub(r" -", "-", rows))


def comma(text: str) -> str:
    return in_lines(text, lambda rows: rows.replace(".", ",")).replace("Time: 0.01", "Time: 0,01")


# what the dialect does to the file, and what is to be said about it
DIALECTS: dict[str, tuple[Callable[[str], str], str]] = {
    "names with blanks": (lambda s: re.sub(r"(ROOT|JOINT) (\w+)", r"\1 Bip01 \2", s), ""),
    "brace behind the name": (lambda s: re.sub(r"(\w)\n\s*\{", r"\1 {", s), ""),
    "brace glued to the name": (lambda s: re.sub(r"(\w)\n\s*\{", r"\1{", s), ""),
    "named end sites": (lambda s: s.replace("End Site", "End Site tip of it"), ""),
    "EndSite": (lambda s: s.replace("End Site", "EndSite"), ""),
    "End site": (lambda s: s.replace("End Site", "END site"), ""),
    "lower case": (lambda s: "\n".join(line.lower() for line in s.split("\n")), ""),
    "a joint named like an end": (lambda s: s.replace("JOINT Head", "JOINT Arm_end"), ""),
    "the same name twice": (lambda s: s.replace("JOINT Leg", "JOINT Arm"), "Arm_2"),
    "frames one less": (lambda s: s.replace("Frames: 12", "Frames: 11"), "says 11"),
    "frames one more": (lambda s: s.replace("Frames: 12", "Frames:\t13"), "says 13"),
    "frames without end": (lambda s: s.replace("Frames: 12", "Frames: " + "9" * 5000), "says 9"),
    "no number of frames": (lambda s: s.replace("Frames: 12\n", ""), "12 frames"),
    "wrapped": (wrapped, ""),
    "glued": (glued, ""),
    "decimal commas": (comma, ""),
    "windows": (lambda s: s.replace("\n", "\r\n"), ""),
    "old mac": (lambda s: s.replace("\n", "\r"), ""),
    "tabs": (lambda s: s.replace("  ", "\t").replace(" ", "\t"), ""),
    "byte order mark": (lambda s: "\ufeff" + s, ""),
    "blank lines": (lambda s: in_lines(s, lambda rows: rows.replace("\n", "\n\n")) + "\n \n", ""),
    "text behind": (lambda s: s + "exported by a tool\nof 1999\n", "text behind"),
    "cut in a frame": (lambda s: s + "1.0 2.0 3.0\n", "cut off after 3 of 19"),
    "channels miscounted": (
        lambda s: s.replace("CHANNELS 1 Xrotation", "CHANNELS 3 Xrotation"), "1 channels, not 3",
    ),
    "offsets with rotations": (
        lambda s: re.sub(r"(OFFSET \S+ \S+ \S+)", r"\1 90.0 0.5 -90.0", s), "",
    ),
    "channels before the offset": (
        lambda s: s.replace(
            "    OFFSET 9 -2 0\n    CHANNELS 1 Xrotation", "CHANNELS 1 Xrotation\nOFFSET 9 -2 0"
        ), "",
    ),
}  # fmt: skip


@pytest.mark.parametrize("dialect", DIALECTS)
def test_a_dialect_holds_the_same_motion(tmp_path: Path, dialect: str) -> None:
    text, expected = plain(tmp_path)
    change, said = DIALECTS[dialect]
    assert change(text) != text
    path = tmp_path / "dialect.bvh"
    path.write_bytes(change(text).encode())
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        recording = open_recording(path, positions=True)
    assert recording.rate_hz == 100.0
    assert recording.markers == pytest.approx(expected, abs=1e-9)
    assert len(set(recording.marker_names)) == len(recording.marker_names)
    texts = [str(warning.message) for warning in caught]
    assert len(texts) == (1 if said else 0)
    assert all(said in text for text in texts)


@pytest.mark.parametrize("wobble", [0.0, 0.3])
def test_positions_that_are_counted_from_the_offsets(tmp_path: Path, wobble: float) -> None:
    """Some tools write zeros where others repeat the offset."""
    values = bvh_values()
    text = BVH_HIERARCHY.replace("CHANNELS 3 ", "CHANNELS 6 Xposition Yposition Zposition ")
    rng = np.random.default_rng(0)
    off = wobble * rng.normal(size=(3, len(values), 3))
    offsets = np.array([[0, 25, 1], [18, 30, -2], [0, 40, 0]])
    parts = np.split(values, [6, 9, 12, 15], axis=1)  # hips, spine, arm, head's place, the rest
    tables = []
    for add in (np.zeros((3, 1, 3)), offsets[:, None]):
        moved = off + add
        places = [moved[0], parts[1], moved[1], parts[2], moved[2], parts[4]]
        tables.append(np.concatenate([parts[0], *places], axis=1))
    ours, usual = (
        points_of(write_bvh(tmp_path / f"{i}.bvh", table, text)) for i, table in enumerate(tables)
    )
    assert ours == pytest.approx(usual, abs=1e-12)
    assert np.linalg.norm(ours[:, 1] - ours[:, 0], axis=1).min() > 0.2


def test_latin_1_names(tmp_path: Path) -> None:
    text, expected = plain(tmp_path)
    path = tmp_path / "take.bvh"
    path.write_bytes(text.replace("Hips", "H\u00fcfte").encode("latin-1"))
    recording = open_recording(path, positions=True)
    assert recording.marker_names[0] == "H\u00fcfte"
    assert recording.markers == pytest.approx(expected, abs=1e-12)


@pytest.mark.parametrize("encoding", ["utf-16", "utf-8-sig"])
def test_encodings_with_a_mark(tmp_path: Path, encoding: str) -> None:
    text, expected = plain(tmp_path)
    path = tmp_path / "take.bvh"
    path.write_bytes(text.encode(encoding))
    assert points_of(path) == pytest.approx(expected, abs=1e-12)


def test_cells_that_are_no_numbers_are_missing_with_what_hangs_on_them(tmp_path: Path) -> None:
    values = bvh_values()
    values[3, 9] = np.nan  # the arm's rotation
    path = write_bvh(tmp_path / "take.bvh", values)
    path.write_text(path.read_text().replace("nan", "-1.#IND00"))
    with pytest.warns(RecordingWarning, match="1 cells are not numbers"):
        recording = open_recording(path, positions=True)
    gone = {recording.marker_names[i] for i in np.flatnonzero(np.isnan(recording.markers[3, :, 0]))}
    assert gone == {"Arm_end"}
    assert np.isnan(recording.markers).sum() == 3
    with pytest.warns(RecordingWarning, match="1 cells"):
        angles = open_recording(path)
    assert {angles.channels[i] for i in np.flatnonzero(np.isnan(angles.frames).any(axis=0))} == {
        f"Arm.r{axis}" for axis in "xyz"
    }


@pytest.mark.parametrize(
    ("text", "rate_hz"),
    [("0.0083333", 120.0), ("0.008333", 120.0), ("0.00833", 120.0), ("0.0166667", 60.0),
     ("0.016667", 60.0), ("0.01666", 60.0), ("0.033333", 30.0), ("0.0333667", 29.97),
     ("0.0041667", 240.0), ("0.04", 25.0), ("0,008333", 120.0), ("8.3333e-3", 120.0),
     ("0.0013", 1 / 0.0013), ("0.00138889", 720.0)],
)  # fmt: skip
def test_rate(tmp_path: Path, text: str, rate_hz: float) -> None:
    path = write_bvh(tmp_path / "take.bvh")
    path.write_text(path.read_text().replace("Time: 0.01", f"Time: {text}"))
    assert open_recording(path).rate_hz == pytest.approx(rate_hz, rel=1e-4)
    if rate_hz == int(rate_hz) and rate_hz != 720 and "e" not in text:
        assert open_recording(path).rate_hz == rate_hz


@pytest.mark.parametrize("line", ["Frame Time: 0", "Frame Time: nan", "Frame Time: 1e-9", ""])
def test_a_rate_that_makes_no_sense_is_asked_for(tmp_path: Path, line: str) -> None:
    path = write_bvh(tmp_path / "take.bvh")
    path.write_text(path.read_text().replace("Frame Time: 0.01", line))
    with pytest.raises(RecordingError, match=r"Frame Time.*Hints\(rate_hz=\.\.\.\)"):
        open_recording(path)
    assert open_recording(path, hints=Hints(rate_hz=50.0)).rate_hz == 50.0


@pytest.mark.parametrize(
    ("change", "found"),
    [
        (lambda s: in_lines(s, lambda _: ""), "no frames"),
        (lambda s: in_lines(s, lambda rows: rows.replace("\n", " 7\n")), "20 columns"),
        (lambda s: in_lines(s, lambda rows: rows.replace("\n", "\n7 ", 1)), "20 columns"),
        (lambda s: in_lines(s, lambda rows: "one " + rows), "holds text"),
        (lambda s: s + "three\n1 2 3\n", "holds text"),
        (lambda s: s[: s.index("MOTION")], "MOTION"),
        (lambda s: s.replace("End Site", "JOINT"), "'{' after a name"),
        (lambda s: s.replace("OFFSET 0 25 1", "OFFSET 0 25 nan"), "OFFSET of Spine"),
        (lambda s: s.replace("OFFSET 0 25 1", ""), "'Spine' has no OFFSET"),
        (lambda s: s.replace("Xrotation Yrotation Zrotation", "Xscale Yscale Zscale"), "Xscale"),
    ],
)  # fmt: skip
def test_what_is_no_bvh_is_named(tmp_path: Path, change: Callable[[str], str], found: str) -> None:
    path = write_bvh(tmp_path / "broken.bvh")
    path.write_text(change(path.read_text()))
    with pytest.raises(RecordingError, match=rf"broken\.bvh.*{found}"):
        open_recording(path)


def test_what_is_no_person_is_read_as_it_is(tmp_path: Path) -> None:
    """A hand: neither its size nor how it lies tells the unit or what is up."""
    fingers = "".join(
        f"JOINT LeftHand{name}1\n{{\nOFFSET 9 0 {2 * i}\nCHANNELS 1 Zrotation\n"
        f"JOINT LeftHand{name}2\n{{\nOFFSET 4 0 0\nCHANNELS 1 Zrotation\n"
        "End Site\n{\nOFFSET 3 0 0\n}\n}\n}\n"
        for i, name in enumerate(("Thumb", "Index", "Middle", "Ring", "Pinky"))
    )
    root = "OFFSET 0 0 0\nCHANNELS 3 Xposition Yposition Zposition\n"
    text = f"HIERARCHY\nROOT LeftHand\n{{\n{root}{fingers}}}\n"
    values = np.random.default_rng(0).uniform(0, 40, (30, 13))
    values[:, :3] = [3.0, 110.0, 5.0]
    path = write_bvh(tmp_path / "hand.bvh", values, text)
    recording = open_recording(path)
    assert recording.channels[:4] == (
        "LeftHand.ty",
        "LeftHand.tz",
        "LeftHand.tx",
        "LeftHandThumb1.rz",
    )
    assert recording.frames[0, 1] == pytest.approx(1.1)
    assert recording.report is not None
    assert (recording.report.unit_m, recording.report.up) == (0.01, "y")
    assert recording.report.notes[0].startswith("no person")
    assert open_recording(path, hints=Hints(unit_m=0.02)).frames[0, 1] == pytest.approx(2.2)


def test_several_trees(tmp_path: Path) -> None:
    text, expected = plain(tmp_path)
    prop = "ROOT Stick\n{\nOFFSET 0 0 0\nCHANNELS 3 Xposition Yposition Zposition\n"
    prop += "End Site\n{\nOFFSET 0 100 0\n}\n}\nMOTION"
    path = tmp_path / "take.bvh"
    text = in_lines(text.replace("MOTION", prop), lambda rows: rows.replace("\n", " 50 0 0\n"))
    path.write_text(text)
    recording = open_recording(path, positions=True)
    assert recording.markers[:, :8] == pytest.approx(expected, abs=1e-12)
    assert recording.marker_names[8:] == ("Stick", "Stick_end")
    assert recording.markers[:, 9] == pytest.approx(np.tile([0.0, 0.5, 1.0], (12, 1)))
    assert recording.skeleton is not None
    assert recording.skeleton.parents[8] == -1


@settings(
    max_examples=60, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture]
)
@given(
    orders=st.lists(st.sampled_from(["".join(p) for p in permutations("XYZ")]), min_size=4,
                    max_size=4),
    partial=st.sampled_from(["", "X", "Y", "Z", "XY", "ZX", "YZ", "ZY"]),
    seed=st.integers(0, 1000),
    unit=st.sampled_from([0.01, 1.0, 0.001, 0.0254]),
)  # fmt: skip
def test_any_rotation_order(
    tmp_path: Path, orders: list[str], partial: str, seed: int, unit: float
) -> None:
    """Positions by matrices of scipy; angles, continuous, make the same rotations."""
    order = dict(zip(NAMES, [*orders, partial], strict=True))
    place = {"Hips": [0, 95, 0], "Spine": [0, 25, 1], "Arm": [18, 30, -2], "Head": [0, 40, 0],
             "Leg": [9, -92, 0]}  # fmt: skip
    ends = {"Arm": [55, 0, 0], "Head": [0, 20, 0], "Leg": [0, 0, 15]}
    place, ends = ({k: np.array(v) * 0.01 / unit for k, v in d.items()} for d in (place, ends))

    def channels(name: str) -> str:
        turns = [f"{axis}rotation" for axis in order[name]]
        words = ["Xposition", "Yposition", "Zposition", *turns] if name == "Hips" else turns
        return f"CHANNELS {len(words)} {' '.join(words)}"

    def joint(name: str, *inside: str) -> str:
        kind = "ROOT" if name == "Hips" else "JOINT"
        if name in ends:
            inside = (f"End Site\n{{\nOFFSET {' '.join(map(repr, ends[name].tolist()))}\n}}\n",)
        offset = " ".join(map(repr, place[name].tolist()))
        body = f"OFFSET {offset}\n{channels(name)}\n{''.join(inside)}"
        return f"{kind} {name}\n{{\n{body}}}\n"

    text = "HIERARCHY\n" + joint("Hips", joint("Spine", joint("Arm"), joint("Head")), joint("Leg"))
    rng = np.random.default_rng(seed)
    n_frames = 40
    wander = np.cumsum(rng.normal(0, 6.0, (n_frames, sum(map(len, order.values())))), axis=0)
    angles = rng.uniform(-30, 30, wander.shape[1]) + wander
    widths = np.cumsum([len(order[name]) for name in NAMES])[:-1]
    turns = dict(zip(NAMES, np.split(angles, widths, axis=1), strict=True))
    root = place["Hips"] + np.cumsum(rng.normal(0, 0.002 / unit, (n_frames, 3)), axis=0)
    path = write_bvh(tmp_path / "take.bvh", np.concatenate([root, angles], axis=1), text)
    hints = Hints(unit_m=unit, up_axis="y")
    got = open_recording(path, positions=True, hints=hints)

    def turned(name: str) -> Rotation:
        if not order[name]:
            return Rotation.identity(n_frames)
        return Rotation.from_euler(order[name], turns[name], degrees=True)

    hips = turned("Hips")
    spine = hips * turned("Spine")
    expected = {"Hips": root, "Spine": root + hips.apply(place["Spine"])}
    for name, above, turn in (
        ("Arm", "Spine", spine),
        ("Head", "Spine", spine),
        ("Leg", "Hips", hips),
    ):
        expected[name] = expected[above] + turn.apply(place[name])
        expected[f"{name}_end"] = expected[name] + (turn * turned(name)).apply(ends[name])
    for index, name in enumerate(got.marker_names):
        assert got.markers[:, index] == pytest.approx(expected[name][:, [2, 0, 1]] * unit, abs=1e-9)

    recording = open_recording(path, hints=hints)
    channel = dict(zip(recording.channels, recording.frames.T, strict=True))
    for name in NAMES[1:]:
        if order[name]:
            mine = np.stack([channel[f"{name}.r{axis.lower()}"] for axis in order[name]], axis=1)
            apart = (Rotation.from_euler(order[name], mine) * turned(name).inv()).magnitude()
            assert np.degrees(apart.max()) < 3.0
            assert np.degrees(np.median(apart)) < 1e-6


@pytest.mark.parametrize("order", ["".join(p) for p in permutations("XYZ")])
def test_a_shoulder_that_rests_at_gimbal_lock_rests(tmp_path: Path, order: str) -> None:
    values = bvh_values(90)
    values[:] = values[0]
    turning = 100.0 * np.arange(90)
    even = order in ("XYZ", "YZX", "ZXY")
    values[:, 9:12] = np.stack([turning, np.full(90, 90.0), turning * (-1 if even else 1)], 1)
    arm = "CHANNELS 3 Yrotation Zrotation Xrotation"
    assert arm in BVH_HIERARCHY
    words = " ".join(f"{axis}rotation" for axis in order)
    hierarchy = BVH_HIERARCHY.replace(arm, f"CHANNELS 3 {words}")
    path = write_bvh(tmp_path / "take.bvh", values, hierarchy)
    hints = Hints(up_axis="y")
    angles = open_recording(path, hints=hints).frames
    assert np.ptp(angles, axis=0) == pytest.approx(np.zeros(19), abs=1e-9)
    assert np.ptp(points_of(path, hints), axis=0) == pytest.approx(np.zeros((8, 3)), abs=1e-9)


def test_frames_are_read_without_a_loop_over_them(tmp_path: Path) -> None:
    rng = np.random.default_rng(0)
    rows = "\n".join(" ".join(f"{x:.6f}" for x in row) for row in rng.uniform(-30, 30, (200, 19)))
    hints = Hints(unit_m=0.01, up_axis="y")
    calls = []
    for times in (3, 300):
        n_frames = 200 * times
        head = f"{BVH_HIERARCHY}MOTION\nFrames: {n_frames}\nFrame Time: 0.01\n"
        path = tmp_path / f"{n_frames}.bvh"
        path.write_text(head + (rows + "\n") * times)
        assert len(open_recording(path, hints=hints)) == n_frames
        calls.append(count_calls(partial(open_recording, path, hints=hints)))
    assert calls[1] - calls[0] < 600  # for 59,400 more frames


@settings(
    max_examples=300, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture]
)
@given(data=st.data())
def test_mutated_files_never_surprise(tmp_path: Path, data: st.DataObject) -> None:
    words = re.split(r"(\s+)", write_bvh(tmp_path / "plain.bvh").read_text())
    odd = ["{", "}", "End", "Site", "JOINT", "ROOT", "-", "1-1-1-1-1", "nan", "9" * 5000, "1e999",
           "CHANNELS", "6", "OFFSET", "MOTION", "\n", "", "#", ",", "Frames:", "\x01"]  # fmt: skip
    for _ in range(data.draw(st.integers(1, 6), "changes")):
        words[data.draw(st.integers(0, len(words) - 1), "place")] = data.draw(st.sampled_from(odd))
    path = tmp_path / "mutant.bvh"
    path.write_text("".join(words))
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", RecordingWarning)
        for positions in (False, True):
            try:
                recording = open_recording(path, positions=positions)
            except MPLearnError as error:
                assert path.name in str(error)
            else:
                assert not np.isinf(recording.frames).any()


# the case files: a person of 0.95 m hip height, both in one place whatever the dialect
SAME = {
    "bvh_names_with_spaces.bvh": ("Bip01 ", 60, ""),
    "bvh_joint_named_end.bvh": ("", 75, ""),
    "bvh_frames_minus_1.bvh": ("", 60, "says 59"),
    "bvh_cmu_cgspeed_unit.bvh": ("", 60, ""),
    "bvh_zup.bvh": ("", 60, ""),
    "bvh_frames_wrapped.bvh": ("", 60, ""),
    "bvh_named_end_site.bvh": ("", 60, ""),
    "bvh_with_fingers.bvh": ("", 180, ""),
}


@needs_cases
@pytest.mark.parametrize("name", SAME)
def test_case(name: str) -> None:
    prefix, n_channels, said = SAME[name]
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        recording = open_recording(FOLDER / name, positions=True)
    assert [said in str(warning.message) for warning in caught] == ([True] if said else [])
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        angles = open_recording(FOLDER / name)
    assert len(angles.channels) == n_channels
    assert (len(recording), recording.rate_hz) == (60, 60.0)
    at = dict(zip(recording.marker_names, recording.markers[0], strict=True))
    assert at[f"{prefix}Hips"] == pytest.approx([0.0, 0.0, 0.95], abs=1e-3)
    hand = at["Bip01 L Hand" if prefix else "LeftHand"]
    assert hand[2] == pytest.approx(1.609, abs=1e-3)
    if name == "bvh_zup.bvh":  # which way is forward is not said
        assert np.hypot(hand[0], hand[1]) == pytest.approx(np.hypot(0.088, 0.514), abs=1e-3)
    else:
        assert hand[:2] == pytest.approx([0.088, 0.514], abs=1e-3)
    report = recording.report
    assert report is not None
    assert report.up == ("z" if name == "bvh_zup.bvh" else "y")
    unit = 0.0254 / 0.45 if name == "bvh_cmu_cgspeed_unit.bvh" else 0.01
    assert report.unit_m == pytest.approx(unit, rel=1e-3)


@needs_cases
def test_case_gimbal() -> None:
    recording = open_recording(FOLDER / "bvh_gimbal.bvh")
    assert (len(recording), recording.rate_hz) == (120, 30.0)
    assert np.ptp(recording.frames, axis=0) == pytest.approx(np.zeros(15), abs=1e-9)
    assert recording.frames[0, recording.channels.index("LeftShoulder.ry")] == pytest.approx(
        np.pi / 2
    )


@needs_data
def test_all_of_bandai_namco_stands_upright() -> None:
    files = sorted(((DATA or Path()) / "bandai_namco").glob("*.bvh.gz"))
    assert len(files) == 200
    for file in files[::4]:
        recording = open_recording(file, positions=True)
        assert recording.rate_hz == 30.0
        at = dict(zip(recording.marker_names, np.moveaxis(recording.markers, 1, 0), strict=True))
        assert 0.7 < np.median(at["Hips"][:, 2]) < 1.1  # its channels, not its offset of 437 cm
        assert 1.2 < np.median(at["Head"][:, 2]) < 1.8
        assert -0.1 < np.percentile(recording.markers[..., 2].min(axis=1), 5) < 0.15
        for side in "LR":
            shank = np.linalg.norm(at[f"Foot_{side}"] - at[f"LowerLeg_{side}"], axis=1)
            assert np.ptp(shank) < 1e-3
        assert recording.skeleton is not None
        bones = dict(zip(recording.skeleton.names, recording.skeleton.offsets, strict=True))
        assert np.linalg.norm(bones["Foot_L"]) == pytest.approx(np.median(shank), abs=0.02)
