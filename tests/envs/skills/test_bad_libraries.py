"""Libraries, options and actions that an environment refuses."""

import json
import zipfile

import gymnasium
import numpy as np
import pytest
from standing_library import CHANNELS, JUMP, RATE_HZ, standing_library, sweep

import mplearn_envs  # noqa: F401  (registers the environment)
from mplearn.errors import InvalidValueError, LibraryError, MPLearnError, RobotError
from mplearn.graph import TransitionGraph
from mplearn.hmm import fit
from mplearn.library import Primitive, PrimitiveLibrary

ID = "mplearn/PrimitiveHumanoid-v0"


def library_like(**changes):
    library = standing_library()
    given = {
        "primitives": library.primitives,
        "graph": library.graph,
        "channels": library.channels,
        "rate_hz": library.rate_hz,
        "body": library.body,
    }
    return PrimitiveLibrary(**(given | changes))


@pytest.mark.parametrize(
    ("library", "message"),
    [
        (lambda: library_like(body="human"), "not for this robot: motions of body 'human'"),
        (lambda: library_like(channels=("x", *CHANNELS[1:])), r"not for this robot.*'x'"),
        (lambda: library_like(primitives=(), graph=TransitionGraph()), "empty"),
        (lambda: 7, "must be a PrimitiveLibrary"),
        (lambda: "no_such_file.mplearn", "no file"),
    ],
)
def test_a_library_that_does_not_fit_is_refused(library, message):
    with pytest.raises(LibraryError, match=message):
        gymnasium.make(ID, library=library())


def test_a_damaged_file_is_refused(tmp_path):
    path = standing_library().save(tmp_path / "one.mplearn")
    assert gymnasium.make(ID, library=path).unwrapped.library.version == standing_library().version
    data = bytearray(path.read_bytes())
    data[len(data) // 2] ^= 0xFF
    path.write_bytes(data)
    with pytest.raises(LibraryError):
        gymnasium.make(ID, library=path)
    path.write_bytes(b"not ours")
    with pytest.raises(LibraryError):
        gymnasium.make(ID, library=path)


def test_a_file_of_another_version_is_refused(tmp_path):
    path = standing_library().save(tmp_path / "one.mplearn")
    with zipfile.ZipFile(path) as archive:
        parts = {name: archive.read(name) for name in archive.namelist()}
    header = json.loads(parts["header.json"])
    for schema, message in ((99, "newer mplearn"), ("one", "damaged")):
        parts["header.json"] = json.dumps(header | {"schema": schema}).encode()
        with zipfile.ZipFile(path, "w") as archive:
            for name, data in parts.items():
                archive.writestr(name, data)
        with pytest.raises(LibraryError, match=message):
            gymnasium.make(ID, library=path)


def test_a_library_the_robot_cannot_perform_is_refused_with_reasons():
    frames = [sweep({}, JUMP, 0.8)] * 4
    jump = Primitive.from_exemplars(1, fit(frames, 8, variance_floor=1e-4), frames, RATE_HZ)
    graph = TransitionGraph()
    graph.add_node(1)
    env = gymnasium.make(ID, library=PrimitiveLibrary((jump,), graph, CHANNELS, RATE_HZ, "robot"))
    with pytest.raises(RobotError, match=r"none of the library's 1 primitives.*flight"):
        env.reset()


@pytest.mark.parametrize(
    "options",
    [
        {"actions": {"capacity": 5}},
        {"actions": {"capacity": 12.5}},
        {"motion": {"speed": 0.0}},
        {"motion": {"speed": np.nan}},
        {"task": "fly"},
        {"actions": {"illegal": "ignore"}},
        {"discount": 1.5},
        {"actions": {"hold_s": 0.0}},
        {"pictures": {"frame_rate_hz": 0.0}},
        {"actions": {"illegal_penalty": np.inf}},
        {"motion": {"style": "wild"}},
        {"dynamics": "dreamt"},
        {"flat": "yes"},
        {"actions": {"novel_penalty": np.nan}},
        {"motion": {"pace": 1.0}},
        {"motion": {"feasibility": {"flight": 1.0}}},
        {"pictures": 640},
        {"robot": "dalek"},
        {"pictures": {"width": 0}},
    ],
)
def test_bad_options_are_refused(options):
    with pytest.raises(MPLearnError):
        gymnasium.make(ID, library=standing_library(), **options).reset()


@pytest.mark.parametrize("action", [-1, 32, 1.5, np.nan, "hold", None, np.array([1, 2]), True])
def test_bad_actions_are_refused(action):
    env = gymnasium.make(ID, library=standing_library()).unwrapped
    env.reset()
    with pytest.raises(InvalidValueError, match=r"an integer in \[0, 32\)"):
        env.step(action)
