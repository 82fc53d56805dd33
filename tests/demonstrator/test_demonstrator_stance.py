"""The body's side: feet that stand, joints within limits, balance, mirror images."""

import mujoco
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from mplearn.body import human_body, marker_set
from mplearn.body.kinematics.kernels import points_of_postures
from mplearn.demonstrator import PRIMITIVES, Person, Variability, demonstrate, followers
from mplearn.demonstrator.channels import CHANNELS, INDEX, UPPER_JOINTS, as_vector, mirrored
from mplearn.demonstrator.postures import POSTURES, STAND
from mplearn.demonstrator.stance import Stance

ONE_LEGGED = {"left kick": "r", "left march": "r", "right kick": "l", "right march": "l"}


def soles(body, postures):
    """Corners of the left and the right sole at each posture, each (T, 4, 3)."""
    tree = body.tree
    corners = []
    for side in "lr":
        rows = [
            i for i, n in enumerate(tree.site_names) if n.startswith("sole_") and n.endswith(side)
        ]
        assert len(rows) == 4
        corners.append(
            points_of_postures(postures, tree.linkage, tree.site_body[rows], tree.site_offset[rows])
        )
    return corners


def random_script(seed, length):
    rng = np.random.default_rng(seed)
    options = [name for name in PRIMITIVES if PRIMITIVES[name].start == "stand"]
    script = []
    for _ in range(length):
        script.append(str(rng.choice(options)))
        options = followers(script[-1])
    return script


def check_body(body, postures):
    angles, limits = postures[:, 7:], body.joint_limits
    assert np.isfinite(postures).all()
    assert (angles >= limits[:, 0]).all() and (angles <= limits[:, 1]).all()
    np.testing.assert_allclose(np.linalg.norm(postures[:, 3:7], axis=1), 1.0, atol=1e-12)
    left, right = soles(body, postures)
    assert min(left[..., 2].min(), right[..., 2].min()) > -1e-3
    stands = []
    for corners in (left, right):
        down = corners[..., 2].max(axis=1) < 1e-3
        moved = np.abs(np.diff(corners[..., :2], axis=0)).max(axis=(1, 2))
        # a foot that is flat on the floor in two frames has not moved between them
        assert moved[down[1:] & down[:-1]].max(initial=0.0) < 2e-4
        stands.append(down)
    lowest = np.minimum(left[..., 2].min(axis=1), right[..., 2].min(axis=1))
    assert (lowest < 2e-3).all(), "one foot is always on the floor"
    assert stands[0].any() and stands[1].any()


@settings(max_examples=25, deadline=None)
@given(st.integers(0, 10_000), st.integers(1, 12), st.sampled_from([20.0, 60.0, 100.0, 250.0]))
def test_any_person_in_any_script_stands_on_the_floor_within_the_joint_limits(
    seed, length, rate_hz
):
    person = Person.random(np.random.default_rng(seed))
    script = random_script(seed, length)
    shown = demonstrate(script, seed, person=person, rate_hz=rate_hz)
    assert [segment.label for segment in shown.truth] == script
    check_body(human_body(person.height_m, person.proportions), shown.posture.frames)


def test_even_the_largest_habits_stay_within_the_joint_limits():
    for factor in (0.5, 1.5):
        person = Person(
            reach=dict.fromkeys(POSTURES, factor),
            joint_reach=dict.fromkeys(CHANNELS, factor),
            tempo=dict.fromkeys(PRIMITIVES, factor),
        )
        wild = Variability(amplitude=0.5, duration=0.5)
        shown = demonstrate(random_script(3, 60), 3, person=person, variability=wild)
        check_body(human_body(), shown.posture.frames)


def test_legs_put_the_feet_exactly_where_they_are_planned():
    body = human_body(1.62, {"thigh": 1.07, "pelvis_width": 0.94})
    stance = Stance(body)
    rng = np.random.default_rng(0)
    model = body.model()
    data = mujoco.MjData(model)
    home = body.tree.forward(body.rest)[0][[body.tree.body("foot_l"), body.tree.body("foot_r")]]
    for _ in range(50):
        plan = as_vector(
            {
                **STAND,
                "crouch": rng.uniform(0.1, 0.18),
                **{f"pelvis_{a}": rng.normal(0, 0.06) for a in ("roll", "pitch", "yaw")},
                "pelvis_x": rng.normal(0, 0.04),
                "pelvis_y": rng.normal(0, 0.04),
                **{f"foot_{a}_{s}": rng.normal(0, 0.02) for a in "xy" for s in "lr"},
                **{f"foot_yaw_{s}": rng.normal(0, 0.2) for s in "lr"},
                "foot_z_l": rng.uniform(0.0, 0.05),
                "foot_pitch_l": rng.uniform(0.0, 0.3),
            }
        )
        data.qpos[:] = stance.solve(plan[None])[0]
        mujoco.mj_kinematics(model, data)
        for side, letter in enumerate("lr"):
            foot = data.body(f"foot_{letter}")
            shift = [plan[INDEX[f"foot_{axis}_{letter}"]] for axis in "xyz"]
            np.testing.assert_allclose(
                foot.xpos, home[side] + np.array(shift) * stance.leg_m, atol=1e-6
            )
            yaw, pitch = plan[INDEX[f"foot_yaw_{letter}"]], plan[INDEX[f"foot_pitch_{letter}"]]
            forward = [np.cos(yaw) * np.cos(pitch), np.sin(yaw) * np.cos(pitch), -np.sin(pitch)]
            np.testing.assert_allclose(foot.xmat.reshape(3, 3)[:, 0], forward, atol=1e-6)


