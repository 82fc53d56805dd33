"""Postures of a stream, played by their time stamps."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from link_world import PERIOD_S

from mplearn_envs.link.playback import Playback


@settings(deadline=None)
@given(
    gaps=st.lists(st.integers(0, 40), min_size=1, max_size=60),
    late=st.lists(st.integers(0, 30), min_size=60, max_size=60),
)
def test_played_time_never_jumps_nor_overtakes(gaps, late):
    """A posture that tells its time stamp tells what time is played."""
    playback = Playback(PERIOD_S, delay_s=0.1, longest_s=1.0)
    due = PERIOD_S * np.cumsum(np.array(gaps) + 1)
    comes = np.maximum.accumulate(due + PERIOD_S * np.array(late[: len(due)]))
    anew = [playback.add(7, 0.0, np.zeros(1))]
    played, newest, sent = [0.0], 0.0, 0
    for k in range(int(comes[-1] / PERIOD_S) + 500):
        while sent < len(due) and comes[sent] <= k * PERIOD_S:
            newest = due[sent]
            anew.append(playback.add(7, newest, np.array([newest])))
            sent += 1
        played.append(float(playback.advance()[0]))
        assert played[-1] <= newest + 1e-9
    assert sum(anew) == 1
    speed = np.diff(played) / PERIOD_S
    assert speed.min() > -1e-9 and speed.max() < 1.05 + 1e-6
    assert np.diff(speed, prepend=0.0).max() < PERIOD_S / 0.1 + 1e-6
    assert played[-1] == pytest.approx(due[-1], abs=1e-6)


def test_playing_begins_anew_where_a_posture_does_not_follow():
    playback = Playback(PERIOD_S)
    here, there = np.zeros(2), np.ones(2)
    assert playback.add(1, 5.0, here) and not playback.add(1, 5.1, there)
    assert playback.add(1, 5.1, here)  # time stands still
    assert playback.add(1, 2.0, here)  # or runs back
    assert playback.add(1, 1e300, here) and playback.add(1, 3.1, here)
    assert playback.add(2, 3.2, there)  # another stream
    np.testing.assert_array_equal(playback.advance(), there)
    for k in range(100_000):  # an endless stream that is never played stays small
        playback.add(2, 3.2 + 1e-7 * (k + 1), there)
    assert len(playback._waiting) <= 4096
