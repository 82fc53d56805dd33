"""A stream in the points of a body, metres, z up: found in its first frames, kept from there on."""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from ..anatomy import BodyMap, recognise
from ..errors import MPLearnError
from ..mocap.findings import Findings
from ..mocap.markers.names import chosen_names
from ..mocap.placing.handedness import OTHER_HAND, right_handed
from ..mocap.placing.level import leveled, told_of_lean, turn_to_level
from ..mocap.placing.space import Space, placed
from ..recording import BoolArray, FloatArray, IntArray, Recording, marker_channels
from .registry import Wanted
from .source import Block, Change, Source, Stream

FIRST_LOOK_S, DOUBT_S, PATIENCE_S = 1.0, 4.0, 10.0
"""A body is looked for in so much of the stream; so long while something stays in doubt; and no
more than so much is kept while there is none."""
KEPT = 0.6  # of the points by which a body was recognised: with fewer it is looked for again
NEAR_M, FAST_M_S, FAR_M = 0.03, 5.0, 0.15  # a marker that gets another name is where it was
MATCHED_S = 0.3  # so long after the names changed, those that are missing are looked for
SUBJECT = 6  # names with a new prefix: another person


@dataclass(frozen=True, eq=False)
class Sight:
    """How frames of a stream become frames of a body.

    Attributes:
        labels: The stream's names of the K points that are used.
        unit_m: Length of the stream's unit [m].
        turn: From the stream's axes to z up, shape (3, 3): a rotation, with one axis turned round
            where they are left-handed.
        body: Which point is which place; None where positions are learned.
        channels: Names of what comes out.
        report: What was found, a sentence each.
    """

    labels: tuple[str, ...]
    unit_m: float
    turn: FloatArray
    body: BodyMap | None
    channels: tuple[str, ...]
    report: tuple[str, ...]

    def see(self, points: FloatArray) -> FloatArray:
        """Return what points, shape (T, K, 3) [the stream's unit], are: shape (T, D) [m]."""
        if self.unit_m != 1.0:
            points = points * self.unit_m
        if not np.array_equal(self.turn, np.eye(3)):
            points = points @ self.turn.T
        if self.body is not None:
            points = self.body.see(points)
        return points.reshape(len(points), -1)