@pytest.mark.parametrize("height_m", [1.55, 1.75, 1.90])
@pytest.mark.parametrize("posture", POSTURES)
def test_key_postures_are_in_balance(posture, height_m):
    body = human_body(height_m)
    model = body.model()
    data = mujoco.MjData(model)
    data.qpos[:] = Stance(body).solve(as_vector(POSTURES[posture])[None])[0]
    mujoco.mj_kinematics(model, data)
    mujoco.mj_comPos(model, data)
    mass_centre = data.subtree_com[1]
    left, right = soles(body, data.qpos[None])
    feet = {"l": left[0], "r": right[0]}
    support = feet.pop(ONE_LEGGED[posture]) if posture in ONE_LEGGED else np.vstack((*left, *right))
    low, high = support[:, :2].min(axis=0), support[:, :2].max(axis=0)
    assert (mass_centre[:2] > low + 0.01).all() and (mass_centre[:2] < high - 0.01).all()


@pytest.mark.parametrize(
    ("left", "right"),
    [
        (["LAR", "LAL"], ["RAR", "RAL"]),
        (["LKR", "LKT"], ["RKR", "RKT"]),
        (["TLO", "TLR"], ["TRO", "TRR"]),
    ],
)
def test_left_and_right_are_mirror_images(left, right):
    still = Variability.none()
    one, other = (demonstrate(s, 0, variability=still).posture for s in (left, right))
    names = one.channels[7:]
    reflected = [mirrored({name: 1.0}) for name in names]
    picked = np.stack(
        [
            sign * other.frames[:, 7 + names.index(name)]
            for name, sign in (next(iter(pair.items())) for pair in reflected)
        ],
        axis=1,
    )
    np.testing.assert_allclose(one.frames[:, 7:], picked, atol=1e-9)
    np.testing.assert_allclose(one.frames[:, 2], other.frames[:, 2], atol=1e-12)


def test_posture_is_in_mujocos_layout_and_carries_the_markers():
    shown = demonstrate(
        ["AR", "RPE", "RPR", "SQD", "SQR"], 4, variability=Variability(noise_m=0.0, occlusion=0.0)
    )
    body = human_body()
    assert shown.posture.channels[7:] == body.joint_names
    assert set(UPPER_JOINTS) < set(body.joint_names)
    model = body.model()
    data = mujoco.MjData(model)
    markers = marker_set("paper34")
    assert shown.recording.marker_names == markers.names and len(markers.names) == 34
    for frame in range(0, len(shown.posture), 61):
        data.qpos[:] = shown.posture.frames[frame]
        mujoco.mj_kinematics(model, data)
        expected = [
            data.body(name).xpos + data.body(name).xmat.reshape(3, 3) @ offset
            for name, offset in zip(markers.bodies, markers.offsets, strict=True)
        ]
        np.testing.assert_allclose(shown.recording.markers[frame], expected, atol=1e-9)


def test_markers_of_one_segment_keep_their_distances():
    person = Person.random(np.random.default_rng(8))
    script = random_script(8, 20)
    exact = demonstrate(
        script, 8, person=person, variability=Variability(noise_m=0.0, occlusion=0.0)
    ).recording
    noisy = demonstrate(script, 8, person=person).recording
    carriers = marker_set("paper34").bodies
    pairs = [(a, b) for a in range(len(carriers)) for b in range(a) if carriers[a] == carriers[b]]
    assert len(pairs) > 10
    for a, b in pairs:
        length = np.linalg.norm(exact.markers[:, a] - exact.markers[:, b], axis=1)
        assert np.ptp(length) < 1e-9
        seen = np.linalg.norm(noisy.markers[:, a] - noisy.markers[:, b], axis=1)
        assert np.nanmax(np.abs(seen - length[0])) < 7 * np.sqrt(2) * 0.002
