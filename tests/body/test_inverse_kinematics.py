"""Inverse kinematics: against scipy's optimum, on synthetic truth, and when markers go missing."""

import numpy as np
import pytest
from scipy.optimize import least_squares
from scipy.spatial.transform import Rotation
from threadpoolctl import threadpool_limits

from mplearn.body import IKConfig, InverseKinematics, human_body, marker_set, robot_body
from mplearn.body.inverse_kinematics.calibration import Calibration
from mplearn.body.inverse_kinematics.follower import follower
from mplearn.body.inverse_kinematics.gauss_newton import (
    Markers,
    Moves,
    Search,
    Seen,
    empty_equations,
    normal_equations,
    solve_frame,
)
from mplearn.body.inverse_kinematics.inverse_kinematics import FollowedState
from mplearn.body.kinematics.kernels import integrate, locate
from mplearn.body.kinematics.linkage import empty_configuration
from mplearn.errors import BodyError, FrameError, InvalidValueError
from mplearn.mocap import GapTracker

NAMES = marker_set("plug_in_gait39").names


def smooth_motion(body, n_frames, rate_hz, seed, amplitude=0.25):
    """Random smooth motion of all driven joints around standing, shape (T, 7 + n)."""
    rng = np.random.default_rng(seed)
    t = np.arange(n_frames) / rate_hz
    q = np.tile(body.rest, (n_frames, 1))
    for j, (name, (low, high)) in enumerate(zip(body.joint_names, body.joint_limits, strict=True)):
        if name in body.held:
            continue
        reach = amplitude * min(high - low, np.pi)
        wave = sum(rng.normal() * np.sin(2 * np.pi * f * t + rng.uniform(0, 6)) for f in (0.2, 0.5))
        q[:, 7 + j] = np.clip(0.3 * (low + high) / 2 + reach * wave / 2, 0.9 * low, 0.9 * high)
    q[:, :2] += 0.2 * np.stack((np.sin(t), np.cos(0.7 * t)), axis=1)
    q[:, 3:7] = Rotation.from_euler(
        "ZYX", np.stack((0.8 * np.sin(0.5 * t), 0.2 * np.sin(t), 0.1 * np.cos(t)), axis=1)
    ).as_quat(scalar_first=True)
    return q


def markers_of(body, postures, names=NAMES, set_name="plug_in_gait39"):
    bodies, offsets = marker_set(set_name).select(names).attach(body.tree)
    return np.array([body.tree.points(q, bodies, offsets) for q in postures])


def turned_by(before, after):
    """Rotation vector of the base from one posture to the other, in the base's own axes."""
    first, second = (Rotation.from_quat(q[3:7], scalar_first=True) for q in (before, after))
    return (first.inv() * second).as_rotvec()


def known(body, posture, names=NAMES, **config):
    """Inverse kinematics of a body whose sizes and marker places are known exactly."""
    ik = InverseKinematics(body, names, config=IKConfig(**config))
    seen = follower(body)
    start = np.zeros(len(seen.tree.rest))
    start[seen.own] = posture
    offsets = marker_set("plug_in_gait39").select(names).attach(seen.tree)[1]
    ik.load_state(
        FollowedState(
            calibration=Calibration(
                factors=np.ones_like(seen.tree.offset),
                offsets=offsets,
                scale=1.0,
                floor_m=0.0,
                height_m=body.height_m,
                residual_m=0.0,
                posture=start,
            ),
            posture=start,
            variance=np.full(seen.tree.n_dofs, 0.01),
            fresh=False,
        )
    )
    return ik


