"""The animals in a file of key points, each seen from its own body, whatever format it is.

Of several `read` returns the one that was seen most, `read_each` all that were seen at least half
as often.
"""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Callable, Mapping
from copy import deepcopy
from dataclasses import dataclass
from pathlib import Path
from typing import NamedTuple

import numpy as np

from ...errors import RecordingError
from ...option_names import option
from ...recording import FloatArray, Recording
from ..files import bad_file, stem
from ..findings import Findings
from ..rates import rate_beside
from ..reader import Hints, Reader
from .egocentric import seen_from_the_body

USUAL_HZ = 30.0
"""Pictures a second where nobody says how many [1/s]."""

SURE = ("likelihood", "score", "confidence", "conf", "probability", "visibility")
"""Names of how sure a point is."""

COORDS = frozenset(("x", "y", "z", *SURE))
"""Names of the numbers that a point has."""

_OFTEN = 0.5  # of what is seen of one animal most, that is seen of another that is read, too

Columns = Mapping[str, Mapping[str, int]]
"""Where each coordinate of each point stands in a table, by the point's name and by ``x``, ..."""

Track = tuple[FloatArray, tuple[str, ...], FloatArray | None]
"""Points of one animal, shape (T, K, 2 or 3), their names, how sure they are, shape (T, K)."""


class AnimalReader(Reader):
    """Reads files of key points, of one animal or of several."""

    def read(self, path: Path, hints: Hints, *, positions: bool) -> Recording:
        """Read the animal that was seen most; see `Reader.read`."""
        return self._animals(path, hints).seen_most()

    def read_each(self, path: Path, hints: Hints, *, positions: bool) -> tuple[Recording, ...]:
        """Read all animals that were seen often; see `Reader.read_each`."""
        return self._animals(path, hints).seen_often()

    @abstractmethod
    def _animals(self, path: Path, hints: Hints) -> Animals:
        """Return the animals in a file."""


def points_of(path: Path, values: FloatArray, columns: Columns) -> Track:
    """Return points, shape (T, K, 2 or 3), their names, and how likely each is, shape (T, K)."""
    axes = "xyz" if all("z" in own for own in columns.values()) else "xy"
    whole = {name: own for name, own in columns.items() if set(axes) <= own.keys()}
    if not whole:
        raise bad_file(path, "no key point with x and y", "columns x, y (and z) for each point")
    points = np.stack([values[:, [own[axis] for axis in axes]] for own in whole.values()], axis=1)
    if len(axes) == 2:
        points[..., 1] *= -1.0  # a picture's rows are counted downwards
    likely = None
    sure = next((s for s in SURE if all(s in own for own in whole.values())), None)
    if sure is not None:
        likely = values[:, [own[sure] for own in whole.values()]]  # NaN where a person says it
    return points, tuple(whole), likely


def span_of(path: Path, at: FloatArray) -> tuple[int, int]:
    """Return the first and the last of some frames' numbers."""
    whole = len(at) and np.isfinite(at).all() and (at == np.rint(at)).all()
    if not whole or at.min() < 0 or at.max() > 1e15 or np.ptp(at) > 10 * len(at) + 1000:
        raise bad_file(path, "no frames, or numbers far apart", "frames one after the other")
    return int(at.min()), int(at.max())


def by_frame(path: Path, at: FloatArray, table: FloatArray) -> FloatArray:
    """Return a table with a row for each frame by its number, where they are numbered."""
    if len(at) < 2 or not (np.diff(at) >= 1.0).all() or (at != np.rint(at)).any():
        return table
    first, last = span_of(path, at)
    whole = np.full((last - first + 1, table.shape[1]), np.nan)
    whole[at.astype(np.int64) - first] = table
    return whole


def rate_of(path: Path, hints: Hints, findings: Findings) -> float:
    """Return how many pictures there are a second, and say where nobody says it [1/s]."""
    rate_hz = hints.rate_hz or rate_beside(path, findings)
    if rate_hz is None:
        rate_hz = USUAL_HZ
        findings.note(
            f"the file does not say how many pictures there are a second: taken as {USUAL_HZ:g}; "
            f"{option('rate_hz')} settles it"
        )
    return rate_hz


