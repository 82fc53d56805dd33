"""Tables of key points: those of DeepLabCut [Mathis2018] and of SLEAP [Pereira2022], as CSV."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from ...errors import RecordingError
from ...recording import FloatArray, Recording
from ..files import bad_file, head_text, read_text, stem
from ..findings import Findings
from ..numbers import numbers
from ..options import option
from ..reader import Hints, Reader
from .egocentric import seen_from_the_body

_HEADS = frozenset(("scorer", "individuals", "bodyparts", "coords"))
USUAL_HZ = 30.0
"""Pictures a second where nobody says how many [1/s]."""


class DeepLabCutReader(Reader):
    """Reads DeepLabCut's tables: rows of heads, scorer, (individuals,) bodyparts and coords."""

    format = "DeepLabCut"
    suffixes = (".csv",)

    def accepts(self, path: Path) -> bool:
        """Whether the first head is that of the scorer."""
        return head_text(path).lower().startswith("scorer,")

    def read(self, path: Path, hints: Hints, *, positions: bool) -> Recording:
        """Read the animal that was seen most; see `Reader.read`."""
        rows = _cells(path)
        heads = {}
        while rows and rows[0][1][0].lower() in _HEADS:
            name, *head = rows.pop(0)[1]
            heads[name.lower()] = head
        if not {"bodyparts", "coords"} <= heads.keys() or not rows:
            raise bad_file(path, "no rows of key points", "heads scorer, bodyparts and coords")
        parts, coords = heads["bodyparts"], heads["coords"]
        animals = heads.get("individuals", [""] * len(parts))
        values = numbers(path, [row for _, row in rows], 1 + len(parts), [n for n, _ in rows])[
            :, 1:
        ]
        columns: dict[str, dict[str, dict[str, int]]] = {}
        for k, (animal, part, coord) in enumerate(zip(animals, parts, coords, strict=False)):
            columns.setdefault(animal, {}).setdefault(part, {})[coord.lower()] = k
        tracks = {
            animal: _points(path, values, points, ("x", "y", "z"), "likelihood")
            for animal, points in columns.items()
        }
        return _recording(path, tracks, hints, Findings(self.format))


class SLEAPReader(Reader):
    """Reads SLEAP's analysis tables: a row for each frame and track."""

    format = "SLEAP"
    suffixes = (".csv",)

    def accepts(self, path: Path) -> bool:
        """Whether the first columns are track and frame_idx."""
        return head_text(path).lower().replace(" ", "").startswith("track,frame_idx,")

    def read(self, path: Path, hints: Hints, *, positions: bool) -> Recording:
        """Read the track that was seen most; see `Reader.read`."""
        rows = _cells(path)
        head, body = rows[0][1] if rows else [], rows[1:]
        points: dict[str, dict[str, int]] = {}
        for k, name in enumerate(head):
            part, dot, coord = name.rpartition(".")
            if dot and part != "instance":
                points.setdefault(part, {})[coord.lower()] = k - 1
        lines = [line for line, _ in body]
        table = numbers(path, [row[1:] for _, row in body], len(head) - 1, lines)
        at = table[:, 0]
        if not len(at) or np.isnan(at).any() or at.min() < 0 or np.ptp(at) > 100 * len(at) + 1000:
            raise bad_file(path, "no frames, or numbers far apart", "frames one after the other")
        frames = np.rint(at - at.min()).astype(np.int64)
        names = np.array([row[0] for _, row in body])
        tracks = {}
        for track in dict.fromkeys(names.tolist()):
            whole = np.full((int(frames.max()) + 1, table.shape[1]), np.nan)
            whole[frames[names == track]] = table[names == track]
            tracks[track] = _points(path, whole, points, ("x", "y", "z"), "score")
        return _recording(path, tracks, hints, Findings(self.format))


def _cells(path: Path) -> list[tuple[int, list[str]]]:
    """Return the cells of each line that holds any, and the line's number."""
    lines = enumerate(read_text(path).splitlines(), start=1)
    rows = ((n, [cell.strip().strip('"') for cell in line.split(",")]) for n, line in lines)
    return [(n, row) for n, row in rows if any(row)]


Track = tuple[FloatArray, tuple[str, ...], FloatArray | None]


def _points(
    path: Path,
    values: FloatArray,
    columns: dict[str, dict[str, int]],
    axes: tuple[str, ...],
    sure: str,
) -> Track:
    """Return points, shape (T, K, 2 or 3), their names, and how likely each is, shape (T, K)."""
    n_axes = 3 if all("z" in own for own in columns.values()) else 2
    whole = {name: own for name, own in columns.items() if set(axes[:n_axes]) <= own.keys()}
    if not whole:
        raise bad_file(path, "no key point with x and y", "columns x, y (and z) for each point")
    points = np.stack(
        [values[:, [own[axis] for axis in axes[:n_axes]]] for own in whole.values()], axis=1
    )
    if n_axes == 2:
        points[..., 1] *= -1.0  # a picture's rows are counted downwards
    likely = None
    if all(sure in own for own in whole.values()):
        likely = np.nan_to_num(values[:, [own[sure] for own in whole.values()]])
    return points, tuple(whole), likely


def _recording(path: Path, tracks: dict[str, Track], hints: Hints, findings: Findings) -> Recording:
    rate_hz = hints.rate_hz
    if rate_hz is None:
        rate_hz = USUAL_HZ
        findings.note(
            f"the file does not say how many pictures there are a second: taken as {USUAL_HZ:g}; "
            f"{option('rate_hz')} settles it"
        )
    seen = {name: int(np.isfinite(track[0]).all(axis=2).sum()) for name, track in tracks.items()}
    name = max(seen, key=lambda each: seen[each])
    if len(tracks) > 1:
        others = [each for each in tracks if each != name]
        findings.note(f"of {len(tracks)} animals the one that was seen most: {name}")
        findings.leave_out(others)
    points, names, likelihood = tracks[name]
    try:
        frames, channels, length = seen_from_the_body(points, names, rate_hz, likelihood)
    except RecordingError as error:
        raise bad_file(path, str(error), "key points of a body") from error
    findings.note(f"key points along the body's heading, in body lengths of {length:.4g}")
    findings.leave_out(each for each in names if f"{each}.ahead" not in channels)
    return Recording(frames, rate_hz, channels, stem(path), name, report=findings.report(rate_hz))
