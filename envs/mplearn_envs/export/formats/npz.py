"""Arrays in one file, without pickles."""

from __future__ import annotations

import zipfile
from collections.abc import Iterable
from pathlib import Path

import numpy as np

from mplearn.errors import RecordingError
from mplearn.recording import FloatArray

_DAMAGES = (ValueError, OSError, EOFError, zipfile.BadZipFile, KeyError, TypeError, AttributeError)


def arrays(path: Path, needed: Iterable[str]) -> dict[str, FloatArray]:
    """Return the arrays of numbers of an npz file.

    Raises:
        RecordingError: It is none, is damaged, or lacks some.
    """
    try:
        with path.open("rb") as opened, np.load(opened, allow_pickle=False) as file:
            found = {name: np.asarray(file[name]) for name in file.files}
    except (
        ValueError,
        OSError,
        EOFError,
        zipfile.BadZipFile,
        KeyError,
        TypeError,
        AttributeError,
    ) as error:
        raise RecordingError(f"{path}: no npz file without pickles: {error}") from error
    missing = sorted(set(needed) - set(found))
    if missing:
        raise RecordingError(f"{path}: there is no {missing}; it has {sorted(found)}")
    return {
        name: value.astype(np.float64) for name, value in found.items() if value.dtype.kind in "fiu"
    }


def keys(path: Path) -> set[str]:
    """Return the names of the arrays; none where it is no npz file."""
    try:
        with zipfile.ZipFile(path) as file:
            return {name.removesuffix(".npy") for name in file.namelist()}
    except (OSError, zipfile.BadZipFile):
        return set()


def rate(path: Path, fps: FloatArray) -> float:
    """Return frames per second, a number or an array of one.

    Raises:
        RecordingError: It is neither.
    """
    if fps.size != 1:
        raise RecordingError(f"{path}: fps must be one number, not of shape {fps.shape}")
    return float(fps.reshape(-1)[0])
