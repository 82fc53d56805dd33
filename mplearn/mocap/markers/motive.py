"""OptiTrack Motive's CSV: rows of types, names and ids above the frames [Motive].

Versions 1.2x, 2.x and 3.x. Markers are read: labelled ones, of skeletons and rigid bodies too;
without any, the positions of bones. Rotations, mean errors and rigid bodies are left out.
"""

from __future__ import annotations

from pathlib import Path

from ...recording import Recording
from ..files import bad_file, head_text, read_text
from ..findings import Findings
from ..numbers import number
from ..placing.size import named_unit
from ..placing.space import Space
from ..reader import Hints, Reader
from .blocks import Block, marker_columns, read_block
from .sheet import Sheet

_HEADER_LINES = 12
_KINDS = {
    *("marker", "bone", "rigid body", "bone marker", "rigid body marker", "skeleton marker"),
    "unlabeled marker",
}
_WANTED = (  # what to read, the best first
    ("marker",),
    ("rigid body marker", "bone marker", "skeleton marker"),
    ("bone",),
)


class MotiveReader(Reader):
    """Reads the markers of Motive's exports: y up."""

    format = "Motive CSV"
    suffixes = (".csv",)

    def accepts(self, path: Path) -> bool:
        """Whether the file begins with ``Format Version``, or with the row of types below it."""
        text = head_text(path).lstrip('\ufeff"\r\n')
        cells = text.split("\n", 1)[0].replace('"', "").strip().split(",")
        types = {cell.strip().lower() for cell in cells} - {"", "type"}
        return text.startswith("Format Version") or bool(types and types <= _KINDS)

    def read(self, path: Path, hints: Hints, *, positions: bool) -> Recording:
        """Read the markers; see `Reader.read`."""
        findings = Findings(self.format)
        sheet = Sheet.of(path, read_text(path), separators=",;\t")
        said = _header(sheet)
        block = _block(sheet, findings)
        rate = said.get("export frame rate") or said.get("capture frame rate") or ""
        unit = named_unit(said.get("length units", ""))
        space = Space(unit or 1.0, "y", "x", says_unit=unit is not None)
        said_hz = number(path, rate.replace(",", "."), "Export Frame Rate") if rate else None
        return read_block(sheet, block, said_hz, space, hints, findings)


def _header(sheet: Sheet) -> dict[str, str]:
    """Return the first line's names and values, which stand in turn."""
    cells = [cell.strip() for cell in sheet.cells(0)]
    names = [name.lower() for name in cells[::2]]
    return dict(zip(names, cells[1::2], strict=False))


def _block(sheet: Sheet, findings: Findings) -> Block:
    path = sheet.path
    n_lines = min(len(sheet.lines), _HEADER_LINES)
    above = [[cell.strip() for cell in sheet.cells(i)] for i in range(n_lines)]
    axes = next((i for i, row in enumerate(above) if row and row[0].lower() == "frame"), None)
    kinds = next((i for i, row in enumerate(above) if {c.lower() for c in row} & _KINDS), None)
    if axes is None or kinds is None or not kinds + 1 < axes:
        raise bad_file(path, "no rows of types, names and axes", "an export of Motive with markers")
    width = len(above[axes])
    rows = {
        "kind": [cell.lower() for cell in above[kinds]],
        "name": above[kinds + 1],
        "property": [cell.lower() for cell in above[axes - 1]],
    }
    kind, name, what = ((row + [""] * width)[:width] for row in rows.values())
    for wanted in _WANTED:
        kept = [
            kind[i] in wanted and what[i] in ("position", "") and bool(name[i])
            for i in range(width)
        ]
        if any(keep and _plain(name[i]) for i, keep in enumerate(kept)):
            break
    else:
        raise bad_file(path, "no markers and no bones", "an export of Motive with markers")
    tools = {f"{n}:" for n, k in zip(name, kind, strict=True) if k == "rigid body" and n}
    people = [keep and not name[i].startswith(tuple(tools)) for i, keep in enumerate(kept)]
    kept = people if any(people) else kept
    # a name counts only where the column is of the kind that is wanted
    chosen = [cell if keep else "" for cell, keep in zip(above[axes], kept, strict=True)]
    names, columns = marker_columns(name, chosen)
    left = {
        n: None
        for n, k, keep in zip(name, kind, kept, strict=True)
        if n and not keep and k in _KINDS
    }
    findings.leave_out(n for n in left if n not in names)
    if wanted == ("bone",):
        findings.note("there are no markers: the positions of bones are read")
    time = next((i for i, cell in enumerate(above[axes]) if cell.lower().startswith("time")), None)
    return Block(
        tuple(_plain(n) for n in names), columns, axes + 1, len(sheet.lines), width, time, 0
    )


def _plain(name: str) -> str:
    """Return a marker's name: markers that have only a number are not identified."""
    return "" if name.lower().startswith("unlabeled") else name
