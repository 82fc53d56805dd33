"""Which reader reads a file: by its suffix, and by a look at it where several share one."""

from __future__ import annotations

import re
from functools import cache
from pathlib import Path

from ..errors import InvalidValueError, RecordingError
from ..plugins import join_installed
from .files import bad_file, head, head_text, is_file, read_bytes, suffix
from .reader import Reader

ENTRY_POINTS = "mplearn.readers"
"""Group of the entry points by which an installed package brings readers (classes) of its own."""

_XML = re.compile(r"<\?XML[^>]*>\s*")
_HDF5 = (
    "its CSV instead: of DeepLabCut by analyze_videos_converth5_to_csv, of SLEAP by File > Export "
    "Analysis CSV or sleap-convert --format analysis.csv; or their HDF5 (.h5), with h5py installed "
    "(pip install 'mplearn[hdf5]')"
)
_ARRAYS = (".h5", ".hdf5")  # which many programs write, and few of key points:
_KEY_POINTS = ((b"df_with_missing",), (b"track_names", b"node_names"))  # names in those of such,
_NAMES_WITHIN = 65_536  # which stand in so many bytes
_SENT = "it as a stream: mplearn learn --live ndjson:- < FILE"
_EXPORTED = dict.fromkeys((".h5", ".hdf5", ".slp"), _HDF5)  # what programs also write as a table
_LINES = dict.fromkeys((".ndjson", ".jsonl"), _SENT)  # what was sent, or a journal of anything
_TELLING = 256  # bytes, in which formats that name themselves do

_registered: list[Reader] = []  # the latest is asked first


def register_reader(reader: Reader) -> None:
    """Let `open_recording` and the ``mplearn`` command read one more format.

    It is asked before those that were registered earlier, so it may take over a suffix, or those
    of its files that it `Reader.accepts`.

    Args:
        reader: An instance; one of the same class, if there is one, is replaced.

    Raises:
        InvalidValueError: It is no reader, or names no suffix such as ``".abc"``.

    Example:
        >>> import numpy as np
        >>> from mplearn import Recording, open_recording
        >>> from mplearn.mocap import Reader
        >>> class Shouts(Reader):
        ...     format, suffixes = "shouts", (".shout",)
        ...     def read(self, path, hints, *, positions):
        ...         rows = [[float(line)] for line in path.read_text().split()]
        ...         return Recording(np.array(rows), hints.rate_hz or 25.0, ("loudness",))
        >>> register_reader(Shouts())
        >>> _ = Path("a.shout").write_text("0.1 0.5 0.2")
        >>> open_recording("a.shout").channels
        ('loudness',)
    """
    if not isinstance(reader, Reader):
        raise InvalidValueError(f"a reader must be an instance of Reader, not {reader!r}")
    for ending in reader.suffixes or ("",):
        if not ending.startswith(".") or ending != ending.lower() or ending == ".gz":
            raise InvalidValueError(
                f"a reader's suffixes are like '.abc', lower case, not {ending!r}"
            )
    _registered[:] = [reader, *(r for r in _registered if type(r) is not type(reader))]


def readers() -> tuple[Reader, ...]:
    """Return all readers, in the order in which they are asked.

    Example:
        >>> suffixes = {suffix for reader in readers() for suffix in reader.suffixes}
        >>> {".bvh", ".c3d", ".trc"} <= suffixes
        True
    """
    _load_entry_points()
    return tuple(_registered)


def suffixes() -> tuple[str, ...]:
    """Return the suffixes that can be read, in order."""
    return tuple(sorted({ending for reader in readers() for ending in reader.suffixes}))


def instead_of(path: Path) -> str:
    """Return what is read instead of a file that is also written as a table; else nothing."""
    return "" if suffix(path) in suffixes() else _EXPORTED.get(suffix(path), "")


def holds_other_arrays(path: Path) -> bool:
    """Whether a file of arrays is neither DeepLabCut's nor SLEAP's, by the names of its arrays."""
    if suffix(path) not in _ARRAYS or not is_file(path):
        return False
    if suffix(path) in suffixes():  # it can be looked into
        return reader_of(path) is None
    start = head(path, _NAMES_WITHIN)
    return not any(all(name in start for name in names) for names in _KEY_POINTS)


def reader_of(path: Path, *, any_suffix: bool = False) -> Reader | None:
    """Return the reader that takes a file; None for none.

    Args:
        path: The file.
        any_suffix: Whether its start may tell its format where its suffix is nobody's.
    """
    if not is_file(path) or not (any_suffix or suffix(path) in suffixes()):
        return None
    start = _XML.sub("", head_text(path, _TELLING).lstrip().upper())
    fitting = (r for r in readers() if suffix(path) in r.suffixes or start.startswith(r.begins))
    return next((reader for reader in fitting if _accepts(reader, path)), None)


def _accepts(reader: Reader, path: Path) -> bool:
    try:
        return reader.accepts(path)
    except NotADirectoryError:  # it opens files itself, and not those in archives
        return False


def reader_for(path: Path) -> Reader:
    """Return the reader for a file that is meant to be read; the most general one in doubt.

    Raises:
        RecordingError: No reader knows its suffix, or its start.
    """
    found = reader_of(path, any_suffix=True)
    if found is None:
        fitting = [r for r in readers() if suffix(path) in r.suffixes]
        if not fitting:
            read_bytes(path)  # tells what was saved instead of a recording
            expected = (
                instead_of(path) or _LINES.get(suffix(path)) or f"one of {', '.join(suffixes())}"
            )
            raise bad_file(path, f"unknown suffix {suffix(path)!r}", expected)
        found = fitting[-1]
    return found


@cache
def _load_entry_points() -> None:
    join_installed(ENTRY_POINTS, lambda _, made: register_reader(made()), RecordingError)
