"""A session like the paper's."""

from __future__ import annotations

import numpy as np

from .demonstrator import Demonstration, Demonstrator, gather
from .person import Person
from .sequencing import markov_walk
from .variability import Variability

MINUTES = 16
_BALANCE = 0.5


def paper_session(
    seed: int,
    *,
    person: Person | None = None,
    rate_hz: float = 100.0,
    variability: Variability | None = None,
) -> Demonstration:
    """Return the likes of the paper's data [Kulic2012, section 4.2.2].

    16 minutes of one person, about 751 segments of 22 types, about equally often, in the order of
    `SEQUENCING`, some joined fluidly, some with a pause between them.

    Args:
        seed: Seed of everything random, an integer >= 0.
        person: Who moves; the average person where None.
        rate_hz: Frames per second [1/s], in [10, 1000].
        variability: Sizes of what is random; a person's where None.

    Raises:
        InvalidValueError: The seed or the rate is not allowed.
    """
    demonstrator = Demonstrator(person, seed, rate_hz=rate_hz, variability=variability)
    script = markov_walk(np.random.default_rng([seed, MINUTES]), balance=_BALANCE)
    n_frames = round(MINUTES * 60 * demonstrator.rate_hz)
    return gather(demonstrator, demonstrator.blocks(script), n_frames)
