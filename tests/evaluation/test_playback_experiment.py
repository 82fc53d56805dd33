"""A motion played in a loop, and a bad frame in it."""

from dataclasses import replace

import numpy as np
import pytest

from mplearn.demonstrator import demonstrate
from mplearn.evaluation.experiments import glitch_table, loop_table, playback
from mplearn.evaluation.experiments.playback import BAD_FRAMES


@pytest.fixture(scope="module")
def take():
    return replace(demonstrate(["BAR", "BAL", "BAD", "BAU"] * 5, seed=4).recording, name="t")


def share(cell):
    return float(cell.removesuffix(" %"))


def test_what_is_played_again_is_recognised(take):
    unseen = replace(take, frames=np.full_like(take.frames, np.nan), name="unseen")
    table = loop_table([take, unseen])
    (row,) = [row for row in table.rows if row[0] == "t"]
    first, second, third = map(share, row[3:])
    assert first < second and first < third and third > 60.0


def test_each_bad_frame_is_held_against_none(take):
    table = glitch_table([take])
    rows = {row[1]: row for row in table.rows}
    assert list(rows) == ["none", *BAD_FRAMES]
    assert rows["none"][3:] == ("100.0 %", "100.0 %", "0", "0", "+0", "+0")
    assert share(rows["none"][2]) > 60.0
    assert int(rows["of zeros"][6]) >= 1  # the frame itself is lost, or more


def test_a_frame_that_is_not_spoilt_costs_nothing(take, monkeypatch):
    monkeypatch.setattr(playback, "BAD_FRAMES", {"as it is": lambda frames, _: frames})
    none, same = glitch_table([take]).rows
    assert same[2:] == none[2:]
