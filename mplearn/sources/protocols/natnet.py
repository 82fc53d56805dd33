"""OptiTrack Motive: the markers of its marker sets and skeletons, by NatNet [NatNet].

The package natnet knows what the packets hold; the sockets are ours, for its own client fits no
bounded wait and no reconnection.
"""

from __future__ import annotations

import selectors
import socket
import struct
import time
from typing import Any

import numpy as np

from ...extras import require
from ...recording import FloatArray, marker_channels
from ..inbox import Inbox, Sample
from ..received import ReceivedSource, Receiver
from ..registry import Wanted
from ..source import Source, Stream
from .addresses import host_and_port, shown
from .datagrams import LARGEST, ROOM, WAKE_S

EXTRA = "live"
PORT = 1510  # of commands
CONNECT, SERVER_INFO, REQUEST_MODELS, MODELS, FRAME, KEEP_ALIVE = 0, 1, 4, 5, 7, 10
ASK_EACH_S, GONE_S = 1.0, 5.0
_ALL = "all"  # Motive's set of all markers, without names that mean something
_CONNECTION = struct.Struct("<QHB4B")  # clock, data port, multicast or not, its group


def open_natnet(address: str, wanted: Wanted) -> Source:
    """Markers of OptiTrack Motive: ``natnet:HOST[:PORT]``; unicast or multicast, as it says."""
    receiver = NatNetReceiver(host_and_port(address, PORT))
    return ReceivedSource(f"natnet:{shown(receiver.address)}", receiver, wanted.hints.rate_hz)


