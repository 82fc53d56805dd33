"""C3D: binary files of optical systems, read with ezc3d [ezc3d]."""

from __future__ import annotations

import tempfile
from pathlib import Path
from typing import Any

import numpy as np

from ..errors import InvalidValueError
from ..recording import FloatArray, Recording, marker_channels
from .c3d_layout import check_layout
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
        data = read_bytes(path)
        check_layout(path, data)
        points, parameters = _parse(path, data)
        labels = _labels(path, parameters, points.shape[1])
        outputs = {name for kind in _MODEL_OUTPUTS for name in _texts(parameters, "POINT", kind)}
        # Vicon names a trajectory that it could not identify "*1", "*2", ...
        kept = [i for i, name in enumerate(labels) if name not in outputs and name[:1] != "*"]
        names = _plain_names(path, tuple(labels[i] for i in kept))
        if not names or not len(points):
            raise bad_file(
                path, f"{len(names)} markers, {len(points)} frames", "at least one of each"
            )

        unit = hints.unit_m or unit_m(path, next(iter(_texts(parameters, "POINT", "UNITS")), "mm"))
        markers = points[:, kept] @ _axes(path, hints, parameters).T * unit
        checked_markers(path, markers, names)
        rate = _values(parameters, "POINT", "RATE")
        rate_hz = hints.rate_hz or (float(rate[0]) if len(rate) else 0.0)
        if not 0 < rate_hz < np.inf:
            raise bad_file(path, f"POINT:RATE is {rate_hz}", "a positive number [1/s]")
        return Recording(
            frames=markers.reshape(len(markers), -1),
            rate_hz=rate_hz,
            channels=marker_channels(names),
            name=stem(path),
            person=next(iter(_texts(parameters, "SUBJECTS", "NAMES")), ""),
        )


def _parse(path: Path, data: bytes) -> tuple[FloatArray, Any]:
    import ezc3d

    with tempfile.TemporaryDirectory() as folder:
        plain = Path(folder) / "recording.c3d"
        plain.write_bytes(data)
        try:
            content = ezc3d.c3d(str(plain))
            # (3, M, T) -> (T, M, 3)
            points = np.array(content["data"]["points"][:3], dtype=np.float64).transpose(2, 1, 0)
            residuals = np.array(content["data"]["meta_points"]["residuals"][0]).T  # (T, M)
            parameters = content["parameters"]
        except Exception as error:  # the C++ parser throws whatever it meets
            raise bad_file(path, f"damaged ({error})", "a C3D file with points") from error
    gone = (residuals < 0) | (points == 0.0).all(axis=2) | ~np.isfinite(points).all(axis=2)
    points[gone] = np.nan
    return points, parameters


def _values(parameters: Any, group: str, name: str) -> Any:
    return parameters.get(group, {}).get(name, {}).get("value", [])


def _texts(parameters: Any, group: str, name: str) -> list[str]:
    return [text.strip() for text in _values(parameters, group, name) if isinstance(text, str)]


def _labels(path: Path, parameters: Any, n_points: int) -> list[str]:
    labels: list[str] = []
    for part in ("LABELS", *(f"LABELS{i}" for i in range(2, 10))):
        labels.extend(_texts(parameters, "POINT", part))
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


def _axes(path: Path, hints: Hints, parameters: Any) -> FloatArray:
    up = next(iter(_texts(parameters, "POINT", "Y_SCREEN")), "")
    forward = next(iter(_texts(parameters, "POINT", "X_SCREEN")), "")
    if hints.up_axis is not None or not up or not forward:
        return file_axes(hints.up_axis, "z", "x")
    try:
        return to_z_up(up, forward)
    except InvalidValueError as error:
        raise bad_file(path, f"POINT:X_SCREEN and Y_SCREEN: {error}", "two axes") from error
