"""What the upper body's computer sends to the lower body's: one posture a datagram.

Big-endian, without padding, for a robot of n upper joints:

====== ==== ======= ==========================================================
offset size type    field
====== ==== ======= ==========================================================
0      4    bytes   ``MPLU``
4      1    uint8   version, 1
5      1    uint8   flags: bit 0 is set in the last datagram of a stream
6      2    uint16  n, the number of joint angles
8      4    uint32  robot: CRC-32 of the upper joints' names, joined by commas
12     4    uint32  stream: drawn at random by the sender when it starts
16     4    uint32  sequence number, from 0, one more each datagram
20     8    float64 when the posture is due, on the sender's clock [s]
28     56   float64 desired frame of the base: x, y, z [m], w, x, y, z
84     8 n  float64 angles of the upper joints [rad]
84+8n  4    uint32  CRC-32 of all bytes before
====== ==== ======= ==========================================================
"""

from __future__ import annotations

import struct
import zlib
from collections.abc import Sequence
from typing import Literal, NamedTuple, TypeAlias

import numpy as np

from mplearn.errors import MPLearnError
from mplearn.maths.yaw_roll_pitch import roll_pitch_of, yaw_roll_pitch_quaternion
from mplearn.recording import FloatArray

MAGIC, VERSION = b"MPLU", 1
_HEADER = struct.Struct(">4sBBHIIId")
_CHECKSUM = struct.Struct(">I")
_FRAME_VALUES = 7
_LAST = 1

Fault: TypeAlias = Literal["foreign", "malformed"]


class DatagramError(MPLearnError, ValueError):
    """Bytes that are no posture for this robot.

    Attributes:
        fault: "foreign" for something else, or for another robot; "malformed" for a datagram of
            ours that is damaged, or whose values are no posture.
    """

    def __init__(self, fault: Fault, reason: str) -> None:
        super().__init__(f"{fault} datagram: {reason}")
        self.fault = fault


class Datagram(NamedTuple):
    """One posture.

    Attributes:
        stream: Which run of the sender it is of.
        sequence: Its number in the stream.
        time_s: When it is due, on the sender's clock [s].
        base: Desired frame of the base, shape (7,): position [m] and quaternion (w, x, y, z).
        angles: Angles of the upper joints, shape (n,) [rad].
        last: Whether the stream ends with it.
    """

    stream: int
    sequence: int
    time_s: float
    base: FloatArray
    angles: FloatArray
    last: bool = False


def robot_code(joint_names: Sequence[str]) -> int:
    """Return the number that tells robots apart, from the names of the upper joints."""
    return zlib.crc32(",".join(joint_names).encode())


def encode(datagram: Datagram, robot: int) -> bytes:
    """Return the bytes of a datagram for the robot with this code."""
    n = len(datagram.angles)
    header = _HEADER.pack(
        MAGIC,
        VERSION,
        _LAST * datagram.last,
        n,
        robot,
        datagram.stream,
        datagram.sequence,
        datagram.time_s,
    )
    values = np.concatenate((datagram.base, datagram.angles)).astype(">f8").tobytes()
    return header + values + _CHECKSUM.pack(zlib.crc32(header + values))


def decode(data: bytes, robot: int, n_angles: int) -> Datagram:
    """Return what some bytes say.

    Args:
        data: What came.
        robot: Code of the robot that they must be for.
        n_angles: Number of its upper joints.

    Raises:
        DatagramError: They are foreign or malformed; nothing else is raised, whatever comes.
    """
    if data[:4] != MAGIC:
        raise DatagramError("foreign", f"begins with {data[:4]!r}, not {MAGIC!r}")
    size = _HEADER.size + 8 * (_FRAME_VALUES + n_angles) + _CHECKSUM.size
    if len(data) < _HEADER.size + _CHECKSUM.size:
        raise DatagramError("malformed", f"{len(data)} bytes, not {size}")
    if _CHECKSUM.unpack(data[-_CHECKSUM.size :])[0] != zlib.crc32(data[: -_CHECKSUM.size]):
        raise DatagramError("malformed", "its checksum is wrong")
    _, version, flags, n, code, stream, sequence, time_s = _HEADER.unpack_from(data)
    if version != VERSION:
        raise DatagramError("malformed", f"version {version}, not {VERSION}")
    if code != robot:
        raise DatagramError("foreign", f"for robot {code:08x}, not {robot:08x}")
    if n != n_angles or len(data) != size:
        raise DatagramError("malformed", f"{n} angles in {len(data)} bytes, not {n_angles}, {size}")
    values = np.frombuffer(data, ">f8", _FRAME_VALUES + n, _HEADER.size).astype(np.float64)
    norm = float(np.sum(values[3:7] ** 2))
    if not (np.isfinite(values).all() and np.isfinite(time_s) and abs(norm - 1.0) < 1e-3):
        raise DatagramError("malformed", "its values are not finite, or its frame is no rotation")
    last = bool(flags & _LAST)
    return Datagram(stream, sequence, time_s, values[:_FRAME_VALUES], values[_FRAME_VALUES:], last)


def base_frame(height_m: float, roll: float, pitch: float) -> FloatArray:
    """Return the frame of a base without heading, at x = y = 0, shape (7,)."""
    return np.array([0.0, 0.0, height_m, *yaw_roll_pitch_quaternion(0.0, roll, pitch)])


def base_coordinates(frame: FloatArray) -> FloatArray:
    """Return height [m], roll and pitch [rad] of a base's frame; the inverse of `base_frame`."""
    return np.array([frame[2], *roll_pitch_of(frame[3:7])])
