"""A user's word on which point is which place of the body: a text file, a line a point."""

from __future__ import annotations

import os
from difflib import get_close_matches
from pathlib import Path

from ..body import marker_set
from ..errors import BodyError
from ..mocap.files import read_text


def read_map(path: str | os.PathLike[str]) -> dict[str, str]:
    r"""Read a map file.

    Each line is ``point = place``, as ``LeftUpLeg = hip_l``; a place is one of the marker set
    ``"landmarks"``. ``point = -`` leaves a point out. What follows a ``#`` is a comment.

    Args:
        path: The file.

    Returns:
        Place by point; "" for what is left out.

    Raises:
        BodyError: A line is none of these, names no place, or a place or a point occurs twice.
        RecordingError: The file cannot be read.

    Example:
        >>> from pathlib import Path
        >>> lines = ["LeftUpLeg = hip_l", "RightUpLeg = hip_r  # a comment", "Hat = -"]
        >>> _ = Path("names.txt").write_text("\n".join(lines))
        >>> read_map("names.txt")
        {'LeftUpLeg': 'hip_l', 'RightUpLeg': 'hip_r', 'Hat': ''}
    """
    known = marker_set("landmarks").names
    names: dict[str, str] = {}
    for number, line in enumerate(read_text(Path(path)).splitlines(), start=1):
        text = line.split("#", 1)[0].strip()
        if not text:
            continue
        point, equals, place = (part.strip() for part in text.rpartition("="))
        where = f"{path}, line {number}"
        if not equals or not point or not place:
            raise BodyError(f"{where} holds {text[:60]!r}; expected 'point = place'")
        place = "" if place == "-" else place
        if place and place not in known:
            near = ", ".join(get_close_matches(place, known, 4, 0.4)) or ", ".join(known)
            raise BodyError(f"{where}: no place {place[:60]!r} on the body; there are {near}")
        if point in names or (place and place in names.values()):
            raise BodyError(f"{where}: {point[:60]!r} or {place!r} for the second time")
        names[point] = place
    return names
