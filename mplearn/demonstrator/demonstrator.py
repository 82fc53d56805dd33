"""The demonstrator: a person who performs a script before the cameras, with the truth about it.

The truth is what a human observer would mark: "a stop in movement, or a change in movement direction"
[Kulic2012, section 4.2.2]. A motion is seen to begin and end where its speed (of all channels,
weighted by how far they move the body) passes 5 % of its own peak. Where less than 0.3 s lies between
the end of one and the beginning of the next, they share a boundary: the middle of the stop or, where
they overlap, the moment of least speed of their sum. A longer stop is a pause, part of no segment.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass, replace
from itertools import islice

import numpy as np

from ..body import human_body, marker_set
from ..errors import InvalidValueError
from ..recording import FloatArray, LabelledSegment, Recording, marker_channels
from .cameras import Cameras
from .idling import Idling
from .movement import Movement, turning_point_s
from .person import Person
from .planning import Planner
from .primitives import primitive
from .sequencing import check_follows, check_script, markov_walk
from .stance import Stance
from .variability import Variability

PAUSE_S = 0.3
"""A stop of more than this is a pause [s]."""

MARKERS = "paper34"
_TAIL_S = 0.6  # the person stands still after the last motion
_BASE = tuple(f"base_{part}" for part in ("x", "y", "z", "qw", "qx", "qy", "qz"))


@dataclass(frozen=True, eq=False)
class Demonstration:
    """A performance.

    Attributes:
        recording: What the cameras saw: markers [m], NaN where hidden; the truth as its labels.
        truth: The segments, in order; pauses are in none.
        posture: The noiseless truth behind it: base position [m] and quaternion (w, x, y, z), then
            the 40 joint angles [rad], in MuJoCo's qpos layout.
    """

    recording: Recording
    truth: tuple[LabelledSegment, ...]
    posture: Recording


@dataclass(frozen=True, eq=False)
class Block:
    """A piece of a performance, from the start of one motion to the start of the next.

    Attributes:
        markers: Markers, shape (T, M, 3) [m]; NaN where hidden.
        postures: Postures, shape (T, 47).
        truth: Segments that this block closes, in frames of the whole performance.
    """

    markers: FloatArray
    postures: FloatArray
    truth: tuple[LabelledSegment, ...]


class Demonstrator:
    """A person before the cameras, performing live: every run gives the same frames for a seed.

    Args:
        person: Who moves; the average person where None.
        seed: Seed of everything random, an integer >= 0.
        rate_hz: Frames per second [1/s], in [10, 1000].
        variability: Sizes of what is random.

    Attributes:
        body: The person's body.
        marker_names: Names of the M markers.
        channels: Names of the frames' columns, length 3 M.

    Raises:
        InvalidValueError: The seed or the rate is not allowed.
        BodyError: There is no human of the person's stature and proportions.
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
        if not isinstance(rate_hz, int | float | np.number) or not 10.0 <= rate_hz <= 1000.0:
            raise InvalidValueError(f"rate_hz must lie in [10, 1000], not {rate_hz!r}")
        self.person = Person() if person is None else person
        self.seed = int(seed)
        self.rate_hz = float(rate_hz)
        self.variability = Variability() if variability is None else variability
        self.body = human_body(self.person.height_m, self.person.proportions)
        self._stance = Stance(self.body)
        self._markers = marker_set(MARKERS)
        self.marker_names = self._markers.names
        self.channels = marker_channels(self.marker_names)

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
        """Yield the same performance as `stream`, a block at a time, with postures and truth."""
        rngs = np.random.default_rng(self.seed).spawn(4)
        names = iter(markov_walk(rngs[3]) if script is None else script)
        planner = Planner(
            self.person, self.variability, self._stance.leg_m, self._stance.upper_limits, rngs[0]
        )
        idling = Idling(self.variability, rngs[1])
        cameras = Cameras(
            self.body.tree, self._markers, self.rate_hz, self.variability, rngs[2]
        )
        settled = planner.planned.copy()
        active: list[Movement] = []
        observer = _Observer(self.rate_hz, self.person.name)
        first_frame = 0

        def block(until_s: float, truth: tuple[LabelledSegment, ...]) -> Block:
            nonlocal first_frame
            end_frame = max(int(np.ceil(until_s * self.rate_hz)), first_frame)
            times_s = np.arange(first_frame, end_frame) / self.rate_hz
            plan = idling(times_s) + settled
            for movement in active:
                plan[:, movement.channels] += movement.displacement(times_s)
            for movement in [m for m in active if m.end_s * self.rate_hz <= end_frame]:
                settled[movement.channels] += movement.step
                active.remove(movement)
            first_frame = end_frame
            postures = self._stance.solve(plan)
            return Block(cameras.measure(postures), postures, truth)

        last: Movement | None = None
        for index, name in enumerate(names):
            if last is not None:
                check_follows(last.name, name, index)
            last = planner.plan(primitive(name), last)
            yield block(last.start_s, observer.see(last))
            active.append(last)
        if last is None:
            check_script(())
        else:
            yield block(last.end_s + _TAIL_S, observer.finish())


