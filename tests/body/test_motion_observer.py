"""From markers to features: calibration on any person and heading, bad markers, real takes."""

import gzip
from itertools import pairwise

import numpy as np
import pytest
from data_folder import DATA, needs_data
from scipy.spatial.transform import Rotation

from mplearn.body import (
    InverseKinematics,
    MotionObserver,
    TooFewMarkersError,
    features_of,
    human_body,
    marker_set,
    posture_of,
    robot_body,
)
from mplearn.errors import BodyError, FrameError, InvalidValueError

NAMES = marker_set("paper34").names
PERSON = human_body(1.82, {"thigh": 1.06, "upper_arm": 0.95, "shoulder_width": 1.08})


def person_moves(n_frames=120, heading=0.0, arms="hang", rate_hz=100.0, body=PERSON):
    """A person raises both arms while shifting its weight; markers (T, 34, 3)."""
    t = np.arange(n_frames) / rate_hz
    q = np.tile(body.rest, (n_frames, 1))
    joint = {name: 7 + j for j, name in enumerate(body.joint_names)}
    start = {"hang": 0.0, "sideways": 1.5, "overhead": 2.9}[arms]
    for side, sign in (("l", 1.0), ("r", -1.0)):
        q[:, joint[f"shoulder_roll_{side}"]] = sign * (start + 0.15 + 0.1 * np.sin(2 * t))
        q[:, joint[f"elbow_{side}"]] = -0.3 - 0.2 * np.sin(3 * t)
        q[:, joint[f"hip_pitch_{side}"]] = -0.1 - 0.1 * np.sin(2 * t)
        q[:, joint[f"knee_{side}"]] = 0.2 + 0.2 * np.sin(2 * t)
        q[:, joint[f"ankle_pitch_{side}"]] = -0.1 - 0.1 * np.sin(2 * t)
    q[:, 3:7] = Rotation.from_euler("z", heading).as_quat(scalar_first=True)
    q[:, :2] += (1.3, -0.7)
    soles = [i for i, name in enumerate(body.tree.site_names) if name.startswith("sole")]
    for frame in q:  # feet on the floor
        frame[2] -= body.tree.site_positions(frame)[soles, 2].min()
    bodies, offsets = marker_set("paper34").attach(body.tree)
    return np.array([body.tree.points(frame, bodies, offsets) for frame in q]), q


@pytest.mark.parametrize("arms", ["hang", "sideways", "overhead"])
@pytest.mark.parametrize("heading", [0.0, 2.5])
def test_the_person_is_measured(arms, heading):
    markers, truth = person_moves(60, heading, arms)
    noisy = markers + np.random.default_rng(0).normal(0, 0.002, markers.shape)
    ik = InverseKinematics(human_body(), NAMES)
    fit = ik.calibrate(noisy)
    assert fit.height_m == pytest.approx(PERSON.height_m, rel=0.03)
    assert fit.residual_m < 0.008 and abs(fit.floor_m) < 0.03
    thigh = human_body().tree.scaled(fit.factors).offset[human_body().tree.body("shank_l"), 2]
    assert -thigh == pytest.approx(-PERSON.tree.offset[PERSON.tree.body("shank_l"), 2], rel=0.08)
    for frame, q in zip(noisy, truth, strict=True):
        found = ik.update(frame)
        turn = Rotation.from_quat(found[3:7], scalar_first=True).inv() * Rotation.from_quat(
            q[3:7], scalar_first=True
        )
        assert np.degrees(turn.magnitude()) < 6
    elbows = [7 + human_body().joint_names.index(f"elbow_{s}") for s in "lr"]
    assert np.degrees(np.abs(found - truth[-1])[elbows]).max() < 12


