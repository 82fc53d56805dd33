"""A bad network, a sender that changes, a second person: nothing is lost unreported."""

import numpy as np
import pytest
from played import frames_of, texts_of

from benchmarks.bad_network import BadNetwork
from mplearn.recording import Recording
from mplearn.sources import Block, Change, Wanted
from mplearn.sources.recognised import RecognisedSource


@pytest.fixture(scope="module")
def long(session: Recording) -> Recording:
    """The session, again and again."""
    frames = np.tile(session.frames, (3, 1))
    return Recording(frames, session.rate_hz, session.channels)


def run(network: BadNetwork) -> tuple[RecognisedSource, list[Block | Change]]:
    with RecognisedSource(network.received(), Wanted()) as source:
        return source, list(source)


def places(items: list[Block | Change]) -> np.ndarray:
    return np.concatenate(
        [np.rint(b.times_s * 100.0) for b in items if isinstance(b, Block)]
    ).astype(int)


@pytest.mark.parametrize("seed", [0, 1])
def test_every_packet_has_its_place_or_is_counted(long: Recording, seed: int) -> None:
    network = BadNetwork(
        long,
        seed=seed,
        silences=((700, 760), (2300, 2700)),
        jumps={500: 100.0, 900: -3000.0},
        renamed=1100,
        shuffled=1300,
        second=1600,
        stranger=300,
    )
    source, items = run(network)
    tally, sent = source.tally, network.sent
    assert tally.damaged == tally.overrun == tally.unrecognised == 0
    came = tally.frames + tally.doubled + tally.late + tally.foreign + tally.unnamed
    assert came == sent["frames"] + sent["stranger"]
    assert tally.frames + tally.lost == places(items)[-1] + 1
    assert len(long) - 3 <= places(items)[-1] + 1 <= len(long)
    frames = frames_of(items)
    seen = ~np.isnan(frames).all(axis=1)
    assert seen.sum() == tally.frames
    np.testing.assert_array_equal(frames[seen], long.frames[places(items)[seen]])
    blocks = [item for item in items if isinstance(item, Block)]
    gaps = [item for item in items if isinstance(item, Change) and item.kind == "gap"]
    assert sum(b.lost for b in blocks) + sum(gap.count for gap in gaps) == tally.lost
    assert [b.joins for b in blocks].count(False) == 1 + len(gaps) == 2
    assert len(texts_of(items, "clock")) == 2
    assert set(texts_of(items, "subject")) == {
        "'stranger' appeared; '' is followed",
        "'Ben' appeared in the stream",
    }
    names = texts_of(items, "names")
    assert any("renamed: " in text for text in names)
    assert any("another order" in text for text in names)


def test_a_good_network_costs_nothing(session: Recording) -> None:
    source, items = run(BadNetwork(session, loss=0.0, doubles=0.0, disorder=0))
    np.testing.assert_array_equal(frames_of(items), session.frames)
    assert source.tally.faults() == {}
