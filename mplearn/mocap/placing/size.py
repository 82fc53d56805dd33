"""The unit of length, from the size of the person.

Lengths within the body (thigh, shank, trunk) where names tell which points bound them; how far the
points spread otherwise. A unit that the file names wins as long as a person can be meant by it.
"""

from __future__ import annotations

import re
from dataclasses import dataclass
from pathlib import Path
from unicodedata import normalize

import numpy as np

from ...option_names import option
from ...recording import FloatArray
from ..files import bad_file
from ..reader import Hints
from .part_names import LINKS_M, place_of

UNITS_M = {"m": 1.0, "dm": 0.1, "cm": 0.01, "mm": 0.001, "in": 0.0254, "ft": 0.3048}
"""Length of the units that files name [m]."""

CMU_UNIT_M = 0.0254 / 0.45
"""Unit of the CMU database's skeletons, and of most conversions of it [m]."""

_COMMON = (1.0, 0.001, 0.01)
_OTHERS = (0.0254, CMU_UNIT_M, 0.3048, 0.1)
_LOOK = 200  # frames

# how large a person may be against one of 1.75 m: a toddler to a giant, markers off the joints
_PEOPLE = (0.4, 1.4)
_VARY = 0.3  # of the logarithm of their size
_RARE = 3.0  # nat, against a unit that few use
_POSSIBLE = 3.0  # nat: another unit is meant in one of twenty such files
_IN_DOUBT, _BETWEEN_RARE = 0.8, 1.5  # nat; between two that few use, habit does not help
# how far the points may spread against the markers of a whole person: a hand to two people afar
_SPREADS = (0.06, 8.0)
_USUAL_SPREAD_M = 0.45
_USUAL_SPREADS = (0.25, 2.5)


@dataclass(frozen=True)
class Unit:
    """A unit of length that was settled.

    Attributes:
        unit_m: Its length [m].
        fits: Whether a person, or a part of one, can be meant by it.
        contradicts: Whether it is another than the one declared.
        doubtful: Whether the points would be few, or far apart, of a person.
        rival_m: Another unit that may be meant [m]: of a child, or of an adult in inches.
        close: Whether that fits nearly as well.
    """

    unit_m: float
    fits: bool
    contradicts: bool
    doubtful: bool = False
    rival_m: float | None = None
    close: bool = False


def find_unit(
    points: FloatArray, names: tuple[str, ...], declared_m: float, *, says_so: bool = True
) -> Unit:
    """Return the unit of length in which points are a person's.

    Args:
        points: Markers or joint centres in the file's unit, shape (T, M, 3); NaN where missing.
        names: Their names, length M; hints.
        declared_m: The unit that the file, or its format, says [m].
        says_so: Whether the file itself says it, not only its format.
    """
    adult_m = _unit_of_an_adult(points, names)
    if adult_m is not None:
        return likeliest_unit(adult_m, declared_m, _PEOPLE, says_so=says_so)
    spread = spread_of(points)
    if not 0 < spread < np.inf:
        return Unit(declared_m, False, False)
    adult_m = _USUAL_SPREAD_M / spread
    low, high = _USUAL_SPREADS
    if _SPREADS[0] <= declared_m / adult_m <= _SPREADS[1]:
        return Unit(declared_m, True, False, not low <= declared_m / adult_m <= high)
    fits = [u for u in _COMMON if low <= u / adult_m <= high]
    if not fits:
        return Unit(declared_m, False, False)
    best = min(fits, key=lambda u: abs(np.log(u / adult_m)))
    return Unit(best, True, True)


def likeliest_unit(
    adult_m: float, declared_m: float, people: tuple[float, float], *, says_so: bool
) -> Unit:
    """Return the unit in which somebody is most likely as large as people are.

    Args:
        adult_m: The unit in which it would be an adult of the usual size [m].
        declared_m: The unit that the file, or its format, says [m].
        people: The least and the largest size of a person against that.
        says_so: Whether the file itself says it: then it counts whenever it can.
    """
    low, high = people
    if says_so and low <= declared_m / adult_m <= high:
        return Unit(declared_m, True, False)
    candidates = {*_COMMON, *_OTHERS, declared_m}
    fits = [unit for unit in candidates if low <= unit / adult_m <= high]
    if not fits:  # as with wings, or a staff: the unit in which it is the least odd
        best = min((declared_m, *_COMMON), key=lambda unit: abs(np.log(unit / adult_m)))
        return Unit(declared_m if says_so else best, False, False)
    unlikely = {unit: _unlikely(unit, adult_m, declared_m) for unit in fits}
    best, *others = sorted(fits, key=lambda unit: unlikely[unit])
    behind = unlikely[others[0]] - unlikely[best] if others else np.inf
    rival = others[0] if behind < _POSSIBLE else None
    close = behind < (_BETWEEN_RARE if unlikely[best] >= _RARE else _IN_DOUBT)
    return Unit(best, True, best != declared_m, False, rival, close)


