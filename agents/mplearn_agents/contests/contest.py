"""A contestant plays a task with one seed; what was trained and played is kept in a folder."""

from __future__ import annotations

import json
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any, Literal, TypeAlias

import gymnasium

import mplearn_envs  # noqa: F401  (registers the environment)
from mplearn_agents.episodes import Episode, play
from mplearn_agents.policies import POLICIES, Policy
from mplearn_agents.rl import TrainedPolicy, TrainingConfig
from mplearn_agents.rl.config import USUAL_SPEED
from mplearn_agents.rl.train import train
from mplearn_agents.rl.trained import CONFIG, POLICY
from mplearn_envs.tasks import FreeTask

EnvName: TypeAlias = Literal["v0", "v1", "online"]
ENVS: dict[EnvName, str] = {
    "v0": "mplearn/PrimitiveHumanoid-v0",
    "v1": "mplearn/PrimitiveHumanoid-v1",
    "online": "mplearn/OnlinePrimitiveHumanoid-v0",
}


@dataclass(frozen=True)
class Game:
    """Episodes of one task.

    Attributes:
        dynamics: "kinematic" or "simulated".
        episodes: How many.
        body: What the body is like, see `mplearn_envs.execution.bodies`.
        people: Of v1: with whom; None elsewhere.
        changes: Of v1's task ``follow``: what changes, see `mplearn_envs.varied.changes`.
    """

    dynamics: str
    episodes: int
    body: str = "nominal"
    people: str | None = None
    changes: str = "none"

    @property
    def name(self) -> str:
        """What tables call it."""
        body = "" if self.body == "nominal" else f" {self.body}"
        changes = "" if self.changes == "none" else f", {self.changes} changes"
        return f"{self.dynamics}{body}" + (f", {self.people}" if self.people else "") + changes


@dataclass(frozen=True)
class Contest:
    """A contestant, its task and its seed.

    Attributes:
        task: Name of the task.
        name: Of the contestant: of a policy in `POLICIES`, or of what ``training`` trains.
        seed: Of the episodes.
        games: What is played.
        library: File of the library; None is the built-in one.
        training: Of an agent; None for a policy.
        env: Version of the environment, one of `ENVS`.
        speeds: Among which speeds one chooses with the primitive.
    """

    task: str
    name: str
    seed: int
    games: tuple[Game, ...]
    library: str | None
    training: TrainingConfig | None
    env: EnvName = "v0"
    speeds: tuple[float, ...] = USUAL_SPEED

    def play(self, folder: Path) -> list[list[Episode]]:
        """Return the episodes of each game; those that the folder has are taken from there.

        A training that was interrupted goes on at its last checkpoint.

        Args:
            folder: Where agents and episodes are kept.
        """
        return [self._played(game, folder) for game in self.games]

    def _played(self, game: Game, folder: Path) -> list[Episode]:
        options: dict[str, Any] = {
            "task": self.task,
            "dynamics": game.dynamics,
            "body": game.body,
            "actions": {"speeds": self.speeds},
        }
        if self.task == "free" and self.env != "online":  # there no graph is known to the end
            options["task"] = FreeTask(ceiling=True)
        if self.env == "v0":
            options["library"] = self.library
        if self.env == "v1":
            options |= {"people": game.people, "changes": game.changes}
        env = gymnasium.make(ENVS[self.env], disable_env_checker=True, **options)
        asked: dict[str, Any] = {
            "episodes": game.episodes,
            "library": env.unwrapped.library.version,  # type: ignore[attr-defined]
            "training": None if self.training is None else asdict(self.training),
        }
        if self.speeds != USUAL_SPEED:
            asked["speeds"] = self.speeds
        asked = json.loads(json.dumps(asked))  # as it is kept: with lists for tuples
        what = f"{self.task}-{game.name}-{self.name}-{self.seed}".replace(", ", "-")
        what = what if self.env != "online" else f"online-{what}"
        what += _suffix(self.speeds)
        file = folder / "episodes" / f"{what.replace(' ', '-')}.json"
        episodes = _kept(file, asked)
        if episodes is None:
            episodes = play(env, self._player(env, folder), game.episodes, self.seed)
            file.parent.mkdir(parents=True, exist_ok=True)
            made = {"asked": asked, "episodes": [asdict(episode) for episode in episodes]}
            file.write_text(json.dumps(made), encoding="utf-8")
        env.close()
        return episodes

    def _player(self, env: gymnasium.Env[Any, Any], folder: Path) -> Policy:
        if self.training is None:
            return POLICIES[self.name](env)
        agent = _trained(self.training, folder / "agents")
        agent.require_fit(env)
        return agent


def _kept(file: Path, asked: dict[str, Any]) -> list[Episode] | None:
    """Return the episodes of a file; None if it is not there, damaged, or was asked otherwise."""
    try:
        made = json.loads(file.read_text("utf-8"))
        if made["asked"] == asked:
            return [Episode(**episode) for episode in made["episodes"]]
    except (OSError, ValueError, KeyError, TypeError):
        pass
    return None


def _suffix(speeds: tuple[float, ...]) -> str:
    """Return what tells apart files of those who choose among other speeds than the usual one."""
    return "" if speeds == USUAL_SPEED else "-at-" + "-".join(f"{each:g}" for each in speeds)


def _trained(config: TrainingConfig, agents: Path) -> TrainedPolicy:
    """Return the agent of a training, which is made, or ended, if it was not before."""
    what = [config.task, config.algorithm, config.prior, config.steps, config.seed]
    if config.env != "v0":
        what.insert(0, config.env)
    folder = agents / ("-".join(map(str, what)) + _suffix(config.speeds))
    if (folder / POLICY).exists() and TrainingConfig.load(folder / CONFIG)[0] == config:
        return TrainedPolicy.load(folder)
    return train(config, folder, resume=(folder / CONFIG).exists())
