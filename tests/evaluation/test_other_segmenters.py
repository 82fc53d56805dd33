"""Other libraries' segmenters beside ours, or named where they are missing."""

from dataclasses import replace

import numpy as np
import pytest

from mplearn.demonstrator import demonstrate
from mplearn.evaluation.experiments import other_segmenters, segmenter_table
from mplearn.evaluation.experiments.other_segmenters import pelt
from mplearn.recording import LabelledSegment


def test_pelt_finds_the_steps_of_a_step_function():
    pytest.importorskip("ruptures")
    rng = np.random.default_rng(0)
    frames = np.repeat([[0.0, 1.0], [3.0, -1.0], [0.0, 4.0]], 60, axis=0)
    frames += rng.normal(0, 0.05, frames.shape)
    found = pelt(frames, 30.0)
    assert len(found) == 2 and np.abs(np.array(found) - [60, 120]).max() <= 5


def test_each_segmenter_has_a_row_or_is_named(monkeypatch):
    recording = demonstrate(["BAR", "BAL"] * 5 + ["BAD", "BAU"] * 5, seed=2).recording
    half = len(recording) // 2
    labels = (LabelledSegment(0, half, "arms"), LabelledSegment(half, len(recording), "bow"))
    every_tenth = ("", False, lambda frames, _: list(range(10, len(frames), 10)))
    missing = ("no_such_library", True, None)
    found = dict(other_segmenters.PEERS)
    monkeypatch.setattr(
        other_segmenters,
        "PEERS",
        {"ours": found["ours"], "every tenth": every_tenth, "missing": missing},
    )
    table = segmenter_table([replace(recording, labels=labels)])
    rows = {row[0]: row for row in table.rows}
    assert set(rows) == {"ours", "every tenth"}
    assert rows["every tenth"][6] == "100 %" and float(rows["every tenth"][2]) > 170
    assert rows["ours"][1] == "yes" and float(rows["ours"][3]) > 1.0
    assert "missing (not installed" in table.note
