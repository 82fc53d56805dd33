"""The door: a path to a recording, whatever its format."""

from __future__ import annotations

import os
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from types import MappingProxyType

from ..errors import RecordingError
from ..recording import Recording
from .amc import AMCReader
from .bvh import BVHReader
from .c3d import C3DReader
from .csv_table import CSVReader
from .files import bad_file, stem, suffix
from .labels import labels_beside
from .reader import Hints, Reader, joined
from .resample import resample
from .trc import TRCReader
from .ui_prmd import UIPRMDReader

_ALL = (UIPRMDReader(), C3DReader(), AMCReader(), BVHReader(), TRCReader(), CSVReader())

READERS: Mapping[str, Reader] = MappingProxyType(
    {ending: reader for reader in _ALL for ending in reader.suffixes}
)
"""The reader of each file suffix; every one reads gzipped files too."""


def open_recording(
    path: str | os.PathLike[str],
    *,
    take: str | None = None,
    rate_hz: float | None = None,
    positions: bool = False,
    hints: Hints | None = None,
) -> Recording:
    """Read one recording.

    Args:
        path: A file (.c3d, .amc, .bvh, .trc, .csv, UI-PRMD's .txt; each plain or .gz), or a folder.
        take: Which take of a folder: UI-PRMD's ``"m01_s01"``, a file's name without its suffix, or
            with it where two formats hold the same take.
        rate_hz: Resample to this rate [1/s]; by default the file's own.
        positions: For skeletal files (AMC, BVH): joint-centre positions as markers [m] instead of
            joint angles [rad].
        hints: What the file does not say about itself.

    Returns:
        Markers [m] (z up, NaN where occluded) or angles [rad], with the labels that are known.

    Raises:
        RecordingError: The path holds no recording, several takes and none is named, or a file does
            not hold what its format promises.
        InvalidValueError: A rate or a hint lies outside its range.
    """
    takes = _takes(Path(path))
    if take is None and len(takes) > 1:
        raise RecordingError(f"{path}: {len(takes)} takes; expected take= one of {_listed(takes)}")
    name = next(iter(takes)) if take is None else take
    if name not in takes:
        raise RecordingError(f"{path}: no take {take!r}; expected one of {_listed(takes)}")
    return _read(name, takes[name], rate_hz, positions, hints)


def open_recordings(
    path: str | os.PathLike[str],
    *,
    rate_hz: float | None = None,
    positions: bool = False,
    hints: Hints | None = None,
) -> tuple[Recording, ...]:
    """Read all takes of a folder, in order of their names, or one file.

    Args, returns and errors are those of `open_recording`.
    """
    return tuple(
        _read(name, files, rate_hz, positions, hints) for name, files in _takes(Path(path)).items()
    )


def take_names(path: str | os.PathLike[str]) -> tuple[str, ...]:
    """Return the names of the takes that a folder holds, without reading them.

    Raises:
        RecordingError: The path holds no recording.
    """
    return tuple(_takes(Path(path)))


def _takes(path: Path) -> dict[str, tuple[Path, ...]]:
    """Return the files of each take, by name."""
    if path.is_file():
        return {stem(path): (path,)}
    if not path.is_dir():
        raise bad_file(path, "no such file or folder", "a recording or a folder of recordings")
    files: dict[str, list[Path]] = {}
    for file in sorted(path.iterdir()):
        reader = READERS.get(suffix(file))
        if reader is not None and reader.accepts(file) and file.is_file():
            files.setdefault(reader.suffixes[0], []).append(file)
    found = [(name, f) for s, group in files.items() for name, f in READERS[s].takes(group).items()]
    if not found:
        raise bad_file(path, "a folder with nothing readable", f"files named {', '.join(READERS)}")
    names = [name for name, _ in found]
    return dict(sorted((f[0].name if names.count(name) > 1 else name, f) for name, f in found))


def _read(
    name: str,
    files: tuple[Path, ...],
    rate_hz: float | None,
    positions: bool,
    hints: Hints | None,
) -> Recording:
    reader = READERS.get(suffix(files[0]))
    if reader is None:
        raise bad_file(
            files[0], f"unknown suffix {suffix(files[0])!r}", f"one of {', '.join(READERS)}"
        )
    parts = []
    for file in files:
        part = reader.read(file, hints or Hints(), positions=positions)
        parts.append(part if part.labels else replace(part, labels=labels_beside(file, part)))
    recording = parts[0] if len(parts) == 1 else joined(name, parts)
    return recording if rate_hz is None else resample(recording, rate_hz)


def _listed(takes: Mapping[str, object]) -> str:
    names = list(takes)
    return ", ".join(names[:60]) + (", ..." if len(names) > 60 else "")
