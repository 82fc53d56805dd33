"""Vicon Nexus's ASCII export: blocks of devices, model outputs and trajectories [Nexus].

A block begins with its title and its rate; the trajectories' has names above, then axes and units.
"""

from __future__ import annotations

import re
from pathlib import Path

from ...recording import Recording
from ..files import bad_file, head_text, read_text
from ..findings import Findings
from ..placing.size import named_unit
from ..placing.space import Space
from ..reader import Hints, Reader
from .blocks import Block, marker_columns, read_block
from .sheet import Sheet, is_number

_TITLE = "trajectories"
_TITLES = (
    _TITLE, "devices", "model outputs", "segments", "joints", "events", "analog", "global angles",
    "local angles", "forces",
)  # fmt: skip
_RATE = re.compile(r"\s*(\d+(?:[.,]\d+)?)\s*(?:,?\s*hz)?[\s,;]*", re.I)


class NexusReader(Reader):
    """Reads the trajectories of Nexus's exports (CSV or tab-separated): z up, millimetres."""

    format = "Nexus CSV"
    suffixes = (".csv", ".tsv", ".txt")

    def accepts(self, path: Path) -> bool:
        """Whether the file begins with the title of a block, and its rate."""
        lines = head_text(path).lstrip("\ufeff\r\n \t,;").splitlines()[:2]
        return len(lines) == 2 and _title(lines[0]) in _TITLES and bool(_RATE.fullmatch(lines[1]))

    def read(self, path: Path, hints: Hints, *, positions: bool) -> Recording:
        """Read the trajectories; see `Reader.read`."""
        findings = Findings(self.format)
        sheet = Sheet.of(path, read_text(path))
        titles = [i for i, line in enumerate(sheet.lines) if _title(line) in _TITLES]
        start = next((i for i in titles if _title(sheet.lines[i]) == _TITLE), None)
        if start is None or start + 4 > len(sheet.lines):
            raise bad_file(path, "no block 'Trajectories'", "an export of Nexus with trajectories")
        others = [_title(sheet.lines[i]) for i in titles if i != start]
        findings.leave_out(f"block {name!r}" for name in others)
        rate = _RATE.fullmatch(sheet.lines[start + 1])
        block, unit = _block(sheet, start + 2)
        space = Space(unit or 0.001, says_unit=unit is not None)
        said_hz = float(rate[1].replace(",", ".")) if rate else None
        return read_block(sheet, block, said_hz, space, hints, findings)


def _title(line: str) -> str:
    return line.strip(' \t\r\n,;\ufeff"').lower()


def _block(sheet: Sheet, line: int) -> tuple[Block, float | None]:
    names = [cell.strip() for cell in sheet.cells(line)]
    axes = [cell.strip() for cell in sheet.cells(line + 1)]
    first = line + 2
    unit = None
    if first < len(sheet.lines) and not any(map(is_number, sheet.cells(first))):
        texts = {cell.strip() for cell in sheet.cells(first) if cell.strip()}
        units = {unit for unit in map(named_unit, texts) if unit is not None}
        unit = units.pop() if len(units) == 1 else None
        first += 1
    stop = next((i for i in range(first, len(sheet.lines)) if not _filled(sheet, i)), None)
    found, columns = marker_columns(names, axes)
    frame = 0 if axes and axes[0].lower().startswith(("frame", "field")) else None
    width = max((i + 1 for i, axis in enumerate(axes) if axis), default=0)
    stop = len(sheet.lines) if stop is None else stop
    return Block(found, columns, first, stop, width, None, frame), unit


def _filled(sheet: Sheet, line: int) -> bool:
    return bool(sheet.lines[line].strip(" \t,;\r"))
