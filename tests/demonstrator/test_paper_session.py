"""The session like the paper's: its numbers, its structure, its speed."""

from collections import Counter
from functools import partial
from itertools import pairwise

import numpy as np
import pytest
from calls import count_calls

from mplearn.demonstrator import PAPER_PRIMITIVES, SEQUENCING, Person, paper_session


@pytest.fixture(scope="module", params=[1, 23])
def session(request):
    return paper_session(request.param)


def test_it_is_as_long_as_the_papers(session):
    assert session.recording.frames.shape == (96_000, 34 * 3)
    assert session.posture.frames.shape == (96_000, 47)
    assert session.recording.rate_hz == 100.0
    assert len(session.truth) == pytest.approx(751, rel=0.05)
    lengths = np.array([s.end - s.start for s in session.truth]) / 100
    assert lengths.mean() == pytest.approx(1.28, rel=0.05)
    assert lengths.min() > 0.5 and lengths.max() < 2.5


def test_its_types_come_equally_often(session):
    counts = Counter(s.label for s in session.truth)
    assert set(counts) == set(PAPER_PRIMITIVES)
    equal = len(session.truth) / 22
    assert min(counts.values()) > 0.75 * equal and max(counts.values()) < 1.25 * equal


def test_it_has_the_papers_structure(session):
    pairs = Counter((a.label, b.label) for a, b in pairwise(session.truth))
    assert all(second in SEQUENCING[first] for first, second in pairs)
    assert {b for a, b in pairs if a == "LAL"} == {"BAD", "SQD"}
    gaps = np.array([b.start - a.end for a, b in pairwise(session.truth)]) / 100
    assert 0.02 < (gaps > 0.0).mean() < 0.2
    assert (gaps[gaps > 0.0] >= 0.3).all() and gaps.max() < 1.6


def test_occlusions_are_one_percent(session):
    assert np.isnan(session.recording.frames).mean() == pytest.approx(0.01, rel=0.15)


def test_posture_drifts_over_minutes(session):
    # the elbow hangs elsewhere in the last minutes than in the first
    rest = session.posture.frames[:, [n.startswith("elbow") for n in session.posture.channels]]
    gaps = [
        (a.end, b.start)
        for a, b in pairwise(session.truth)
        if b.start > a.end and a.label in ("BAL", "BAU", "SQR", "RKT", "LKT", "MMID")
    ]
    stands = np.array([rest[a:b].mean(axis=0) for a, b in gaps])
    assert (stands.std(axis=0) > 0.01).all() and (stands.std(axis=0) < 0.1).all()


def test_another_person_performs_the_same_script_at_another_rate():
    person = Person.random(np.random.default_rng(1))
    mine, other = paper_session(2, person=person, rate_hz=25.0), paper_session(2, rate_hz=25.0)
    assert mine.recording.frames.shape == (24_000, 102)
    assert {s.person for s in mine.truth} == {person.name}
    n = min(len(mine.truth), len(other.truth))
    assert [s.label for s in mine.truth[:n]] == [s.label for s in other.truth[:n]]


def test_it_is_made_without_a_loop_over_frames():
    slow, fast = (count_calls(partial(paper_session, 4, rate_hz=rate)) for rate in (25.0, 100.0))
    assert fast - slow < 1000  # for 72,000 more frames