@pytest.mark.parametrize("make_body", [human_body, robot_body], ids=["human", "robot"])
@pytest.mark.parametrize("outlier_m", [np.inf, 0.05])
def test_a_frame_is_solved_to_scipys_optimum(make_body, outlier_m):
    body = make_body()
    rng = np.random.default_rng(5)
    tree = body.tree
    bodies, offsets = marker_set("plug_in_gait39").attach(follower(body).tree)
    tree = follower(body).tree
    free = follower(body).free.copy()
    truth = tree.rest
    middle, span = tree.limits.mean(axis=1), np.ptp(tree.limits, axis=1)
    truth[7:] = np.where(free[6:], middle + 0.3 * span * rng.uniform(-1, 1, len(span)), 0.0)
    markers = tree.points(truth, bodies, offsets) + rng.normal(0, 0.01, (39, 3))
    markers[3] = np.nan
    markers[7] += (0.3, -0.2, 0.1)
    before = truth.copy()
    before[7:][free[6:]] += rng.normal(0, 0.05, free[6:].sum())
    before[7:] = np.clip(before[7:], *tree.limits.T)
    dofs, variance = tree.n_dofs, rng.uniform(0.01, 0.1, tree.n_dofs)
    limits = np.concatenate((np.tile((-1.0, 1.0), (6, 1)), tree.limits - before[7:, None]))
    limits[8:12, 1] = np.minimum(limits[8:12, 1], 0.01)  # bounds that bite
    weights = rng.uniform(0.5, 2.0, 39) * 1e4
    q, after, residuals = before.copy(), variance.copy(), np.empty(39)
    n = solve_frame(
        q,
        after,
        markers,
        Markers(bodies, offsets, weights),
        tree.linkage,
        Moves(limits[:, 0], limits[:, 1], free, np.zeros(dofs - 6)),
        Search(outlier_m, 200, 1e-9),
        residuals,
    )
    assert n < 200
    seen = np.isfinite(markers[:, 0])

    def errors(moves):
        step = np.zeros(dofs)
        step[free] = moves
        posture = before.copy()
        integrate(posture, step)
        gap = (tree.points(posture, bodies, offsets) - markers)[seen]
        if np.isfinite(outlier_m):
            far = np.linalg.norm(gap, axis=1, keepdims=True)
            gap = gap * outlier_m * np.sqrt(np.log1p((far / outlier_m) ** 2)) / far
        gap = np.sqrt(weights[seen, None]) * gap
        return np.concatenate((gap.ravel(), step / np.sqrt(variance)))

    moved = np.concatenate((q[:3] - before[:3], turned_by(before, q), q[7:] - before[7:]))[free]
    start = np.clip(0.0, *(0.98 * limits[free].T + 0.02 * limits[free, ::-1].T))
    found = least_squares(errors, start, bounds=limits[free].T, xtol=1e-12, ftol=1e-12)
    assert (errors(moved) ** 2).sum() < (errors(found.x) ** 2).sum() * (1 + 1e-4)
    step = np.zeros(dofs)
    step[free] = found.x
    best = before.copy()
    integrate(best, step)
    assert (errors(found.x) ** 2).sum() > 10.0
    # the kernel sums its base rotation's steps; the difference is of second order in them
    np.testing.assert_allclose(q, best, atol=2e-3)
    assert np.isnan(residuals[3]) and residuals[7] > (0.3 if np.isfinite(outlier_m) else 0.1)


