"""The examples in docstrings run; a module joins by having one."""

import doctest
import importlib
from pathlib import Path

import pytest

import mplearn
import mplearn_agents
import mplearn_envs

MODULES = [
    ".".join(path.relative_to(root.parent).with_suffix("").parts).removesuffix(".__init__")
    for root in (Path(package.__path__[0]) for package in (mplearn, mplearn_envs, mplearn_agents))
    for path in sorted(root.rglob("*.py"))
    if ">>> " in path.read_text(encoding="utf-8")
]


REGISTRIES = {  # what examples register is gone afterwards
    "mplearn.mocap.registry": "_registered",
    "mplearn.sources.registry": "_registered",
    "mplearn.store.commands": "_KINDS",
    "mplearn.tree.distance": "_KINDS",
}


@pytest.mark.parametrize("name", MODULES)
def test_examples_run(name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    for room, registry in REGISTRIES.items():
        module = importlib.import_module(room)
        monkeypatch.setattr(module, registry, getattr(module, registry).copy())
    module = importlib.import_module(name)
    examples = [each for each in doctest.DocTestFinder().find(module) if each.examples]
    assert examples
    runner = doctest.DocTestRunner(optionflags=doctest.ELLIPSIS)
    for each in examples:  # each in a folder of its own: files have the same names
        folder = tmp_path / each.name
        folder.mkdir()
        monkeypatch.chdir(folder)
        runner.run(each)
    assert not runner.summarize().failed


PUBLIC = {  # beside all of `mplearn.__all__`: what a user of each room starts from
    "mplearn.activities": ["find_activities"],
    "mplearn.anatomy": ["as_bodies", "recognise"],
    "mplearn.baselines": ["minimum_error_split"],
    "mplearn.body": [
        *("human_body", "robot_body", "marker_set", "KinematicTree", "InverseKinematics"),
        *("MotionObserver", "features_of", "keypoints_of", "posture_of", "find_marker_set"),
        *("Body", "MarkerSet"),
    ],
    "mplearn.corpus": ["learn_corpus", "deal"],
    "mplearn.demonstrator": [
        "demonstrate",
        "Person",
        "markov_script",
        "Demonstrator",
        "markov_walk",
    ],
    "mplearn.evaluation": ["match_segments", "content_of", "score_boundaries", "Table", "alike"],
    "mplearn.generation": ["generate", "retime", "Trajectory"],
    "mplearn.graph": ["TransitionGraph", "MergedGraph", "LevelledGraph"],
    "mplearn.hmm": [
        *("fit", "fit_factorial", "fit_semi_markov", "distance", "to_hmmlearn"),
        *("LeftRightHMM", "MotionTracker", "score_batch", "select_size"),
        *("FactorialHMM", "SemiMarkovHMM", "from_hmmlearn"),
    ],
    "mplearn.library": ["Primitive", "PrimitiveLibrary", "CompactMotion"],
    "mplearn.learner": ["MotionLearner", "LearnerConfig", "FrameBuffer", "Recognised"],
    "mplearn.merging": ["merge_learners", "merge_graphs"],
    "mplearn.people": ["PeopleTree", "PeopleConfig"],
    "mplearn.mocap": [
        *("Hints", "GapTracker", "resample", "with_channels", "Reader", "Findings", "placed"),
        *("join_by_name", "take_names"),
        *("bad_file", "readers"),
    ],
    "mplearn.segmentation": ["Segmenter", "make_segmenter", "register_segmenter", "ZeroVelocity"],
    "mplearn.sources": ["open_source", "Stream", "source_kinds"],
    "mplearn.state": [
        "State",
        "checkpoint",
        "newer",
        "saved_as",
        "from_plain",
        "require",
        "require_no_cycle",
        "to_plain",
    ],
    "mplearn.statistics": ["compare", "durations", "quality", "tempo", "transitions"],
    "mplearn.store": ["LifelongLearner", "StoreReader", "backup", "check"],
    "mplearn.tables": ["write_segments", "read_segments", "SegmentTable"],
    "mplearn.tree": ["PrimitiveTree", "TreeConfig", "Distance", "make_distance"],
    "mplearn_envs.export": ["perform", "export", "robot_model", "format_of", "RobotMotion"],
    "mplearn_envs.environment.primitive_humanoid": ["PrimitiveHumanoidEnv"],
    "mplearn_envs.environment.options": ["MotionOptions", "ActionOptions"],
    "mplearn_envs.mechanics": ["reference_robot", "rest_reference"],
    "mplearn_envs.planning": ["Planner", "PlannerConfig"],
    "mplearn_envs.robot": ["Robot", "Retargeting", "described_robot", "humanoid", "make_robot"],
    "mplearn_envs.skills.feasibility": ["FeasibilityConfig"],
    "mplearn_envs.tasks": ["FreeTask", "GoalTask", "FollowTask", "ReciteTask"],
    "mplearn_agents.rl": ["TrainingConfig"],
    "mplearn_agents.policies": [
        "RandomWalk",
        "legal_actions",
        "transition_prior",
        "Greedy",
        "PathToGoal",
        "UniformLegal",
    ],
}


@pytest.mark.parametrize(
    ("room", "name"),
    [("mplearn", name) for name in mplearn.__all__]
    + [(room, name) for room, names in PUBLIC.items() for name in names],
)
def test_what_a_user_starts_from_has_an_example(room: str, name: str) -> None:
    assert ">>> " in (getattr(importlib.import_module(room), name).__doc__ or "")


def test_the_ground_floor_has_examples() -> None:
    assert "mplearn.maths.rotations" in MODULES
