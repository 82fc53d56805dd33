"""Key points of animals: the same wherever they are, however large, however they are turned."""

import pickle
import re
import struct
import tracemalloc
from pathlib import Path

import h5py
import numpy as np
import pandas
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from mocap_writers import KEYPOINTS, keypoint_values, write

from mplearn import LearnerConfig, MotionLearner, open_recording
from mplearn.errors import RecordingError, RecordingWarning
from mplearn.mocap import Hints, find_takes, open_recordings, open_takes
from mplearn.mocap.keypoints.egocentric import seen_from_the_body
from mplearn.recording import FloatArray

NAMES = ("snout", "left_paw", "right_paw", "tail_base")
RATE_HZ = 50.0


def mouse(seconds: float = 24.0, z: bool = False) -> FloatArray:
    """Return points, shape (T, 4, 2), of a mouse that raises one paw, then the other, and rests."""
    t = np.arange(0, seconds, 1 / RATE_HZ)
    bump = np.where(t % 2 < 1, np.sin(np.pi * t) ** 2, 0.0)
    left, right = (np.where((t // 2) % 2 == k, bump, 0.0) for k in (0, 1))
    points = np.zeros((len(t), 4, 3))
    points[:, :, 0] = [2.0, 0.8, 0.8, -2.0]
    points[:, 1, 1], points[:, 2, 1] = 0.7 + 0.6 * left, -0.7 - 0.6 * right
    points[:, 1, 0] += 0.8 * left
    points[:, 2, 0] += 0.8 * right
    points[:, 1, 2] = left
    return points if z else points[..., :2]


def placed(points: FloatArray, size: float, turn: float, speed: float = 3.0) -> FloatArray:
    """Return points turned, enlarged and moved on a curve."""
    t = np.arange(len(points)) / RATE_HZ
    angle = turn + 0.4 * np.sin(0.5 * t)
    c, s = np.cos(angle), np.sin(angle)
    rotation = np.stack([np.stack([c, -s], 1), np.stack([s, c], 1)], axis=1)
    moved = points.copy()
    moved[..., :2] = np.einsum("tij,tkj->tki", rotation, points[..., :2])
    path = np.cumsum(np.stack([c, s], axis=1), axis=0) * speed / RATE_HZ
    moved[..., :2] += path[:, None]
    return size * moved


@settings(deadline=None, max_examples=25)
@given(st.floats(0.01, 500), st.floats(-10, 10), st.booleans())
def test_where_and_how_large_changes_nothing(size: float, turn: float, z: bool) -> None:
    plain, channels, length = seen_from_the_body(mouse(4.0, z), NAMES, RATE_HZ)
    seen, _, larger = seen_from_the_body(placed(mouse(4.0, z), size, turn), NAMES, RATE_HZ)
    np.testing.assert_allclose(seen, plain, atol=1e-8)
    assert larger == pytest.approx(size * length)
    assert length == pytest.approx(4.0)
    assert channels[:3] == ("snout.ahead", "snout.left", "snout.up" if z else "left_paw.ahead")


def test_without_names_the_heading_is_where_it_goes() -> None:
    for turn in (0.0, 2.0, 4.0):
        seen, _, _ = seen_from_the_body(
            placed(mouse(8.0), 1.0, turn), ("a", "b", "c", "d"), RATE_HZ
        )
        assert (seen[:, 0] > 0.3).all()  # the snout is ahead
        assert (seen[:, 3] > 0.1).all()  # the left paw is left


def test_short_gaps_are_bridged_and_long_ones_stay() -> None:
    points = mouse(8.0)
    likelihood = np.ones(points.shape[:2])
    likelihood[50:55, 1] = 0.2
    likelihood[100:150, 2] = 0.2
    seen, _, _ = seen_from_the_body(points, NAMES, RATE_HZ, likelihood)
    lost = np.isnan(seen)
    assert lost[100:150, [4, 5]].all()
    lost[100:150, [4, 5]] = False
    assert not lost.any()
    with pytest.raises(RecordingError, match="three"):
        seen_from_the_body(points, NAMES, RATE_HZ, np.zeros_like(likelihood))
    with pytest.raises(RecordingError, match="one place"):
        seen_from_the_body(np.ones_like(points), NAMES, RATE_HZ)


def deeplabcut(path: Path, points: FloatArray, animals: tuple[str, ...] = ()) -> None:
    """Write a table as DeepLabCut does: by pandas, with heads of several rows."""
    pixels = points * [1, -1]  # rows are counted downwards
    values = np.concatenate([pixels, np.full((*points.shape[:2], 1), 0.99)], axis=2)
    heads = [["net"], list(NAMES), ["x", "y", "likelihood"]]
    names = ["scorer", "bodyparts", "coords"]
    flat = values.reshape(len(points), -1)
    if animals:
        heads.insert(1, list(animals))
        names.insert(1, "individuals")
        rare = np.full_like(flat, np.nan)
        rare[:10] = flat[:10]
        flat = np.concatenate([rare, flat], axis=1)
    columns = pandas.MultiIndex.from_product(heads, names=names)
    pandas.DataFrame(flat, columns=columns).to_csv(path)


def test_a_table_of_deeplabcut_is_learned(tmp_path: Path) -> None:
    points = 40 * placed(mouse(), 1.0, 1.0) + 300
    deeplabcut(tmp_path / "mouse.csv", points)
    take = open_recording(tmp_path / "mouse.csv", hints=Hints(rate_hz=RATE_HZ))
    expected, channels, _ = seen_from_the_body(mouse(), NAMES, RATE_HZ)
    assert take.channels == channels
    np.testing.assert_allclose(take.frames, expected, atol=1e-6)
    learner = MotionLearner(LearnerConfig(take.channels, take.rate_hz))
    for _ in learner.learn_recording(take, 100):
        pass
    assert 2 <= len(learner.tree.leaves) <= 4  # each paw, up and down


def test_of_several_animals_the_one_seen_most_is_read(tmp_path: Path) -> None:
    deeplabcut(tmp_path / "two.csv", mouse(4.0), ("shy", "bold"))
    take = open_recording(tmp_path / "two.csv")
    assert "pictures there are a second" in take.report.notes[0]
    assert (take.person, take.rate_hz, take.report.left_out) == ("bold", 30.0, ("shy",))


def test_several_animals_that_are_seen_often_are_a_take_each(tmp_path: Path) -> None:
    points = mouse(4.0)
    other = points[::-1]  # does the same backwards, and is seen from frame 30 on
    rows = [
        {"track": track, "frame_idx": k, "instance.score": 0.9,
         **{f"{name}.{axis}": at[k, p, a] * (1, -1)[a] for p, name in enumerate(NAMES)
            for a, axis in enumerate("xy")}, **{f"{name}.score": 0.9 for name in NAMES}}
        for track, at, first, last in (("b", other, 30, 200), ("a", points, 0, 200),
                                       ("c", points, 0, 20))
        for k in range(first, last)
    ]  # fmt: skip
    pandas.DataFrame(rows).to_csv(tmp_path / "pair.analysis.csv", index=False)
    hints = Hints(rate_hz=RATE_HZ)
    b, a = open_recordings(tmp_path / "pair.analysis.csv", hints=hints)
    assert [(each.name, each.person) for each in (b, a)] == [
        ("pair.analysis (b)", "b"),
        ("pair.analysis (a)", "a"),
    ]
    assert a.report.left_out == b.report.left_out == ("c",)
    assert "2 animals: b, a" in " ".join(a.report.notes)
    alone = open_recording(tmp_path / "pair.analysis.csv", hints=hints)
    assert alone.person == "a"
    np.testing.assert_array_equal(alone.frames, a.frames)
    expected, _, _ = seen_from_the_body(points, NAMES, RATE_HZ)
    np.testing.assert_allclose(a.frames, expected[:200], atol=1e-3)
    assert np.isnan(b.frames[:30]).all()  # what both do at once has the same time
    assert np.isfinite(b.frames[30:]).all()
    (take,) = find_takes(tmp_path).takes
    assert [each.person for each in take.read(hints=hints)] == ["b", "a"]


@pytest.mark.parametrize("apart", [False, True])
def test_tracks_that_come_one_after_the_other_are_read(tmp_path: Path, apart: bool) -> None:
    points = mouse(4.0)[:150]
    flat = points.reshape(len(points), -1)
    starts = {"first": 0, "second": 150, "third": 100_000 if apart else 300}
    rows = [
        ",".join([track, f"{start + k}", *(f"{value:.4f}" for value in flat[k])])
        for track, start in starts.items()
        for k in range(len(flat))
    ]
    rows.append(",".join(["stray", "1e9", *map(str, flat[0])]))  # costs no other
    columns = ["track", "frame_idx", *(f"{name}.{axis}" for name in NAMES for axis in "xy")]
    path = tmp_path / "tracks.analysis.csv"
    path.write_text("\n".join([",".join(columns), *rows, ""]))
    found = open_recordings(path, hints=Hints(rate_hz=RATE_HZ))
    assert [each.person for each in found] == list(starts)
    assert [len(each) for each in found] == ([150] * 3 if apart else [150, 300, 450])
    assert ("pictures far apart" in " ".join(found[0].report.notes)) == apart
    for each in found:
        assert np.isfinite(each.frames[-150:]).all()
        assert each.report.left_out == ("stray",)


def test_an_animal_that_cannot_be_read_costs_no_other(tmp_path: Path) -> None:
    points = mouse(4.0)
    values = np.concatenate([points, np.full((*points.shape[:2], 1), 0.99)], axis=2)
    stuck = values * [0.0, 0.0, 1.0]
    heads = [["net"], ["stuck", "well", "also"], list(NAMES), ["x", "y", "likelihood"]]
    flat = np.concatenate([each.reshape(len(points), -1) for each in (stuck, values, values)], 1)
    names = ["scorer", "individuals", "bodyparts", "coords"]
    columns = pandas.MultiIndex.from_product(heads, names=names)
    pandas.DataFrame(flat, columns=columns).to_csv(tmp_path / "three.csv")
    with pytest.warns(RecordingWarning, match=r"stuck is left out: .*one place"):
        found = open_recordings(tmp_path / "three.csv", hints=Hints(rate_hz=RATE_HZ))
    assert [each.person for each in found] == ["well", "also"]


def test_sleap_has_a_row_for_each_frame_and_track(tmp_path: Path) -> None:
    points = mouse(4.0) * [1, -1]
    rows = [
        {
            "track": track, "frame_idx": 7 + k, "instance.score": 0.9,
            **{f"{name}.{axis}": points[k, p, a] for p, name in enumerate(NAMES)
               for a, axis in enumerate("xy")},
            **{f"{name}.score": 0.9 for name in NAMES},
        }
        for track, last in (("track_0", 200), ("track_1", 20))
        for k in range(last) if k != 50
    ]  # fmt: skip
    pandas.DataFrame(rows).to_csv(tmp_path / "mouse.analysis.csv", index=False)
    take = open_recording(tmp_path / "mouse.analysis.csv", hints=Hints(rate_hz=RATE_HZ))
    expected, _, _ = seen_from_the_body(mouse(4.0), NAMES, RATE_HZ)
    assert take.person == "track_0"
    np.testing.assert_allclose(np.delete(take.frames, 50, 0), np.delete(expected, 50, 0), atol=1e-6)
    assert np.isfinite(take.frames).all()  # one frame is bridged


@pytest.mark.parametrize("tracked", [True, False])
def test_a_row_may_hold_all_animals_wherever_each_stands_in_it(
    tmp_path: Path, tracked: bool
) -> None:
    """As sleap-io's CSV of frames does: a place in the row is no animal where tracks are said."""
    both = {"anna": mouse(4.0) * [1, -1], "ben": mouse(4.0) * [1, -1] + 40.0}
    rows, apart = [], []
    for k in range(200):
        order = ["anna", "ben"] if k < 100 or not tracked else ["ben", "anna"]
        if k >= 190:
            order.remove("ben")
        row: dict[str, object] = {"frame_idx": k}
        for place, name in enumerate(order):
            at = {
                f"{point}.{axis}": both[name][k, p, a] + 0.01 * k * (name == "ben")
                for p, point in enumerate(NAMES)
                for a, axis in enumerate("xy")
            }
            track = {"track": name} if tracked else {}
            row |= {f"inst{place}.{key}": value for key, value in (track | at).items()}
            apart.append({"frame_idx": k, "track": name if tracked else f"inst{place}", **at})
        rows.append(row)
    pandas.DataFrame(rows).to_csv(tmp_path / "frames.csv", index=False)
    pandas.DataFrame(apart).to_csv(tmp_path / "instances.csv", index=False)
    found, expected = (
        open_recordings(tmp_path / f"{name}.csv", hints=Hints(rate_hz=RATE_HZ))
        for name in ("frames", "instances")
    )
    assert [each.person for each in found] == (["anna", "ben"] if tracked else ["inst0", "inst1"])
    for one, other in zip(found, expected, strict=True):
        assert one.channels == other.channels
        np.testing.assert_array_equal(one.frames, other.frames)


def test_a_row_may_be_named_like_its_picture(tmp_path: Path) -> None:
    deeplabcut(tmp_path / "mouse.csv", 40 * mouse(4.0) + 300)
    heads = (tmp_path / "mouse.csv").read_text().splitlines()
    named = [f"labeled-data/mouse/img{line}" for line in heads[3:]]
    named = [line.replace(",", ".png,", 1) for line in named]
    (tmp_path / "named.csv").write_text("\n".join([*heads[:3], *named, ""]))
    one, other = (
        open_recording(tmp_path / f"{name}.csv", hints=Hints(rate_hz=RATE_HZ))
        for name in ("mouse", "named")
    )
    assert len(one) == len(other)
    np.testing.assert_array_equal(one.frames, other.frames)


HEADS = [
    ["scorer", *["net"] * 12],
    ["bodyparts", *[name for name in KEYPOINTS for _ in range(3)]],
    ["coords", *["x", "y", "likelihood"] * 4],
]
ROWS = [[str(k), *(f"{x:.6f}" for x in row)] for k, row in enumerate(keypoint_values())]
SLEAP = ["track", "frame_idx", *[f"{n}.{c}" for n in KEYPOINTS for c in ("x", "y", "score")]]
FLAT = ["frame", *[f"{n}_{c}" for n in KEYPOINTS for c in ("x", "y", "likelihood")]]


def _points() -> list[list[str]]:
    return [
        [row[0], "mouse", name, *row[1 + 3 * k : 4 + 3 * k]]
        for row in ROWS
        for k, name in enumerate(KEYPOINTS)
    ]


@pytest.mark.parametrize(
    ("rows", "separator"),
    [
        ([*HEADS, *ROWS], ","),
        ([*HEADS, *ROWS], "\t"),
        ([*HEADS, *ROWS], ";"),
        ([*HEADS, ["frame", *[""] * 12], *ROWS], ","),  # an index with a name
        ([HEADS[0], ["individuals", *["mouse"] * 12], *HEADS[1:], *ROWS], ","),
        ([*HEADS[1:], *ROWS], ","),
        ([["", *row[1:]] for row in HEADS] + ROWS, ","),
        ([[f'"{cell}"' for cell in row] for row in [*HEADS, *ROWS]], ","),
        ([SLEAP, *(["mouse", *row] for row in ROWS)], ","),
        ([SLEAP[1:], *ROWS], ","),
        ([["", "video", *SLEAP], *(["0", "a.mp4", "mouse", *row] for row in ROWS)], ","),
        ([[*SLEAP[1::-1], *SLEAP[2:]], *([row[0], "mouse", *row[1:]] for row in ROWS)], ";"),
        ([["frame_idx", "track", "node", "x", "y", "score"], *_points()], ","),
        ([FLAT, *ROWS], ","),
        ([FLAT[1:], *(row[1:] for row in ROWS)], ","),
    ],
)
def test_tables_spelled_otherwise(tmp_path: Path, rows: list[list[str]], separator: str) -> None:
    if separator == ";":  # decimals have a comma there
        rows = [[re.sub(r"^(-?\d+)\.", r"\1,", cell) for cell in row] for row in rows]
    (tmp_path / "a_50fps.csv").write_text("".join(separator.join(row) + "\n" for row in rows))
    take = open_recording(tmp_path / "a_50fps.csv")
    seen = keypoint_values().reshape(len(ROWS), 4, 3)
    expected, channels, _ = seen_from_the_body(seen[..., :2] * [1, -1], KEYPOINTS, 50.0)
    assert (take.channels, take.rate_hz) == (channels, 50.0)
    np.testing.assert_allclose(take.frames, expected, atol=1e-6)


def test_pictures_that_are_left_out_are_a_gap(tmp_path: Path) -> None:
    rows = [row for k, row in enumerate(ROWS) if not 4 <= k < 9]
    (tmp_path / "a_10fps.csv").write_text("".join(",".join(row) + "\n" for row in HEADS + rows))
    take = open_recording(tmp_path / "a_10fps.csv")
    assert len(take) == len(ROWS)
    assert np.flatnonzero(np.isnan(take.frames).all(axis=1)).tolist() == [4, 5, 6, 7, 8]


@pytest.mark.parametrize("each", ["track", "node"])
def test_many_names_far_apart_take_no_memory(tmp_path: Path, each: str) -> None:
    head = "frame_idx,track,node,x,y,score" if each == "node" else ",".join(SLEAP)
    n = 2000
    rows = [
        f"{50 * k},one,node{k},1,2,0.9" if each == "node" else f"track{k},{50 * k}" + ",1,2,0.9" * 4
        for k in range(n)
    ]
    (tmp_path / "a.csv").write_text("\n".join([head, *rows]) + "\n")
    tracemalloc.start()
    with pytest.raises(RecordingError):
        open_recording(tmp_path / "a.csv")
    most = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert most < 50e6


@pytest.mark.parametrize("format", ["DeepLabCut", "SLEAP"])
def test_hdf5_holds_what_the_table_does(tmp_path: Path, format: str) -> None:
    hdf5 = write(tmp_path, f"{format} HDF5")
    found = open_recording(hdf5)
    table = open_recording(write(tmp_path, format))
    np.testing.assert_allclose(found.frames, table.frames, atol=1e-6)
    assert (found.channels, found.person) == (table.channels, table.person)
    (take,) = find_takes(tmp_path).takes  # both hold it: the table is read
    assert take.reader.format == format
    other = hdf5.rename(tmp_path / "other.h5")
    assert [each.name for each in find_takes(tmp_path).takes] == ["other", "take"]
    with h5py.File(tmp_path / "weights.hdf5", "w") as file:  # of something else
        file["layer"] = np.zeros(3)
        file["raw"], file["sums"] = h5py.SoftLink("/gone"), h5py.ExternalLink("gone.h5", "/sums")
    assert [each.name for each in find_takes(tmp_path).takes] == ["other", "take"]
    assert open_takes(tmp_path).passed_over == ("weights.hdf5",)
    with pytest.raises(
        RecordingError, match=r"holds \['layer', 'raw', 'sums'\]; expected a table of DeepLabCut"
    ):
        open_recording(tmp_path / "weights.hdf5")
    other.write_bytes(other.read_bytes()[:-500])
    with pytest.raises(RecordingError, match=r"other\.h5: damaged"):
        open_recordings(tmp_path, strict=True)


@pytest.mark.parametrize("name", ["pandas_table", "pandas_fixed", "sleap_io"])
def test_files_of_the_programs_themselves(name: str) -> None:
    """Written by pandas with PyTables, as DeepLabCut does, and by sleap-io, one frame by hand."""
    take = open_recording(Path(__file__).parent / "data" / f"{name}.h5.gz")
    seen = keypoint_values().reshape(len(ROWS), 4, 3)
    expected, channels, _ = seen_from_the_body(seen[..., :2] * [1, -1], KEYPOINTS, 30.0)
    assert take.channels == channels
    np.testing.assert_allclose(take.frames, expected, atol=1e-9)


@pytest.mark.parametrize("order", ["tckf", "fkct", "ftkc"])
@pytest.mark.parametrize("z", [False, True])
def test_sleap_exports_arrays_in_several_orders(tmp_path: Path, order: str, z: bool) -> None:
    points = np.stack([mouse(4.0, z), mouse(4.0, z)[::-1]], axis=1)  # (f, t, k, c)
    pixels = points if z else points * [1, -1]
    pixels[150:, 0] = np.nan  # seen less often than the other
    with h5py.File(tmp_path / "pair_50fps.h5", "w") as file:
        file["tracks"] = np.einsum(f"ftkc->{order}", pixels)
        file["node_names"] = np.array(NAMES, "S")
        file["track_names"] = np.array(["left", "right"], "S")
    left, right = open_recordings(tmp_path / "pair_50fps.h5")
    assert (left.person, right.person, right.rate_hz) == ("left", "right", 50.0)
    expected, channels, _ = seen_from_the_body(mouse(4.0, z)[::-1], NAMES, RATE_HZ)
    assert right.channels == channels
    np.testing.assert_allclose(right.frames, expected, atol=1e-6)


def test_what_pandas_pickled_is_only_names(tmp_path: Path) -> None:
    path = write(tmp_path, "DeepLabCut HDF5")
    with h5py.File(path, "r+") as file:
        told = np.bytes_(pickle.dumps([Path("found"), "x"], 0))
        file["df_with_missing/table"].attrs["values_block_0_kind"] = told
    with pytest.raises(RecordingError, match=r"damaged \(pathlib"):
        open_recording(path)
    with h5py.File(path, "r+") as file:  # an array of 2^28 bytes, of which none is there
        told = np.bytes_(b"\x80\x05\x96" + struct.pack("<Q", 2**28) + b".")
        file["df_with_missing/table"].attrs["values_block_0_kind"] = told
    tracemalloc.start()
    with pytest.raises(RecordingError, match="damaged"):
        open_recording(path)
    _, most = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    assert most < 50e6