def test_the_robot_stands_where_the_person_stands():
    markers, _ = person_moves(150, 1.0)
    markers[..., 2] += 0.25  # a recording with its floor somewhere else
    robot = robot_body()
    ik = InverseKinematics(robot, NAMES)
    fit = ik.calibrate(markers[:60])
    assert fit.scale == pytest.approx(1.65 / 1.82, rel=0.06)
    soles = [i for i, name in enumerate(robot.tree.site_names) if name.startswith("sole")]
    for frame in markers:
        heights = robot.tree.site_positions(ik.update(frame))[soles, 2]
        assert abs(heights.mean()) < 0.02


def test_features_and_postures_are_inverse_to_each_other():
    robot, rng = robot_body(), np.random.default_rng(1)
    q = np.zeros((50, robot.nq))
    angles = rng.uniform(-1, 1, (50, 3)) * (np.pi, 1.5, 3.0)  # yaw, roll, pitch
    q[:, :3] = rng.normal(size=(50, 3))
    q[:, 3:7] = Rotation.from_euler("ZXY", angles).as_quat(scalar_first=True)
    q[:, 7 + robot.driven] = rng.normal(size=(50, 30))
    features = features_of(q)
    np.testing.assert_allclose(features[:, 1:3], angles[:, 1:], atol=1e-9)
    back = posture_of(features, q[:, 0], q[:, 1], angles[:, 0])
    back[:, 3:7] *= np.sign((back[:, 3:7] * q[:, 3:7]).sum(axis=1, keepdims=True))
    np.testing.assert_allclose(back, q, atol=1e-9)
    turned = features_of(posture_of(features, yaw=1.0))
    np.testing.assert_allclose(turned, features, atol=1e-9)  # heading does not matter
    with pytest.raises(BodyError, match="33"):
        posture_of(np.zeros(32))
    with pytest.raises(BodyError, match="45"):
        features_of(np.zeros(44))


def test_the_observer_gathers_then_streams():
    markers, _ = person_moves(100)
    observer = MotionObserver(NAMES, 100.0)
    assert observer.channels[:4] == ("base_height", "base_roll", "base_pitch", "waist_yaw")
    assert len(observer.channels) == 33
    lengths = [len(observer.update(frame.ravel())) for frame in markers]
    assert lengths[:59] == [0] * 59 and lengths[59] == 60 and set(lengths[60:]) == {1}
    short = MotionObserver(NAMES, 100.0)
    assert short.observe(markers[:30].reshape(30, -1)).shape == (30, 33)
    assert len(short.flush()) == 0


@pytest.mark.parametrize("rate_hz", [20.0, 250.0])
def test_any_frame_rate(rate_hz):
    n = int(2 * rate_hz)
    markers, truth = person_moves(n, rate_hz=rate_hz)
    features = MotionObserver(NAMES, rate_hz).observe(markers.reshape(n, -1))
    elbow = MotionObserver(NAMES, rate_hz).channels.index("elbow_l")
    expected = truth[:, 7 + PERSON.joint_names.index("elbow_l")]
    travel = features[:, elbow] - features[0, elbow] - (expected - expected[0])
    assert features.shape == (n, 33) and np.degrees(np.abs(travel)).max() < 8


def test_occlusions_never_show_as_nan_or_jump():
    markers, _ = person_moves(200)
    clean = MotionObserver(NAMES, 100.0).observe(markers.reshape(200, -1))
    rng = np.random.default_rng(2)
    holes = markers.copy()
    for _ in range(60):
        start, marker = rng.integers(60, 190), rng.integers(34)
        holes[start : start + 10, marker] = np.nan
    holes[120:125] = np.nan
    features = MotionObserver(NAMES, 100.0).observe(holes.reshape(200, -1))
    assert np.isfinite(features).all()
    assert np.degrees(np.abs(np.diff(features[:, 1:], axis=0))).max() < 10
    assert np.degrees(np.sqrt(((features - clean)[:, 1:] ** 2).mean())) < 1.5