@pytest.mark.parametrize("make_body", [human_body, robot_body], ids=["human", "robot"])
def test_the_normal_equations_are_those_of_the_jacobian(make_body):
    body = make_body()
    rng = np.random.default_rng(8)
    tree = follower(body).tree
    linkage, n = tree.linkage, len(tree.joint_names)
    bodies, offsets = marker_set("plug_in_gait39").attach(tree)
    q = tree.rest
    q[:3] += rng.normal(size=3)
    q[3:7] = rng.normal(size=4)
    q[3:7] /= np.linalg.norm(q[3:7])
    q[7:] = rng.uniform(-1, 1, n) * np.where(tree.slides, 0.05, 1.0)
    points = tree.points(q, bodies, offsets)
    markers = points + rng.normal(0, 0.05, points.shape)
    markers[5] = np.nan
    residuals, weights = np.linalg.norm(markers - points, axis=1), rng.uniform(0, 2, 39)
    at, equations = empty_configuration(linkage), empty_equations(linkage)
    locate(q, linkage, bodies, offsets, at, np.empty((39, 3)))
    normal, gradient = equations.normal, equations.gradient
    normal[:], gradient[:] = np.nan, np.nan
    placed = Markers(bodies, offsets, weights)
    normal_equations(q, Seen(markers, points, residuals), placed, 0.06, linkage, at, equations)
    seen = np.isfinite(residuals)
    jacobian = tree.jacobian(q, bodies[seen], offsets[seen]).reshape(-1, 6 + n)
    weight = np.repeat(weights[seen] / (1 + (residuals[seen] / 0.06) ** 2), 3)
    expected = jacobian.T @ (weight[:, None] * jacobian)
    np.testing.assert_allclose(gradient, jacobian.T @ (weight * (markers - points)[seen].ravel()))
    filled = np.isfinite(normal)
    np.testing.assert_allclose(normal[filled], expected[filled], atol=1e-9)
    assert not expected[~(filled | filled.T)].any()


def test_known_bodies_are_followed_exactly():
    for body in (human_body(), robot_body()):
        truth = smooth_motion(body, 150, 100.0, seed=1)
        ik = known(body, truth[0], joint_drift=20.0, tolerance=1e-7, max_iterations=20)
        ik._rest_weight[:] = 1e-9  # no prior: the markers alone
        found = np.array([ik.update(frame) for frame in markers_of(body, truth)])
        places = markers_of(body, found) - markers_of(body, truth)
        assert np.abs(places).max() < 2e-3


def test_joint_angles_of_the_human_under_noise():
    body = human_body()
    truth = smooth_motion(body, 300, 100.0, seed=2, amplitude=0.15)
    noise = np.random.default_rng(0).normal(0, 0.002, (300, 39, 3))
    ik = known(body, truth[0])
    found = np.array([ik.update(frame) for frame in markers_of(body, truth) + noise])
    error = np.degrees(np.sqrt(((found - truth)[30:, 7:] ** 2).mean(axis=0)))
    undetermined = {"toe_l", "toe_r"}  # no marker moves with the toes
    loose = {  # one marker, or markers close to the axis
        name for name in body.joint_names if name.startswith(("clavicle", "wrist", "ankle_roll"))
    } | {"thorax_pitch", "lumbar_pitch", "thorax_roll", "lumbar_roll"}
    for name, value in zip(body.joint_names, error, strict=True):
        if name not in undetermined:
            assert value < (4.0 if name in loose else 2.5), (name, value)


def test_noise_is_not_searched_farther_than_it_tells():
    body = human_body()
    truth = smooth_motion(body, 200, 100.0, seed=4, amplitude=0.15)
    clean = markers_of(body, truth)
    noisy = clean + np.random.default_rng(0).normal(0, 0.01, clean.shape)

    def followed(frames, rough_tolerance):
        ik = known(body, truth[0], rough_tolerance=rough_tolerance)
        steps = [(ik.update(frame), ik.iterations) for frame in frames]
        return np.array([q for q, _ in steps]), sum(n for _, n in steps) / len(frames)

    (whole, longer), (found, shorter) = followed(noisy, 1e-9), followed(noisy, 0.03)
    off = np.degrees(np.abs(found - whole)[:, 7:])
    noise = np.degrees(np.abs(whole - truth)[:, 7:])
    assert 0.0 < np.median(off) < 0.01 * np.median(noise)
    assert shorter < longer - 1.0
    ik = known(body, truth[0])
    assert np.array_equal(ik.update_many(noisy), found)  # at once as one by one
    bent = clean.copy()  # a leg that the body cannot follow is no noise
    bent[:, [name in ("LTHI", "LKNE", "LTIB", "LANK", "LHEE", "LTOE") for name in NAMES]] += 0.1
    for frames in (clean, bent):
        assert np.array_equal(followed(frames, 1e-9)[0], followed(frames, 0.03)[0])


