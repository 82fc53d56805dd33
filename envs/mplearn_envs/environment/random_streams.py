"""An environment's randomness: one stream a purpose, all from one seed."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np


class RandomStreams(NamedTuple):
    """Sources of randomness that have nothing to do with each other.

    Nor have they with ``np.random.default_rng(seed)``, from which ``env.action_space.seed(seed)``
    and many a policy draw: else who acts with the environment's own seed would draw the very
    numbers that decide what the demonstrator does.

    Attributes:
        task: What a task draws: goals, requests, its demonstrator.
        demonstrator: What a demonstrator draws who goes on while the robot acts.
        body: Which body an episode has, and what happens to it.
    """

    task: np.random.Generator
    demonstrator: np.random.Generator
    body: np.random.Generator

    @classmethod
    def of(cls, seed: int) -> RandomStreams:
        """Return the streams of a seed."""
        children = np.random.SeedSequence(seed).spawn(len(cls._fields))
        return cls(*map(np.random.default_rng, children))
