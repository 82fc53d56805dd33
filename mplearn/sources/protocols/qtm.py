"""Qualisys Track Manager: labelled markers by its real-time protocol [QTM]."""

from __future__ import annotations

import asyncio
import logging
import struct
import time
from collections.abc import Callable
from typing import Any
from xml.etree import ElementTree

import numpy as np

from ...extras import require
from ...mocap import DIRECTIONS
from ...recording import marker_channels
from ..inbox import Inbox, Sample
from ..received import ReceivedSource, Receiver
from ..registry import Wanted
from ..source import Source, Stream, known_rate
from .addresses import host_and_port, shown

EXTRA = "live"
PORT = 22223  # of the little-endian server
VERSION = "1.25"  # of the protocol
TIMEOUT_S, SILENT_S, WAKE_S = 5.0, 5.0, 0.1
MILLIMETRES = 0.001
LARGEST = 2**24  # bytes of a packet: settings of thousands of labels, a million markers
_HEADER = struct.Struct("<Ihh")  # of a component: markers, and rates of what was dropped
_PACKET = struct.Struct("<II")  # its size, this included, and its kind
_FRAME, _COMPONENT = struct.Struct("<qII"), struct.Struct("<II")
_DATA = 3  # the kind of a packet that holds a frame


def open_qtm(address: str, wanted: Wanted) -> Source:
    """Labelled markers of Qualisys Track Manager: ``qtm:HOST[:PORT]``."""
    receiver = QTMReceiver(host_and_port(address, PORT))
    return ReceivedSource(f"qtm:{shown(receiver.address)}", receiver, wanted.hints.rate_hz)


class QTMReceiver(Receiver):
    """Streams all frames; the labels are asked for again whenever something changes.

    Args:
        address: Host and port of Qualisys Track Manager.

    Raises:
        MissingDependencyError: qtm-rt is not installed.
    """

    ordered = True

    def __init__(self, address: tuple[str, int]) -> None:
        self._protocol = require("qtm_rt.protocol", EXTRA).QTMProtocol
        self._connection = require("qtm_rt", EXTRA).QRTConnection
        self._component = require("qtm_rt.packet", EXTRA).QRTComponentType.Component3d
        self.address = address
        self.hint = "no measurement runs in Qualisys Track Manager, or none with labels"
        log = logging.getLogger("qtm_rt")  # what it says is said by the source
        if not log.handlers:
            log.addHandler(logging.NullHandler())

    def receive(self, inbox: Inbox) -> None:
        """Connect, and receive until the connection is lost."""
        try:
            asyncio.run(self._receive(inbox))
        except TimeoutError:
            raise ConnectionError(f"{shown(self.address)} does not answer") from None

    def close(self) -> None:
        """Nothing stays open."""

    async def _receive(self, inbox: Inbox) -> None:
        changed, lost = asyncio.Event(), asyncio.Event()
        stream: Stream | None = None
        heard_s = time.monotonic()

        def cannot_read(error: object) -> None:
            inbox.damaged(f"a packet cannot be read: {error!r:.200}")

        def take(packet: Any) -> None:
            nonlocal heard_s
            arrived_s = heard_s = time.monotonic()
            at = packet.components.get(self._component)
            if at is None:
                return
            count, _, _ = _HEADER.unpack_from(packet.data, at)
            points = np.frombuffer(packet.data, "<f4", 3 * count, at + _HEADER.size)
            if stream is None or 3 * count != len(stream.channels):
                inbox.say("names", f"a frame of {count} markers, whose labels are asked for", 1)
                changed.set()
                return
            with np.errstate(invalid="ignore"):  # a NaN that signals is one that is quiet here
                values = points.astype(np.float64)
            values[np.isinf(values)] = np.nan
            inbox.put(
                Sample(stream, values, arrived_s, packet.framenumber, packet.timestamp * 1e-6)
            )

        def on_failure(_: asyncio.AbstractEventLoop, context: dict[str, Any]) -> None:
            cannot_read(context.get("exception", context["message"]))

        loop = asyncio.get_running_loop()
        loop.set_exception_handler(on_failure)
        client = self._protocol(
            loop=loop,
            on_event=lambda event: changed.set(),
            on_disconnect=lambda error: lost.set(),
        )
        try:
            await loop.create_connection(lambda: WholePackets(client, cannot_read), *self.address)
        except OSError:
            raise ConnectionError(
                f"no Qualisys Track Manager answers at {shown(self.address)}"
            ) from None
        connection = self._connection(client, timeout=TIMEOUT_S)
        try:
            await asyncio.wait_for(client.set_version(VERSION), TIMEOUT_S)
            stream = described(await connection.get_parameters(["general", "3d"]))
            await connection.stream_frames(components=["3d"], on_packet=take)
            changed.clear()
            while not (inbox.closed or lost.is_set()):
                if time.monotonic() - heard_s > SILENT_S:  # asked, it answers, or is gone
                    heard_s = time.monotonic()
                    changed.set()
                if changed.is_set():
                    changed.clear()
                    found = described(await connection.get_parameters(["general", "3d"]))
                    if (found.channels, found.rate_hz, found.up) != (
                        stream.channels,
                        stream.rate_hz,
                        stream.up,
                    ):
                        stream = found
                await asyncio.sleep(WAKE_S if not changed.is_set() else 0.0)
        finally:
            if not lost.is_set():
                connection.disconnect()
                await asyncio.sleep(0)


