"""Thousands of macro steps in bodies of every level: how often the robot falls, and of what."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence

import numpy as np

from mplearn.evaluation.table import Table, percent
from mplearn.library import PrimitiveLibrary
from mplearn_envs.environment.primitive_humanoid import PrimitiveHumanoidEnv
from mplearn_envs.execution.bodies import BODIES

_EPISODE = 100  # macro steps


def soak_table(
    library: PrimitiveLibrary | None = None,
    n_steps: int = 2000,
    seed: int = 0,
    levels: Sequence[str] = tuple(BODIES),
) -> Table:
    """Return what comes of random legal primitives in bodies of each level.

    Args:
        library: The primitives; None is the built-in library.
        n_steps: Macro steps a level.
        seed: Of bodies, pushes and choices.
        levels: Names of levels.
    """
    rows = []
    for level in levels:
        env = PrimitiveHumanoidEnv(library, body=level)
        rng = np.random.default_rng(seed)
        falls, doing = 0, Counter[str]()
        unsound, episodes, took_s, age = 0, 0, 0.0, _EPISODE
        for _ in range(n_steps):
            if age >= _EPISODE:
                observation, info = env.reset(seed=seed + episodes)
                episodes, age = episodes + 1, 0
            prior = info["transition_prior"]
            action = int(rng.choice(len(prior), p=prior / prior.sum()))
            observation, _, terminated, _, info = env.step(action)
            took_s, age = took_s + info["duration_s"], age + 1
            unsound += any(not np.isfinite(part).all() for part in observation.values())
            if terminated:
                falls, age = falls + 1, _EPISODE
                doing[info["primitive_name"] or "holding"] += 1
        env.close()
        worst = "; ".join(f"{name} {n}" for name, n in doing.most_common(3))
        rows.append(
            (
                level,
                str(n_steps),
                f"{took_s / 60.0:.0f}",
                str(episodes),
                str(falls),
                percent(falls / n_steps),
                str(unsound),
                worst or "-",
            )
        )
    return Table(
        "Random walks in bodies of each level",
        ("body", "steps", "minutes", "episodes", "falls", "a step", "NaN", "falls in"),
        tuple(rows),
        "Next primitives as likely as the demonstrator made them; at the human's half speed; an "
        f"episode has {_EPISODE} macro steps or ends with a fall.",
    )