class RecognisedSource(Source):
    """A source whose frames are those of a body, as `mplearn learn` takes them from a file.

    Unit, vertical axis and body are found in the first second, or, where they stay in doubt, in
    the first four; nothing of it is lost. Where the names of markers change, those that are where
    a marker was that is gone are taken for it; where most are gone, the body is found again.

    Args:
        source: The stream as it comes.
        wanted: What is to be seen in it.
    """

    def __init__(self, source: Source, wanted: Wanted) -> None:
        self.name, self.tally = source.name, source.tally
        self._source, self._wanted = source, wanted
        self._channels: tuple[str, ...] | None = None  # of all that comes out
        self._raw: Stream | None = None  # what came last
        self._out: Stream | None = None  # what it became
        self._sight: Sight | None = None
        self._columns: IntArray = np.zeros(0, dtype=np.int64)  # of the sight's labels; -1: missing
        self._places: IntArray = np.zeros(0, dtype=np.int64)  # of the sight's channels in ours
        self._last: FloatArray | None = None  # where the sight's points were last, (K, 3)
        self._last_s, self._changed_s = 0.0, 0.0
        self._free: IntArray = np.zeros(0, dtype=np.int64)  # new names that may be those missing
        self._held: deque[Block] = deque()
        self._held_frames, self._seen_frames, self._next_look, self._refused = 0, 0, 0, ""
        self._joins = True

    @property
    def ended(self) -> bool:
        """Whether nothing more will come."""
        return self._source.ended and not self._held

    def close(self) -> None:
        """End the stream."""
        waiting = sum(int((~block.gaps).sum()) for block in self._held)
        self._held.clear()
        self.tally.frames -= waiting
        self.tally.unread += waiting
        self._source.close()

    def read(self, timeout_s: float | None = None) -> list[Block | Change]:
        """Return what came; see `Source.read`."""
        out: list[Block | Change] = []
        for item in self._source.read(timeout_s):
            if isinstance(item, Change):
                out.append(item)
            else:
                out += self._take(item)
        if self._source.ended and self._held:
            out += self._look(at_last=True)
            self._held.clear()
        return out

    # ---- inside

    def _take(self, block: Block) -> list[Block | Change]:
        out: list[Block | Change] = []
        if block.stream is not self._raw:
            out += self._changed(block)
        elif self._sight is not None and len(self._free):
            out += self._renamed(self._match(block), float(block.times_s[0]))
        if self._sight is not None and self._enough:
            held, self._held = self._held, deque()
            return [*out, *(self._seen(each) for each in (*held, block))]
        self._held.append(block)
        self._held_frames += len(block)
        self._seen_frames += int(np.isfinite(block.frames).any(axis=1).sum())
        late = float(block.times_s[0]) - self._changed_s > MATCHED_S or not len(self._free)
        if self._sight is not None and late:  # it is another body
            self._sight, self._free = None, self._free[:0]
        return out if self._sight is not None else out + self._look()

    @property
    def _enough(self) -> bool:
        """Whether enough is left of the points by which the body was recognised."""
        return int((self._columns >= 0).sum()) >= KEPT * len(self._columns)

    def _changed(self, block: Block) -> list[Block | Change]:
        """Take notice of another description of the stream."""
        out: list[Block | Change] = []
        if self._held:
            self._sight = None
            out += self._look(at_last=True)
        before, self._raw = self._raw, block.stream
        self._begin_search()
        if before is None or self._sight is None:
            return out
        if before.is_markers != block.stream.is_markers:
            self._sight, self._last, self._free = None, None, self._free[:0]
            what = "points" if block.stream.is_markers else "channels that are no points"
            said = f"the names changed; what comes are {what} now"
            return [*out, Change("names", said, float(block.times_s[0]))]
        names, known = _names(block.stream), set(_names(before))
        at = {name: i for i, name in reversed([*enumerate(names)])}
        self._columns = np.array([at.get(label, -1) for label in self._sight.labels])
        free = [i for i, name in enumerate(names) if name not in known]
        self._free = np.array(free if block.stream.is_markers else [], dtype=np.int64)
        self._changed_s = float(block.times_s[0])
        return [*out, *_told(before, block, self._match(block))]

    def _begin_search(self) -> None:
        self._held.clear()
        self._held_frames, self._seen_frames, self._refused = 0, 0, ""
        self._next_look = self._frames(FIRST_LOOK_S)

    def _match(self, block: Block) -> dict[str, str]:
        """Find points that are gone among those that are new, by where they are."""
        assert self._sight is not None
        gone = np.flatnonzero(self._columns < 0)
        points = block.frames.reshape(len(block), -1, 3)[:, self._free] if len(self._free) else None
        if self._last is None or points is None or not len(gone):
            return {}
        row = int(np.argmax(_seen_rows(points)))
        apart = np.linalg.norm(points[row][None] - self._last[gone][:, None], axis=2)
        apart = np.where(np.isnan(apart), np.inf, apart)  # (gone, new)
        passed_s = float(block.times_s[row]) - self._last_s
        reach = min(NEAR_M + FAST_M_S * passed_s, FAR_M) / self._sight.unit_m
        names, renamed, taken = _names(block.stream), {}, []
        for i, place in enumerate(gone):
            j = int(apart[i].argmin())
            if apart[i, j] <= reach and int(apart[:, j].argmin()) == i:
                self._columns[place] = self._free[j]
                renamed[self._sight.labels[place]] = names[self._free[j]]
                taken.append(j)
        self._free = np.delete(self._free, taken)
        labels = tuple(renamed.get(label, label) for label in self._sight.labels)
        self._sight = replace(self._sight, labels=labels)
        return renamed

    @staticmethod
    def _renamed(renamed: dict[str, str], time_s: float) -> list[Change]:
        return [Change("names", _renamings(renamed), time_s)] if renamed else []

    def _look(self, *, at_last: bool = False) -> list[Block | Change]:
        """Look for a body in what is held back, if there is enough of it."""
        raw = self._raw
        assert raw is not None
        known = raw.recording is not None or not self._placeable
        out: list[Block | Change] = []
        while self._held and (known or at_last or self._seen_frames >= self._next_look):
            try:
                sight = self._find(raw, self._looked_at(all_of_it=known or at_last))
            except MPLearnError as error:
                out += self._not_found(str(error), at_last=at_last)
                continue
            doubt = any(text.startswith("warning") for text in sight.report)
            if doubt and not (known or at_last) and self._next_look < self._frames(DOUBT_S):
                self._next_look += self._frames(FIRST_LOOK_S)
                continue
            return out + self._found(sight)
        return out

    def _looked_at(self, *, all_of_it: bool) -> FloatArray:
        """Return the frames to look at: however they came, the same ones."""
        frames = np.concatenate([b.frames for b in self._held])
        seen = np.isfinite(frames).any(axis=1)
        later = self._seen_frames - self._next_look  # that came after those to look at
        if all_of_it or later <= 0:
            return frames
        return frames[: len(frames) - int(np.argmax(np.cumsum(seen[::-1]) > later))]

    def _found(self, sight: Sight) -> list[Block | Change]:
        """Go on with a body, and hand out what was held back."""
        assert self._raw is not None
        self._sight = sight
        names = _names(self._raw)
        self._columns = np.array([names.index(label) for label in sight.labels])
        if self._channels is None:
            self._channels = sight.channels
        at = {name: i for i, name in enumerate(self._channels)}
        self._places = np.array([at.get(name, -1) for name in sight.channels])
        report = list(sight.report)
        missing = len(self._channels) - int((self._places >= 0).sum())
        if missing:
            report.append(f"warning: {missing} of {len(self._channels)} channels are missing now")
        out: list[Block | Change] = [
            Change("body", text, float(self._held[0].times_s[0])) for text in report
        ]
        out += [self._seen(block) for block in self._held]
        self._held.clear()
        return out

    def _not_found(self, why: str, *, at_last: bool) -> list[Block | Change]:
        """Go on without a body: keep the latest frames only, and say why."""
        self._next_look += self._frames(FIRST_LOOK_S)
        dropped = 0
        limit = 0 if at_last else self._frames(PATIENCE_S)
        while self._held and self._held_frames - len(self._held[0]) >= limit:
            block = self._held.popleft()
            self._held_frames -= len(block)
            dropped += len(block)
            self._joins = False
        if dropped:
            self.tally.unrecognised += dropped
            self.tally.frames -= dropped
        if why == self._refused and not dropped:
            return []
        self._refused = why
        return [Change("body", why, self._last_s, dropped)]

    def _seen(self, block: Block) -> Block:
        """Return frames as those of the body."""
        assert self._sight is not None and self._channels is not None
        if self._out is None or self._out.recording is not block.stream.recording:
            self._out = None
        missing = self._columns < 0
        if block.stream.is_markers:
            points = block.frames.reshape(len(block), -1, 3)[:, self._columns]
            points[:, missing] = np.nan
            self._remember(points, block)
            frames = self._sight.see(points)
        else:
            frames = block.frames[:, self._columns]
            frames[:, missing] = np.nan
        if not np.array_equal(self._places, np.arange(len(self._channels))):
            ours = np.full((len(frames), len(self._channels)), np.nan)
            kept = self._places >= 0
            ours[:, self._places[kept]] = frames[:, kept]
            frames = ours
        if self._out is None or (self._out.rate_hz, self._out.subject) != (
            block.rate_hz,
            block.stream.subject,
        ):
            self._out = Stream(
                self._channels,
                block.rate_hz,
                unit_m=1.0 if self._placeable else None,
                up="z" if self._placeable else "",
                subject=block.stream.subject,
            )
        joins, self._joins = block.joins and self._joins, True
        return replace(block, stream=self._out, frames=frames, joins=joins)

    def _remember(self, points: FloatArray, block: Block) -> None:
        """Keep where points were when they were seen last, if that is not long ago."""
        seen = np.flatnonzero(_seen_rows(points))
        if not len(seen):
            return
        row = int(seen[-1])
        last = points[row].copy()
        before = float(block.times_s[row]) - self._last_s
        if self._last is not None and len(self._last) == len(last) and before < MATCHED_S:
            last = np.where(np.isnan(last), self._last, last)
        self._last, self._last_s = last, float(block.times_s[row])

    @property
    def _placeable(self) -> bool:
        return self._raw is not None and self._raw.is_markers and self._wanted.observe != "channels"

    def _frames(self, seconds: float) -> int:
        assert self._raw is not None
        return max(2, round(seconds * self._raw.rate_hz))

    def _find(self, raw: Stream, frames: FloatArray) -> Sight:
        """Find unit, axes and body.

        Raises:
            MPLearnError: There is none, with the reason.
        """
        if not self._placeable:
            return Sight(_names(raw), 1.0, np.eye(3), None, raw.channels, ())
        report: list[str] = []
        if raw.recording is not None:
            recording, labels, unit_m, turn = raw.recording, raw.points, 1.0, np.eye(3)
        else:
            path, points = Path(self.name), frames.reshape(len(frames), -1, 3)
            findings = Findings(self.name.partition(":")[0])
            seen = np.isfinite(points).all(axis=2).sum(axis=0)
            kept, names = [*range(len(raw.points))], raw.points
            if raw.skeleton is None:
                kept, names = chosen_names(path, raw.points, seen, findings)
            labels = tuple(raw.points[i] for i in kept)
            space = Space(
                raw.unit_m or 1.0,
                raw.up or "z",
                says_unit=raw.unit_m is not None,
                says_up=bool(raw.up),
            )
            hints = self._wanted.hints
            place = placed(path, points[:, kept], names, raw.rate_hz, space, hints, findings)
            unit_m, turn = place.unit_m, place.axes
            told = findings.report(raw.rate_hz, unit_m, place.up)
            skeleton = raw.skeleton
            if skeleton is not None:
                skeleton = replace(skeleton, offsets=skeleton.offsets * unit_m @ turn.T)
            recording = Recording(
                place.points.reshape(len(points), -1),
                raw.rate_hz,
                marker_channels(names),
                self.name,
                raw.subject,
                skeleton=skeleton,
                report=told,
            )
            if hints.mirrored:
                recording, turn = right_handed(path, recording), OTHER_HAND @ turn
            if hints.level:
                tilt = turn_to_level(path, recording)
                recording, turn = leveled(recording, tilt), tilt @ turn
            else:
                recording = told_of_lean(recording)
            told = recording.report or told
            report = [f"warning: {text}" for text in told.warnings] + list(told.notes)
        if self._wanted.observe == "positions":
            return Sight(labels, unit_m, turn, None, recording.channels, tuple(report))
        body = recognise(recording, names=self._wanted.names)
        of = {name: i for i, name in enumerate(recording.marker_names)}
        labels = tuple(labels[of[name]] for name in body.points)
        report += [f"warning: {text}" for text in body.warnings]
        left = f"; left out: {', '.join(body.left_out)}" if body.left_out else ""
        report.append(f"a body by {len(body.places)} places{left}")
        return Sight(labels, unit_m, turn, body, marker_channels(body.places), tuple(report))


