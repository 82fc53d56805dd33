"""A body is found in a stream, and kept when its markers are called otherwise."""

from dataclasses import replace

import numpy as np
import pytest
from played import Given, blocks, frames_of, texts_of
from scipy.spatial.transform import Rotation

from mplearn.mocap import Hints
from mplearn.recording import Recording, marker_channels
from mplearn.sources import Block, Change, Stream, Wanted
from mplearn.sources.recognised import RecognisedSource


def seen(items: list[Block | Change], **wanted: object) -> list[Block | Change]:
    return list(RecognisedSource(Given(items), Wanted(**wanted)))


def test_unit_and_vertical_axis_are_found(session: Recording) -> None:
    y_up = session.markers[..., [0, 2, 1]] * [1000.0, 1000.0, -1000.0]
    items = seen(blocks(Stream(session.channels, 100.0), y_up.reshape(len(session), -1)))
    np.testing.assert_allclose(frames_of(items), session.frames)
    assert any("mm" in text for text in texts_of(items, "body"))
    assert len(frames_of(items)) == len(session)


def test_what_the_caller_says_wins(session: Recording) -> None:
    stream = Stream(session.channels, 100.0)
    items = seen(blocks(stream, session.frames[:200]), hints=Hints(unit_m=1.0, up_axis="z"))
    np.testing.assert_array_equal(frames_of(items), session.frames[:200])


@pytest.mark.parametrize("observe", ["positions", "robot"])
def test_left_handed_axes_are_turned_round_where_that_is_said(
    session: Recording, observe: str
) -> None:
    unity = session.markers[:300][..., [1, 2, 0]] * [-1.0, 1.0, 1.0]  # x right, y up, z ahead
    stream = Stream(session.channels, 100.0, unit_m=1.0, up="y")
    hints = Hints(mirrored=True)
    items = seen(blocks(stream, unity.reshape(300, -1)), hints=hints, observe=observe)
    found, areas = frames_of(items).reshape(300, -1, 3), []
    for each in (found, session.markers[:300]):  # triangles of markers, from above
        one, other = each[:, :-2] - each[:, 1:-1], each[:, 2:] - each[:, 1:-1]
        areas.append(np.cross(one, other)[..., 2])
    np.testing.assert_allclose(*areas, atol=1e-9)
    assert any("left-handed" in text for text in texts_of(items, "body"))


def test_who_leans_by_a_tilted_camera_is_told_and_set_upright_where_that_is_said(
    session: Recording,
) -> None:
    tilt = Rotation.from_euler("x", 25.0, degrees=True)
    tilted = (session.markers[:300] @ tilt.as_matrix().T).reshape(300, -1)
    given = blocks(Stream(session.channels, 100.0, unit_m=1.0, up="z"), tilted)
    plain = seen(given, observe="positions")
    assert any("leans by" in text for text in texts_of(plain, "body"))
    items = seen(given, observe="positions", hints=Hints(level=True))
    assert not any("leans by" in text for text in texts_of(items, "body"))
    found, wanted = (x.reshape(300, -1, 3) for x in (frames_of(items), session.frames[:300]))
    known = ~np.isnan(wanted).any(axis=2)
    off = Rotation.align_vectors(found[known], wanted[known])[0]
    assert np.degrees(off.magnitude()) < 5.0  # people stand so straight


def test_a_subjects_prefix_falls_away(session: Recording) -> None:
    names = tuple(f"Anna:{name}" for name in session.marker_names)
    items = seen(blocks(Stream(marker_channels(names), 100.0), session.frames[:300]))
    block = items[-1]
    assert isinstance(block, Block)
    assert block.channels == session.channels
    np.testing.assert_array_equal(frames_of(items), session.frames[:300])


def test_names_in_another_order_are_put_in_order(session: Recording) -> None:
    order = np.random.default_rng(0).permutation(len(session.marker_names))
    names = tuple(session.marker_names[i] for i in order)
    other = session.markers[200:, order].reshape(len(session) - 200, -1)
    items = seen(
        blocks(Stream(session.channels, 100.0), session.frames[:200])
        + blocks(Stream(marker_channels(names), 100.0), other, 200)
    )
    np.testing.assert_array_equal(frames_of(items), session.frames)
    assert texts_of(items, "names") == ["the names changed; in another order"]


def test_markers_that_get_other_names_are_known_by_where_they_are(session: Recording) -> None:
    frames = np.nan_to_num(session.frames, nan=0.5)
    names = list(session.marker_names)
    names[3:6] = ["m1", "m2", "m3"]
    items = seen(
        blocks(Stream(session.channels, 100.0), frames[:200])
        + blocks(Stream(marker_channels(tuple(names)), 100.0), frames[200:], 200)
    )
    np.testing.assert_array_equal(frames_of(items), frames)
    (text,) = texts_of(items, "names")
    assert f"{session.marker_names[3]} to m1" in text


def test_all_names_may_change(session: Recording) -> None:
    names = tuple(f"p{i}" for i in range(len(session.marker_names)))
    frames = np.nan_to_num(session.frames, nan=0.5)
    items = seen(
        blocks(Stream(session.channels, 100.0), frames[:200])
        + blocks(Stream(marker_channels(names), 100.0), frames[200:], 200)
    )
    np.testing.assert_array_equal(frames_of(items), frames)