def test_a_hidden_limb_is_held_and_said_to_be_uncertain():
    body = robot_body()
    truth = smooth_motion(body, 200, 100.0, seed=3)
    frames = markers_of(body, truth)
    hidden = [
        i
        for i, name in enumerate(NAMES)
        if name in ("LELB", "LUPA", "LFRM", "LWRA", "LWRB", "LFIN")
    ]
    frames[80:140, hidden] = np.nan
    ik = known(body, truth[0])
    arm = [
        7 + j
        for j, name in enumerate(body.joint_names)
        if name.startswith(("elbow_l", "wrist_yaw_l"))
    ]
    postures, sigma = [], []
    for frame in frames:
        postures.append(ik.update(frame))
        sigma.append(ik.uncertainty)
    postures, sigma = np.array(postures), np.array(sigma)
    np.testing.assert_allclose(postures[135, arm], postures[80, arm], atol=1e-6)
    elbow = 6 + body.joint_names.index("elbow_l")
    assert sigma[135, elbow] > 5 * sigma[79, elbow]
    assert np.abs(np.diff(postures[:, 7:], axis=0)).max() <= 17.0 / 100 + 1e-9
    assert np.abs(markers_of(body, postures[190:]) - markers_of(body, truth[190:])).max() < 0.01


def test_nothing_seen_holds_the_posture():
    body = robot_body()
    ik = known(body, body.rest)
    first = ik.update(markers_of(body, body.rest[None])[0])
    blind = np.full((39, 3), np.nan)
    blind[:2] = 1.0
    for _ in range(50):
        np.testing.assert_array_equal(ik.update(blind), first)
    assert ik.iterations == 0 and np.isfinite(ik.uncertainty).all()
    assert ik.uncertainty[6] > 0.5


def test_a_flying_and_a_swapped_marker_hardly_matter():
    body = robot_body()
    truth = smooth_motion(body, 60, 100.0, seed=4)
    frames = markers_of(body, truth)
    wrong = frames.copy()
    a, b = NAMES.index("LWRA"), NAMES.index("RWRA")
    wrong[30:40, [a, b]] = wrong[30:40, [b, a]]
    wrong[30:40, NAMES.index("LKNE")] += (0.4, 0.3, 0.5)
    right, disturbed = known(body, truth[0]), known(body, truth[0])
    gap = [
        np.abs(right.update(x) - disturbed.update(y))[7:]
        for x, y in zip(frames, wrong, strict=True)
    ]
    assert np.degrees(np.max(gap)) < 18.0  # the knee's own; without the robust loss: 60
    assert np.nanmax(disturbed.residual_m) < 0.02


def test_limits_hold():
    body = robot_body()
    ik = known(body, body.rest)
    human = human_body(1.65)
    q = human.rest
    q[7 + human.joint_names.index("knee_l")] = -0.09  # farther back than the robot's knee goes
    for _ in range(20):
        found = ik.update(markers_of(human, q[None])[0])
        assert (found[7:] >= body.joint_limits[:, 0] - 1e-12).all()
        assert (found[7:] <= body.joint_limits[:, 1] + 1e-12).all()


def test_the_same_frames_give_the_same_postures_and_the_state_resumes():
    body = robot_body()
    frames = markers_of(body, smooth_motion(body, 60, 100.0, seed=5))
    first, second = known(body, body.rest), known(body, body.rest)
    expected = [first.update(frame) for frame in frames]
    for frame in frames[:30]:
        second.update(frame)
    third = InverseKinematics(body, NAMES)
    third.load_state(second.state())
    for frame, q in zip(frames[30:], expected[30:], strict=True):
        np.testing.assert_array_equal(third.update(frame), q)