def _names(stream: Stream) -> tuple[str, ...]:
    return stream.points if stream.is_markers else stream.channels


def _told(before: Stream, block: Block, renamed: dict[str, str]) -> list[Change]:
    """Say what is new in a stream's names, and who."""
    at_s = float(block.times_s[0])
    old, now = _names(before), _names(block.stream)
    new = [name for name in now if name not in set(old) | set(renamed.values())]
    gone = [name for name in old if name not in set(now) | renamed.keys()]
    prefixes = [name.rpartition(":")[0] for name in new]
    known = {name.rpartition(":")[0] for name in old}
    people = [
        p for p in dict.fromkeys(prefixes) if p and p not in known and prefixes.count(p) >= SUBJECT
    ]
    changes = [Change("subject", f"{person!r} appeared in the stream", at_s) for person in people]
    if before.subject != block.stream.subject:
        said = f"{block.stream.subject!r} is followed now, {before.subject!r} no longer"
        changes.append(Change("subject", said, at_s))
    texts = [_renamings(renamed)] if renamed else []
    new = [name for name, prefix in zip(new, prefixes, strict=True) if prefix not in people]
    texts += [f"new: {', '.join(new)}"] if new else []
    texts += [f"gone: {', '.join(gone)}"] if gone else []
    if not texts and not changes:
        texts = ["in another order"] if old != now else ["described again"]
    if texts:
        changes.append(Change("names", f"the names changed; {'; '.join(texts)}", at_s))
    return changes


def _seen_rows(points: FloatArray) -> BoolArray:
    """Return in which frames a point is seen, shape (T, K, 3) to (T,)."""
    seen: BoolArray = np.asarray(np.isfinite(points).all(axis=2))
    return np.asarray(seen.any(axis=1))


def _renamings(renamed: dict[str, str]) -> str:
    return f"renamed: {', '.join(f'{a} to {b}' for a, b in renamed.items())}"