def test_a_marker_that_goes_is_missing_and_named(session: Recording) -> None:
    kept = [i for i in range(len(session.marker_names)) if i != 4]
    names = tuple(session.marker_names[i] for i in kept)
    rest = session.markers[200:, kept].reshape(len(session) - 200, -1)
    items = seen(
        blocks(Stream(session.channels, 100.0), session.frames[:200])
        + blocks(Stream(marker_channels(names), 100.0), rest, 200)
    )
    expected = session.frames.copy()
    expected[200:, 12:15] = np.nan
    np.testing.assert_array_equal(frames_of(items), expected)
    assert texts_of(items, "names") == [f"the names changed; gone: {session.marker_names[4]}"]


def test_a_second_subject_is_named_and_left_out(session: Recording) -> None:
    both = np.concatenate([session.frames[200:], session.frames[200:] + 1.0], axis=1)
    names = tuple(f"{who}:{name}" for who in ("Anna", "Ben") for name in session.marker_names)
    alone = Stream(marker_channels(names[: len(names) // 2]), 100.0)
    items = seen(
        blocks(alone, session.frames[:200])
        + blocks(Stream(marker_channels(names), 100.0), both, 200)
    )
    np.testing.assert_array_equal(frames_of(items), session.frames)
    assert texts_of(items, "subject") == ["'Ben' appeared in the stream"]


def test_the_other_subject_is_followed_when_the_first_leaves(session: Recording) -> None:
    names = tuple(f"Ben:{name}" for name in session.marker_names)
    anna = tuple(f"Anna:{name}" for name in session.marker_names)
    items = seen(
        blocks(Stream(marker_channels(anna), 100.0), session.frames[:200])
        + blocks(Stream(marker_channels(names), 100.0), session.frames[200:] + 5.0, 200)
    )
    assert len(frames_of(items)) == len(session)
    np.testing.assert_array_equal(frames_of(items)[200:], session.frames[200:] + 5.0)


def test_nobody_is_said_and_counted(session: Recording) -> None:
    names = tuple(f"p{i}" for i in range(len(session.marker_names)))
    source = RecognisedSource(
        Given(blocks(Stream(marker_channels(names), 100.0), np.tile(session.frames, (3, 1)))),
        Wanted(),
    )
    items = list(source)
    assert not [item for item in items if isinstance(item, Block)]
    assert "belong to no known set" in texts_of(items, "body")[0]
    assert source.tally.unrecognised == 3 * len(session)
    assert source.tally.frames == 0
    dropped = [item.count for item in items if isinstance(item, Change)]
    assert sum(dropped) == 3 * len(session)


def test_a_map_says_what_is_what(session: Recording) -> None:
    places = {
        "C7": "c7", "T10": "t10", "CLAV": "jugular_notch", "STRN": "xiphoid",
        "LSHO": "acromion_l", "RSHO": "acromion_r", "LASI": "iliac_front_l",
        "RASI": "iliac_front_r", "LANK": "ankle_outer_l", "RANK": "ankle_outer_r",
    }  # fmt: skip
    names = tuple(f"p{i}" for i in range(len(session.marker_names)))
    said = {f"p{session.marker_names.index(name)}": place for name, place in places.items()}
    items = seen(blocks(Stream(marker_channels(names), 100.0), session.frames), names=said)
    block = items[-1]
    assert isinstance(block, Block)
    assert {name[:-2] for name in block.channels} == set(places.values())
    assert len(frames_of(items)) == len(session)


def test_the_wait_for_a_body_costs_no_frame_and_no_order(session: Recording) -> None:
    items = seen(blocks(Stream(session.channels, 100.0), session.frames, size=1))
    times = np.concatenate([item.times_s for item in items if isinstance(item, Block)])
    np.testing.assert_array_equal(times, np.arange(len(session)) / 100.0)


def test_plain_channels_pass_as_they_come() -> None:
    frames = np.random.default_rng(1).normal(size=(30, 2))
    stream = Stream(("hip", "knee"), 50.0)
    np.testing.assert_array_equal(frames_of(seen(blocks(stream, frames))), frames)
    other = replace(stream, channels=("knee", "ankle"))
    items = seen(blocks(stream, frames[:10]) + blocks(other, frames[10:], 10))
    np.testing.assert_array_equal(frames_of(items)[10:, 1], frames[10:, 0])
    assert np.isnan(frames_of(items)[10:, 0]).all()


@pytest.mark.parametrize("observe", ["positions", "channels"])
def test_positions_and_channels(session: Recording, observe: str) -> None:
    stream = Stream(session.channels, 100.0, unit_m=1.0, up="z")
    items = seen(blocks(stream, session.frames), observe=observe)
    np.testing.assert_array_equal(frames_of(items), session.frames)


@pytest.mark.parametrize("observe", ["channels", "robot"])
def test_channels_that_become_markers_of_the_same_names_are_missing(observe: str) -> None:
    channels, markers = Stream(("a", "b"), 100.0), Stream(marker_channels(("a", "b")), 100.0)
    ones, more = np.ones((30, 2)), np.ones((200, 6))
    items = seen(blocks(channels, ones) + blocks(markers, more, 30), observe=observe)
    frames = frames_of(items)
    assert frames.shape[1] == 2
    np.testing.assert_array_equal(frames[:30], ones)
    assert np.isnan(frames[30:]).all()
    assert "what comes are points now" in texts_of(items, "names")[0]
