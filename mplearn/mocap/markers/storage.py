"""OpenSim's tables, ``.sto`` and ``.mot``: lines of names and values, then columns [OpenSim].

Markers are three columns each, or one of vectors (``DataType=Vec3``), y up, in metres. Coordinates
of a model, as inverse kinematics gives them, are channels in radians and metres.
"""

from __future__ import annotations

import re
from dataclasses import replace
from pathlib import Path

from ..files import bad_file, read_text
from ..placing.space import Space
from .columns import Columns, meaning_of
from .csv_table import CSVReader
from .sheet import Header, Sheet

_END = "endheader"
_MOST_LINES = 200  # above the table
_LENGTH = re.compile(  # pelvis_ty, knee_tx_r, .../pelvis_ty/value; of a body's place: femur_r_X
    r"time|.*_[tp]?[xyz](_[lr])?(/value|/speed)?", re.I
)


class StorageReader(CSVReader):
    """Reads OpenSim's tables; see the module's docstring."""

    format = "OpenSim storage"
    suffixes = (".sto", ".mot")
    usual = Space(1.0, "y", "x")

    def sheet(self, path: Path) -> Sheet:
        """Return the table below the header, degrees and vectors told by its names and cells."""
        lines = read_text(path).splitlines(keepends=True)
        heads = [line.strip().lower() for line in lines[:_MOST_LINES]]
        if _END not in heads:
            raise bad_file(
                path, f"no {_END!r} in its first {_MOST_LINES} lines", "a table of OpenSim"
            )
        end = heads.index(_END)
        parts = (head.partition("=") for head in heads[:end])
        said = {name.strip(): value.strip() for name, _, value in parts}
        if said.get("datatype", "double") not in ("double", "vec3"):
            raise bad_file(path, f"a table of {said['datatype']}", "numbers (double), or Vec3")
        begin = next((i for i in range(end + 1, len(lines)) if lines[i].strip()), len(lines))
        # the lines of the header stay as empty ones: messages tell of lines in the file
        table = ["\n"] * begin + [_tabbed(line) for line in lines[begin:]]
        if said.get("indegrees") == "yes" and begin < len(lines):
            names = table[begin].rstrip().split("\t")
            degrees = (name if _LENGTH.fullmatch(name) else f"{name} (deg)" for name in names)
            table[begin] = "\t".join(degrees) + "\n"
        if said.get("datatype") == "vec3":
            table[begin + 1 :] = [
                re.sub(r"(?<=\t)[^\t\r\n]+", r"[\g<0>]", row) for row in table[begin + 1 :]
            ]
        return Sheet.of(path, "".join(table), separators="\t")

    def columns(self, header: Header) -> Columns:
        """Return what the columns mean: markers only where all are, for a root is at a place, too.

        Of ``pelvis_tilt, ..., pelvis_tx, pelvis_ty, pelvis_tz, knee_angle_r`` none is a marker.
        """
        found = meaning_of(header.names)
        if {*found.measured} <= {i for axes in found.markers.values() for i in axes}:
            return found
        return replace(found, markers={}, doubled=(), confidences=(), who=None, fine=None)


def _tabbed(line: str) -> str:
    """Return a line with a tab, and no blanks, between its cells."""
    cells = line.split("\t") if "\t" in line.strip() else line.split()
    return "\t".join(cell.strip() for cell in cells) + ("\n" if line[-1] in "\r\n" else "")
