"""OpenSim's tables, whose coordinates of a whole body become a skeleton [OpenSim]."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

from ...recording import Recording
from ..findings import Findings
from ..markers.storage import StorageReader
from ..reader import Hints
from .coordinates import is_whole_body, motion_of_coordinates
from .skeletal import skeletal_recording


class OpenSimReader(StorageReader):
    """Reads OpenSim's tables: markers, coordinates as channels, or the joints of their model.

    The last is for coordinates of a whole body where positions are asked for; see `coordinates`.
    """

    def read(self, path: Path, hints: Hints, *, positions: bool) -> Recording:
        """Read the table; see `Reader.read`."""
        table = super().read(path, hints, positions=positions)
        if not positions or table.is_markers or not is_whole_body(table.channels):
            return table
        findings = Findings(self.format)
        motion = motion_of_coordinates(table.channels, table.frames, table.rate_hz, findings)
        ours = replace(hints, unit_m=1.0, up_axis="z")  # as its bones are, whatever the file's
        joints = skeletal_recording(path, motion, ours, findings, positions=True)
        assert joints.report is not None
        return replace(joints, labels=table.labels, report=replace(joints.report, up=self.usual.up))
