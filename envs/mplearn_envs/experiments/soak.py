"""Thousands of macro steps in bodies of every level: how often the robot falls, and of what.

    python -m mplearn_envs.experiments soak out/soak.jsonl --steps 20000

goes on where it was interrupted, for each episode stands in the file when it is over. The same
file tells `mplearn_envs.experiments.falls` what makes the robot fall.
"""

from __future__ import annotations

import json
from collections import Counter
from collections.abc import Iterable, Iterator, Sequence
from pathlib import Path
from typing import Any, NamedTuple, get_args

import numpy as np

from mplearn.errors import InvalidValueError
from mplearn.evaluation.table import Table, percent
from mplearn.library import PrimitiveLibrary
from mplearn_envs.environment.macro_step import MacroStepEnv
from mplearn_envs.environment.options import ActionOptions
from mplearn_envs.environment.primitive_humanoid import PrimitiveHumanoidEnv
from mplearn_envs.environment.varied_humanoid import VariedHumanoidEnv
from mplearn_envs.execution.bodies import BODIES, BodyName
from mplearn_envs.execution.risk import strain_of

LONGEST = 100  # macro steps of an episode


class SoakedStep(NamedTuple):
    """A macro step.

    Attributes:
        name: What was performed; empty for holding.
        speed: At which share of the usual speed.
        duration_s: How long it took [s].
        planned_s: How long it was to take [s].
        fallen: Whether the robot fell.
        unsound: Whether a number of the observation was not finite.
        strain: See `mplearn_envs.execution.risk.strain_of`.
    """

    name: str
    speed: float
    duration_s: float
    planned_s: float
    fallen: bool
    unsound: bool
    strain: tuple[float, ...]


class SoakedEpisode(NamedTuple):
    """An episode of random legal primitives.

    Attributes:
        level: Name of the body's level.
        episode: Its number.
        steps: What happened.
    """

    level: str
    episode: int
    steps: tuple[SoakedStep, ...]

    def line(self) -> str:
        """Return it as a line of JSON."""
        return json.dumps(self, separators=(",", ":"))

    @classmethod
    def of(cls, line: str) -> SoakedEpisode:
        """Return what `line` said.

        Raises:
            InvalidValueError: It is no such line.
        """
        try:
            level, episode, steps = json.loads(line)
            made = tuple(SoakedStep._make((*step[:-1], tuple(step[-1]))) for step in steps)
            return cls(str(level), int(episode), made)
        except (ValueError, TypeError, IndexError) as error:
            raise InvalidValueError(f"{line!r:.80} is no episode of a soak: {error}") from error


def soaked(env: MacroStepEnv, level: str, episode: int, seed: int) -> SoakedEpisode:
    """Return an episode of primitives that are drawn as the demonstrator chose them, at any speed.

    Args:
        env: The environment.
        level: What its body's level is called.
        episode: Number of the episode.
        seed: Of all episodes.
    """
    own = np.random.SeedSequence([seed, list(BODIES).index(level), episode])
    rng, first = np.random.default_rng(own), int(own.generate_state(1)[0])
    _, info = env.reset(seed=first)
    speeds, steps = env.actions.speeds, []
    for _ in range(LONGEST):
        prior = info["transition_prior"][: env.capacity]
        slot, block = int(rng.choice(len(prior), p=prior / prior.sum())), rng.integers(len(speeds))
        id = env.repertoire.primitive(slot)
        plan = env.performer.plan(id, speeds[block])
        observation, _, terminated, _, info = env.step(int(slot + block * env.capacity))
        steps.append(
            SoakedStep(
                "" if id is None else env.library[id].name,
                speeds[block],
                round(float(info["duration_s"]), 4),
                round(plan.duration_s, 4),
                bool(info["fallen"]),
                any(not np.isfinite(part).all() for part in observation.values()),
                tuple(strain_of(plan).round(5).tolist()),
            )
        )
        if terminated:
            break
    return SoakedEpisode(level, episode, tuple(steps))


