"""Sessions from takes: made takes whose reversals and sides are known, and people's."""

from collections import Counter
from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from data_folder import DATA, needs_data

from mplearn.errors import InvalidValueError, RecordingError
from mplearn.evaluation.executions import (
    all_without_gaps,
    find_limb,
    find_reversal,
    split_repetitions,
    stood_like,
    without_gaps,
)
from mplearn.evaluation.sessions import SessionConfig, make_session
from mplearn.recording import LabelledSegment, Recording, marker_channels

MARKERS = ("LANK", "RANK", "LWRA", "RWRA", "LASI", "RASI", "HEAD")
STAND = np.array(
    [[0, 0.1, 0.1], [0, -0.1, 0.1], [0, 0.3, 0.8], [0, -0.3, 0.8], [0.1, 0.1, 1], [0.1, -0.1, 1],
     [0, 0, 1.7]]
)  # fmt: skip


def take(name, moving, reps=4, length=200, turn=0.4, start_away=False):
    """A take in which one marker goes out and back, with its true reversals at `turn`."""
    x = np.arange(length) / length
    there = np.where(x < turn, x / turn, (1 - x) / (1 - turn))
    bell = there**3 * (10 - 15 * there + 6 * there**2)
    if start_away:
        bell = 1 - bell
    points = np.repeat(STAND[None], reps * length, axis=0)
    points[:, MARKERS.index(moving), 0] += 0.4 * np.tile(bell, reps)
    return Recording(
        frames=points.reshape(len(points), -1),
        rate_hz=100.0,
        channels=marker_channels(MARKERS),
        name=name,
        person="s1",
        labels=tuple(
            LabelledSegment(i * length, (i + 1) * length, name, "s1") for i in range(reps)
        ),
    )


TAKES = [take("a", "RANK"), take("b", "LWRA", turn=0.6), take("c", "HEAD", length=150)]


def test_the_reversal_is_found():
    for turn in (0.3, 0.5, 0.7):
        recording = take("a", "RANK", turn=turn)
        assert abs(find_reversal(recording.frames[:200], 100.0) - 200 * turn) <= 6


def test_the_side_is_that_of_the_limb_that_travels():
    assert find_limb(TAKES[0], TAKES[0].frames) == ("R", "leg")
    assert find_limb(TAKES[1], TAKES[1].frames) == ("L", "arm")
    assert find_limb(TAKES[2], TAKES[2].frames) == ("", "body")


def test_joint_angles_have_sides_too():
    t = np.linspace(0, 6, 300)
    frames = np.column_stack([np.sin(t), 0.01 * np.sin(t)])
    recording = Recording(frames, 100.0, ("shoulder_pitch_l", "shoulder_pitch_r"))
    assert find_limb(recording, frames) == ("L", "arm")


def test_repetitions_become_out_and_back():
    split = split_repetitions(TAKES)
    assert [label.label for label in split[0].labels[:2]] == ["aR-out", "aR-back"]
    assert {label.label for label in split[1].labels} == {"bL-out", "bL-back"}
    assert {label.label for label in split[2].labels} == {"c-out", "c-back"}
    assert split[0].labels[0].start == 200  # the first repetition is dropped
    assert abs(split[0].labels[0].end - 280) <= 2


def test_out_leads_away_from_where_takes_start():
    takes = [take("a", "RANK"), take("d", "RANK"), take("e", "RANK", start_away=True)]
    assert split_repetitions(takes)[2].labels[0].label == "eR-back"


def test_a_session_holds_every_execution_once_and_tiles():
    session = make_session(TAKES, np.random.default_rng(0))
    counts = Counter(label.label for label in session.labels)
    assert counts == {f"{m}-{half}": 3 for m in ("aR", "bL", "c") for half in ("out", "back")}
    assert session.labels[0].start == 0
    assert session.labels[-1].end == len(session)
    for a, b in pairwise(session.labels):
        assert a.end == b.start
        if a.label.endswith("out"):
            assert b.label == a.label.replace("out", "back")


def test_a_session_is_reproducible_and_its_order_random():
    a, b, c = (make_session(TAKES, np.random.default_rng(seed)) for seed in (5, 5, 6))
    assert np.array_equal(a.frames, b.frames)
    assert a.labels == b.labels
    assert [s.label for s in a.labels] != [s.label for s in c.labels]