def test_a_body_is_fitted_alike_by_any_number_of_threads():
    frames = markers_of(human_body(), smooth_motion(human_body(), 40, 100.0, seed=5))
    fitted = []
    for threads in (1, 2, 4):
        with threadpool_limits(threads, user_api="blas"):
            ik = InverseKinematics(human_body(), NAMES)
            fitted.append(ik.calibrate(frames))
    for other in fitted[1:]:
        np.testing.assert_array_equal(other.factors, fitted[0].factors)
        np.testing.assert_array_equal(other.offsets, fitted[0].offsets)


def test_bad_frames():
    body = robot_body()
    ik = InverseKinematics(body, NAMES)
    with pytest.raises(BodyError, match="calibrate"):
        ik.update(np.zeros((39, 3)))
    ik = known(body, body.rest)
    with pytest.raises(FrameError, match="shape"):
        ik.update(np.zeros((38, 3)))
    with pytest.raises(FrameError, match="infinite"):
        ik.update(np.full((39, 3), np.inf))
    with pytest.raises(FrameError, match="shape"):
        ik.calibrate(np.zeros((39, 3)))
    with pytest.raises(InvalidValueError, match="rate_hz"):
        InverseKinematics(body, NAMES, rate_hz=0.0)
    with pytest.raises(InvalidValueError, match="outlier_m"):
        IKConfig(outlier_m=-1.0)


def test_minks_solution_is_ours():
    """mink, by quadratic programming on MuJoCo's Jacobians, ends in the same posture."""
    import mink
    import mujoco

    body, rng = human_body(), np.random.default_rng(8)
    truth = body.rest
    low, high = body.joint_limits.T
    truth[7:] = 0.5 * (low + high) + 0.25 * (high - low) * rng.uniform(-1, 1, len(low))
    toes = [7 + body.joint_names.index(name) for name in ("toe_l", "toe_r")]
    truth[toes] = 0.0  # no marker tells
    start = truth.copy()
    start[7:] = np.clip(truth[7:] + rng.normal(0, 0.08, len(low)), low, high)
    start[toes] = 0.0
    frame = markers_of(body, truth[None])[0] + rng.normal(0, 0.003, (39, 3))

    spec = mujoco.MjSpec.from_string(body.xml)
    chosen = marker_set("plug_in_gait39")
    for name, carrier, offset in zip(chosen.names, chosen.bodies, chosen.offsets, strict=True):
        spec.body(carrier).add_site(name=f"marker_{name}", pos=offset)
    configuration = mink.Configuration(spec.compile(), q=start)
    tasks = [
        mink.FrameTask(f"marker_{name}", "site", position_cost=1.0, orientation_cost=0.0)
        for name in NAMES
    ]
    for task, place in zip(tasks, frame, strict=True):
        task.set_target(mink.SE3.from_translation(place))
    limits = [mink.ConfigurationLimit(configuration.model)]
    for _ in range(60):
        velocity = mink.solve_ik(configuration, tasks, 1.0, "daqp", damping=1e-8, limits=limits)
        configuration.integrate_inplace(velocity, 1.0)

    ours = known(body, start, outlier_m=np.inf, joint_drift=1e4, base_drift=1e4,
                 joint_speed=1e4, base_speed=1e4, most_uncertain=1e4, tolerance=1e-9,
                 max_iterations=100)  # fmt: skip
    ours._rest_weight[:] = 1e-9
    found = ours.update(frame)
    misfits = [((markers_of(body, q[None]) - frame) ** 2).sum() for q in (found, configuration.q)]
    assert misfits[0] == pytest.approx(misfits[1], rel=0.01)
    np.testing.assert_allclose(found[:3], configuration.q[:3], atol=1e-4)
    assert np.linalg.norm(turned_by(found, configuration.q)) < 1e-3
    np.testing.assert_allclose(found[7:], configuration.q[7:], atol=0.015)  # flat about shoulders
    assert np.degrees(np.abs(found - truth)[7:]).mean() < 2.5


