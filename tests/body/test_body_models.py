"""The committed models: what the builder draws, of the size and mass that the sources say."""

from importlib.resources import files

import mujoco
import numpy as np
import pytest

from mplearn.body import PROPORTIONS, human_body, robot_body
from mplearn.body.inverse_kinematics.follower import follower
from mplearn.body.marker_sets.marker_set import marker_set
from mplearn.errors import BodyError

HUMAN_JOINTS = [
    *("lumbar_pitch", "lumbar_roll", "lumbar_yaw", "thorax_pitch", "thorax_roll"),
    *("neck_pitch", "neck_roll", "neck_yaw"),
] + [
    f"{name}_{side}"
    for names in (
        "clavicle_elevation clavicle_protraction shoulder_pitch shoulder_roll shoulder_yaw elbow "
        "forearm_yaw wrist_pitch wrist_roll",
        "hip_yaw hip_roll hip_pitch knee ankle_pitch ankle_roll toe",
    )
    for side in "lr"
    for name in names.split()
]
ROBOT_JOINTS = ["waist_yaw", "neck_yaw", "neck_pitch", "neck_roll"] + [
    f"{name}_{side}"
    for names in (
        "shoulder_pitch shoulder_roll shoulder_yaw elbow wrist_yaw wrist_pitch wrist_roll",
        "hip_yaw hip_roll hip_pitch knee ankle_pitch ankle_roll",
    )
    for side in "lr"
    for name in names.split()
]


def test_the_builder_draws_the_committed_models():
    from mplearn.body.models.build import models

    for name, xml in models().items():
        committed = (files("mplearn.body.models") / f"{name}.xml").read_text(encoding="utf-8")
        assert xml == committed, f"run python -m mplearn.body.models.build for {name}"


def test_joints_and_sizes():
    human, robot = human_body(), robot_body()
    assert list(human.joint_names) == HUMAN_JOINTS and len(HUMAN_JOINTS) == 40
    assert list(robot.driven_names) == ROBOT_JOINTS and len(ROBOT_JOINTS) == 30
    assert len(robot.held) == 8 and set(robot.held) < set(robot.joint_names)
    assert human.height_m == pytest.approx(1.75) and robot.height_m == pytest.approx(1.65, abs=2e-3)
    assert robot.model().body_mass.sum() == pytest.approx(63.0)
    assert human.model().body_mass.sum() == pytest.approx(22.5 * 1.75**2, rel=1e-3)
    for body in (human, robot):
        assert (body.joint_limits[:, 0] <= 0).all() and (body.joint_limits[:, 1] >= 0).all()


def test_only_the_robots_soles_collide():
    model = robot_body().model()
    colliding = [model.geom(i).name for i in np.flatnonzero(model.geom_contype)]
    assert sorted(colliding) == ["sole_l", "sole_r"] and model.nu == 0
    np.testing.assert_allclose(2 * model.geom("sole_l").size, (0.24, 0.11, 0.04))
    assert not human_body().model().geom_contype.any()


@pytest.mark.parametrize(
    ("joint", "angle", "part", "axis", "sign"),
    [
        ("shoulder_pitch_l", -1.0, "hand_l", 0, 1),  # arm forward
        ("shoulder_roll_l", 1.0, "hand_l", 1, 1),  # abducted
        ("shoulder_roll_r", -1.0, "hand_r", 1, -1),
        ("elbow_r", -1.0, "hand_r", 0, 1),
        ("hip_pitch_l", -1.0, "foot_l", 0, 1),
        ("hip_roll_r", -0.5, "foot_r", 1, -1),
        ("knee_r", 1.0, "foot_r", 0, -1),
        ("ankle_pitch_l", 0.5, "toes_l", 2, -1),
    ],
)
@pytest.mark.parametrize("make_body", [human_body, robot_body], ids=["human", "robot"])
def test_signs_of_the_joints(make_body, joint, angle, part, axis, sign):
    body = make_body()
    q = body.rest
    before = body.tree.forward(q)[0][body.tree.body(part), axis]
    q[7 + body.joint_names.index(joint)] = angle
    after = body.tree.forward(q)[0][body.tree.body(part), axis]
    assert sign * (after - before) > 0.03


