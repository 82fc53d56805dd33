"""Xsens MVN's network streamer: position and orientation of a person's segments [MXTP].

The packets of type 02 ("Position + Orientation (Quaternion)") are read; those that say other
things of a character are passed over.
"""

from __future__ import annotations

import struct
from dataclasses import dataclass, field

import numpy as np

from ...maths.rotations import quaternion_to_matrix
from ...recording import FloatArray
from ..inbox import Inbox, Sample
from ..received import ReceivedSource
from ..registry import Wanted
from ..source import Source, Stream
from .addresses import LOOPBACK, host_and_port
from .datagrams import DatagramReceiver
from .skeletons import points_of, with_axes

PORT = 9763
SEGMENTS = (
    *("Pelvis", "L5", "L3", "T12", "T8", "Neck", "Head"),
    *("RightShoulder", "RightUpperArm", "RightForeArm", "RightHand"),
    *("LeftShoulder", "LeftUpperArm", "LeftForeArm", "LeftHand"),
    *("RightUpperLeg", "RightLowerLeg", "RightFoot", "RightToe"),
    *("LeftUpperLeg", "LeftLowerLeg", "LeftFoot", "LeftToe"),
)
PARENTS = (-1, 0, 1, 2, 3, 4, 5, 4, 7, 8, 9, 4, 11, 12, 13, 0, 15, 16, 17, 0, 19, 20, 21)
HEADER = struct.Struct(">6sIBBIBBBBHH")
_ITEM = np.dtype([("id", ">i4"), ("place", ">f4", 3), ("turn", ">f4", 4)])
_POSES = {b"01": "Euler", b"03": "positions only", b"05": "Unity3D"}  # that are not read
_LARGE = 20.0  # a person of more units than this is given in centimetres
_WAITING = 16  # frames of which parts are waited for


def open_xsens(address: str, wanted: Wanted) -> Source:
    """Xsens MVN's network streamer, quaternions by UDP: ``xsens:[HOST:]PORT``, where we listen."""
    receiver = XsensReceiver(host_and_port(address, PORT, host=LOOPBACK))
    return ReceivedSource(f"xsens:{receiver.address}", receiver, wanted.hints.rate_hz)


@dataclass(eq=False)
class _Parts:
    """The datagrams of a frame that came."""

    places: FloatArray = field(default_factory=lambda: np.full((len(SEGMENTS), 3), np.nan))
    turns: FloatArray = field(default_factory=lambda: np.full((len(SEGMENTS), 4), np.nan))
    came: set[int] = field(default_factory=set)
    last: int | None = None

    @property
    def whole(self) -> bool:
        return self.last is not None and len(self.came) == self.last + 1


class XsensReceiver(DatagramReceiver):
    """Takes the poses of all characters; each is a subject."""

    def __init__(self, address: tuple[str, int]) -> None:
        super().__init__(address)
        self._parts: dict[tuple[int, int], _Parts] = {}
        self._streams: dict[int, Stream] = {}

    def take(self, data: bytes, sender: tuple[str, int], arrived_s: float, inbox: Inbox) -> None:
        """Take a datagram."""
        kind, number, part, n_items, time_ms, character, *_, size = HEADER.unpack_from(data)
        if kind[:4] != b"MXTP":
            raise ValueError("it does not begin with MXTP")
        if kind[4:] in _POSES:
            raise ValueError(
                f"it holds poses as {_POSES[kind[4:]]}: choose Position + Orientation (Quaternion)"
            )
        if kind[4:] != b"02":
            return
        body = data[HEADER.size :]
        if len(body) < n_items * _ITEM.itemsize or (size and size != len(body)):
            raise ValueError(f"it holds {len(body)} bytes, of {n_items} segments")
        items = np.frombuffer(body, _ITEM, n_items)
        key = character, number
        parts = self._parts.setdefault(key, _Parts())
        own = items[(items["id"] >= 1) & (items["id"] <= len(SEGMENTS))]  # no props, no fingers
        index = own["id"] - 1
        parts.places[index], parts.turns[index] = own["place"], own["turn"]
        parts.came.add(part & 0x7F)
        if part & 0x80:
            parts.last = part & 0x7F
        if parts.whole:
            del self._parts[key]
            values = self._frame(character, parts, inbox)
            if values is not None:
                stream = self._streams[character]
                inbox.put(Sample(stream, values, arrived_s, number, time_ms * 1e-3))
        while len(self._parts) > _WAITING:  # what is not whole by now never will be
            del self._parts[next(iter(self._parts))]
            inbox.damaged("a part of a frame is missing")

    def _frame(self, character: int, parts: _Parts, inbox: Inbox) -> FloatArray | None:
        size = np.linalg.norm(parts.turns, axis=1)
        turns = quaternion_to_matrix(np.where(size[:, None] > 0.5, parts.turns, np.nan))
        stream = self._streams.get(character)
        if stream is None:
            if np.isnan(parts.places).any() or np.isnan(turns).any():
                inbox.say("names", "a frame without all segments, before one that has them", 1)
                return None
            stream = self._streams[character] = _described(character, parts.places, turns)
        assert stream.unit_m is not None
        return points_of(parts.places, turns, stream.unit_m)


def _described(character: int, places: FloatArray, turns: FloatArray) -> Stream:
    """Return what a character's first frame says of it: its bones, and the unit."""
    unit_m = 0.01 if float(np.ptp(places, axis=0).max()) > _LARGE else 1.0
    offsets = np.zeros_like(places)
    for index, parent in enumerate(PARENTS):
        if parent >= 0:
            offsets[index] = turns[parent].T @ (places[index] - places[parent])
    channels, skeleton = with_axes(SEGMENTS, PARENTS, offsets, unit_m)
    return Stream(channels, 0.0, skeleton, unit_m, subject=f"character {character}")
