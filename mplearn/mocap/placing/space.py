"""From a file's axes and unit of length to metres, z up, x forward, y left."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from ...errors import InvalidValueError
from ...option_names import option
from ...recording import FloatArray
from ..files import bad_file
from ..findings import Findings
from ..reader import DIRECTIONS, Hints
from .hanging import hanging, trees_of
from .size import UNITS_M, Unit, find_unit, spread_of
from .vertical import find_vertical

_FARTHEST_M = 100.0  # no capture volume is larger
_SMALLEST_M = 0.02  # all markers of a body within less: not a body
_MANY = 10  # markers; fewer may be a hand's
_THIN_M = 1e-3  # no body is thinner
_LOOK = 100  # frames
_FEW = 3  # markers; about fewer the file alone can tell


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


def upright(up: str) -> FloatArray:
    """Return the smallest turn that makes a file's axis, one of `DIRECTIONS`, ours that is up."""
    return to_z_up(up, {"x": "-z", "-x": "z"}.get(up, "x"))


def file_axes(up_hint: str | None, up: str, forward: str) -> FloatArray:
    """Return `to_z_up` for a format's axes, or for a hinted vertical with the next axis forward."""
    if up_hint is None or up_hint == up:
        return to_z_up(up, forward)
    following = {"x": "y", "y": "z", "z": "x"}
    return to_z_up(up_hint, following[up_hint]) if up_hint in following else upright(up_hint)


@dataclass(frozen=True)
class Space:
    """What a file, or its format, says of its lengths and axes.

    Attributes:
        unit_m: Length of the unit [m].
        up: The axis that points up.
        forward: The axis that points forward.
        says_unit: Whether the file itself names the unit, not only its format.
        says_up: Whether the file itself names the axes.

    Example:
        >>> space = Space(unit_m=0.001, up="y", says_unit=False)  # millimetres, most likely
        >>> space.up, space.forward
        ('y', 'x')
    """

    unit_m: float
    up: str = "z"
    forward: str = "x"
    says_unit: bool = True
    says_up: bool = False


@dataclass(frozen=True, eq=False)
class Placed:
    """Points in metres, z up, and how they came to be so.

    Attributes:
        points: Shape (T, M, 3) [m].
        unit_m: Length of the file's unit [m].
        up: The file's axis that points up.
        axes: Rotation from the file's axes to ours, shape (3, 3).
    """

    points: FloatArray
    unit_m: float
    up: str
    axes: FloatArray


def placed(
    path: Path,
    points: FloatArray,
    names: tuple[str, ...],
    rate_hz: float,
    space: Space,
    hints: Hints,
    findings: Findings,
    sized: Unit | None = None,
    parents: Sequence[int] | None = None,
) -> Placed:
    """Return a file's points in metres, z up, x forward where that is known, never mirrored.

    Hints win; then what the file says, unless the person's size or posture contradicts it; what
    was found out otherwise, or stays in doubt, is added to the findings.

    Args:
        path: The file, for messages.
        points: In the file's unit and axes, shape (T, M, 3); NaN where missing.
        names: Names of the points, length M.
        rate_hz: Frames per second [1/s].
        space: What the file or its format says.
        hints: What the caller says.
        findings: Where to tell what was found.
        sized: The unit by the size of the person, where the caller knows better than `find_unit`.
        parents: Index of each point's parent, -1 for a root, where they are a skeleton's joints:
            its largest tree tells what is up.

    Raises:
        RecordingError: No person can be meant by the points.

    Example:
        >>> points = np.array([[[0.0, 1700.0, 30.0], [80.0, 960.0, 0.0], [90.0, 80.0, 20.0]]])
        >>> names, findings = ("head", "hip", "ankle"), Findings("ours")
        >>> space = Space(0.001, "y", "z")  # millimetres, y up, z ahead
        >>> at = placed(Path("take.abc"), points, names, 100.0, space, Hints(), findings)
        >>> at.points[0].tolist()
        [[0.03, 0.0, 1.7], [0.0, 0.08, 0.96], [0.02, 0.09, 0.08]]
    """
    unit = hints.unit_m or _settled_unit(points, names, space, findings, sized)
    metres = checked_markers(path, points if unit == 1.0 else points * unit, names)
    _warn_of_flat(metres, findings)
    usual = ("x", "y", "z") if sized else DIRECTIONS  # cameras have theirs as they hang
    body = range(len(names)) if parents is None else _largest_tree(metres, parents)
    up = hints.up_axis or _settled_up(
        metres[:, body], tuple(names[k] for k in body), rate_hz, space, findings, usual
    )
    turn = to_z_up(up, space.forward) if up == space.up else upright(up)
    turned = metres if np.array_equal(turn, np.eye(3)) else metres @ turn.T
    return Placed(turned, unit, up, turn)


