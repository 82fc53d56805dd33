"""C3D: binary files of optical systems [C3D]."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from ..errors import InvalidValueError
from ..recording import FloatArray, Recording, marker_channels
from .c3d_file import C3DContent, parse_c3d
from .files import bad_file, read_bytes, stem
from .reader import Hints, Reader
from .space import checked_markers, file_axes, to_z_up, unit_m

_MODEL_OUTPUTS = ("ANGLES", "FORCES", "MOMENTS", "POWERS", "SCALARS", "MODELED_MARKERS")


class C3DReader(Reader):
    """Reads the markers of C3D files; analog channels and model outputs are left out.

    Unit and axes are the file's (``POINT:UNITS``, ``POINT:X_SCREEN`` and ``Y_SCREEN``, z up without
    these). A subject's prefix falls away (``Anna:LASI`` -> ``LASI``) where there is one subject.
    """

    suffixes = (".c3d",)

    def read(self, path: Path, hints: Hints, *, positions: bool) -> Recording:
        """Read the markers; see `Reader.read`."""
        content = parse_c3d(path, read_bytes(path))
        labels = _labels(path, content)
        outputs = {name for kind in _MODEL_OUTPUTS for name in content.texts("POINT", kind)}
        # Vicon names a trajectory that it could not identify "*1", "*2", ...
        kept = [i for i, name in enumerate(labels) if name not in outputs and name[:1] != "*"]
        names = _plain_names(path, tuple(labels[i] for i in kept))
        if not names:
            raise bad_file(path, "no marker with a name", "at least one")

        unit = hints.unit_m or unit_m(path, next(iter(content.texts("POINT", "UNITS")), "mm"))
        markers = content.points[:, kept] @ _axes(path, hints, content).T * unit
        checked_markers(path, markers, names)
        rates = content.numbers("POINT", "RATE")
        rate_hz = hints.rate_hz or (float(rates[0]) if len(rates) else content.rate_hz)
        if not 0.0 < rate_hz < np.inf:
            raise bad_file(path, f"POINT:RATE is {rate_hz}", "a positive number [1/s]")
        return Recording(
            frames=markers.reshape(len(markers), -1),
            rate_hz=rate_hz,
            channels=marker_channels(names),
            name=stem(path),
            person=next(iter(content.texts("SUBJECTS", "NAMES")), ""),
        )


def _labels(path: Path, content: C3DContent) -> list[str]:
    n_points = content.points.shape[1]
    parts = ("LABELS", *(f"LABELS{i}" for i in range(2, 10)))  # one holds 255 names at most
    labels = [name for part in parts for name in content.texts("POINT", part)]
    if len(labels) < n_points:
        raise bad_file(path, f"{len(labels)} names for {n_points} points", "a name for each")
    return labels[:n_points]


def _plain_names(path: Path, labels: tuple[str, ...]) -> tuple[str, ...]:
    prefixes = {name.split(":")[0] for name in labels if ":" in name}
    names = tuple(name.split(":")[-1] for name in labels) if len(prefixes) == 1 else labels
    if len(set(names)) != len(names) or not all(names):
        twice = sorted({name for name in names if names.count(name) > 1})
        raise bad_file(path, f"marker names {twice[:5]} more than once", "a name for each marker")
    return names


def _axes(path: Path, hints: Hints, content: C3DContent) -> FloatArray:
    up = next(iter(content.texts("POINT", "Y_SCREEN")), "")
    forward = next(iter(content.texts("POINT", "X_SCREEN")), "")
    if hints.up_axis is not None or not up or not forward:
        return file_axes(hints.up_axis, "z", "x")
    try:
        return to_z_up(up, forward)
    except InvalidValueError as error:
        raise bad_file(path, f"POINT:X_SCREEN and Y_SCREEN: {error}", "two axes") from error