def soak(
    n_steps: int,
    levels: Sequence[str] = tuple(BODIES),
    seed: int = 0,
    file: Path | None = None,
    **options: Any,
) -> Iterator[SoakedEpisode]:
    """Yield episodes of each level until it has so many macro steps.

    Args:
        n_steps: Macro steps a level, at least.
        levels: Names of levels.
        seed: Of bodies, pushes and choices.
        file: Where each episode is written when it is over; those that are there already are not
            performed again. One process may write to it.
        options: See `made`.

    Raises:
        InvalidValueError: There is no such level, or the file holds something else.
    """
    if unknown := [level for level in levels if level not in BODIES]:
        raise InvalidValueError(f"levels must be among {get_args(BodyName)}, not {unknown}")
    known: dict[tuple[str, int], SoakedEpisode] = {}
    if file is not None and file.exists():
        for each in read_soak(file):
            known[each.level, each.episode] = each
    for level in levels:
        env, done, episode = made(level, **options), 0, 0
        while done < n_steps:
            found = known.get((level, episode))
            if found is None:
                found = soaked(env, level, episode, seed)
                if file is not None:
                    file.parent.mkdir(parents=True, exist_ok=True)
                    with file.open("a", encoding="utf-8") as out:
                        out.write(found.line() + "\n")
            done, episode = done + len(found.steps), episode + 1
            yield found
        env.close()


def read_soak(file: Path) -> list[SoakedEpisode]:
    """Return the episodes of a file; a line that was cut off when the process ended is left out.

    Raises:
        InvalidValueError: It holds something else.
    """
    text = file.read_text("utf-8")
    whole = text[: text.rfind("\n") + 1]
    if len(whole) < len(text):
        file.write_text(whole, "utf-8")
    return [SoakedEpisode.of(line) for line in whole.splitlines()]


def made(
    level: str,
    env: str = "v0",
    library: PrimitiveLibrary | None = None,
    speeds: Sequence[float] = (1.0,),
) -> MacroStepEnv:
    """Return an environment with a body of a level.

    Args:
        level: Name of the level.
        env: Version, "v0" or "v1"; of "v1" all people come.
        library: Of v0: the primitives; None is the built-in library.
        speeds: Speeds among which it is chosen at random.
    """
    actions = ActionOptions(speeds=tuple(speeds))
    if env == "v1":
        return VariedHumanoidEnv("all", task="free", actions=actions, body=level)
    return PrimitiveHumanoidEnv(library, task="free", actions=actions, body=level)


def soak_table(
    library: PrimitiveLibrary | None = None,
    n_steps: int = 2000,
    seed: int = 0,
    levels: Sequence[str] = tuple(BODIES),
) -> Table:
    """Return what comes of random legal primitives in bodies of each level.

    Args:
        library: The primitives; None is the built-in library.
        n_steps: Macro steps a level, at least.
        seed: Of bodies, pushes and choices.
        levels: Names of levels.
    """
    return table_of(soak(n_steps, levels, seed, library=library))


def table_of(episodes: Iterable[SoakedEpisode]) -> Table:
    """Return one row for each level."""
    of_level: dict[str, list[SoakedEpisode]] = {}
    for each in episodes:
        of_level.setdefault(each.level, []).append(each)
    rows = []
    for level, group in of_level.items():
        steps = [step for each in group for step in each.steps]
        falls = [step.name or "holding" for step in steps if step.fallen]
        worst = "; ".join(f"{name} {n}" for name, n in Counter(falls).most_common(3))
        minutes = sum(step.duration_s for step in steps) / 60.0
        rows.append(
            (
                level,
                str(len(steps)),
                f"{minutes:.0f}",
                str(len(group)),
                str(len(falls)),
                percent(len(falls) / len(steps)),
                f"{len(falls) / minutes:.2f}",
                str(sum(step.unsound for step in steps)),
                worst or "-",
            )
        )
    return Table(
        "Random walks in bodies of each level",
        ("body", "steps", "minutes", "episodes", "falls", "a step", "a minute", "NaN", "falls in"),
        tuple(rows),
        "Next primitives as likely as the demonstrator made them; usual speed: half the human's; "
        f"an episode has {LONGEST} macro steps or ends with a fall.",
    )
