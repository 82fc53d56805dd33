"""From a file's axes and unit of length to metres, z up, x forward, y left."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from ..errors import InvalidValueError, RecordingError
from ..recording import FloatArray
from .files import bad_file

UNITS_M = {"m": 1.0, "dm": 0.1, "cm": 0.01, "mm": 0.001, "in": 0.0254, "ft": 0.3048}
"""Length of the units that files name [m]."""

_FARTHEST_M = 100.0  # no capture volume is larger
_SMALLEST_M = 0.02  # all markers of a body within less: not a body
_BODY_EXTENT_M = (0.4, 3.0)  # largest extent of a person's skeleton, from a toddler's on


def unit_m(path: Path, name: str) -> float:
    """Return the length of a named unit [m].

    Raises:
        RecordingError: The unit is not known.
    """
    plain = name.strip().lower()
    plain = {"meters": "m", "metres": "m", "inch": "in", "inches": "in"}.get(plain, plain)
    if plain not in UNITS_M:
        raise bad_file(path, f"unit of length {name!r}", f"one of {', '.join(UNITS_M)}")
    return UNITS_M[plain]


def to_z_up(up: str, forward: str) -> FloatArray:
    """Return the matrix that turns a file's axes to z up, x forward, y left.

    Args:
        up: The file's axis that points up, as ``"y"`` or ``"-y"``.
        forward: The file's axis that points forward.

    Returns:
        Rotation, shape (3, 3): ours = matrix @ theirs.

    Raises:
        InvalidValueError: The two are not different axes.
    """
    u, f = _axis(up), _axis(forward)
    if u @ f:
        raise InvalidValueError(f"up {up!r} and forward {forward!r} must be different axes")
    return np.stack([f, np.cross(u, f), u])


def file_axes(up_hint: str | None, up: str, forward: str) -> FloatArray:
    """Return `to_z_up` for a format's axes, or for a hinted vertical with the next axis forward."""
    if up_hint is None or up_hint == up:
        return to_z_up(up, forward)
    return to_z_up(up_hint, {"x": "y", "y": "z", "z": "x"}[up_hint])


def checked_markers(path: Path, points: FloatArray, names: tuple[str, ...]) -> FloatArray:
    """Return marker positions, shape (T, M, 3) [m], if a person can be meant by them.

    Raises:
        RecordingError: Nothing was measured, a marker lies 100 m away, or all lie within 2 cm.
    """
    size = np.abs(points)
    if np.isnan(size).all():
        raise bad_file(path, "no marker was ever seen", "measured positions")
    frame, marker, _ = np.unravel_index(np.nanargmax(size), size.shape)
    if size[frame, marker].max() > _FARTHEST_M:
        raise bad_file(
            path,
            f"marker {names[marker]!r} is {np.nanmax(size):.3g} m away in frame {frame}",
            f"less than {_FARTHEST_M:g} m; is the unit of length right? Hints(unit_m=...) sets it",
        )
    if points.shape[1] >= 5:
        some = points[:: max(1, len(points) // 200)]
        gone = np.isnan(some)
        spread = np.where(gone, -np.inf, some).max(1) - np.where(gone, np.inf, some).min(1)
        extent = spread.max(axis=1)  # (t,)
        if np.median(extent[extent >= 0], axis=0) < _SMALLEST_M:
            raise bad_file(
                path,
                f"all {points.shape[1]} markers lie within {np.median(extent) * 1000:.3g} mm",
                f"at least {_SMALLEST_M * 1000:g} mm: is the unit of length right? "
                "(Hints(unit_m=...) sets it)",
            )
    return points


def check_skeleton(path: Path, rest: FloatArray, unit: float) -> None:
    """Check that a skeleton at rest, joints at (J, 3) [m], has the size of a person.

    Raises:
        RecordingError: It has not; the message tells which unit of length would fit.
    """
    extent = float(np.ptp(rest, axis=0).max())
    low, high = _BODY_EXTENT_M
    if low <= extent <= high:
        return
    fits = [
        f"{m:g}" for m in (1.0, 0.01, 0.001, 0.0254, 0.056444) if low <= extent / unit * m <= high
    ]
    raise RecordingError(
        f"{path}: the skeleton measures {extent:.3g} m with a unit of {unit:g} m; expected "
        f"{low:g} to {high:g} m. Hints(unit_m=...) sets the unit"
        + (f": {' or '.join(fits)} would fit" if fits else "")
    )


def _axis(name: str) -> FloatArray:
    letter = name.lower().removeprefix("+")
    sign = -1.0 if letter.startswith("-") else 1.0
    letter = letter.removeprefix("-")
    if letter not in ("x", "y", "z"):
        raise InvalidValueError(f"an axis is x, y or z, with a sign or without, not {name!r}")
    unit: FloatArray = sign * np.eye(3)["xyz".index(letter)]
    return unit
