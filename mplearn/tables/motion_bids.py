"""Motion-BIDS: an events file with its sidecar, which says what the columns are [Jeung2024]."""

from __future__ import annotations

import csv
import io
import json
from pathlib import Path
from typing import Any

from ..errors import RecordingError
from ..library import RecognisedSegment, SegmentTable
from ..writing import written_whole
from .boris import UNKNOWN, behaviour

_MISSING = "n/a"
_OTHERS = ("take", "end", "primitive", "nearest", "distance", "p_value", "person", "confidence")
_SAID: dict[str, dict[str, Any]] = {
    "onset": {"Description": "When the segment begins", "Units": "s"},
    "duration": {"Description": "How long it is", "Units": "s"},
    "trial_type": {
        "LongName": "Name of the motion primitive",
        "Description": f"Primitive that the segment is an execution of; {UNKNOWN}: of none",
    },
    "take": {"Description": "Name of the recording"},
    "end": {"Description": "When the segment ends", "Units": "s"},
    "primitive": {"Description": "Id of the primitive"},
    "nearest": {"Description": "Name of the nearest primitive, recognised or not"},
    "distance": {"Description": "To the nearest primitive, in nats a frame"},
    "p_value": {"Description": "Share of what was learned that is at least as far out"},
    "person": {"Description": "Who moves"},
    "confidence": {"Description": "How sure the segmenter is of the boundary at the end"},
}


def write(table: SegmentTable, path: Path) -> None:
    """Write an events file, and its sidecar beside it."""
    out = io.StringIO()
    writer = csv.writer(out, delimiter="\t", lineterminator="\n", quoting=csv.QUOTE_MINIMAL)
    writer.writerow(("onset", "duration", "trial_type", *_OTHERS))
    for row in sorted(table, key=lambda row: (row.start_s, row.take)):
        values = {**row.as_dict(), "end": row.end_s}
        cells = (values[name] for name in _OTHERS)
        duration = repr(row.duration_s)
        writer.writerow(
            (
                row.start_s,
                duration,
                behaviour(row),
                *(_MISSING if c in (None, "") else c for c in cells),
            )
        )
    with written_whole(path) as file:
        file.write_text(out.getvalue(), encoding="utf-8", errors="backslashreplace")
    with written_whole(path.with_suffix(".json")) as file:
        file.write_text(json.dumps(_SAID, indent=2), encoding="utf-8")


def read(path: Path) -> SegmentTable:
    """Read an events file; one that others wrote needs onset, duration and trial_type."""
    text = path.read_text(encoding="utf-8")
    rows = []
    reader = csv.DictReader(io.StringIO(text), delimiter="\t")
    lacking = {"onset", "duration", "trial_type"} - {*(reader.fieldnames or ())}
    if lacking:
        raise RecordingError(
            f"{path}: a table of events needs columns {', '.join(sorted(lacking))}"
        )
    for values in reader:
        row = {key: None if value == _MISSING else value for key, value in values.items()}
        start_s = float(row["onset"] or "nan")
        end = row.get("end")
        name = row["trial_type"] or ""
        rows.append(
            {
                **dict.fromkeys(RecognisedSegment._fields),
                **{key: value for key, value in row.items() if key in RecognisedSegment._fields},
                "start_s": start_s,
                "end_s": start_s + float(row["duration"] or "nan") if end is None else end,
                "name": "" if name == UNKNOWN and row.get("primitive") is None else name,
            }
        )
    table = SegmentTable(map(RecognisedSegment.from_dict, rows))
    return SegmentTable(sorted(table, key=lambda row: row.take))
