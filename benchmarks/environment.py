"""The environment against the raw simulation, its modes against each other, and its start."""

import hashlib
import subprocess
import sys
import time
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor

import gymnasium as gym
import mujoco
import numpy as np

import mplearn_envs  # noqa: F401

from .interleaved import interleaved

ID = "mplearn/PrimitiveHumanoid-v0"
CYCLE = ("right arm raise", "right arm lower", "bow down", "bow up")  # both feet down
Row = tuple[str, str, str, str]


def wall_s(code: str, before: str = "pass") -> float:
    """Return the median time of ``code`` in a new interpreter that has run ``before`` [s]."""
    timed = (
        f"{before}\nimport time; t = time.perf_counter()\n{code}\nprint(time.perf_counter() - t)"
    )

    def run() -> float:
        command = [sys.executable, "-c", timed]
        return float(subprocess.run(command, check=True, capture_output=True, text=True).stdout)

    return float(np.median([run() for _ in range(5)]))


def walker(**options: object) -> tuple[gym.Env, Callable[[], None]]:
    """Return an environment and what makes a step of a random walk in it."""
    env = gym.make(ID, **options)
    info = env.reset(seed=1)[1]
    env.action_space.seed(1)

    def step() -> None:
        nonlocal info
        action = env.action_space.sample(probability=info["transition_prior"])
        *_, over, truncated, info = env.step(action)
        if over or truncated:
            info = env.reset()[1]

    return env, step


def per_call_us(function: Callable[[], object], n: int = 1000) -> float:
    """Return the processor time of a call [us]."""
    function()
    begin = time.process_time()
    for _ in range(n):
        function()
    return 1e6 * (time.process_time() - begin) / n


def double_support() -> Row:
    """A macro step with both feet down against ``mj_step`` with the same commands, interleaved."""
    env = gym.make(ID, max_episode_steps=10**6).unwrapped
    env.reset(seed=0)
    slots = [env.repertoire.slots[env.library[name].id] for name in CYCLE]
    simulation, model = env.simulation, env.model
    plan = env.repertoire.skills.plan
    sent: list[np.ndarray] = []

    def planned(*wanted: object) -> object:
        made = plan(*wanted)
        sent.append(made.commands)
        return made

    env.repertoire.skills.plan = planned
    raw = mujoco.MjData(model)
    times: dict[str, list[float]] = {"environment": [], "mj_step": []}
    for _ in range(15):
        start = simulation.state()
        sent.clear()
        begin = time.process_time()
        for slot in slots:
            env.step(slot)
        middle = time.process_time()
        mujoco.mj_setState(model, raw, start, mujoco.mjtState.mjSTATE_INTEGRATION)
        ready = time.process_time()
        for commands in sent:
            for command in commands:
                raw.ctrl[:] = command
                mujoco.mj_step(model, raw)
        times["mj_step"].append(time.process_time() - ready)
        times["environment"].append(middle - begin)
    took = {name: float(np.median(each[1:])) / len(slots) for name, each in times.items()}
    env.repertoire.skills.plan = plan
    return (
        "step, both feet down",
        f"{1e3 * took['environment']:.1f} ms",
        f"{1e3 * took['mj_step']:.1f} ms, mj_step of the same commands",
        f"{took['environment'] / took['mj_step']:.2f} x",
    )


def modes() -> list[Row]:
    """The two modes, steps of a random walk."""
    walks = {mode: walker(dynamics=mode)[1] for mode in ("simulated", "kinematic")}
    for step in walks.values():
        for _ in range(150):
            step()

    def many(step: Callable[[], None], n: int) -> Callable[[], None]:
        return lambda: [step() for _ in range(n)] and None

    times = interleaved(
        {"simulated": many(walks["simulated"], 10), "kinematic": many(walks["kinematic"], 1000)}
    )
    simulated, kinematic = 10 / times["simulated"], 1000 / times["kinematic"]
    return [
        (
            "kinematic mode",
            f"{kinematic:.0f} steps/s",
            f"{simulated:.0f} steps/s, simulated",
            f"{kinematic / simulated:.0f} x",
        )
    ]


def threads() -> Row:
    """Random walks of eight environments on two threads against one, wall-clock, interleaved.

    What two threads can gain at that moment is measured by hashing, which needs no Python either.
    """
    vectors = {
        n: gym.make_vec(ID, num_envs=8, n_threads=n, max_episode_steps=10**6) for n in (1, 2)
    }
    infos = {n: vector.reset(seed=1)[1] for n, vector in vectors.items()}
    pools = {n: ThreadPoolExecutor(n) for n in vectors}
    work = [bytes(10**7)] * 8
    times: dict[tuple[str, int], list[float]] = {(w, n): [] for w in ("env", "hash") for n in pools}
    rng = np.random.default_rng(0)
    for _ in range(40):
        priors = infos[1]["transition_prior"]
        actions = np.array([rng.choice(len(prior), p=prior) for prior in priors])
        for n, vector in vectors.items():
            begin = time.perf_counter()
            infos[n] = vector.step(actions)[-1]
            middle = time.perf_counter()
            list(pools[n].map(hashlib.sha256, work))
            times["env", n].append(middle - begin)
            times["hash", n].append(time.perf_counter() - middle)
    took = {key: float(np.median(each[15:])) for key, each in times.items()}
    for n, vector in vectors.items():
        vector.close()
        pools[n].shutdown()
    gain, possible = (took[what, 1] / took[what, 2] for what in ("env", "hash"))
    return (
        "8 environments, 2 threads",
        f"{8 / took['env', 2]:.0f} steps/s",
        f"{8 / took['env', 1]:.0f} steps/s, 1 thread (hashing gains {possible:.2f} x)",
        f"{gain:.2f} x",
    )


def online() -> Row:
    """The online environment: real time of demonstrator and robot over processor time."""
    env = gym.make("mplearn/OnlinePrimitiveHumanoid-v0", warm_up_s=30.0)
    info = env.reset(seed=1)[1]
    env.action_space.seed(1)
    passed_s, begin = 0.0, time.process_time()
    for _ in range(40):
        action = env.action_space.sample(probability=info["transition_prior"])
        info = env.step(action)[-1]
        passed_s += info["duration_s"]
    took_s = time.process_time() - begin
    return ("online environment", f"{took_s:.1f} s", "real time", f"{passed_s / took_s:.0f} x")


def rows() -> list[Row]:
    env, _ = walker()
    inner = env.unwrapped
    look = per_call_us(
        lambda: (inner.performer._sensors.read(), inner._observation(), inner._info())
    )
    reset = per_call_us(env.reset, 200)
    make = f"gymnasium.make({ID!r})"
    imported = "import numpy, gymnasium, mplearn_envs"
    seconds = {
        "import mplearn": wall_s("import mplearn", "import numpy"),
        "import mplearn_envs": wall_s("import mplearn_envs", "import numpy"),
        "gym.make": wall_s(make, imported),
        "first reset": wall_s("env.reset()", f"{imported}\nenv = {make}"),
    }
    return [
        ("mask, prior, observation", f"{look:.0f} us", "50 us", f"{look / 50:.2f} x"),
        ("reset", f"{1e-3 * reset:.2f} ms", "2 ms", f"{reset / 2000:.2f} x"),
        double_support(),
        *modes(),
        threads(),
        online(),
        *((what, f"{took:.2f} s", "a new interpreter", "-") for what, took in seconds.items()),
    ]