def test_the_same_stream_gives_the_same_features_and_the_state_resumes():
    markers, _ = person_moves(120)
    frames = markers.reshape(120, -1)
    whole = MotionObserver(NAMES, 100.0).observe(frames)
    for stop in (20, 90):
        first = MotionObserver(NAMES, 100.0)
        before = [first.update(frame) for frame in frames[:stop]]
        second = MotionObserver(NAMES, 100.0)
        second.load_state(first.state())
        after = [second.update(frame) for frame in frames[stop:]]
        np.testing.assert_array_equal(np.concatenate(before + after), whole)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (lambda m: m * 1000, "millimetres"),
        (lambda m: m * (1, -1, 1), "mirrored"),
        (lambda m: m * (1, -1, -1), "leans"),
        (lambda m: m[..., [0, 2, 1]] * (1, -1, 1), "leans"),  # y up
        (lambda m: np.full_like(m, np.nan), "none of the 34"),
        (lambda m: np.where(np.arange(34)[:, None] < 20, np.nan, m), "too few markers"),
        (lambda m: m[:, ::-1], "mirrored|leans|farthest|times as large"),  # names in a wrong order
    ],
    ids=["mm", "mirrored", "upside down", "y up", "nothing", "legs only", "wrong order"],
)
def test_markers_that_are_no_person(change, message):
    markers, _ = person_moves(60)
    with pytest.raises(BodyError, match=message):
        InverseKinematics(robot_body(), NAMES).calibrate(change(markers))


def test_a_stream_that_never_shows_its_markers_is_given_up_in_the_end():
    observer = MotionObserver(NAMES, 20.0)
    blind = np.full(102, np.nan)
    for _ in range(59):
        assert observer.update(blind).shape == (0, 33)
    with pytest.raises(TooFewMarkersError):
        observer.update(blind)


def test_bad_arguments():
    with pytest.raises(BodyError, match="no marker set"):
        MotionObserver([f"M{i}" for i in range(30)], 100.0)
    with pytest.raises(InvalidValueError, match="calibration_s"):
        MotionObserver(NAMES, 100.0, calibration_s=0.0)
    observer = MotionObserver(NAMES, 100.0)
    with pytest.raises(FrameError, match="102"):
        observer.update(np.zeros(99))
    with pytest.raises(FrameError, match="infinite"):
        observer.update(np.full(102, np.inf))


def ui_prmd_take(stem):
    rows = []
    for path in sorted((DATA / "ui_prmd").glob(f"{stem}_e*_positions.txt.gz")):
        with gzip.open(path) as file:
            rows.append(np.loadtxt(file, delimiter=","))
    markers = np.concatenate(rows).reshape(-1, 39, 3) / 1000
    markers[(markers == 0).all(axis=2)] = np.nan
    return markers, np.cumsum([len(part) for part in rows])


@needs_data
@pytest.mark.parametrize("stem", ["m01_s01", "m07_s02"])
def test_real_takes(stem):
    markers, ends = ui_prmd_take(stem)
    names = marker_set("plug_in_gait39").names
    observer = MotionObserver(names, 100.0)
    features = observer.observe(markers.reshape(len(markers), -1))
    assert np.isfinite(features).all()
    assert np.degrees(np.abs(np.diff(features[:, 1:], axis=0))).max() < 10
    assert features[:, 0].min() > 0.2 and features[:, 0].max() < 0.95
    # repetitions look alike: variance between them is small beside the variance within one
    time = np.linspace(0, 1, 50)
    repetitions = np.array(
        [
            [np.interp(time, np.linspace(0, 1, b - a), channel) for channel in features[a:b].T]
            for a, b in pairwise(ends)
        ]
    )
    travel = repetitions.mean(axis=0).std(axis=1)
    moving = travel > 0.1
    spread = repetitions.std(axis=0).mean(axis=1)[moving] / travel[moving]
    assert moving.sum() >= 2 and spread.max() < 0.8

    ik = InverseKinematics(human_body(), names)
    ik.calibrate(markers[:60])
    residuals = []
    for frame in markers[:600]:
        ik.update(frame)
        residuals.append(np.nanmean(ik.residual_m))
    assert np.mean(residuals) < 0.010