def wrong_stretch(kind, frames):
    """Spoil the frames 60 to 160 of a stream in one of the ways in which streams go wrong."""
    bad = frames.copy()
    part = slice(60, 160)
    if kind == "all missing":
        bad[part] = np.nan
    elif kind == "millimetres":
        bad[part] *= 1000
    elif kind == "upside down":
        bad[part, :, 1:] *= -1
    elif kind == "mirrored":
        bad[part, :, 1] *= -1
    elif kind == "names shuffled":
        bad[part] = bad[part, np.random.default_rng(0).permutation(39)]
    elif kind == "elsewhere":
        bad[part] += (3.0, -2.0, 0.0)
    else:
        bad[part] = np.random.default_rng(1).normal(0, 1, bad[part].shape)
    return bad


@pytest.mark.parametrize("fill_gaps", [False, True])
@pytest.mark.parametrize(
    "kind",
    [
        "all missing",
        "millimetres",
        "upside down",
        "mirrored",
        "names shuffled",
        "elsewhere",
        "noise",
    ],
)
def test_a_bad_second_never_becomes_a_wild_motion(kind, fill_gaps):
    """Within limits and speeds throughout, said to be uncertain, and right again afterwards."""
    body = robot_body()
    truth = smooth_motion(body, 300, 100.0, seed=7, amplitude=0.1)
    gaps = GapTracker(39, 100.0)
    ik = known(body, truth[0])
    postures, worst = [], []
    for frame in wrong_stretch(kind, markers_of(body, truth)):
        postures.append(ik.update(gaps.update(frame) if fill_gaps else frame))
        seen = ik.residual_m[np.isfinite(ik.residual_m)]
        worst.append(seen.mean() if len(seen) else np.inf)
    postures = np.array(postures)
    assert np.isfinite(postures).all()
    assert (postures[:, 7:] >= body.joint_limits[:, 0] - 1e-9).all()
    assert (postures[:, 7:] <= body.joint_limits[:, 1] + 1e-9).all()
    assert np.abs(np.diff(postures[:, 7:], axis=0)).max() <= 17.0 / 100 + 1e-9
    assert np.abs(np.diff(postures[:, :3], axis=0)).max() <= 10.0 / 100 + 1e-9
    if kind in ("upside down", "elsewhere"):  # a person may turn over, or come back elsewhere
        assert np.median(worst[140:155]) < 0.02
    else:
        assert np.median(worst[80:150]) > 0.05  # it does not fit, and says so
    after = np.abs(markers_of(body, postures[-20:]) - markers_of(body, truth[-20:]))
    assert after.mean() < 0.01 and after.max() < 0.15  # a hand may stay turned for a while


@pytest.mark.parametrize("rate_hz", [30.0, 250.0])
def test_other_rates_are_followed_as_well(rate_hz):
    body = robot_body()
    truth = smooth_motion(body, int(4 * rate_hz), rate_hz, seed=9, amplitude=0.15)
    ik = known(body, truth[0])
    ik.rate_hz = rate_hz
    found = np.array([ik.update(frame) for frame in markers_of(body, truth)])
    assert np.abs(markers_of(body, found) - markers_of(body, truth)).max() < 0.02


def test_a_stream_slower_than_said_is_followed_late_not_wildly():
    """30 frames a second taken for 100: every third of a fast motion, and no joint flies."""
    body = robot_body()
    truth = smooth_motion(body, 400, 100.0, seed=10, amplitude=0.15)
    ik = known(body, truth[0])
    found = np.array([ik.update(frame) for frame in markers_of(body, truth)[::3]])
    assert np.abs(np.diff(found[:, 7:], axis=0)).max() <= 17.0 / 100 + 1e-9
    assert np.abs(markers_of(body, found) - markers_of(body, truth[::3])).mean() < 0.01
