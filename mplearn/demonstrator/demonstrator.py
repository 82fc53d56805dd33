"""The demonstrator: a person who performs motion primitives before the cameras, live."""

from __future__ import annotations

from collections.abc import Iterable, Iterator

import numpy as np

from mplearn.body import human_body, marker_set
from mplearn.errors import InvalidValueError
from mplearn.recording import FloatArray, marker_channels

from .cameras import Cameras
from .idling import Idling
from .movement import Movement
from .observer import Observer
from .performance import Block, Performance
from .person import Person
from .planning import Planner
from .primitives import primitive
from .sequencing import check_follows, check_script, markov_walk
from .stance import Stance
from .variability import Variability

MARKERS = "paper34"
RATES_HZ = (10.0, 1000.0)
_TAIL_S = 0.6  # the person stands still after the last motion


class Demonstrator:
    """A person before the cameras. Every performance of a script gives the same frames for a seed.

    Args:
        person: Who moves; the average person where None.
        seed: Seed of everything random, an integer >= 0.
        rate_hz: Frames per second [1/s], in [10, 1000].
        variability: Sizes of what is random; a person's where None.

    Attributes:
        body: The person's body.
        channels: Names of a frame's columns, length 3 M.

    Raises:
        InvalidValueError: The seed or the rate is not allowed.
        BodyError: There is no human of the person's stature and proportions.

    Example:
        >>> teacher = Demonstrator(seed=1)
        >>> blocks = list(teacher.blocks(["BAR", "BAL"]))  # both arms raised, and lowered
        >>> [segment.label for block in blocks for segment in block.truth]
        ['BAR', 'BAL']
    """

    def __init__(
        self,
        person: Person | None = None,
        seed: int = 0,
        *,
        rate_hz: float = 100.0,
        variability: Variability | None = None,
    ) -> None:
        if isinstance(seed, bool) or not isinstance(seed, int | np.integer) or seed < 0:
            raise InvalidValueError(f"seed must be an integer >= 0, not {seed!r}")
        low, high = RATES_HZ
        if not isinstance(rate_hz, int | float | np.number) or not low <= rate_hz <= high:
            raise InvalidValueError(f"rate_hz must lie in [{low}, {high}], not {rate_hz!r}")
        self.person = Person() if person is None else person
        self.seed = int(seed)
        self.rate_hz = float(rate_hz)
        self.variability = Variability() if variability is None else variability
        self.body = human_body(self.person.height_m, self.person.proportions)
        self._stance = Stance(self.body)
        self._markers = marker_set(MARKERS)
        self.channels = marker_channels(self._markers.names)

    def stream(self, script: Iterable[str] | None = None) -> Iterator[FloatArray]:
        """Yield one frame of markers after another, shape (3 M,) [m]; NaN where a marker is hidden.

        Args:
            script: Primitives in order; it may be endless. Where None, the person goes on for ever
                in the order of `SEQUENCING`.

        Raises:
            InvalidValueError: While running: the script is empty, names an unknown primitive or one
                that cannot follow its predecessor.
        """
        for block in self.blocks(script):
            yield from block.markers.reshape(len(block.markers), -1)

    def blocks(self, script: Iterable[str] | None = None) -> Iterator[Block]:
        """Yield the same performance as `stream` does, in blocks, with postures and truth."""
        rngs = np.random.default_rng(self.seed).spawn(4)
        names = markov_walk(rngs[3]) if script is None else script
        planner = Planner(self.person, self.variability, self._stance, rngs[0])
        performance = Performance(
            planner.planned,
            Idling(self.variability, rngs[1]),
            self._stance,
            Cameras(self.body.tree, self._markers, self.rate_hz, self.variability, rngs[2]),
            self.rate_hz,
        )
        observer = Observer(self.rate_hz, self.person.name)
        last: Movement | None = None
        for index, name in enumerate(names):
            if last is not None:
                check_follows(last.name, name, index)
            last = planner.plan(primitive(name), last)
            yield performance.until(last.start_s, observer.see(last))
            performance.add(last)
        if last is None:
            check_script(())
        else:
            yield performance.until(last.end_s + _TAIL_S, observer.finish())
