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

In a keyed stream the version is 2, and these follow:

====== ==== ======= ==========================================================
88+8n  8    float64 when it was sent, on the sender's wall clock [s since 1970]
96+8n  32   bytes   HMAC-SHA256 of all bytes before, with the shared key
====== ==== ======= ==========================================================
"""

from __future__ import annotations

import hashlib
import hmac
import struct
import zlib
from collections.abc import Sequence
from pathlib import Path
from typing import Literal, NamedTuple, TypeAlias

import numpy as np

from mplearn.errors import InvalidValueError, MPLearnError
from mplearn.maths.yaw_roll_pitch import roll_pitch_of, yaw_roll_pitch_quaternion
from mplearn.recording import FloatArray

MAGIC, VERSION, KEYED = b"MPLU", 1, 2
SHORTEST_KEY = 16  # bytes
_HEADER = struct.Struct(">4sBBHIIId")
_CHECKSUM = struct.Struct(">I")
_SENT = struct.Struct(">d")
_MAC_SIZE = hashlib.sha256().digest_size
_FRAME_VALUES = 7
_LAST = 1

Fault: TypeAlias = Literal["foreign", "malformed"]


class DatagramError(MPLearnError, ValueError):
    """Bytes that are no posture for this robot.

    Attributes:
        fault: "foreign" for something else, or for another robot; "malformed" for a datagram of
            ours that is damaged, or whose values are no posture.

    Example:
        >>> try:
        ...     raise DatagramError("malformed", "it ends early")
        ... except DatagramError as error:
        ...     print(error.fault)
        malformed
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
        sent_s: When it was sent, on the sender's wall clock [s]; None where it is not keyed.

    Example:
        >>> import numpy as np
        >>> upright = np.array([0.0, 0.0, 0.9, 1.0, 0.0, 0.0, 0.0])
        >>> posture = Datagram(stream=7, sequence=0, time_s=0.0, base=upright, angles=np.zeros(18))
        >>> len(encode(posture, robot=1)) < 300
        True
    """

    stream: int
    sequence: int
    time_s: float
    base: FloatArray
    angles: FloatArray
    last: bool = False
    sent_s: float | None = None


def checked_key(key: bytes | None) -> bytes | None:
    """Return a key that both ends share.

    Raises:
        InvalidValueError: It is too short to keep anyone out.
    """
    if key is not None and len(key) < SHORTEST_KEY:
        raise InvalidValueError(f"a key needs {SHORTEST_KEY} bytes or more, not {len(key)}")
    return key


def read_key(path: Path) -> bytes:
    """Return the key in a file, blanks around it left out.

    Raises:
        InvalidValueError: The file cannot be read, or its key is too short.
    """
    try:
        return checked_key(path.read_bytes().strip()) or b""
    except OSError as error:
        raise InvalidValueError(f"the key file {path} cannot be read: {error.strerror}") from error


def robot_code(joint_names: Sequence[str]) -> int:
    """Return the number that tells robots apart, from the names of the upper joints."""
    return zlib.crc32(",".join(joint_names).encode())


def encode(datagram: Datagram, robot: int, key: bytes | None = None) -> bytes:
    """Return the bytes of a datagram for the robot with this code; keyed, it needs ``sent_s``.

    Example:
        >>> import numpy as np
        >>> upright = np.array([0.0, 0.0, 0.9, 1.0, 0.0, 0.0, 0.0])
        >>> posture = Datagram(stream=7, sequence=0, time_s=0.0, base=upright, angles=np.zeros(18))
        >>> type(encode(posture, robot=1)).__name__
        'bytes'
    """
    n = len(datagram.angles)
    header = _HEADER.pack(
        MAGIC,
        VERSION if key is None else KEYED,
        _LAST * datagram.last,
        n,
        robot,
        datagram.stream,
        datagram.sequence,
        datagram.time_s,
    )
    values = np.concatenate((datagram.base, datagram.angles)).astype(">f8").tobytes()
    plain = header + values + _CHECKSUM.pack(zlib.crc32(header + values))
    if key is None:
        return plain
    proven = plain + _SENT.pack(datagram.sent_s)
    return proven + hmac.digest(key, proven, "sha256")


def decode(data: bytes, robot: int, n_angles: int, key: bytes | None = None) -> Datagram:
    """Return what some bytes say.

    Args:
        data: What came.
        robot: Code of the robot that they must be for.
        n_angles: Number of its upper joints.
        key: What the sender must share; None takes datagrams without a key, and only these.

    Raises:
        DatagramError: They are foreign or malformed; nothing else is raised, whatever comes.

    Example:
        >>> code = robot_code(["elbow_l"])
        >>> base = np.array([0.0, 0.0, 1.0, 1.0, 0.0, 0.0, 0.0])
        >>> sent = Datagram(1, 0, 0.0, base, np.array([0.5]))
        >>> decode(encode(sent, code), code, 1).angles.tolist()
        [0.5]
    """
    if data[:4] != MAGIC:
        raise DatagramError("foreign", f"begins with {data[:4]!r}, not {MAGIC!r}")
    sent_s = None
    if key is not None:
        data, sent_s = _proven(data, key)
    size = _HEADER.size + 8 * (_FRAME_VALUES + n_angles) + _CHECKSUM.size
    if len(data) < _HEADER.size + _CHECKSUM.size:
        raise DatagramError("malformed", f"{len(data)} bytes, not {size}")
    if key is None and data[len(MAGIC)] == KEYED:
        raise DatagramError("foreign", "it is keyed, and no key is known here")
    if _CHECKSUM.unpack(data[-_CHECKSUM.size :])[0] != zlib.crc32(data[: -_CHECKSUM.size]):
        raise DatagramError("malformed", "its checksum is wrong")
    _, version, flags, n, code, stream, sequence, time_s = _HEADER.unpack_from(data)
    if version != (VERSION if key is None else KEYED):
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
    base, angles = values[:_FRAME_VALUES], values[_FRAME_VALUES:]
    return Datagram(stream, sequence, time_s, base, angles, last, sent_s)


def _proven(data: bytes, key: bytes) -> tuple[bytes, float]:
    """Return the part of a keyed datagram before its proof, and when it was sent [s]."""
    proven, mac = data[:-_MAC_SIZE], data[-_MAC_SIZE:]
    if len(data) < _MAC_SIZE + _SENT.size:
        raise DatagramError("foreign", f"{len(data)} bytes hold no proof of a shared key")
    if not hmac.compare_digest(mac, hmac.digest(key, proven, "sha256")):
        raise DatagramError("foreign", "its sender does not share the key")
    return proven[: -_SENT.size], float(_SENT.unpack(proven[-_SENT.size :])[0])


def base_frame(height_m: float, roll: float, pitch: float) -> FloatArray:
    """Return the frame of a base without heading, at x = y = 0, shape (7,)."""
    return np.array([0.0, 0.0, height_m, *yaw_roll_pitch_quaternion(0.0, roll, pitch)])


def base_coordinates(frame: FloatArray) -> FloatArray:
    """Return height [m], roll and pitch [rad] of a base's frame; the inverse of `base_frame`."""
    return np.array([frame[2], *roll_pitch_of(frame[3:7])])
