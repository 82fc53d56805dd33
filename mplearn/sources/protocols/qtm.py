"""Qualisys Track Manager: labelled markers by its real-time protocol [QTM]."""

from __future__ import annotations

import asyncio
import logging
import struct
import time
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
TIMEOUT_S, SILENT_S, WAKE_S = 5.0, 5.0, 0.1
MILLIMETRES = 0.001
_HEADER = struct.Struct("<Ihh")  # of a component: markers, and rates of what was dropped


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
        self._qtm = require("qtm_rt", EXTRA)
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

        def on_packet(packet: Any) -> None:
            try:
                take(packet)
            except Exception as error:  # whatever a packet holds, the connection goes on
                cannot_read(error)

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
            values = points.astype(np.float64)
            values[np.isinf(values)] = np.nan
            inbox.put(
                Sample(stream, values, arrived_s, packet.framenumber, packet.timestamp * 1e-6)
            )

        def on_failure(_: asyncio.AbstractEventLoop, context: dict[str, Any]) -> None:
            cannot_read(context.get("exception", context["message"]))  # the package's; it ends

        asyncio.get_running_loop().set_exception_handler(on_failure)
        host, port = self.address
        connection = await self._qtm.connect(
            host,
            port,
            on_event=lambda event: changed.set(),
            on_disconnect=lambda error: lost.set(),
            timeout=TIMEOUT_S,
        )
        if connection is None:
            raise ConnectionError(f"no Qualisys Track Manager answers at {shown(self.address)}")
        try:
            stream = described(await connection.get_parameters(["general", "3d"]))
            await connection.stream_frames(components=["3d"], on_packet=on_packet)
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