def test_joins_are_smooth_though_bodies_stand_elsewhere():
    turned = []
    for i, recording in enumerate(TAKES):
        c, s = np.cos(i), np.sin(i)
        turn = np.array([[c, -s, 0], [s, c, 0], [0, 0, 1]])
        points = recording.markers @ turn.T + [3.0 * i, 1.0, 0.0]
        turned.append(replace(recording, frames=points.reshape(len(points), -1)))
    session = make_session(turned, np.random.default_rng(1))
    steps = np.linalg.norm(np.diff(session.markers, axis=0), axis=2).max()
    inside = max(np.linalg.norm(np.diff(t.markers, axis=0), axis=2).max() for t in TAKES)
    assert steps <= 1.5 * inside
    hips = session.markers[:, 4:6].mean(axis=1)
    assert np.ptp(hips[:, :2], axis=0).max() < 1.0


def test_standing_like_a_frame_undoes_a_turn_and_a_shift():
    c, s = np.cos(0.7), np.sin(0.7)
    moved = STAND @ np.array([[c, -s, 0], [s, c, 0], [0, 0, 1]]).T + [2.0, -1.0, 0.0]
    back = stood_like(moved.reshape(1, -1), STAND.ravel())
    assert np.allclose(back[0], STAND.ravel(), atol=1e-12)


def test_missing_measurements_stay_missing():
    frames = TAKES[0].frames.copy()
    frames[450:460, 0:3] = np.nan
    takes = [replace(TAKES[0], frames=frames), *TAKES[1:]]
    session = make_session(takes, np.random.default_rng(0))
    assert np.isnan(session.frames).sum() == 30
    assert not np.isnan(without_gaps(session.frames)).any()


def test_features_make_a_session_too():
    takes = [
        replace(t, channels=tuple(f"joint_{i}" for i in range(t.frames.shape[1]))) for t in TAKES
    ]
    session = make_session(takes, np.random.default_rng(0))
    assert len(session.labels) == 18


def test_what_does_not_fit_is_named():
    rng = np.random.default_rng(0)
    with pytest.raises(RecordingError, match="at least one take"):
        make_session([], rng)
    with pytest.raises(RecordingError, match="rate_hz"):
        make_session([TAKES[0], replace(TAKES[1], rate_hz=50.0)], rng)
    with pytest.raises(RecordingError, match="repetitions"):
        make_session([replace(TAKES[0], labels=TAKES[0].labels[:1])], rng)
    with pytest.raises(RecordingError, match="missing throughout"):
        make_session([replace(TAKES[0], frames=TAKES[0].frames * np.nan)], rng)
    with pytest.raises(InvalidValueError, match="blend_s"):
        SessionConfig(blend_s=(0.5, 0.2))


@needs_data
def test_one_persons_takes_with_sides_found_from_data():
    from mplearn.mocap import open_recording

    assert DATA is not None
    names = {}
    for person in ("s01", "s02"):
        takes = [
            open_recording(DATA / "ui_prmd", take=f"m{m}_{person}") for m in ("02", "07", "09")
        ]
        names[person] = [t.labels[0].label for t in split_repetitions(takes)]
    assert names["s01"][:2] == ["m02R-out", "m07R-out"]
    assert names["s02"][:2] == ["m02L-out", "m07R-out"]
    assert names["s01"][2] != names["s02"][2]  # s01's starts at the other end


def test_a_marker_that_one_take_never_shows_is_put_beside_its_neighbours():
    rng = np.random.default_rng(4)
    rest = np.array([[0, 0, 0], [0.1, 0, 0], [0, 0.1, 0], [0.05, 0.05, 0], [1, 1, 1], [1, 1, 1.5]])
    takes = []
    for shift in (0.0, 3.0):
        way = np.cumsum(rng.normal(0, 0.01, (40, 1, 3)), axis=0) + shift
        markers = (rest + way).reshape(40, -1)
        takes.append(Recording(markers, 100.0, marker_channels(tuple("ABCDEF")), f"{shift}"))
    lost = takes[1].frames.copy()
    lost[:, 9:12] = np.nan  # D lies between A, B and C
    takes[1] = replace(takes[1], frames=lost)
    filled = all_without_gaps(takes)
    np.testing.assert_array_equal(filled[0], takes[0].frames)
    between = lost.reshape(40, -1, 3)[:, :3].mean(axis=1)
    np.testing.assert_allclose(filled[1][:, 9:12], between)
    with pytest.raises(RecordingError, match="missing throughout"):
        all_without_gaps([replace(takes[1], frames=np.full_like(lost, np.nan))])