def _largest_tree(metres: FloatArray, parents: Sequence[int]) -> list[int]:
    """Return the joints of the largest tree: not a root on the floor, or far away, nor props."""
    kept, _ = hanging(metres[:: max(1, len(metres) // _LOOK)], parents)
    return max(trees_of(kept).values(), key=len)


def _warn_of_flat(metres: FloatArray, findings: Findings) -> None:
    """Warn where all points lie in one plane of the axes, as points of a picture do."""
    if metres.shape[1] < _MANY:
        return
    some = metres[:: max(1, len(metres) // 200)]
    some = some[~np.isnan(some).any(axis=2)]
    thin = np.ptp(some, axis=0) < _THIN_M if len(some) else np.zeros(3, dtype=np.bool_)
    if thin.any() and not thin.all():
        findings.warn(
            f"all points have the same {'xyz'[int(thin.argmax())]}: they seem to be those of a "
            "picture, without depth, and how somebody is turned cannot be told from them"
        )


def _settled_unit(
    points: FloatArray,
    names: tuple[str, ...],
    space: Space,
    findings: Findings,
    sized: Unit | None,
) -> float:
    found = sized or find_unit(points, names, space.unit_m, says_so=space.says_unit)
    taken = f"the unit of length is taken as {unit_text(found.unit_m)}"
    rival = "" if found.rival_m is None else f"; {unit_text(found.rival_m)} would fit as well"
    if found.contradicts:
        said = f"{'the file says' if space.says_unit else 'usual is'} {unit_text(space.unit_m)}"
        tell = findings.warn if space.says_unit or found.close else findings.note
        sets = f"({option('unit_m')} sets it)"
        tell(f"{taken}, by the size of the person; {said}{rival} {sets}")
    elif found.doubtful and len(names) >= _MANY:
        close = spread_of(points) * found.unit_m < 0.2
        findings.warn(
            f"{taken}, by which the points are {'close together' if close else 'far apart'} for a "
            f"person's; {option('unit_m')} settles it"
        )
    elif rival:
        tell = findings.warn if found.close else findings.note
        tell(f"{taken}, as is usual{rival}: {option('unit_m')} settles it")
    elif sized is not None and not found.fits:
        findings.warn(f"{taken}, though nobody is as large: {option('unit_m')} settles it")
    elif not space.says_unit and found.fits:
        findings.note(f"{taken}: it fits a person")
    return found.unit_m


def _settled_up(
    metres: FloatArray,
    names: tuple[str, ...],
    rate_hz: float,
    space: Space,
    findings: Findings,
    usual: tuple[str, ...],
) -> str:
    found = find_vertical(metres, names, rate_hz, space.up, says_so=space.says_up)
    if found.contradicts:  # where a skeleton's is turned round, somebody may stand on the hands
        tell = findings.warn if space.says_up or found.up not in usual else findings.note
        said = "the file says" if space.says_up else "usual in the format is"
        tell(
            f"{found.up} is taken as the vertical axis, by feet, head and floor; {said} {space.up} "
            f"({option('up_axis')} sets it)"
        )
    told = space.says_up and not found.contradicts and not found.inverted
    if found.doubtful and not told and len(names) >= _FEW:
        findings.up_in_doubt = True
        findings.warn(f"whether {found.up} points up is in doubt; {option('up_axis')} settles it")
    return found.up


def unit_text(unit_m: float) -> str:
    """Return the name of a unit, or its length where it has none."""
    return next((name for name, length in UNITS_M.items() if length == unit_m), f"{unit_m:.6g} m")


def checked_markers(path: Path, points: FloatArray, names: tuple[str, ...]) -> FloatArray:
    """Return marker positions, shape (T, M, 3) [m], if a person can be meant by them.

    Raises:
        RecordingError: Nothing was measured, in most frames a marker lies 100 m away, or all lie
            within 2 cm.
    """
    measured = np.isfinite(points).any(axis=(1, 2))
    if not measured.any():
        raise bad_file(path, "no marker was ever seen", "measured positions")
    far = ((points > _FARTHEST_M) | (points < -_FARTHEST_M)).any(axis=(1, 2))
    if 2 * np.count_nonzero(far) > np.count_nonzero(measured):  # a few frames are the learner's
        size = np.abs(points)
        frame, marker, _ = np.unravel_index(np.nanargmax(size), size.shape)
        raise bad_file(
            path,
            f"marker {names[marker]!r} is {np.nanmax(size):.3g} m away in frame {frame}",
            f"less than {_FARTHEST_M:g} m; is the unit of length right? {option('unit_m')} sets it",
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
                f"({option('unit_m')} sets it)",
            )
    return points


def _axis(name: str) -> FloatArray:
    letter = name.lower().removeprefix("+")
    sign = -1.0 if letter.startswith("-") else 1.0
    letter = letter.removeprefix("-")
    if letter not in ("x", "y", "z"):
        raise InvalidValueError(f"an axis is x, y or z, with a sign or without, not {name!r}")
    unit: FloatArray = sign * np.eye(3)["xyz".index(letter)]
    return unit
