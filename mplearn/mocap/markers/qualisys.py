"""Qualisys Track Manager's TSV: lines of names and values, then a row for each frame [QTM]."""

from __future__ import annotations

from pathlib import Path

from ...recording import Recording
from ..files import bad_file, head_text, read_text
from ..findings import Findings
from ..numbers import number
from ..placing.space import Space
from ..reader import Hints, Reader
from .blocks import Block, marker_columns, read_block
from .columns import meaning_of
from .sheet import Sheet, is_number

_FIRST = "NO_OF_FRAMES"
_NAMES = "MARKER_NAMES"


class QualisysReader(Reader):
    """Reads the markers of QTM's TSV: z up, millimetres; missing is empty or (0, 0, 0)."""

    format = "Qualisys TSV"
    suffixes = (".tsv", ".txt")

    def accepts(self, path: Path) -> bool:
        """Whether the file begins with ``NO_OF_FRAMES``."""
        return head_text(path, 64).lstrip("\ufeff").startswith(_FIRST)

    def read(self, path: Path, hints: Hints, *, positions: bool) -> Recording:
        """Read the markers; see `Reader.read`."""
        findings = Findings(self.format)
        sheet = Sheet.of(path, read_text(path), separators="\t")
        said: dict[str, list[str]] = {}
        start = 0
        for line in range(len(sheet.lines)):
            cells = [cell.strip() for cell in sheet.cells(line)]
            if cells and cells[0].isupper() and not is_number(cells[0]):
                said[cells[0]] = cells[1:]
                start = line + 1
            elif any(cells):
                break
        if _FIRST not in said:
            raise bad_file(path, f"no {_FIRST}", "an export of QTM with its header")
        included = said.get("DATA_INCLUDED", ["3D"])[:1]
        if included != ["3D"]:
            raise bad_file(path, f"DATA_INCLUDED is {' '.join(included)!r}", "'3D': markers")
        block = _block(sheet, said, start)
        rate = next(iter(said.get("FREQUENCY", [])), "")
        said_hz = number(path, rate, "FREQUENCY") if rate else None
        n_frames = sum(bool(line.strip()) for line in sheet.lines[block.start :])
        if said[_FIRST][:1] != [str(n_frames)]:
            findings.warn(f"{_FIRST} is {said[_FIRST][:1]}, but {n_frames} are there and read")
        return read_block(
            sheet, block, said_hz, Space(0.001), hints, findings, zero_is_missing=True
        )


def _block(sheet: Sheet, said: dict[str, list[str]], start: int) -> Block:
    names = list(said.get(_NAMES, []))
    while names and not names[-1]:
        names.pop()
    if not names:
        return _named_columns(sheet, said, start)
    before = 0
    time = frame = None
    headed = start < len(sheet.lines) and not sheet.is_data(start)
    if headed:  # a row that names the columns: perhaps Frame and Time, then the axes
        cells = [cell.strip().lower() for cell in sheet.cells(start)]
        frame = cells.index("frame") if "frame" in cells else None
        time = cells.index("time") if "time" in cells else None
        before = sum(column is not None for column in (frame, time))
        start += 1
    elif start < len(sheet.lines):
        cells = sheet.cells(start)
        while cells and not cells[-1].strip():
            cells.pop()
        before = (len(cells) - 3 * len(names)) if len(cells) > 3 * len(names) else 0
        if before in (1, 2):
            frame = 0
            time = 1 if before == 2 else None
        else:
            before = 0
    columns = tuple((at, at + 1, at + 2) for at in range(before, before + 3 * len(names), 3))
    width = before + 3 * len(names)
    return Block(tuple(names), columns, start, len(sheet.lines), width, time, frame)


def _named_columns(sheet: Sheet, said: dict[str, list[str]], start: int) -> Block:
    """Return the points that a row of names tells of, as in exports of skeletons.

    The axes follow a name in a column of its own, which is empty below, or bear it: ``Hips X``.
    """
    cells = sheet.cells(start) if start < len(sheet.lines) and not sheet.is_data(start) else []
    meaning = meaning_of(cells) if cells else None
    before = ["", *cells][: len(cells)]
    names = [name if axis == "X" else "" for name, axis in zip(before, cells, strict=True)]
    markers = dict(zip(*marker_columns(names, cells), strict=True))
    if meaning is not None:
        markers = meaning.markers or markers
    if meaning is None or not markers:
        raise bad_file(sheet.path, f"no {_NAMES}", "an export of QTM with its header")
    if said.get("REFERENCE", [""])[:1] == ["LOCAL"]:
        raise bad_file(sheet.path, "REFERENCE is LOCAL", "'GLOBAL': places in the world")
    return Block(
        tuple(markers),
        tuple(markers.values()),
        start + 1,
        len(sheet.lines),
        len(meaning.names),
        next(iter(meaning.times), None),
        next(iter(meaning.frames), None),
    )
