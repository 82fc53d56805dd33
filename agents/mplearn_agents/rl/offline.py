"""Episodes as a Minari data set, for offline reinforcement learning."""

from __future__ import annotations

import os
import warnings
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Any, SupportsFloat

import gymnasium

from mplearn.errors import InvalidValueError
from mplearn.extras import require
from mplearn.library import PrimitiveLibrary
from mplearn_agents.episodes import Episode, play
from mplearn_agents.policies import Policy
from mplearn_envs.environment.plain import to_plain

if TYPE_CHECKING:
    import minari

#: What of ``info`` is kept: a learner needs the discounts.
KEPT = ("discount", "duration_s", "illegal", "fallen")


def export_episodes(
    env: gymnasium.Env[Any, Any],
    policy: Policy,
    episodes: int,
    dataset: str,
    folder: str | Path | None = None,
    seed: int = 0,
    author: str = "",
    show: Callable[[int], None] = lambda done: None,
) -> tuple[minari.MinariDataset, list[Episode]]:
    """Play episodes and write them as a Minari data set.

    The observations (masks and priors among them), actions and rewards are as the environment gives
    them; of the infos those of `KEPT`.

    Args:
        env: An environment that `gymnasium.make` made, of a library that is not live; its arguments
            are stored with the data, the library's content included.
        policy: Who chooses.
        episodes: How many.
        dataset: Id of the data set, like "mplearn/goal-random-v0".
        folder: Where data sets lie; None is Minari's own place.
        seed: Of the episodes.
        author: Who made it.
        show: Called after each episode with how many are done.

    Returns:
        The data set, as it is on disk, and what came of each episode.

    Raises:
        InvalidValueError: The environment's arguments cannot be stored, or Minari refuses the id.
        MissingDependencyError: The extra ``offline`` is not installed.
    """
    for module in ("h5py", "minari"):
        require(module, "offline")
    import minari
    from minari.data_collector import EpisodeBuffer

    try:
        spec = env.spec
        if spec is None:
            raise ValueError("it has no spec")
        if isinstance(spec.kwargs.get("library"), str):  # which may be gone by then
            library = PrimitiveLibrary.load(spec.kwargs["library"])
            spec.kwargs = spec.kwargs | {"library": to_plain(library)}
        spec.to_json()
    except (TypeError, ValueError, AttributeError) as error:
        raise InvalidValueError(
            "the environment's arguments are stored with the data set: make it by gymnasium.make, "
            f"with a library that is not live, and tasks that are dataclasses ({error})"
        ) from error
    recorder = _Recorder(env)
    played = play(recorder, policy, episodes, seed, show=show)
    with _datasets_in(folder), warnings.catch_warnings():
        warnings.simplefilter("ignore", UserWarning)  # that there is no link to the code
        try:
            written = minari.create_dataset_from_buffers(
                dataset_id=dataset,
                buffer=[EpisodeBuffer(**each) for each in recorder.episodes],
                env=spec,
                observation_space=env.observation_space,
                action_space=env.action_space,
                algorithm_name=type(policy).__name__,
                author=author or None,
                requirements=["mplearn"],
            )
        except (ValueError, AssertionError) as error:
            raise InvalidValueError(f"Minari refuses the data set {dataset!r}: {error}") from error
    return written, played


class _Recorder(gymnasium.Wrapper[Any, Any, Any, Any]):
    """Keeps episodes as Minari's buffers want them: a list of each step's numbers."""

    def __init__(self, env: gymnasium.Env[Any, Any]) -> None:
        super().__init__(env)
        self.episodes: list[dict[str, Any]] = []

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[Any, dict[str, Any]]:
        """Start an episode."""
        observation, info = self.env.reset(seed=seed, options=options)
        steps: dict[str, Any] = {
            name: [] for name in ("actions", "rewards", "terminations", "truncations")
        }
        shown = {key: [value] for key, value in observation.items()}
        infos = {key: [info[key]] for key in KEPT}
        self.episodes.append({"seed": seed, "observations": shown, "infos": infos, **steps})
        return observation, info

    def step(self, action: Any) -> tuple[Any, SupportsFloat, bool, bool, dict[str, Any]]:
        """Perform a macro step."""
        step = self.env.step(action)
        observation, reward, terminated, truncated, info = step
        episode = self.episodes[-1]
        for key, value in observation.items():
            episode["observations"][key].append(value)
        for key, values in episode["infos"].items():
            values.append(info[key])
        episode["actions"].append(action)
        episode["rewards"].append(float(reward))
        episode["terminations"].append(terminated)
        episode["truncations"].append(truncated)
        return step


class _datasets_in:  # noqa: N801  (a context, like contextlib's)
    """Lets Minari have its data sets in a folder for a while."""

    def __init__(self, folder: str | Path | None) -> None:
        self.folder = folder

    def __enter__(self) -> None:
        self._before = os.environ.get("MINARI_DATASETS_PATH")
        if self.folder is not None:
            os.environ["MINARI_DATASETS_PATH"] = str(Path(self.folder).resolve())

    def __exit__(self, *error: object) -> None:
        if self.folder is None:
            return
        if self._before is None:
            del os.environ["MINARI_DATASETS_PATH"]
        else:
            os.environ["MINARI_DATASETS_PATH"] = self._before