class _Observer:
    """Marks segments as a human observer would (see the module's text)."""

    def __init__(self, rate_hz: float, person: str) -> None:
        self._rate_hz, self._person = rate_hz, person
        self._last: Movement | None = None
        self._start_s = 0.0

    def see(self, movement: Movement) -> tuple[LabelledSegment, ...]:
        """Take the next movement and return the segment that it closes, if any."""
        begin_s, _ = movement.visible_s()
        if self._last is None:
            closed: tuple[LabelledSegment, ...] = ()
        else:
            _, end_s = self._last.visible_s()
            if begin_s - end_s <= PAUSE_S:
                begin_s = end_s = turning_point_s(self._last, movement)
            closed = self._closed(end_s)
        self._last, self._start_s = movement, begin_s
        return closed

    def finish(self) -> tuple[LabelledSegment, ...]:
        """Return the last segment."""
        assert self._last is not None
        return self._closed(self._last.visible_s()[1])

    def _closed(self, end_s: float) -> tuple[LabelledSegment, ...]:
        assert self._last is not None
        start, end = round(self._start_s * self._rate_hz), round(end_s * self._rate_hz)
        return (LabelledSegment(start, end, self._last.name, self._person),)


def demonstrate(
    script: Iterable[str],
    seed: int,
    *,
    person: Person | None = None,
    rate_hz: float = 100.0,
    variability: Variability | None = None,
) -> Demonstration:
    """Let a person perform a script.

    Args:
        script: Names of primitives (see `PRIMITIVES`), each starting where its predecessor ends.
        seed: Seed of everything random, an integer >= 0.
        person: Who moves; the average person where None.
        rate_hz: Frames per second [1/s], in [10, 1000].
        variability: Sizes of what is random; a person's where None.

    Raises:
        InvalidValueError: The script is empty, or names an unknown primitive or one that cannot
            follow its predecessor; the seed or the rate is not allowed.
    """
    names = tuple(script)
    check_script(names)
    demonstrator = Demonstrator(person, seed, rate_hz=rate_hz, variability=variability)
    return gather(demonstrator, demonstrator.blocks(names))


def gather(
    demonstrator: Demonstrator, blocks: Iterable[Block], n_frames: int | None = None
) -> Demonstration:
    """Join blocks to a demonstration, cut after ``n_frames`` where given."""
    pieces: list[Block] = []
    length = 0
    for block in blocks:
        pieces.append(block)
        length += len(block.postures)
        if n_frames is not None and length >= n_frames:
            break
    name = f"demonstration-{demonstrator.seed}"
    truth = tuple(segment for piece in pieces for segment in piece.truth)
    whole = Recording(
        frames=np.concatenate([p.markers for p in pieces]).reshape(length, -1)[:n_frames],
        rate_hz=demonstrator.rate_hz,
        channels=demonstrator.channels,
        name=name,
        person=demonstrator.person.name,
    )
    truth = tuple(segment for segment in truth if segment.end <= len(whole))
    posture = replace(
        whole,
        frames=np.concatenate([p.postures for p in pieces])[:n_frames],
        channels=_BASE + demonstrator.body.joint_names,
        labels=truth,
    )
    return Demonstration(replace(whole, labels=truth), truth, posture)
