"""A sender on a bad network: packets lost, doubled and shuffled, and all that else can happen."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass, field
from itertools import islice

import numpy as np

from mplearn.recording import Recording, marker_channels
from mplearn.sources import Block, Change, Source, Stream, Tally
from mplearn.sources.inbox import Inbox, Sample
from mplearn.sources.protocols.addresses import LOOPBACK
from mplearn.sources.protocols.lines import frame_line, header_line
from mplearn.sources.protocols.own import UDPReceiver
from mplearn.sources.sequencer import Sequencer

HEADER_EACH = 50  # frames
AT_ONCE = 20  # datagrams that a receiver takes
STREAMS = {"named": 1, "renamed": 2, "shuffled": 3, "two": 4, "stranger": 9}


@dataclass
class BadNetwork:
    """Sends a recording in our own format, badly.

    Attributes:
        recording: What is sent.
        loss: Share of the packets that are lost.
        doubles: Share of the others that come twice.
        disorder: Frames by which packets are late, at most.
        seed: Of what is random.
        silences: Stretches [frame, frame) in which nothing is sent.
        jumps: By how much the sender's clock jumps, by frame [s].
        renamed: From this frame on every fourth marker has another name.
        shuffled: From this frame on markers are in another order, with their old names.
        second: From this frame on another person's markers are in the stream as well.
        stranger: From this frame on another person's stream comes besides.
        sent: What became of frames, counted.
    """

    recording: Recording
    loss: float = 0.05
    doubles: float = 0.02
    disorder: int = 3
    seed: int = 0
    silences: tuple[tuple[int, int], ...] = ()
    jumps: dict[int, float] = field(default_factory=dict)
    renamed: int | None = None
    shuffled: int | None = None
    second: int | None = None
    stranger: int | None = None
    sent: Counter[str] = field(default_factory=Counter)

    def datagrams(self) -> Iterator[tuple[int, bytes]]:
        """Yield datagrams in the order of their arrival, each with the frame at which it comes."""
        rng = np.random.default_rng(self.seed)
        waiting: dict[int, list[bytes]] = {}
        late = 0.0
        for i in range(len(self.recording)):
            silent = any(start <= i < end for start, end in self.silences)
            late += self.jumps.get(i, 0.0)
            for line, header, name in self._frames(i, late):
                if header and not silent and rng.random() >= self.loss:
                    waiting.setdefault(i, []).insert(0, header)
                if silent:
                    self.sent["silent" if name != "stranger" else "stranger lost"] += 1
                    continue
                if rng.random() < self.loss:
                    self.sent["lost" if name != "stranger" else "stranger lost"] += 1
                    continue
                times = 1 + (rng.random() < self.doubles)
                self.sent["stranger" if name == "stranger" else "frames"] += times
                for _ in range(times):
                    at = i + int(rng.integers(0, self.disorder + 1))
                    waiting.setdefault(at, []).append(line)
            for data in waiting.pop(i, []):
                yield i, data
        for at in sorted(waiting):
            for data in waiting[at]:
                yield at, data

    def received(self) -> Source:
        """Return what a receiver makes of it, in the recording's own time, though at once."""
        return _Received(self)

    def _frames(self, i: int, late: float) -> Iterator[tuple[bytes, bytes | None, str]]:
        """Yield what is sent of a frame: its line, its header where it is sent, whose it is."""
        name = "named"
        for each in ("renamed", "shuffled", "two"):
            since = getattr(self, "second" if each == "two" else each)
            if since is not None and i >= since:
                name = each
        names, markers = self._shown(name, self.recording.markers[i])
        number, time_s = STREAMS[name], i / self.recording.rate_hz + late
        header = header_line(self._stream(names), number) if self._heads(i) else None
        yield frame_line(markers.reshape(-1), i, time_s, number), header, name
        if self.stranger is not None and i >= self.stranger:
            stream = self._stream(self.recording.marker_names, "stranger")
            yield (
                frame_line((self.recording.markers[i] + 2.0).reshape(-1), i, time_s, 9),
                header_line(stream, 9) if (i - self.stranger) % HEADER_EACH == 0 else None,
                "stranger",
            )

    def _heads(self, i: int) -> bool:
        starts = (0, self.renamed, self.shuffled, self.second)
        begins = any(start is not None and 0 <= i - start < 5 for start in starts)
        return begins or i % HEADER_EACH == 0

    def _stream(self, names: tuple[str, ...], subject: str = "") -> Stream:
        return Stream(
            marker_channels(names), self.recording.rate_hz, unit_m=1.0, up="z", subject=subject
        )

    def _shown(self, name: str, markers: np.ndarray) -> tuple[tuple[str, ...], np.ndarray]:
        """Return the names and the places of the markers, as they are at some time."""
        names = list(self.recording.marker_names)
        if name == "named":
            return tuple(names), markers
        names[::4] = [f"marker {k}" for k in range(len(names[::4]))]
        if name == "renamed":
            return tuple(names), markers
        order = np.random.default_rng(1).permutation(len(names))
        if name == "shuffled":
            return tuple(names[k] for k in order), markers[order]
        both = [f"{who}:{each}" for who in ("Anna", "Ben") for each in names]
        return tuple(both), np.concatenate([markers, markers + np.array([2.0, 0.0, 0.0])])


class _Received(Source):
    """The receiver of a bad network, with its clock instead of ours."""

    def __init__(self, network: BadNetwork) -> None:
        self.name, self.tally = "udp:", Tally()
        self._rate_hz = network.recording.rate_hz
        self._datagrams = network.datagrams()
        self._receiver, self._inbox = UDPReceiver((LOOPBACK, 0)), Inbox()
        self._sequencer = Sequencer(self.tally, ordered=False)
        self._over = False

    @property
    def ended(self) -> bool:
        return self._over

    def close(self) -> None:
        self._over = True
        self._receiver.close()

    def read(self, timeout_s: float | None = None) -> list[Block | Change]:
        out: list[Block | Change] = []
        now_s = 0.0
        for i, data in islice(self._datagrams, AT_ONCE):
            now_s = i / self._rate_hz
            self._receiver.take(data, (LOOPBACK, 1), now_s, self._inbox)
        samples = []
        for item in self._inbox.take(0.0):
            if isinstance(item, Sample):
                samples.append(item)
            else:
                self.tally.unnamed += item.count
                out.append(Change(item.kind, item.text, now_s, item.count))
        if not samples and not out:
            self.close()
            return self._sequencer.finish()
        return out + self._sequencer.take(samples, now_s)
