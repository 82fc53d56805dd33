"""UI-PRMD: ten repetitions of one movement by one person, each a CSV file of 39 markers [UIPRMD].

The repetitions ``e01`` to ``e10`` of a movement and a subject were cut from one continuous take;
together they are that take again, with known boundaries.
"""

from __future__ import annotations

import re
from collections import defaultdict
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from ...errors import RecordingError
from ...recording import LabelledSegment, Recording, marker_channels
from ..files import bad_file, read_text, stem
from ..findings import Findings
from ..numbers import numbers, without_cut_row
from ..placing.space import checked_markers, file_axes
from ..reader import Hints, Reader

# fmt: off
PLUG_IN_GAIT_MARKERS = (
    "LFHD", "RFHD", "LBHD", "RBHD", "C7", "T10", "CLAV", "STRN", "RBAK",
    "LSHO", "LUPA", "LELB", "LFRM", "LWRA", "LWRB", "LFIN",
    "RSHO", "RUPA", "RELB", "RFRM", "RWRA", "RWRB", "RFIN",
    "LASI", "RASI", "LPSI", "RPSI",
    "LTHI", "LKNE", "LTIB", "LANK", "LHEE", "LTOE",
    "RTHI", "RKNE", "RTIB", "RANK", "RHEE", "RTOE",
)
# fmt: on
"""The 39 markers of Vicon's Plug-in Gait, in the order of UI-PRMD's columns."""

_NAME = re.compile(r"(?P<movement>m\d+)_(?P<person>s\d+)_e(?P<repetition>\d+)_positions(_inc)?")
_RATE_HZ = 100.0


class UIPRMDReader(Reader):
    """Reads UI-PRMD's Vicon positions: 117 columns [mm], 100 Hz, (0, 0, 0) where occluded."""

    format = "UI-PRMD"
    suffixes = (".txt",)

    def accepts(self, path: Path) -> bool:
        """Whether the file is named like ``m01_s01_e01_positions.txt``."""
        return _NAME.fullmatch(stem(path)) is not None

    def person(self, take: str) -> str:
        """Return who moves in a take: ``m01_s01`` is of ``s01``."""
        match = re.match(r"m\d+_(s\d+)", take)
        return match[1] if match else ""

    def takes(self, paths: Sequence[Path]) -> dict[str, tuple[Path, ...]]:
        """Join consecutive repetitions of a movement by a person into a take, ``m01_s01``.

        Where repetitions are missing in between, what is left is no continuous take: each run of
        consecutive repetitions is one of its own, ``m01_s01_e01-e04``.
        """
        repetitions: defaultdict[str, dict[int, Path]] = defaultdict(dict)
        for path in paths:
            match = _match(path)
            base, repetition = f"{match['movement']}_{match['person']}", int(match["repetition"])
            if repetition in repetitions[base]:
                raise RecordingError(
                    f"{path}: the same repetition lies beside it as "
                    f"{repetitions[base][repetition].name!r}; expected each repetition once"
                )
            repetitions[base][repetition] = path
        named: dict[str, tuple[Path, ...]] = {}
        for base, files in repetitions.items():
            order = np.array(sorted(files))
            runs = np.split(order, np.flatnonzero(np.diff(order) > 1) + 1)
            for run in runs:
                name = base if len(runs) == 1 else f"{base}_e{run[0]:02d}-e{run[-1]:02d}"
                named[name] = tuple(files[int(i)] for i in run)
        return named

    def read(self, path: Path, hints: Hints, *, positions: bool) -> Recording:
        """Read one repetition; see `Reader.read`."""
        match = _match(path)
        findings = Findings(self.format)
        text = read_text(path)
        rows = [(i, s.split(",")) for i, s in enumerate(text.splitlines(), 1) if s.strip()]
        rows = without_cut_row(rows, text, findings)
        if not rows:
            raise bad_file(path, "no frames", "a row for each")
        width = 3 * len(PLUG_IN_GAIT_MARKERS)
        values = numbers(path, [row for _, row in rows], width, [i for i, _ in rows])
        points = values.reshape(len(rows), -1, 3)
        points[(points == 0.0).all(axis=2)] = np.nan
        unit = 0.001 if hints.unit_m is None else hints.unit_m
        points = points @ file_axes(hints.up_axis, "z", "x").T * unit
        checked_markers(path, points, PLUG_IN_GAIT_MARKERS)
        movement, person = match["movement"], match["person"]
        rate_hz = _RATE_HZ if hints.rate_hz is None else hints.rate_hz
        return Recording(
            frames=points.reshape(len(rows), -1),
            rate_hz=rate_hz,
            channels=marker_channels(PLUG_IN_GAIT_MARKERS),
            name=f"{movement}_{person}_e{match['repetition']}",
            person=person,
            labels=(LabelledSegment(0, len(rows), movement, person),),
            report=findings.report(rate_hz, unit, hints.up_axis or "z"),
        )


def _match(path: Path) -> re.Match[str]:
    match = _NAME.fullmatch(stem(path))
    if match is None:
        raise bad_file(
            path, "not the name of a recording", "a UI-PRMD name like 'm01_s01_e01_positions.txt'"
        )
    return match
