"""HDF5 of DeepLabCut [Mathis2018] and of SLEAP [Pereira2022], as their programs write it.

DeepLabCut's is a frame of pandas with a column for each coordinate, as in its table; SLEAP's holds
arrays (File > Export Analysis HDF5). What pandas pickles of it, the names of the columns, may be
lists and texts: nothing else is made of it.
"""

from __future__ import annotations

import importlib.util
import io
import pickle
import struct
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np

from ...errors import RecordingError
from ...extras import require
from ...recording import FloatArray
from ..files import bad_file, read_bytes
from ..findings import Findings
from ..packed.packing import most_unpacked
from ..reader import Hints
from .animals import COORDS, AnimalReader, Animals, by_frame

_SIGNATURE = b"\x89HDF\r\n\x1a\n"
_DAMAGE = (OSError, KeyError, ValueError, RuntimeError, TypeError, AttributeError, IndexError,
           OverflowError, EOFError, NotImplementedError, MemoryError, struct.error,
           pickle.UnpicklingError)  # fmt: skip
_FRAMES = (b"frame", b"frame_table")  # what pandas calls a frame kept as arrays, as rows
_EXPECTED = "a table of DeepLabCut, or what SLEAP exports for analysis"
# the axes of SLEAP's arrays: as it writes them, as it does untransposed, as sleap-io does
_ORDERS = ("track coord node frame", "frame node coord track", "frame track node coord")


class DeepLabCutHDF5Reader(AnimalReader):
    """Reads DeepLabCut's HDF5: a frame of pandas, its columns named as the heads of its table."""

    format = "DeepLabCut HDF5"
    suffixes = (".h5", ".hdf5")

    def accepts(self, path: Path) -> bool:
        """Whether it holds a frame of pandas, or cannot be looked into, which is to be said."""
        try:
            with _opened(path) as file:
                return bool(_frames(file))
        except RecordingError:
            return True

    def _animals(self, path: Path, hints: Hints) -> Animals:
        with _opened(path) as file:
            frames = _frames(file)
            if not frames:
                raise bad_file(path, f"it holds {sorted(file)[:5]}", _EXPECTED)
            heads, at, values = _read_frame(path, frames[0])
        columns: dict[str, dict[str, dict[str, int]]] = {}
        for k, (*above, part, coord) in enumerate(heads):
            animal = above[-1] if len(above) > 1 else ""  # below the scorer
            columns.setdefault(animal, {}).setdefault(part, {})[coord.lower()] = k
        table = by_frame(path, at, values)
        return Animals.in_columns(path, table, columns, hints, Findings(self.format))


class SLEAPHDF5Reader(AnimalReader):
    """Reads the HDF5 that SLEAP exports for analysis: arrays of tracks, and names of nodes."""

    format = "SLEAP HDF5"
    suffixes = (".h5", ".hdf5")

    def accepts(self, path: Path) -> bool:
        """Whether there are tracks, and names of nodes."""
        try:
            with _opened(path) as file:
                return {"tracks", "node_names"} <= set(file)
        except RecordingError:
            return False

    def _animals(self, path: Path, hints: Hints) -> Animals:
        with _opened(path) as file:
            nodes = _texts(_array(path, file["node_names"]))
            names = _texts(_array(path, file["track_names"])) if "track_names" in file else []
            tracks = _numbers(path, file["tracks"])
            order = _order(tracks.shape, len(nodes), len(names))
            if not order:
                raise bad_file(path, f"tracks of shape {tracks.shape}", f"{len(nodes)} nodes each")
            points = _in_order(tracks, order, "frame track node coord")
            coords = [*"xyz"[: points.shape[3]]]
            if "point_scores" in file:
                scores = _numbers(path, file["point_scores"])
                apart = " ".join(axis for axis in order.split() if axis != "coord")
                scores = _in_order(scores, apart, "frame track node")
                points = np.concatenate([points, scores[..., None]], axis=3)
                coords.append("score")
        n_frames, n_tracks = points.shape[:2]
        animals = names or [f"track_{k}" if n_tracks > 1 else "" for k in range(n_tracks)]
        place = np.arange(np.prod(points.shape[1:])).reshape(points.shape[1:])
        columns = {
            animal: {
                node: dict(zip(coords, place[a, n].tolist(), strict=True))
                for n, node in enumerate(nodes)
            }
            for a, animal in enumerate(animals)
        }
        table = points.reshape(n_frames, -1)
        return Animals.in_columns(path, table, columns, hints, Findings(self.format))


def hdf5_readers() -> tuple[AnimalReader, ...]:
    """Return the readers of HDF5; none where h5py (extra ``hdf5``) is not installed."""
    if importlib.util.find_spec("h5py") is None:
        return ()
    return DeepLabCutHDF5Reader(), SLEAPHDF5Reader()


@contextmanager
def _opened(path: Path) -> Iterator[Any]:
    """Open a file, plain or packed, or in an archive.

    Raises:
        RecordingError: It is none of HDF5, or damaged.
    """
    h5py = require("h5py", "hdf5")
    source: Path | io.BytesIO = path
    if not _is_plain(path):
        data = read_bytes(path)
        if not data.startswith(_SIGNATURE):
            raise bad_file(path, "it is no HDF5", _EXPECTED)
        source = io.BytesIO(data)
    try:
        with h5py.File(source, "r") as file:
            yield file
    except RecordingError:
        raise
    except _DAMAGE as error:
        raise bad_file(path, f"damaged ({error})", "whole HDF5") from error


