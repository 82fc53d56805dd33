"""Which formats there are, and which of them a file is of."""

from __future__ import annotations

from functools import cache
from pathlib import Path

from mplearn.errors import InvalidValueError, RecordingError
from mplearn.plugins import join_installed

from .format import Format

ENTRY_POINTS = "mplearn.formats"
"""Group of the entry points by which an installed package brings formats (classes) of its own."""

_registered: dict[str, Format] = {}


def register_format(format: Format) -> None:
    """Let ``mplearn export`` write, and check, one more format; one of the same name is replaced.

    Args:
        format: An instance.

    Raises:
        InvalidValueError: It is no format, or has no name.

    Example:
        >>> class Lines(Format):
        ...     name, about, suffix = "lines", "the base's path, a line a frame", ".lines"
        ...     def write(self, path, motions, model):
        ...         np.savetxt(path, motions[0].root_pos)
        ...     def read(self, path, model):
        ...         places = np.loadtxt(path)
        ...         upright = np.tile([1.0, 0.0, 0.0, 0.0], (len(places), 1))
        ...         return (Reading(self.rate_hz, places, upright),)
        >>> register_format(Lines())
        >>> format_of("lines").suffix
        '.lines'
    """
    if not isinstance(format, Format) or not getattr(format, "name", ""):
        raise InvalidValueError(f"a format must be an instance of Format, not {format!r}")
    _registered[format.name] = format


def formats() -> dict[str, Format]:
    """Return all formats by name.

    Example:
        >>> {"unitree", "mjlab", "gltf"} <= set(formats())
        True
    """
    _load_entry_points()
    return dict(_registered)


def format_of(name: str) -> Format:
    """Return the format of a name.

    Raises:
        InvalidValueError: There is none.

    Example:
        >>> format_of("unitree").rate_hz
        30.0
    """
    known = formats()
    if name not in known:
        raise InvalidValueError(f"--to must be one of {', '.join(known)}, not {name!r}")
    return known[name]


def recognised(path: Path) -> Format:
    """Return the format of a file; the latest registered that accepts it.

    Raises:
        RecordingError: There is no such file, or no format accepts it.
    """
    if not path.exists():
        raise RecordingError(f"{path}: there is no such file")
    for format in reversed(formats().values()):
        if format.accepts(path):
            return format
    raise RecordingError(
        f"{path}: of no format that can be checked; give --format, one of {', '.join(formats())}"
    )


@cache
def _load_entry_points() -> None:
    join_installed(ENTRY_POINTS, lambda _, made: register_format(made()))
