"""How the takes of a corpus become streams that one learner can learn."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Literal

from ..anatomy import as_bodies, recognise
from ..errors import CorpusError, MPLearnError
from ..learner import LearnerConfig, learnable_rate
from ..mocap import Hints, TakeFiles, join_by_name, resample, with_channels
from ..recording import Recording
from .executors import Executor, Here

_PROBED = 16  # takes that are read to find the usual rate and channels
_SAME_RATE = 1e-3  # rates that differ by a smaller share are one


@dataclass(frozen=True)
class Reading:
    """What of the takes is learned, and what their files do not say.

    Attributes:
        observe: ``"robot"``: the body in them; ``"positions"``: markers or joints as positions;
            ``"channels"``: the files' own channels.
        hints: What the files do not say about themselves.
        names: Place of the body by point, for what is known better than `recognise` finds it.

    Example:
        >>> from mplearn.mocap import Hints
        >>> reading = Reading(observe="channels", hints=Hints(rate_hz=50.0))
        >>> reading.hints.rate_hz
        50.0
    """

    observe: Literal["robot", "positions", "channels"] = "robot"
    hints: Hints = field(default_factory=Hints)
    names: Mapping[str, str] | None = None

    def takes_of(self, take: TakeFiles) -> tuple[Recording, ...]:
        """Read a take: a recording of each person, named after the take.

        Raises:
            RecordingError: It cannot be read.
        """
        hints = replace(self.hints, joint_axes=self.observe == "robot")
        found = take.read(positions=self.observe != "channels", hints=hints)
        several = len(found) > 1
        return tuple(
            replace(
                each,
                name=f"{take.name} ({each.person})" if several else take.name,
                person=each.person or take.person,
            )
            for each in found
        )

    def streams(self, take: TakeFiles, config: LearnerConfig) -> tuple[Recording, ...]:
        """Return a take as streams for a learner: a body's points, or the learner's channels.

        Raises:
            MPLearnError: It cannot be read, no body is found in it, or it lacks channels.
        """
        streams = []
        for each in self.takes_of(take):
            if self.observe == "robot" and each.is_markers:
                seen = recognise(each, names=self.names).apply(each)
            else:
                seen = with_channels(each, config.channels)
            same = abs(seen.rate_hz - config.rate_hz) <= _SAME_RATE * config.rate_hz
            streams.append(
                replace(seen, rate_hz=config.rate_hz) if same else resample(seen, config.rate_hz)
            )
        return tuple(streams)


def probe(
    takes: Sequence[TakeFiles],
    reading: Reading,
    rate_hz: float | None = None,
    executor: Executor | None = None,
) -> LearnerConfig:
    r"""Find the rate and the channels at which a corpus is learned, from some of its takes.

    Takes spread evenly over the corpus are read: the rate is that of most of them, the channels are
    those that they share. Bodies of other markers are learned all the same.

    Args:
        takes: All takes, at least one.
        reading: What of them is learned.
        rate_hz: The rate, where it is given [1/s].
        executor: Who reads them; this process by default.

    Raises:
        MPLearnError: No take can be read; the first one's error.

    Example:
        >>> from pathlib import Path
        >>> from mplearn.mocap import find_takes
        >>> rows = "".join(f"{k / 50:.2f},{k % 7}\n" for k in range(200))
        >>> Path("takes").mkdir(exist_ok=True)
        >>> for name in ("slow.csv", "quick.csv"):
        ...     _ = Path("takes", name).write_text("time_s,elbow\n" + rows)
        >>> config = probe(find_takes("takes").takes, Reading(observe="channels"))
        >>> config.channels, config.rate_hz
        (('elbow',), 50.0)
    """
    executor = executor or Here()
    step = max(1, len(takes) // _PROBED)
    spread = [*takes[::step], *(take for k, take in enumerate(takes) if k % step)]
    found: list[Recording] = []
    first: BaseException | None = None
    faults = 0
    for k, take in enumerate(spread):
        if (found and k >= _PROBED) or faults >= _PROBED:
            break
        future = executor.submit(first_frames, take, reading)
        error = future.exception()  # one after the other: who ends the worker, is left out alone
        if error is None:
            found += future.result()
        faults += error is not None and not isinstance(error, MPLearnError)
        first = first or error
    if not found:
        if isinstance(first, MPLearnError):
            raise first
        raise CorpusError(f"no take can be read; the first: {type(first).__name__}: {first}")
    rates = Counter(each.rate_hz for each in found)
    markers = [each for each in found if each.is_markers]
    if reading.observe == "robot" and markers:
        channels = markers[0].channels
    else:
        channels = join_by_name(found).recordings[0].channels
    observe: Literal["robot", "markers"] = "robot" if reading.observe == "robot" else "markers"
    usual = learnable_rate(rates.most_common(1)[0][0])
    return LearnerConfig(channels, usual if rate_hz is None else rate_hz, observe=observe)


def first_frames(take: TakeFiles, reading: Reading) -> list[Recording]:
    """Return the first frame of a take, as it is learned, for each person in it.

    Raises:
        MPLearnError: It cannot be read, or no body is found in it.
    """
    found: Sequence[Recording] = reading.takes_of(take)
    if reading.observe == "robot" and all(each.is_markers for each in found):
        found = as_bodies(found, names=reading.names).recordings
    return [
        replace(each, frames=each.frames[:1], labels=(), skeleton=None, report=None)
        for each in found
    ]
