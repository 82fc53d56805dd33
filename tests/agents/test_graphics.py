import os
import subprocess
import sys

from mplearn_envs.rendering.backend import choose_backend


def test_the_demo_chooses_its_graphics_library_before_mujoco_is_imported():
    program = "import sys, mplearn_agents.demo.run; sys.exit('mujoco' in sys.modules)"
    assert subprocess.run([sys.executable, "-c", program], check=False).returncode == 0


def test_a_library_is_not_chosen_once_mujoco_has_chosen(monkeypatch):
    import mujoco  # noqa: F401  (MuJoCo has read the variable now)

    monkeypatch.delenv("MUJOCO_GL", raising=False)
    choose_backend()
    assert "MUJOCO_GL" not in os.environ