@pytest.mark.parametrize("make_body", [human_body, robot_body], ids=["human", "robot"])
def test_left_and_right_mirror_each_other(make_body):
    body = make_body()
    rng = np.random.default_rng(0)
    q, mirrored = body.rest, body.rest
    for j, name in enumerate(body.joint_names):
        angle = rng.uniform(*(0.5 * body.joint_limits[j]))
        other = name[:-1] + {"l": "r", "r": "l"}[name[-1]] if name[-2] == "_" else name
        flips = any(axis in name for axis in ("roll", "yaw", "clavicle", "finger"))
        q[7 + j] = angle
        mirrored[7 + body.joint_names.index(other)] = -angle if flips else angle
    here, there = body.tree.forward(q)[0], body.tree.forward(mirrored)[0]
    for i, name in enumerate(body.tree.body_names):
        other = name[:-1] + {"l": "r", "r": "l"}[name[-1]] if name[-2] == "_" else name
        np.testing.assert_allclose(
            here[i], there[body.tree.body(other)] * (1, -1, 1), atol=1e-9, err_msg=name
        )


def test_a_human_of_any_size_stands_on_the_floor_at_the_height_asked_for():
    rng = np.random.default_rng(3)
    for _ in range(5):
        height = rng.uniform(1.2, 2.1)
        proportions = {name: rng.uniform(0.8, 1.2) for name in PROPORTIONS}
        body = human_body(height, proportions)
        assert body.height_m == pytest.approx(height)
        model = body.model()
        data = mujoco.MjData(model)
        data.qpos[:] = body.rest
        mujoco.mj_forward(model, data)
        soles = [data.site(i).xpos[2] for i in range(model.nsite) if "sole" in model.site(i).name]
        np.testing.assert_allclose(soles, 0.0, atol=1e-9)
        np.testing.assert_allclose(model.body_pos[1:], body.tree.offset, atol=1e-12)


def test_proportions_stretch_what_they_name():
    average, long_legged = human_body(1.8), human_body(1.8, {"thigh": 1.1})
    ratio = {
        name: np.linalg.norm(long_legged.tree.offset[i]) / np.linalg.norm(average.tree.offset[i])
        for i, name in enumerate(average.tree.body_names)
    }
    assert ratio["shank_l"] / ratio["foot_l"] == pytest.approx(1.1)  # the shank hangs on the thigh
    assert ratio["forearm_l"] == pytest.approx(ratio["foot_l"])


@pytest.mark.parametrize(
    ("height", "proportions", "message"),
    [
        (175.0, {}, "height_m"),
        (float("nan"), {}, "height_m"),
        (1.7, {"legs": 1.1}, "legs"),
        (1.7, {"thigh": -1.0}, "thigh"),
    ],
)
def test_impossible_humans(height, proportions, message):
    with pytest.raises(BodyError, match=message):
        human_body(height, proportions)


def test_nobody_changes_a_body_that_others_share():
    for body in (human_body(), robot_body()):
        shared = follower(body)
        for array in (
            body.joint_limits, body.driven, body.tree.offset, body.tree.limits,
            shared.free, shared.own, shared.rest_weight, shared.tree.axis,
            marker_set("plug_in_gait39").offsets,
        ):  # fmt: skip
            with pytest.raises(ValueError, match="read-only"):
                array[:] = 0
        factors = np.full_like(body.tree.offset, 1.1)
        larger = body.tree.scaled(factors)  # is another's, and says the same to kernels
        np.testing.assert_array_equal(larger.linkage.offset, larger.offset)
        np.testing.assert_array_equal(body.tree.linkage.offset, body.tree.offset)
        assert larger.offset[0, 2] > body.tree.offset[0, 2]
