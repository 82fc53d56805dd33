"""Messages between the processes, and to the page: a header of plain values, and bytes.

Between processes a message is the length of its header (4 bytes, little-endian), the header as
JSON, and the bytes that belong to it. To the page, headers go as text; what comes at every tick is
binary (`tick`, `clip`).
"""

from __future__ import annotations

import json
import re
import struct
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from mplearn.errors import InvalidValueError

Header = dict[str, Any]
Poses = NDArray[np.float32]

LONGEST_REQUEST = 8192  # characters
TICK, CLIP = 1, 2
_BRIEF = 200  # characters
_BACKWARD = re.compile("[\u0590-\u08ff\u200f\u202a-\u202e\u2066-\u2069\ufb1d-\ufdff\ufe70-\ufeff]")
_KEPT_APART = str.maketrans("", "", "\u2066\u2067\u2068\u2069")
_TICK = struct.Struct("<BBHHHII")  # kind, 0, bodies of person and robot, channels, first row, rows
_CLIP = struct.Struct("<BBHIfI")  # kind, 0, bodies, number of the request, rate, motions


def pack(header: Mapping[str, Any], blob: bytes = b"") -> bytes:
    """Return a message between processes."""
    text = as_text(header).encode("ascii")
    return struct.pack("<I", len(text)) + text + blob


def unpack(message: bytes) -> tuple[Header, bytes]:
    """Return header and bytes of a message."""
    (length,) = struct.unpack_from("<I", message)
    return json.loads(message[4 : 4 + length]), message[4 + length :]


def as_text(header: Mapping[str, Any]) -> str:
    """Return a header as JSON in ASCII, so that any name at all can be sent."""
    return json.dumps(header, separators=(",", ":"), allow_nan=False)


def mention(id: int | None) -> str:
    """Return what stands in a text for a primitive's name, whatever that is when it is shown."""
    return f"{{{id}}}"


def brief(text: str) -> str:
    """Return a name as it is shown: a page has no room for more, and would take long to find out.

    >>> len(brief("a" * 10_000))
    200
    """
    return text if len(text) <= _BRIEF else f"{text[: _BRIEF - 1]}…"


def literal(text: object) -> str:
    """Return a text as part of another, where none of it stands for a primitive.

    What is written from right to left is kept apart, so that the rest stays where it was.

    >>> literal("{1} is a name"), mention(1)
    ('{{1} is a name', '{1}')
    """
    plain = str(text).replace("{", "{{")
    return f"\u2068{plain.translate(_KEPT_APART)}\u2069" if _BACKWARD.search(plain) else plain


def tick(person: Poses, robot: Poses, first: int, rows: Poses) -> bytes:
    """Return what a page needs at every tick.

    Args:
        person: Position [m] and quaternion of each body of the person, shape (P, 7); P = 0 where
            nobody is seen.
        robot: The same of the robot, shape (R, 7).
        first: Number of the first of the rows.
        rows: The channels since the last tick, shape (n, D).
    """
    head = _TICK.pack(TICK, 0, len(person), len(robot), rows.shape[1], first, len(rows))
    return head + b"".join(np.ascontiguousarray(p, "<f4").tobytes() for p in (person, robot, rows))


def clip(number: int, rate_hz: float, motions: Sequence[Poses]) -> bytes:
    """Return motions to be played on the page: the primitive's own, then its demonstrations.

    Args:
        number: Of the request that they answer.
        rate_hz: Frames per second [1/s].
        motions: Poses of each motion, shape (T, B, 7).
    """
    head = _CLIP.pack(CLIP, 0, motions[0].shape[1], number, rate_hz, len(motions))
    lengths = np.array([len(motion) for motion in motions], "<u4").tobytes()
    return head + lengths + b"".join(np.ascontiguousarray(m, "<f4").tobytes() for m in motions)


def number(asked: Header, key: str) -> int:
    """Return a whole number that a request holds.

    Raises:
        InvalidValueError: It holds none of 32 bits.
    """
    value = asked.get(key)
    if type(value) is not int or not 0 <= value < 2**32:
        raise InvalidValueError(f"{key} must be a whole number, not {value!r:.40}")
    return value


def request(text: str) -> Header:
    """Return what a page asks for.

    Raises:
        InvalidValueError: It is too long, or no JSON object with a string ``do``.
    """
    if len(text) > LONGEST_REQUEST:
        raise InvalidValueError(f"a request has at most {LONGEST_REQUEST} characters")
    try:
        asked = json.loads(text)
        as_text(asked)  # 1e999 is a number to Python's reader, and nothing that can be passed on
    except (ValueError, RecursionError) as error:
        raise InvalidValueError(f"a request must be JSON, not {text[:60]!r}") from error
    if not isinstance(asked, dict) or not isinstance(asked.get("do"), str):
        raise InvalidValueError("a request must be an object with a string 'do'")
    return asked