def often_seen(seen: Mapping[str, int]) -> list[str]:
    """Return who was seen at least half as often as the one seen most."""
    least = _OFTEN * max(seen.values(), default=0)
    return [each for each, n_seen in seen.items() if n_seen >= least]


@dataclass(frozen=True)
class Animals:
    """The animals in a file.

    Attributes:
        path: The file.
        seen: Of each, by name, how many numbers there are.
        track: Returns the key points of one.
        rate_hz: Pictures a second [1/s].
        findings: What was found out on the way.
    """

    path: Path
    seen: Mapping[str, int]
    track: Callable[[str], Track]
    rate_hz: float
    findings: Findings

    @classmethod
    def in_columns(
        cls,
        path: Path,
        table: FloatArray,
        columns: Mapping[str, Columns],
        hints: Hints,
        findings: Findings,
    ) -> Animals:
        """Return the animals in a table, shape (T, C), of which each has some columns."""
        tracks = {animal: points_of(path, table, own) for animal, own in columns.items()}
        seen = {each: int(np.isfinite(track[0]).sum()) for each, track in tracks.items()}
        return cls(path, seen, tracks.__getitem__, rate_of(path, hints, findings), findings)

    def seen_most(self) -> Recording:
        """Return the animal that was seen most, and tell which others there are."""
        most = max(self.seen, key=lambda each: self.seen[each])
        if len(self.seen) > 1:
            self.findings.note(f"of {len(self.seen)} animals the one that was seen most: {most}")
            self.findings.leave_out(each for each in self.seen if each != most)
        return self._recording(self._seen(most), most, stem(self.path), self.findings)

    def seen_often(self) -> tuple[Recording, ...]:
        """Return all animals that were seen at least half as often as the one seen most."""
        often = often_seen(self.seen)
        if len(often) == 1:
            return (self.seen_most(),)
        found, problems = {}, {}
        for animal in often:
            try:
                found[animal] = self._seen(animal)
            except RecordingError as error:
                problems[animal] = error
        if not found:
            raise next(iter(problems.values()))
        names = ", ".join(who or "one unnamed" for who in found)
        self.findings.note(
            f"{len(found)} animals: {names}; each is a take of its own "
            f"({option('person')} picks one)"
            if len(found) > 1
            else f"of {len(self.seen)} animals the one that can be read: {names}"
        )
        self.findings.leave_out(each for each in self.seen if each not in found)
        for animal, problem in problems.items():
            self.findings.warn(f"{animal or 'one unnamed'} is left out: {problem}")
        name, several = stem(self.path), len(found) > 1
        return tuple(
            self._recording(
                seen, who, f"{name} ({who})" if who and several else name, deepcopy(self.findings)
            )
            for who, seen in found.items()
        )

    def _seen(self, animal: str) -> _Seen:
        """Return an animal as it is seen from its body."""
        points, names, likelihood = self.track(animal)
        try:
            frames, channels, length = seen_from_the_body(points, names, self.rate_hz, likelihood)
        except RecordingError as error:
            raise bad_file(self.path, str(error), "key points of a body") from error
        hidden = tuple(each for each in names if f"{each}.ahead" not in channels)
        return _Seen(frames, channels, length, hidden)

    def _recording(self, seen: _Seen, who: str, name: str, findings: Findings) -> Recording:
        findings.note(f"key points along the body's heading, in body lengths of {seen.length:.4g}")
        findings.leave_out(seen.hidden)
        report = findings.report(self.rate_hz)
        return Recording(seen.frames, self.rate_hz, seen.channels, name, who, report=report)


class _Seen(NamedTuple):
    """An animal as it is seen from its body.

    Attributes:
        frames: Shape (T, D) [body lengths].
        channels: Their names, length D.
        length: Of the body, in the file's unit.
        hidden: Names of points that were never seen.
    """

    frames: FloatArray
    channels: tuple[str, ...]
    length: float
    hidden: tuple[str, ...]
