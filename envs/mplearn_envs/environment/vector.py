"""Many humanoids at a time, each simulated in a thread."""

from __future__ import annotations

import copy
import os
from collections.abc import Callable
from concurrent.futures import Future, ThreadPoolExecutor, wait
from typing import Any, ClassVar, cast

import gymnasium
import numpy as np
from gymnasium.vector import AutoresetMode, SyncVectorEnv
from gymnasium.wrappers import TimeLimit
from numpy.typing import NDArray

from mplearn.errors import InvalidValueError

from .macro_step import MacroStepEnv
from .plain import PlainSpec
from .primitive_humanoid import PrimitiveHumanoidEnv
from .varied_humanoid import VariedHumanoidEnv


class PrimitiveHumanoidVectorEnv(PlainSpec, SyncVectorEnv):
    """Environments that are stepped in threads; results are those of single ones, bit for bit.

    While a robot is simulated, MuJoCo leaves Python to the other threads. What is known of the
    library is shared.
    ``gymnasium.make_vec("mplearn/PrimitiveHumanoid-v0", num_envs=8)`` makes it; it is a
    `gymnasium.vector.SyncVectorEnv` in all else, autoreset and seeds included.

    Args:
        num_envs: Number of environments.
        n_threads: Number of threads; None is the number of processors that may be used.
        autoreset_mode: When an episode that is over begins anew, see gymnasium.
        max_episode_steps: Macro steps after which an episode is truncated; None: never.
        **options: Of each environment, see `PrimitiveHumanoidEnv`. Each gets a copy of a task
            object.

    Example:
        >>> import gymnasium as gym
        >>> import mplearn_envs
        >>> envs = gym.make_vec("mplearn/PrimitiveHumanoid-v0", num_envs=2, dynamics="kinematic")
        >>> observations, infos = envs.reset(seed=1)
        >>> envs.unwrapped.action_masks().shape[0], infos["action_mask"].shape[0]
        (2, 2)
        >>> envs.close()
    """

    env_class: ClassVar[type[MacroStepEnv]] = PrimitiveHumanoidEnv

    def __init__(
        self,
        num_envs: int = 1,
        *,
        n_threads: int | None = None,
        autoreset_mode: str | AutoresetMode = AutoresetMode.NEXT_STEP,
        max_episode_steps: int | None = None,
        **options: Any,
    ) -> None:
        for name, value in (
            ("num_envs", num_envs),
            ("n_threads", n_threads),
            ("max_episode_steps", max_episode_steps),
        ):
            if value is not None and (not isinstance(value, int) or value < 1):
                raise InvalidValueError(f"{name} must be an integer from 1, not {value!r}")
        self.options = options
        self.n_threads = n_threads or _n_processors()
        self._pool: ThreadPoolExecutor | None = None
        super().__init__(
            [_maker(self.env_class, options, max_episode_steps)] * num_envs,
            autoreset_mode=autoreset_mode,
        )

    def step(self, actions: Any) -> tuple[Any, Any, Any, Any, dict[str, Any]]:
        """Step all environments at a time; see `gymnasium.vector.SyncVectorEnv.step`."""
        if self._pool is None:
            self._pool = ThreadPoolExecutor(self.n_threads, "mplearn-env")
        next_step = self.autoreset_mode == AutoresetMode.NEXT_STEP
        actions = np.asarray(actions)
        if actions.shape != (self.num_envs,):
            raise InvalidValueError(f"{self.num_envs} actions are needed, not {actions!r}")
        waiting = [
            (cast(_Begun, env), action)
            for env, action, over in zip(self.envs, actions, self._autoreset_envs, strict=True)
            if not (over and next_step)
        ]
        # the longest first, so that no thread is left with a long one at the end
        waiting.sort(key=lambda each: -each[0].expected_s(each[1]))
        wait([env.begin(self._pool, action) for env, action in waiting])  # out of their way
        return super().step(actions)

    def action_masks(self) -> NDArray[np.bool_]:
        """Return which actions are legal, shape (num_envs, capacity)."""
        return np.stack(self.call("action_masks"))

    def close_extras(self, **kwargs: Any) -> None:
        """End the threads and close the environments."""
        if self._pool is not None:
            self._pool.shutdown()
            self._pool = None
        super().close_extras(**kwargs)


class VariedHumanoidVectorEnv(PrimitiveHumanoidVectorEnv):
    """The same of `VariedHumanoidEnv`.

    Example:
        >>> import gymnasium as gym
        >>> import mplearn_envs
        >>> envs = gym.make_vec("mplearn/PrimitiveHumanoid-v1", num_envs=2, dynamics="kinematic")
        >>> envs.num_envs
        2
        >>> envs.close()
    """

    env_class = VariedHumanoidEnv


class _Begun(gymnasium.Wrapper[Any, Any, Any, Any]):
    """An environment whose next step may have begun already, in another thread."""

    _result: Future[Any] | None = None

    def expected_s(self, action: np.int64) -> float:
        """Return how long what an action stands for takes the robot, legal or not [s]."""
        env = cast(MacroStepEnv, self.unwrapped)
        known = self.action_space.contains(action)
        id = env.repertoire.primitive(int(action) % env.capacity) if known else None
        return env.actions.hold_s if id is None else env.repertoire.skills.duration_s(id)

    def begin(self, pool: ThreadPoolExecutor, action: np.int64) -> Future[Any]:
        """Begin the step that `step` will be asked for."""
        self._result = pool.submit(self.env.step, action)
        return self._result

    def step(self, action: Any) -> Any:
        """Return what came of it."""
        if self._result is None:
            return self.env.step(action)
        result, self._result = self._result, None
        return result.result()


def _maker(
    env_class: type[MacroStepEnv], options: dict[str, Any], max_episode_steps: int | None
) -> Callable[[], gymnasium.Env[Any, Any]]:
    def make() -> gymnasium.Env[Any, Any]:
        own = {"task": copy.deepcopy(options["task"])} if "task" in options else {}
        env: gymnasium.Env[Any, Any] = env_class(**(options | own))
        if max_episode_steps is not None:
            env = TimeLimit(env, max_episode_steps)
        return _Begun(env)

    return make


def _n_processors() -> int:
    """Return how many processors may be used."""
    if hasattr(os, "sched_getaffinity"):
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1
