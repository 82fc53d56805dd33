"""The environment against the raw simulation, and how long it takes to get there."""

import subprocess
import sys
import time

import gymnasium as gym
import mujoco
import numpy as np

import mplearn_envs  # noqa: F401


def wall(code: str) -> float:
    """Return the median time of a new interpreter running ``code`` beyond importing numpy [s]."""

    def run(what: str) -> float:
        begin = time.perf_counter()
        subprocess.run([sys.executable, "-c", what], check=True)
        return time.perf_counter() - begin

    return float(np.median([run(code) - run("import numpy") for _ in range(5)]))


def rows() -> list[tuple[str, str, str, str]]:
    env = gym.make("mplearn/PrimitiveHumanoid-v0", max_episode_steps=10_000)
    _, info = env.reset(seed=1)
    env.action_space.seed(1)
    simulated_s, step_s, raw_s = 0.0, [], []
    for _ in range(12):
        action = env.action_space.sample(probability=info["transition_prior"])
        begin = time.process_time()
        _, _, terminated, truncated, info = env.step(action)
        step_s.append(time.process_time() - begin)
        simulated_s += info["duration_s"]
        simulation = env.unwrapped.simulation
        model, data = simulation.model, simulation.data
        copy = mujoco.MjData(model)
        copy.qpos[:], copy.ctrl[:] = data.qpos, data.ctrl
        substeps = round(info["duration_s"] / model.opt.timestep)
        begin = time.process_time()
        mujoco.mj_step(model, copy, nstep=substeps)
        raw_s.append(time.process_time() - begin)
        if terminated or truncated:
            _, info = env.reset()
    env.close()
    return [
        (
            "environment step",
            f"{1e3 * np.median(step_s):.1f} ms",
            f"{1e3 * np.median(raw_s):.1f} ms, mj_step of the same substeps",
            f"{np.sum(step_s) / np.sum(raw_s):.2f} x",
        ),
        (
            "simulation",
            f"{np.sum(step_s):.2f} s",
            "real time",
            f"{simulated_s / np.sum(step_s):.0f} x",
        ),
        ("import mplearn", f"{wall('import mplearn'):.2f} s", "beyond numpy", "-"),
        ("import mplearn_envs", f"{wall('import mplearn_envs'):.2f} s", "beyond numpy", "-"),
        (
            "gym.make",
            f"{wall(chr(10).join(('import gymnasium, mplearn_envs', MAKE))):.2f} s",
            "imports included, beyond numpy",
            "-",
        ),
    ]


MAKE = "gymnasium.make('mplearn/PrimitiveHumanoid-v0')"
