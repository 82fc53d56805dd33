"""Pictures, where they can be drawn."""

import os
import subprocess
import sys

import gymnasium
import mujoco
import numpy as np
import pytest
from standing_library import standing_library

import mplearn_envs  # noqa: F401  (registers the environment)
from mplearn.errors import InvalidValueError, MissingDependencyError
from mplearn_envs.environment.primitive_humanoid import PrimitiveHumanoidEnv

ID = "mplearn/PrimitiveHumanoid-v0"


@pytest.fixture(scope="module")
def pictured(renderer):
    """An environment that can draw."""
    env = gymnasium.make(
        ID,
        library=standing_library(),
        render_mode="rgb_array",
        pictures={"width": 160, "height": 120},
    )
    env.reset(seed=0)
    env.render()  # the driver rounds the first picture of a new context differently
    yield env
    env.close()
    env.close()  # a second time does nothing


def test_a_picture_shows_the_robot(pictured):
    pictured.reset(seed=0)
    standing = pictured.render()
    assert standing.shape == (120, 160, 3) and standing.dtype == np.uint8
    assert standing.std() > 10
    np.testing.assert_array_equal(pictured.render(), standing)  # nothing moved
    pictured.step(3)
    assert (pictured.render() != standing).any(axis=2).mean() > 0.02  # it bows


def test_rendering_needs_a_mode_and_a_screen(monkeypatch):
    env = gymnasium.make(ID, library=standing_library()).unwrapped
    env.reset()
    with pytest.raises(InvalidValueError, match="render_mode"):
        env.render()
    if sys.platform == "linux":
        monkeypatch.delenv("DISPLAY", raising=False)
        monkeypatch.delenv("WAYLAND_DISPLAY", raising=False)
        env = gymnasium.make(ID, library=standing_library(), render_mode="human")
        with pytest.raises(MissingDependencyError, match="screen"):
            env.reset()
    with pytest.raises(InvalidValueError, match="render_mode must be"):
        PrimitiveHumanoidEnv(standing_library(), render_mode="ascii")


def run(code):
    path = os.pathsep.join(p for p in sys.path if p)
    return subprocess.run(
        [sys.executable, "-c", code],
        capture_output=True,
        text=True,
        check=True,
        env={**os.environ, "PYTHONPATH": path},
    )


def test_a_renderer_that_is_left_open_ends_in_silence(renderer):
    left = run(
        "import numpy as np; from mplearn_envs.rendering.renderer import Renderer;"
        "from mplearn_envs.robot import humanoid; import mujoco; model = humanoid().model();"
        "data = mujoco.MjData(model); mujoco.mj_forward(model, data);"
        "first, second = Renderer(model, 32, 24), Renderer(model, 32, 24);"
        "print(first.render(data).shape, np.std(second.render(data)) > 1)"
    )
    assert left.stdout == "(24, 32, 3) True\n" and left.stderr == ""


def test_importing_the_package_is_light():
    heavy = ("mujoco", "numba", "dm_control", "scipy", "torch")
    done = run(f"import sys, mplearn_envs; print([m for m in {heavy} if m in sys.modules])")
    assert done.stdout.strip() == "[]"


def test_making_an_environment_is_light():
    unwanted = (
        "mplearn_envs.environment.online",
        "mplearn_envs.rendering.renderer",
        "scipy.signal",
        "torch",
        "mplearn.learner",  # nor what learns, keeps or reads recordings
        "mplearn.store",
        "mplearn.people",
        "mplearn.segmentation",
        "mplearn.mocap",
        "mplearn.tables",
        "sqlite3",
    )
    done = run(
        "import sys, gymnasium, mplearn_envs; gymnasium.make('mplearn/PrimitiveHumanoid-v0');"
        f"print([m for m in {unwanted} if m in sys.modules])"
    )
    assert done.stdout.strip() == "[]"


def test_what_could_not_be_drawn_is_not_tried_again(monkeypatch):
    """A second attempt without a graphics library would abort the process."""
    tried = []

    def refuse(*args, **kwargs):
        tried.append(args)
        raise mujoco.FatalError("no graphics library")

    monkeypatch.setattr("mplearn_envs.rendering.renderer._refusal", [])
    monkeypatch.setattr(mujoco, "Renderer", refuse)
    env = gymnasium.make(ID, library=standing_library(), render_mode="rgb_array")
    env.reset()
    for _ in range(3):
        with pytest.raises(MissingDependencyError, match=r"install libegl1.*no graphics library"):
            env.render()
    assert len(tried) == 1


def test_gymnasium_records_videos_of_it(pictured, tmp_path):
    pytest.importorskip("moviepy", reason="the extra 'video' is not installed")
    film = gymnasium.wrappers.RecordVideo(pictured, str(tmp_path / "films"), disable_logger=True)
    _, info = film.reset(seed=0)
    for _ in range(2):
        *_, info = film.step(int(np.flatnonzero(info["action_mask"])[-1]))
    film.stop_recording()
    (written,) = tmp_path.glob("films/*.mp4")
    assert written.stat().st_size > 1000
