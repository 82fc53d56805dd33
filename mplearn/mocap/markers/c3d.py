"""C3D: binary files of optical systems [C3D]."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np

from ...errors import InvalidValueError
from ...option_names import option
from ...recording import FloatArray, Recording
from ..files import bad_file, read_bytes
from ..findings import Findings
from ..placing.placed_markers import placed_markers
from ..placing.size import said_unit
from ..placing.space import Space, to_z_up
from ..rates import rate_beside
from ..reader import Hints, Reader
from .c3d_file import C3DContent, parse_c3d
from .names import chosen_names

_MODEL_OUTPUTS = ("ANGLES", "FORCES", "MOMENTS", "POWERS", "SCALARS", "MODELED_MARKERS")
_OUTPUT_NAME = re.compile(r".*(Angles?|Forces?|Moments?|Powers?)$")
_SQUARE = 0.05  # cosine between two axes of a bone, at most


class C3DReader(Reader):
    """Reads the markers of C3D files; analog channels and model outputs are left out.

    Unit and axes are the file's (``POINT:UNITS``, ``POINT:X_SCREEN`` and ``Y_SCREEN``; millimetres
    and z up are usual without these). A subject's prefix falls away (``Anna:LASI`` -> ``LASI``)
    where there is one subject.
    """

    format = "C3D"
    suffixes = (".c3d",)

    def read(self, path: Path, hints: Hints, *, positions: bool) -> Recording:
        """Read the markers; see `Reader.read`."""
        findings = Findings(self.format)
        content = parse_c3d(path, read_bytes(path))
        n_frames = len(content.points)
        if content.said_frames is not None:
            findings.warn(
                f"the header tells of {content.said_frames} frames, {n_frames} are there and read"
            )
        if content.unmeasured:
            findings.warn(
                "no point is said to be measured, in no frame: they are taken as they are"
            )
        space = space_of(path, hints, content)
        if not content.points.shape[1]:
            raise bad_file(path, "it holds no points", "a C3D file with markers")
        points, names = _measured(path, content, findings)
        rate_hz = hints.rate_hz or _rate(path, content, findings)
        person = next(iter(content.texts("SUBJECTS", "NAMES")), "")
        return placed_markers(path, points, names, rate_hz, space, hints, findings, person=person)


def _measured(
    path: Path, content: C3DContent, findings: Findings
) -> tuple[FloatArray, tuple[str, ...]]:
    """Return the points that were measured, in the file's unit, and their names."""
    n_points = content.points.shape[1]
    parts = ("LABELS", *(f"LABELS{i}" for i in range(2, 100)))  # one holds 255 names at most
    labels = [name for part in parts for name in content.texts("POINT", part)][:n_points]
    if len(labels) < n_points:
        findings.warn(f"{n_points - len(labels)} of {n_points} points have no name")
        labels += [""] * (n_points - len(labels))
    outputs = {name for kind in _MODEL_OUTPUTS for name in content.texts("POINT", kind)}
    outputs |= {name for name in labels if _OUTPUT_NAME.fullmatch(name)}
    outputs |= _bone_axes(content.points, labels)
    kept = [i for i, name in enumerate(labels) if name not in outputs]
    findings.leave_out(name for name in labels if name and name in outputs)
    seen = (~np.isnan(content.points[:, kept]).any(axis=2)).sum(axis=0)
    chosen, names = chosen_names(path, [labels[i] for i in kept], seen, findings)
    return content.points[:, [kept[i] for i in chosen]], names


def _bone_axes(points: FloatArray, labels: list[str]) -> set[str]:
    """Return the names of points that draw a bone's axes, as Vicon's models write them.

    ``PELO`` is the origin, ``PELA``, ``PELL`` and ``PELP`` lie on the axes: at constant distances
    and at right angles.
    """
    index = {name: i for i, name in enumerate(labels)}
    found: set[str] = set()
    for name in labels:
        quadruple = [f"{name[:-1]}{end}" for end in "OALP"]
        if len(name) < 2 or name[-1] != "O" or not all(each in index for each in quadruple):
            continue
        origin, *ends = (points[:, index[each]] for each in quadruple)
        axes = np.stack(ends, axis=1) - origin[:, None]  # (T, 3, 3)
        axes = axes[~np.isnan(axes).any(axis=(1, 2))]
        length = np.linalg.norm(axes, axis=2)
        if not len(axes) or not (length > 0).all():
            continue
        unit = axes / length[..., None]
        cosine = np.abs(np.einsum("tij,tkj->tik", unit, unit) - np.eye(3)).max()
        steady = np.ptp(length / np.median(length, axis=0), axis=0).max() < 0.1
        if cosine < _SQUARE and steady:
            found.update(quadruple)
    return found


def _rate(path: Path, content: C3DContent, findings: Findings) -> float:
    said = [float(rate) for rate in content.numbers("POINT", "RATE")[:1]]
    rates = [rate for rate in (*said, content.rate_hz) if 0.0 < rate < np.inf]
    if not rates and (beside := rate_beside(path, findings)):
        return beside
    if not rates:
        raise bad_file(
            path, f"POINT:RATE is {said or 'missing'}", f"a rate [1/s], or {option('rate_hz')}"
        )
    if len(rates) == 2 and abs(rates[0] - rates[1]) > 0.01 * rates[0]:
        findings.warn(
            f"POINT:RATE says {rates[0]:g} Hz and is used, the header says {rates[1]:g} Hz"
        )
    return rates[0]


def space_of(path: Path, hints: Hints, content: C3DContent) -> Space:
    """Return what a C3D file says of its unit and axes.

    Raises:
        RecordingError: A unit that nobody knows, or axes that are none.
    """
    text = next(iter(content.texts("POINT", "UNITS")), "")
    unit = said_unit(path, text, hints)
    up = next(iter(content.texts("POINT", "Y_SCREEN")), "").lower().removeprefix("+")
    forward = next(iter(content.texts("POINT", "X_SCREEN")), "").lower().removeprefix("+")
    says_unit = unit is not None
    if not up or not forward:
        return Space(unit or 0.001, says_unit=says_unit)
    try:
        to_z_up(up, forward)
    except InvalidValueError as error:
        raise bad_file(path, f"POINT:X_SCREEN and Y_SCREEN: {error}", "two axes") from error
    return Space(unit or 0.001, up, forward, says_unit=says_unit, says_up=True)
