"""Installs each built distribution into an environment of its own and runs the smallest whole job.

Usage: ``python benchmarks/smoke_build.py dist``
"""

import subprocess
import sys
import tempfile
import venv
from pathlib import Path

CONSTRAINTS = Path(__file__).parents[1] / "constraints.txt"

SMOKE = """
import gymnasium as gym, mplearn, mplearn_envs, mplearn_agents
env = gym.make("mplearn/PrimitiveHumanoid-v0")
observation, info = env.reset(seed=1)
for _ in range(2):
    action = env.action_space.sample(probability=info["transition_prior"])
    observation, reward, terminated, truncated, info = env.step(action)
    assert not terminated, info
env.close()
print("smoke test passed:", mplearn.__file__)
"""


def smoke(distribution: Path) -> None:
    with tempfile.TemporaryDirectory() as folder:
        venv.create(folder, with_pip=True)
        python = str(Path(folder) / "bin" / "python")
        install = [python, "-m", "pip", "install", "--quiet", "--constraint", str(CONSTRAINTS)]
        subprocess.run([*install, str(distribution)], check=True, cwd=folder)
        subprocess.run([python, "-c", SMOKE], check=True, cwd=folder)
        subprocess.run([str(Path(folder) / "bin" / "mplearn"), "--version"], check=True, cwd=folder)


def main() -> None:
    built = sorted(Path(sys.argv[1]).resolve().glob("mplearn-*"))
    if {path.suffix for path in built} != {".whl", ".gz"}:
        raise SystemExit(f"expected one wheel and one sdist in {sys.argv[1]}, found {built}")
    for distribution in built:
        smoke(distribution)


if __name__ == "__main__":
    main()
