"""Small files of the kinds that people have, each with the value that is right.

They lie beside the repository (``shared/cases``), one of each kind.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from data_folder import DATA

from mplearn.mocap import open_recording, open_takes

CASES = None if DATA is None else DATA.parent / "cases" / "files"
pytestmark = [
    pytest.mark.skipif(
        CASES is None or not CASES.is_dir(),
        reason="no case files beside the recordings (shared/cases); set MPLEARN_DATA",
    ),
    pytest.mark.filterwarnings("ignore::mplearn.errors.RecordingWarning"),
]
FOLDER = CASES or Path()

# file -> (what its report must say, in notes or warnings)
MARKER_FILES = {
    "c3d_qtm_screen.c3d": "the file says -z",
    "c3d_pig_virtual_points.c3d": "",
    "c3d_duplicate_label.c3d": "more than once: LKNE",
    "c3d_empty_label.c3d": "1 point without a name",
    "c3d_frames_above_65535.c3d": "",
    "c3d_unit_mete.c3d": "",
    "c3d_sgi_last_offset.c3d": "",
    "c3d_yup_without_screen.c3d": "y is taken as the vertical axis",
    "trc_zup.trc": "z is taken as the vertical axis",
    "trc_datarate_not_time.trc": "DataRate is 250.00, the times say 25 Hz",
    "trc_numframes_more.trc": "NumFrames is 900, but 100 frames",
    "trc_unnamed_columns.trc": "more columns than names",
    "trc_millimeters.trc": "",
    "csv_motive.csv": "",
    "csv_nexus.csv": "",
    "qtm.tsv": "",
    "csv_frame_and_time.csv": "",
    "csv_underscore_mm.csv": "taken as mm, by the size of the person",
    "csv_decimal_comma.csv": "",
}


@pytest.mark.parametrize("name", MARKER_FILES)
def test_marker_files(name: str) -> None:
    recording = open_recording(FOLDER / name)
    assert len(recording) == 100
    assert recording.rate_hz == pytest.approx(25.0)
    assert recording.is_markers
    assert len(recording.marker_names) == (110 if "virtual" in name else 34)
    head = recording.markers[0, recording.marker_names.index("LFHD")]
    assert head == pytest.approx([0.1006, 0.0724, 1.6608], abs=2e-4)
    heels = [i for i, each in enumerate(recording.marker_names) if each in ("LHEE", "RHEE")]
    assert np.abs(recording.markers[:, heels, 2]).max() < 0.1
    report = recording.report
    assert report is not None
    assert MARKER_FILES[name] in "\n".join([*report.notes, *report.warnings])


def test_500_hz_are_read_as_they_are() -> None:
    recording = open_recording(FOLDER / "c3d_500hz.c3d")
    assert (len(recording), recording.rate_hz) == (200, 500.0)


def test_takes_of_a_folder_in_two_orders() -> None:
    one, other = open_takes(FOLDER / "folder_marker_order").recordings
    assert set(one.marker_names) == set(other.marker_names)
    assert one.marker_names != other.marker_names
