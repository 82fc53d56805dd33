"""The lab streaming layer [LSL]: any stream of motion capture on the network, by its name."""

from __future__ import annotations

import subprocess
import sys
import threading
from types import ModuleType
from typing import Any
from xml.etree import ElementTree

import numpy as np

from ...errors import InvalidValueError
from ...extras import require
from ...mocap import UNITS_M
from ...mocap.markers.xdf import described_markers, described_unit
from ...recording import marker_channels
from ...spawning import deaf_to_interrupts
from ..inbox import Inbox, Sample
from ..received import ReceivedSource, Receiver
from ..registry import Wanted
from ..sender import Sender
from ..source import Block, Source, Stream, known_rate
from . import lsl_process
from .lines import MOST_CHANNELS
from .lsl_process import CHUNK, DESCRIBED, FAILED, HEAD, SAMPLES

EXTRA = "live"
HANGS_S = 15.0  # a process that says nothing for so long hangs; liblsl may take 5 s for an answer
_LOOK_S = 0.2
TYPE = "MoCap"  # as the layer's conventions call motion capture


def open_lsl(address: str, wanted: Wanted) -> Source:
    """A stream of the lab streaming layer: ``lsl:NAME``; ``lsl:`` takes the first of type MoCap."""
    receiver = LSLReceiver(address)
    return ReceivedSource(f"lsl:{address}", receiver, wanted.hints.rate_hz)


class LSLReceiver(Receiver):
    """Pulls a stream; where it is lost, one of the same name is looked for.

    It is pulled by another process: where liblsl crashes, that one ends, and where it hangs, that
    one is ended; the stream is disconnected and connected again as by any other loss.

    Args:
        name: Of the stream; the first one of type MoCap where empty.

    Raises:
        MissingDependencyError: pylsl is not installed.
    """

    ordered = True

    def __init__(self, name: str) -> None:
        lsl()
        self._name = name
        self._process: subprocess.Popen[bytes] | None = None
        self.hint = f"no stream {name!r} is on the network" if name else f"no stream of type {TYPE}"

    def receive(self, inbox: Inbox) -> None:
        """Look for the stream, and take what is pulled until it is lost."""
        what = ("name", self._name) if self._name else ("type", TYPE)
        command = [sys.executable, lsl_process.__file__, *what, "attended"]
        with deaf_to_interrupts():
            self._process = subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE)
        with self._process:
            try:
                _Pulled(self._process, inbox).take()
            finally:
                self._process.kill()

    def close(self) -> None:
        """Nothing stays open."""


class _Pulled:
    """What a process of `lsl_process` says, which is ended where it says nothing any more.

    Args:
        process: The process.
        inbox: Where samples go.
    """

    def __init__(self, process: subprocess.Popen[bytes], inbox: Inbox) -> None:
        self._process, self._inbox = process, inbox
        self._silent = 0  # looks since it said something
        self._over = threading.Event()
        self._hangs = False

    def take(self) -> None:
        """Take samples until nobody reads any more.

        Raises:
            OSError: The stream, or the process, is lost.
        """
        attending = threading.Thread(target=self._attend, name="lsl-attending", daemon=True)
        attending.start()
        try:
            self._take()
        finally:
            self._over.set()
            attending.join()

    def _attend(self) -> None:
        """End the process when nobody reads, or it hangs: a read of what it says would not end."""
        while not self._over.wait(_LOOK_S):
            self._silent += 1  # time in which this process stood still, too, is none of it
            self._hangs = self._silent * _LOOK_S > HANGS_S
            if self._inbox.closed or self._hangs:
                self._process.kill()
                return

    def _take(self) -> None:
        inbox = self._inbox
        stream, columns = Stream((), 0.0), np.zeros(0, np.int64)
        while not inbox.closed:
            kind, size = HEAD.unpack(self._read(HEAD.size))
            body = self._read(size)
            if kind == FAILED:
                raise OSError(body.decode("utf-8", "replace"))
            if kind == DESCRIBED:
                stream, used = described(body.decode("utf-8", "surrogateescape"))
                columns = np.array(used)
            elif kind == SAMPLES:
                arrived_s, n = CHUNK.unpack_from(body)
                numbers = np.frombuffer(body, "<f8", offset=CHUNK.size)
                rows = numbers[n:].reshape(n, -1)[:, columns]
                rows[np.isinf(rows)] = np.nan
                for row, time_s in zip(rows, numbers[:n].tolist(), strict=True):
                    inbox.put(Sample(stream, row, arrived_s, time_s=time_s))

    def _read(self, size: int) -> bytes:
        assert self._process.stdout is not None
        data = self._process.stdout.read(size)
        self._silent = 0
        if len(data) == size:
            return data
        code = self._process.wait()
        if self._hangs:
            raise OSError(f"liblsl said nothing for {HANGS_S:g} s: it hangs, and is begun anew")
        why = f"signal {-code}" if code < 0 else f"code {code}"
        raise OSError(f"the process that pulls the stream ended ({why})")