def _unlikely(unit_m: float, adult_m: float, declared_m: float) -> float:
    """Return how unlikely a unit is [nat]: people are rarely small, and few files in inches."""
    size = np.log(unit_m / adult_m) / _VARY
    return float(0.5 * size**2 + (0.0 if unit_m in (declared_m, *_COMMON) else _RARE))


def spread_of(points: FloatArray) -> float:
    """Return the median distance of the points from their middle, in their unit; NaN for none."""
    some = points[:: max(1, len(points) // _LOOK)]
    seen = ~np.isnan(some).any(axis=2)
    some = some[seen.sum(axis=1) >= 3]
    if not len(some):
        return float("nan")
    middle = np.nanmedian(some, axis=1, keepdims=True)
    return float(np.nanmedian(np.linalg.norm(some - middle, axis=2)))


def named_unit(text: str) -> float | None:
    """Return the length of a unit as files write it [m]: in short, in words, or cut; or None.

    ``"mm"``, ``"Millimeters"``, ``"mete"``, ``"[m]"``, ``"inches"``, ``"mm/deg"``.

    Example:
        >>> named_unit("Millimeters"), named_unit("[m]"), named_unit("furlongs")
        (0.001, 1.0, None)
    """
    decomposed = normalize("NFD", _ANGLES_TOO.sub("", text.lower()))  # accents by themselves
    plain = "".join(c for c in decomposed if c.isalpha())
    if plain in UNITS_M:
        return UNITS_M[plain]
    if len(plain) < 2:
        return None
    for words, unit in _WORDS:
        # a text of at least three letters may be cut off, as C3D parameters are
        if plain in words or (len(plain) >= 3 and any(w.startswith(plain) for w in words)):
            return unit
    return None


def said_unit(path: Path, text: str, hints: Hints) -> float | None:
    """Return the length of the unit that a file says [m]; None where it says nothing.

    Raises:
        RecordingError: It says what is no unit of length, and no hint tells what is meant.
    """
    unit = named_unit(text)
    if unit is None and hints.unit_m is None and not _SAYS_NOTHING.fullmatch(text.strip().lower()):
        expected = f"one of {', '.join(UNITS_M)}, or {option('unit_m')}"
        raise bad_file(path, f"unit of length {text!r}", expected)
    return unit


_ANGLES_TOO = re.compile(r"\W*(?:deg|degrees?|rad|radians?|°)\W*$")  # one text for both
_SAYS_NOTHING = re.compile(r"|\W+|n/?a|none|null|unknown|undefined|unspecified|units?|arbitrary")
# fmt: off
_WORDS = (
    (("um", "µm", "μm", "micrometers", "micrometres", "microns"), 1e-6),
    (("millimeters", "millimetres", "mms", "milimeters", "milimetres",
      "milimetros", "millimetri", "мм", "毫米"), 0.001),
    (("centimeters", "centimetres", "cms", "zentimeter", "centimetros", "centimetri", "см",
      "厘米"), 0.01),
    (("decimeters", "decimetres", "dezimeter"), 0.1),
    (("meters", "metres", "mtrs", "metros", "metri"), 1.0),
    (("inches", "inchs", "zoll", "pouces"), 0.0254),
    (("feet", "foot"), 0.3048),
)
# fmt: on


def _unit_of_an_adult(points: FloatArray, names: tuple[str, ...]) -> float | None:
    """Return the unit [m] in which the named parts are as far apart as in a person of 1.75 m."""
    some = points[:: max(1, len(points) // _LOOK)]
    columns: dict[tuple[str, str], list[int]] = {}
    for index, name in enumerate(names):
        place = place_of(name)
        if place.part:
            columns.setdefault((place.part, place.side), []).append(index)
    centres: dict[tuple[str, str], FloatArray] = {}
    for key, indices in columns.items():
        centres[key] = _middle(some[:, indices])
    for part in {part for part, _ in columns}:  # the middle of both sides, and of what has no side
        both = [centres[key] for key in columns if key[0] == part]
        centres[part, ""] = _middle(np.stack(both, axis=1))
    ratios = []
    for (a, b), length_m in LINKS_M.items():
        for side in [s for s in "lr" if (a, s) in centres and (b, s) in centres] or [""]:
            if (a, side) in centres and (b, side) in centres:
                apart = np.linalg.norm(centres[a, side] - centres[b, side], axis=1)
                apart = apart[(apart > 0) & np.isfinite(apart)]
                if len(apart):
                    ratios.append(length_m / float(np.median(apart)))
    return float(np.median(ratios)) if len(ratios) >= 2 else None


def _middle(points: FloatArray) -> FloatArray:
    """Return the mean of the points that are seen, shape (T, K, 3) to (T, 3); NaN for none."""
    seen = ~np.isnan(points)
    count = seen.sum(axis=1)
    total = np.where(seen, points, 0.0).sum(axis=1)
    middle: FloatArray = np.where(count > 0, total / np.maximum(count, 1), np.nan)
    return middle
