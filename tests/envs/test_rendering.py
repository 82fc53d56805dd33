"""Pictures, where they can be drawn."""

import os
import subprocess
import sys

import gymnasium
import numpy as np
import pytest
from standing_library import standing_library

import mplearn_envs  # noqa: F401  (registers the environment)
from mplearn.errors import InvalidValueError, MissingDependencyError
from mplearn_envs.primitive_humanoid import PrimitiveHumanoidEnv

ID = "mplearn/PrimitiveHumanoid-v0"


@pytest.fixture(scope="module")
def pictured(renderer):
    """An environment that can draw."""
    env = gymnasium.make(
        ID, library=standing_library(), render_mode="rgb_array", width=160, height=120
    )
    env.reset(seed=0)
    yield env
    env.close()
    env.close()  # a second time does nothing


def test_a_picture_shows_the_robot(pictured):
    pictured.reset(seed=0)
    standing = pictured.render()
    assert standing.shape == (120, 160, 3) and standing.dtype == np.uint8
    assert standing.std() > 10
    np.testing.assert_allclose(pictured.render(), standing.astype(int), atol=2)  # nothing moved
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


def test_importing_the_package_is_light():
    heavy = ("mujoco", "numba", "dm_control", "scipy", "torch")
    code = f"import sys, mplearn_envs; print([m for m in {heavy} if m in sys.modules])"
    path = os.pathsep.join(p for p in sys.path if p)
    done = subprocess.run(
        [sys.executable, "-c", code],
        capture_output=True,
        text=True,
        check=True,
        env={**os.environ, "PYTHONPATH": path},
    )
    assert done.stdout.strip() == "[]"