class WholePackets(asyncio.Protocol):
    """Hands whole packets, looked at, to the package's client, which believes what they say.

    A size or a count that no packet can have would let that client wait, or count, for ever. A
    packet that cannot be read is passed over; one whose end is not known ends the connection.

    Args:
        client: The package's protocol.
        cannot_read: Takes why a packet cannot be read.
    """

    def __init__(self, client: Any, cannot_read: Callable[[object], None]) -> None:
        self._client, self._cannot_read = client, cannot_read
        self._receiver = require("qtm_rt.receiver", EXTRA).Receiver
        self._waiting = bytearray()

    def connection_made(self, transport: asyncio.BaseTransport) -> None:
        """Pass it on."""
        self._client.connection_made(transport)

    def connection_lost(self, error: Exception | None) -> None:
        """Pass it on."""
        self._waiting.clear()
        self._client.connection_lost(error)

    def data_received(self, data: bytes) -> None:
        """Hand on the packets that are whole now."""
        self._waiting += data
        while len(self._waiting) >= _PACKET.size and self._client.transport is not None:
            size, kind = _PACKET.unpack_from(self._waiting)
            if not _PACKET.size <= size <= LARGEST:
                self._cannot_read(ValueError(f"its size is {size} bytes"))
                self._client.transport.abort()
                return
            if len(self._waiting) < size:
                return
            packet = bytes(self._waiting[:size])
            del self._waiting[:size]
            try:
                if kind == _DATA:
                    check_frame(packet[_PACKET.size :])
                self._receiver(self._client._handlers).data_received(packet)
            except Exception as error:  # whatever it holds, the connection goes on
                self._cannot_read(error)


def check_frame(content: bytes) -> None:
    """Check that a frame holds the components that it announces, each within it.

    Raises:
        ValueError: It does not.
    """
    if len(content) < _FRAME.size:
        raise ValueError(f"a frame of {len(content)} bytes")
    at = _FRAME.size
    for number in range(_FRAME.unpack_from(content)[2]):
        left = len(content) - at
        size = _COMPONENT.unpack_from(content, at)[0] if left >= _COMPONENT.size else 0
        if not _COMPONENT.size <= size <= left:
            raise ValueError(f"its component {number} has {size} bytes, where {left} are left")
        at += size


def described(xml: bytes | str) -> Stream:
    """Return what the settings say: labels, rate, vertical axis.

    Raises:
        ValueError: They are no settings, or there are no labels.
    """
    try:
        root = ElementTree.fromstring(xml)
    except ElementTree.ParseError as error:
        raise ValueError(f"the settings cannot be read: {error}") from None
    names = tuple((label.findtext("Name") or "").strip() for label in root.findall("The_3D/Label"))
    if not names:
        raise ValueError("there are no labelled markers: is an AIM model applied?")
    up = root.findtext("The_3D/AxisUpwards", "").strip().lower().removeprefix("+")
    try:
        rate_hz = float(root.findtext("General/Frequency", "0"))
    except ValueError:
        rate_hz = 0.0
    return Stream(
        marker_channels(names),
        known_rate(rate_hz),
        unit_m=MILLIMETRES,
        up=up if up in DIRECTIONS else "",
    )
