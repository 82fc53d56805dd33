"""The page that sets other libraries beside ours, on data whose answer is known."""

from dataclasses import replace

import numpy as np
import pytest

from mplearn.demonstrator import demonstrate
from mplearn.errors import InvalidValueError
from mplearn.evaluation.experiments import page_of_peers
from mplearn.evaluation.experiments.page_of_peers import (
    METHODS,
    PEERS,
    activity_peers_table,
    boundary_peers_table,
)
from mplearn.recording import LabelledSegment, Recording


@pytest.fixture(scope="module")
def planted() -> Recording:
    """Three activities, two of which come back: rhythms around postures of their own."""
    rng = np.random.default_rng(0)
    t = np.arange(300) / 30.0
    frames, labels = [], []
    for k, kind in enumerate([0, 1, 2, 0, 1]):
        middle = np.eye(3)[kind] * 1.5
        wave = np.stack([np.sin(2 * np.pi * (0.5 + 0.3 * kind) * t + p) for p in range(3)], axis=1)
        frames.append(middle + 0.3 * wave + 0.01 * rng.normal(size=wave.shape))
        labels.append(LabelledSegment(300 * k, 300 * (k + 1), f"activity {kind}"))
    return Recording(np.concatenate(frames), 30.0, ("a", "b", "c"), "planted", labels=tuple(labels))


def test_what_is_planted_is_found_by_all(planted: Recording) -> None:
    table = activity_peers_table([planted])
    assert [row[1] for row in table.rows[:3]] == list(METHODS)[:3]
    told = {row[1]: row[2] for row in table.rows}
    assert told["ours, find_activities"] == "nothing"
    for row in table.rows[:3]:
        assert float(row[3]) > 0.8, row
        assert row[-1].endswith(" MB")


def test_a_take_of_one_activity_is_left_out_and_named(planted: Recording) -> None:
    alone = replace(planted.sliced(0, 600), name="alone", labels=planted.labels[:1])
    table = activity_peers_table([alone])
    assert not table.rows
    assert "alone (one activity" in table.note


def test_a_library_that_breaks_is_left_out_and_named(
    planted: Recording, monkeypatch: pytest.MonkeyPatch
) -> None:
    def broken(*_: object) -> object:
        raise KeyError("no such thing")

    ours = METHODS["ours, find_activities"]
    methods = {"theirs": ("json", "nothing", broken), "ours, find_activities": ours}
    monkeypatch.setattr(page_of_peers, "METHODS", methods)
    table = activity_peers_table([planted])
    assert [row[1] for row in table.rows] == ["ours, find_activities"]
    assert "theirs, of planted (KeyError: 'no such thing')" in table.note
    monkeypatch.setattr(page_of_peers, "METHODS", {"ours": ("", "nothing", broken)})
    with pytest.raises(KeyError, match="no such thing"):
        activity_peers_table([planted])


def test_boundaries_of_each_are_scored_alike(monkeypatch: pytest.MonkeyPatch) -> None:
    shown = demonstrate(["BAR", "BAL"] * 8, seed=2, rate_hz=30.0)
    whole = [
        LabelledSegment(a.start, b.end, "raise", "anna")
        for a, b in zip(shown.truth[::2], shown.truth[1::2], strict=True)
    ]
    recording = shown.recording
    take = Recording(
        recording.frames, 30.0, recording.channels, "raise", "anna", labels=tuple(whole)
    )
    table = boundary_peers_table([take])
    ours = table.rows[0]
    assert ours[0] == "ours"
    assert float(ours[4]) > 0.7
    assert {row[0] for row in table.rows} >= {"ours", "ruptures, PELT"}

    def broken(*_: object) -> list[int]:
        raise AttributeError("no trapz")

    monkeypatch.setattr(page_of_peers, "PEERS", {"theirs": ("json", False, broken)} | PEERS)
    again = boundary_peers_table([take])
    assert again.rows[0][0] == "ours" and len(again.rows) == len(table.rows)
    assert "theirs (AttributeError: no trapz)" in again.note


def test_boundaries_of_nothing_are_refused():
    with pytest.raises(InvalidValueError, match="repeated movements"):
        boundary_peers_table([])