def _is_plain(path: Path) -> bool:
    """Whether a file begins as HDF5 does, where it lies: then not all of it needs be read."""
    try:
        with path.open("rb") as file:
            return file.read(len(_SIGNATURE)) == _SIGNATURE
    except (OSError, ValueError):
        return False


def _numbers(path: Path, found: Any) -> FloatArray:
    """Return an array of numbers, NaN where they are not finite."""
    values = _array(path, found).astype(np.float64)
    values[np.isinf(values)] = np.nan
    return np.asarray(values)


def _array(path: Path, found: Any) -> Any:
    """Return an array, unless the file is far too small for it."""
    if found.nbytes > most_unpacked(found.file.id.get_filesize()):
        raise bad_file(path, f"{found.name} expands to {found.nbytes} bytes", "measured points")
    return np.asarray(found[()])


def _texts(names: Any) -> list[str]:
    """Return names as texts."""
    return [
        name.decode("utf-8", "replace") if isinstance(name, bytes) else str(name)
        for name in names.ravel().tolist()
    ]


def _order(shape: tuple[int, ...], n_nodes: int, n_tracks: int) -> str:
    """Return what the axes of tracks are, by how long they are; nothing where they fit nowhere."""
    for order in _ORDERS:
        sizes = dict(zip(order.split(), shape, strict=False))
        fits = len(shape) == len(sizes) and n_tracks in (0, sizes["track"])
        if fits and sizes["node"] == n_nodes and sizes["coord"] in (2, 3):
            return order
    return ""


def _in_order(array: FloatArray, order: str, wanted: str) -> FloatArray:
    """Return an array with its axes in another order."""
    axes = order.split()
    return np.moveaxis(array, [axes.index(axis) for axis in wanted.split()], range(len(axes)))


def _frames(file: Any) -> list[Any]:
    """Return the frames of pandas in a file; a link in it may lead nowhere."""
    groups = [each for each in map(file.get, file) if each is not None]
    return [each for each in groups if _plain(each.attrs.get("pandas_type")) in _FRAMES]


def _plain(value: Any) -> bytes:
    """Return what an attribute says, as bytes."""
    return value.encode() if isinstance(value, str) else bytes(value or b"")


_Heads = list[tuple[str, ...]]


def _read_frame(path: Path, frame: Any) -> tuple[_Heads, FloatArray, FloatArray]:
    """Return a frame of pandas: heads of its columns, its index (T,), and its values (T, C)."""
    heads: list[Any] = []
    blocks = []
    if "table" in frame:
        rows = _array(path, frame["table"])
        at = rows["index"]
        for name in rows.dtype.names:
            kind = frame["table"].attrs.get(f"{name}_kind")
            if name.startswith("values_block_") and kind is not None:
                heads += _unpickled(_plain(kind))
                blocks.append(rows[name].reshape(len(rows), -1))
    else:
        at = _array(path, frame["axis1"]) if "axis1" in frame else np.zeros((0, 0))
        for k in range(int(frame.attrs["nblocks"])):
            heads += _levels(path, frame, f"block{k}_items")
            blocks.append(_array(path, frame[f"block{k}_values"]))
    known = all(
        isinstance(head, tuple) and len(head) > 1 and all(isinstance(each, str) for each in head)
        for head in heads
    )
    numbered = at.ndim == 1 and at.dtype.kind in "iuf"
    if not (known and heads and numbered and {h[-1].lower() for h in heads} <= COORDS):
        raise bad_file(path, "a frame of pandas that is no track of key points", _EXPECTED)
    values = np.concatenate(blocks, axis=1).astype(np.float64)
    values[np.isinf(values)] = np.nan
    if values.shape != (len(at), len(heads)):
        raise bad_file(path, f"{values.shape[1]} columns with {len(heads)} heads", "one head each")
    return heads, at.astype(np.float64), values


def _levels(path: Path, frame: Any, name: str) -> list[Any]:
    """Return an index of several levels that pandas has written."""
    levels = []
    for k in range(int(frame.attrs.get(f"{name}_nlevels", 0))):
        texts = _texts(_array(path, frame[f"{name}_level{k}"]))
        levels.append([texts[i] for i in _array(path, frame[f"{name}_label{k}"]).tolist()])
    return list(zip(*levels, strict=True))


class _Unpickler(pickle._Unpickler):
    """Makes lists and texts, and nothing that has to be found by name.

    In Python: in C what is remembered is an array, which damage can make as large as memory. So it
    can an array of bytes, which is made before it is read.
    """

    dispatch = {  # noqa: RUF012
        code: load
        for code, load in pickle._Unpickler.dispatch.items()
        if code != pickle.BYTEARRAY8[0]
    }

    def find_class(self, module_name: str, global_name: str) -> Any:
        raise pickle.UnpicklingError(f"{module_name}.{global_name} among names of columns")


def _unpickled(data: bytes) -> list[Any]:
    """Return a list that pandas has pickled."""
    found = _Unpickler(io.BytesIO(data)).load()
    if not isinstance(found, list):
        raise pickle.UnpicklingError(f"{type(found).__name__} among names of columns")
    return found