class LSLSender(Sender):
    """Offers a stream on the network.

    Args:
        name: Name of the stream.

    Raises:
        InvalidValueError: There is no name.
        MissingDependencyError: pylsl is not installed.
    """

    def __init__(self, name: str) -> None:
        if not name:
            raise InvalidValueError("lsl: needs a name for the stream, as in lsl:walk")
        self._lsl, self._name = lsl(), name
        self._stream: Stream | None = None
        self._outlet: Any = None
        self._start_s = 0.0

    def offer(self, stream: Stream) -> None:
        """Offer a stream, before its first frame is there."""
        info = described_info(self._lsl, self._name, stream)
        self._stream, self._outlet = stream, self._lsl.StreamOutlet(info)
        self._start_s = self._lsl.local_clock()

    def send(self, block: Block) -> None:
        """Send the frames that came."""
        if block.stream is not self._stream:
            self.offer(block.stream)
        for values, time_s, gap in zip(block.frames, block.times_s, block.gaps, strict=True):
            if not gap:
                self._outlet.push_sample(values.tolist(), self._start_s + float(time_s))

    def close(self) -> None:
        """Withdraw the stream."""
        self._outlet = None


def lsl() -> ModuleType:
    """Return pylsl.

    Raises:
        MissingDependencyError: It is not installed.
    """
    return require("pylsl", EXTRA)


def described(xml: str) -> tuple[Stream, list[int]]:
    """Return what the description of a stream says, and which of its columns are used.

    Raises:
        ValueError: It is none of numbers, or of no number of channels that there can be.
        ElementTree.ParseError: It cannot be read.
    """
    info = ElementTree.fromstring(xml)
    n_channels = int(info.findtext("channel_count", "0"))
    if not 1 <= n_channels <= MOST_CHANNELS:
        raise ValueError(f"a stream of {n_channels} channels: 1 to {MOST_CHANNELS:,} can be read")
    if info.findtext("channel_format") == "string":
        raise ValueError(f"the stream {info.findtext('name', '')!r} holds text")
    rate_hz = known_rate(float(info.findtext("nominal_srate", "0")))
    markers = described_markers(info, n_channels)
    subject = info.findtext("desc/subject/id", "").strip()
    if markers:
        columns = [i for axes in markers.values() for i in axes]
        return (
            Stream(
                marker_channels(tuple(markers)),
                rate_hz,
                unit_m=described_unit(info, n_channels, columns),
                subject=subject,
            ),
            columns,
        )
    labels = [c.findtext("label", "").strip() for c in info.findall("desc/channels/channel")]
    names = [label or f"channel {i}" for i, label in enumerate(labels[:n_channels])]
    names += [f"channel {i}" for i in range(len(names), n_channels)]
    if len(set(names)) != len(names):
        names = [f"{name} {i}" for i, name in enumerate(names)]
    return Stream(tuple(names), rate_hz, subject=subject), list(range(n_channels))


def described_info(lsl: ModuleType, name: str, stream: Stream) -> Any:
    """Return a stream's description, as the layer's conventions for motion capture have it."""
    info = lsl.StreamInfo(
        name, TYPE, len(stream.channels), stream.rate_hz, "double64", f"mplearn-{name}"
    )
    channels = info.desc().append_child("channels")
    for label in stream.channels:
        channel = channels.append_child("channel")
        channel.append_child_value("label", label)
        if stream.is_markers:
            channel.append_child_value("marker", label[:-2])
            channel.append_child_value("type", f"Position{label[-1].upper()}")
            unit = next((name for name, m in UNITS_M.items() if m == stream.unit_m), "")
            if unit:
                channel.append_child_value("unit", unit)
    return info