class NatNetReceiver(Receiver):
    """Asks Motive what it tracks, and takes its frames.

    Args:
        address: Host and command port of Motive.

    Raises:
        MissingDependencyError: natnet is not installed.
    """

    def __init__(self, address: tuple[str, int]) -> None:
        self._buffer = _bounded(require("natnet.packet_buffer", EXTRA).PacketBuffer)
        self._info = require("natnet.server_info", EXTRA).ServerInfo
        self._models = require("natnet.data_descriptions", EXTRA).DataDescriptions
        self._frame = require("natnet.data_frame", EXTRA).DataFrame
        self.address = address
        self.hint = "Motive streams nothing: is 'Broadcast Frame Data' on, and Labeled Markers?"
        self._version: Any = None
        self._names: dict[str, tuple[str, ...]] = {}  # of the markers of each set
        self._streams: dict[tuple[tuple[str, int], ...], Stream] = {}
        self._known = self._doubted = False

    def receive(self, inbox: Inbox) -> None:
        """Connect, and receive until nothing comes any more."""
        self._version, self._known = None, False
        family, _, _, _, at = socket.getaddrinfo(*self.address, type=socket.SOCK_DGRAM)[0]
        heard_s = time.monotonic()
        with (
            selectors.DefaultSelector() as selector,
            socket.socket(family, socket.SOCK_DGRAM) as one,
        ):
            one.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, ROOM)
            one.setblocking(False)
            selector.register(one, selectors.EVENT_READ)
            group: socket.socket | None = None
            asked_s = 0.0
            try:
                while not inbox.closed:
                    now_s = time.monotonic()
                    if now_s - asked_s > ASK_EACH_S:
                        asked_s = now_s
                        self._ask(one, at)
                    for key, _ in selector.select(WAKE_S):
                        try:
                            data = key.fileobj.recv(LARGEST)  # type: ignore[union-attr]
                        except ConnectionRefusedError:
                            continue
                        heard_s = time.monotonic()
                        try:
                            joined = self._take(data, heard_s, inbox)
                        except Exception as error:  # whatever the package meets in a packet
                            inbox.damaged(f"a packet cannot be read: {error!r:.200}")
                            self._doubted = True
                            continue
                        if joined is not None and group is None:
                            group = _joined(*joined)
                            selector.register(group, selectors.EVENT_READ)
                        if self._version is not None and not self._known:
                            self._ask(one, at)
                    if time.monotonic() - heard_s > GONE_S:
                        raise ConnectionError(f"no Motive answers at {shown(self.address)}")
            finally:
                if group is not None:
                    group.close()

    def close(self) -> None:
        """Nothing stays open."""

    def _ask(self, one: socket.socket, at: Any) -> None:
        """Say that we are here, and ask for what is not known, or may be wrong."""
        if self._version is None or self._doubted:
            one.sendto(_packet(CONNECT, b"Ping\0"), at)
        if self._version is None:
            return
        one.sendto(_packet(KEEP_ALIVE), at)
        if not self._known:
            one.sendto(_packet(REQUEST_MODELS), at)

    def _take(self, data: bytes, arrived_s: float, inbox: Inbox) -> tuple[str, int] | None:
        """Take a packet; return the multicast group that it says frames come by."""
        buffer = self._buffer(data)
        kind = buffer.read_uint16()
        buffer.read_uint16()
        if kind == SERVER_INFO:
            self._version = self._info.read_from_buffer(buffer, None).nat_net_protocol_version
            self._doubted = False
            rest = bytes(buffer.data[buffer.pointer :])
            if len(rest) >= _CONNECTION.size:
                _, port, by_group, *group = _CONNECTION.unpack_from(rest)
                return (".".join(map(str, group)), port) if by_group else None
        elif self._version is None:
            return None
        elif kind == MODELS:
            models = self._models.read_from_buffer(buffer, self._version)
            self._names = {each.name: tuple(each.marker_names) for each in models.marker_sets}
            self._known = True
        elif kind == FRAME:
            self._take_frame(self._frame.read_from_buffer(buffer, self._version), arrived_s, inbox)
        return None

    def _take_frame(self, frame: Any, arrived_s: float, inbox: Inbox) -> None:
        if frame.suffix.tracked_models_changed:
            self._known = False
        sets = [s for s in frame.marker_sets if s.model_name != _ALL and s.marker_pos_list]
        if not sets and not self._known:
            return
        key = tuple((each.model_name, len(each.marker_pos_list)) for each in sets)
        if any(len(self._names.get(name, ())) != count for name, count in key):
            self._known = False
            inbox.say("names", "a frame of markers whose names are asked for", 1)
            return
        if not key:
            inbox.say("names", "a frame without a marker set", 1)
            return
        names = tuple(f"{name}:{marker}" for name, _ in key for marker in self._names[name])
        stream = self._streams.get(key)
        if stream is None or stream.points != names:
            stream = self._streams[key] = Stream(marker_channels(names), 0.0)
        points: FloatArray = np.array(
            [place for each in sets for place in each.marker_pos_list], dtype=np.float64
        )
        points[(points == 0.0).all(axis=1) | np.isinf(points).any(axis=1)] = np.nan  # not seen
        number, time_s = frame.prefix.frame_number, float(frame.suffix.timestamp)
        inbox.put(Sample(stream, points.ravel(), arrived_s, number, time_s))


def _bounded(buffer: Any) -> Any:
    """Return the package's buffer, but one that never reads beyond its end, whatever counts say."""

    class Bounded(buffer):  # type: ignore[misc]
        def read_string(self, max_length: int | None = None, static_length: bool = False) -> str:
            self._require(1)
            return str(super().read_string(max_length, static_length))

        def read_float32_array(self, count: int) -> tuple[float, ...]:
            self._require(4 * count)
            return tuple(super().read_float32_array(count))

        def _require(self, size: int) -> None:
            left = len(self.data) - self.pointer
            if size > left:
                raise ValueError(f"it ends too soon: {size} bytes more are said, {left} are left")

    return Bounded


def _packet(kind: int, content: bytes = b"\0") -> bytes:
    return struct.pack("<HH", kind, len(content)) + content


def _joined(group: str, port: int) -> socket.socket:
    """Return a socket that hears a multicast group."""
    found = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
    found.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
    found.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, ROOM)
    found.bind(("", port))
    member = socket.inet_aton(group) + socket.inet_aton("0.0.0.0")
    found.setsockopt(socket.IPPROTO_IP, socket.IP_ADD_MEMBERSHIP, member)
    found.setblocking(False)
    return found
