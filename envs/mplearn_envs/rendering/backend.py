"""Finds out with which graphics library MuJoCo can draw off screen here."""

from __future__ import annotations

import os
import subprocess
import sys

_TRIAL = """
import mujoco
renderer = mujoco.Renderer(mujoco.MjModel.from_xml_string("<mujoco/>"), 16, 16)
renderer.update_scene(mujoco.MjData(renderer.model))
renderer.render()
renderer.close()
"""
_LINUX = ("egl", "osmesa", "glfw")


def choose_backend() -> bool:
    """Set ``MUJOCO_GL`` to the first graphics library that draws, where it is not set yet.

    Each is tried in a process of its own, since one that fails may take its process along. MuJoCo
    reads the variable when it is imported: call this before. Afterwards only what MuJoCo has
    already chosen is tried.

    Returns:
        Whether pictures can be drawn.
    """
    chosen = os.environ.get("MUJOCO_GL")
    fixed = chosen is not None or "mujoco" in sys.modules or sys.platform != "linux"
    for backend in (chosen,) if fixed else _LINUX:
        environment = {**os.environ, **({} if backend is None else {"MUJOCO_GL": backend})}
        trial = subprocess.run(
            [sys.executable, "-c", _TRIAL], env=environment, capture_output=True, check=False
        )
        if trial.returncode == 0:
            os.environ.update(environment)
            return True
    return False
